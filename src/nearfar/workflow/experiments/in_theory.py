"""A scene by theory: one complex pattern per frequency, no noise (figure 5).

The paper takes a transport that was acquired by brute force for the truth; this one is computed.
"""

import time
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Floats, Size
from nearfar.callbacks import Report
from nearfar.estimate.paper import estimate
from nearfar.illumination.pictures import lettering, natural_picture, random_pattern, white
from nearfar.photometry.theory import measure_in_theory
from nearfar.plan import Plan, paper_plan
from nearfar.scenes.cache import cached_scene
from nearfar.transport.exact import ExactTransport
from nearfar.transport.model import Transport
from nearfar.workflow.evaluate import percentiles, relighting_snr, row_snr
from nearfar.workflow.experiments.acquired import relit, savings_in_theory, thin
from nearfar.workflow.experiments.data import Data

# Which natural picture.
PICTURE_SEED = 1


@dataclass(frozen=True)
class Theory:
    """A scene to measure without photos.

    Attributes
    ----------
    scene : str
    projector : Size
    window : int
        W.
    far, dropped : Size
        Far band, and the block of lowest near frequencies to leave out.
    """

    scene: str
    projector: Size
    window: int
    far: Size
    dropped: Size

    @property
    def plan(self) -> Plan:
        """The theory's plan: one complex pattern per frequency."""
        return paper_plan(
            self.projector,
            self.window,
            self.far,
            dropped=self.dropped,
            offset="none",
            correspondence="none",
        )


# Figures 5 and 6.
WEDGE = Theory("wedge", Size(68, 100), 19, Size(7, 10), Size(3, 3))


def lights(projector: Size) -> dict[str, Floats]:
    """Return the four lights of figure 6, each (Py, Px)."""
    return {
        "white": white(projector),
        "picture": natural_picture(projector, PICTURE_SEED),
        "letters": lettering(projector),
        "random": random_pattern(projector, 0),
    }


def estimate_in_theory(case: Theory, truth: ExactTransport, report: Report) -> Transport:
    """Measure and estimate a scene without noise; correspondence is the truth's own."""
    report("theory", 0.0)
    measurements = measure_in_theory(case.plan, truth)
    pixels = measurements.camera.pixels
    return estimate(
        measurements,
        truth.correspondence,
        case.window,
        case.far,
        case.dropped,
        progress=lambda done: report("theory", done / pixels),
    )


def acquire_in_theory(case: Theory, report: Report) -> Data:
    """Estimate a scene by theory and compare it with the truth everywhere.

    Parameters
    ----------
    case : Theory
    report : callable
        Called with what is being done and the share done.

    Returns
    -------
    Data
        Arrays: pictures under each light as in `acquired.relit`, ``snr_b`` over all frequencies
        with DC in the middle, ``snr_t`` over all camera pixels. Numbers: counts and SNR.
    """
    truth = cached_scene(case.scene, case.projector, progress=report)
    started = time.monotonic()
    transport = estimate_in_theory(case, truth, report)
    seconds = time.monotonic() - started
    rows = row_snr(transport, truth, progress=report)
    shown = lights(case.projector)
    arrays: dict[str, NDArray[Any]] = {"snr_t": rows.snr_t, "snr_b": rows.snr_b_of_frequency}
    arrays |= {f"{name}/light": light for name, light in shown.items()}
    arrays |= relit(transport, truth, shown)
    worst_b = np.unravel_index(np.nanargmin(rows.snr_b_of_frequency), rows.snr_b_of_frequency.shape)
    worst_t = np.unravel_index(np.nanargmin(rows.snr_t), rows.snr_t.shape)
    numbers = {
        "scene": case.scene,
        "projector": list(case.projector),
        "window": case.window,
        "far": list(case.far),
        "dropped": list(case.dropped),
        "plan": case.plan.summary(),
        "savings_in_theory": savings_in_theory(case.projector, case.window, case.far),
        "snr_b": relighting_snr(transport, truth, shown),
        "snr_b_frequency": percentiles(rows.snr_b_of_frequency),
        "snr_t": percentiles(rows.snr_t),
        # (ky, kx) with DC at 0, and the camera pixel (y, x).
        "lowest_frequency": [
            int(k) - side // 2 for k, side in zip(worst_b, case.projector, strict=True)
        ],
        "lowest_camera_pixel": [int(c) for c in worst_t],
        "seconds": {"reconstruction": seconds},
    }
    return Data({name: thin(values) for name, values in arrays.items()}, numbers)
