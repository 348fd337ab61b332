"""Compressive light transport on the case of figure 5, with as many patterns (section 5.2)."""

import time
from typing import Any

from numpy.typing import NDArray

from nearfar.baselines.choosing import best_share
from nearfar.baselines.compressive import reconstruct_compressive
from nearfar.baselines.random_patterns import bernoulli_patterns, measure_without_noise
from nearfar.callbacks import Report
from nearfar.illumination.frequencies import representatives
from nearfar.illumination.real_basis import real_basis
from nearfar.plan.patterns import Exponential
from nearfar.scenes.cache import cached_scene
from nearfar.workflow.evaluate import percentiles, snr, snr_of_rows
from nearfar.workflow.experiments.acquired import thin
from nearfar.workflow.experiments.data import Data
from nearfar.workflow.experiments.in_theory import Theory, lights


def acquire_compressively(case: Theory, report: Report) -> Data:
    """Acquire a case's scene by compressive light transport, with the case's number of patterns.

    Parameters
    ----------
    case : Theory
    report : callable
        Called with what is being done and the share done.

    Returns
    -------
    Data
        Arrays: ``LIGHT/CLT`` for each of the case's lights. Numbers, under ``CLT``: SNR, the
        lambda that was best against the truth and the grid it is from.
    """
    truth = cached_scene(case.scene, case.projector, progress=report)
    count = case.plan.transport_photos
    measurements = measure_without_noise(truth, bernoulli_patterns(case.projector, count, 0))
    report("choosing lambda", 0.0)
    choice = best_share(measurements, truth)
    report("choosing lambda", 1.0)
    started = time.monotonic()
    found = reconstruct_compressive(
        measurements,
        choice.share,
        refitted=choice.is_refitted,
        progress=lambda share: report("rows", share),
    )
    seconds = time.monotonic() - started
    arrays: dict[str, NDArray[Any]] = {}
    snr_b = {}
    for name, light in lights(case.projector).items():
        arrays[f"{name}/CLT"] = found @ light
        snr_b[name] = snr(truth @ light, arrays[f"{name}/CLT"])
    numbers = {
        "patterns": count,
        "answers_of_this_method": real_basis(
            representatives(
                pattern.frequency
                for pattern in case.plan.patterns
                if isinstance(pattern, Exponential)
            ),
            case.projector,
        ).count,
        "snr_b": snr_b,
        "snr_t": percentiles(snr_of_rows(truth, found)),
        "share": choice.share,
        "refitted": choice.is_refitted,
        # Share, SNR as the l1 norm has it, SNR refitted.
        "grid": list(zip(choice.shares, choice.plain, choice.refitted, strict=True)),
        "seconds": {"reconstruction": seconds},
    }
    return Data({name: thin(values) for name, values in arrays.items()}, {"CLT": numbers})
