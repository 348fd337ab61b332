"""The transport of a light stage: a photo under each lamp, times a gain fitted to references.

Index convention: n runs over lamps, k over references; photos are [y, x, channel].
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import nnls

from nearfar.arrays import Floats, Size, blocks
from nearfar.errors import InputError
from nearfar.estimate.light_stage import LampGains, Sums, fit_gains, spread_of, sums_of
from nearfar.illumination.real_basis import basis_of_every_frequency
from nearfar.progress import Report, ignore_progress
from nearfar.release import version
from nearfar.transport.model import Transport
from nearfar.transport.posterior import LEAST_SQUARES, FreePosterior
from nearfar.transport.quality import Quality
from nearfar.transport.store_writing import write_transport
from nearfar.transport.verdict import Grade, KeptVerdict, Reason
from nearfar.workflow.light_stage_photos import LightStage
from nearfar.workflow.verdict.verdict import DOUBTFUL_DECIBELS, WRONG_DECIBELS

METHOD = "light stage"
# Bands of camera rows between which the gains are compared.
BANDS = 16
# Levels by which the noise is fitted, each of as many values.
LEVELS = 32
# Bytes of camera rows that are made into a transport at once, and such rows at most.
BYTES_AT_ONCE = 2.5e8
ROWS_AT_ONCE = 64


def import_light_stage(
    stage: LightStage, output: Path, *, force: bool = False, progress: Report = ignore_progress
) -> tuple[LampGains | None, KeptVerdict]:
    """Write the transport of a light stage, of as many lamps as photos.

    Parameters
    ----------
    stage : LightStage
    output : Path
    force : bool
        Replace a transport that is there.
    progress : callable
        Called with the step and the share that is done.

    Returns
    -------
    gains : LampGains or None
        None without references; then every gain is 1.
    verdict : KeptVerdict

    Raises
    ------
    InputError
        If the references are saturated throughout.
    ExistingOutputError, MissingFileError, StorageError
        As `nearfar.files.new_output`.
    """
    gains = None
    if len(stage.references):
        gains = fit_gains(_sums(stage, progress), stage.lit, share_black=stage.has_black)
    verdict = _judge(stage, gains)
    parts = _blocks(stage, gains, verdict, progress)
    write_transport(output, parts, len(stage.black), force=force)
    return gains, verdict


def _sums(stage: LightStage, progress: Report) -> Sums:
    """Sum over bands of camera rows, without saturated camera pixels."""
    height = len(stage.black)
    bands = [band for band in np.array_split(np.arange(height), BANDS) if len(band)]
    usable = [band for band in bands if not stage.saturated[band].all()]
    if len(usable) < 2:
        raise InputError(
            "photos are saturated at nearly every camera pixel, so that no gain can be fitted: "
            "expose less."
        )

    def values() -> Iterator[tuple[Floats, Floats]]:
        for number, band in enumerate(usable):
            good = ~stage.saturated[band]
            chosen = [
                part[:, band][:, good].reshape(len(part), -1).astype(np.float64)
                for part in (stage.photos, stage.references)
            ]
            progress("gains", (number + 1) / len(usable))
            yield chosen[0], chosen[1]

    return sums_of(values())


def _judge(stage: LightStage, gains: LampGains | None) -> KeptVerdict:
    if gains is None:
        reason = Reason(
            "unchecked",
            "nothing was checked, and every gain is 1: give photos of several lamps at once as "
            "`references`.",
        )
        return KeptVerdict("doubtful", (reason,))
    snr = float(-10 * np.log10(np.mean(10 ** (-gains.held_out_snr / 10))))
    found = KeptVerdict("good", held_out_snr=min(snr, 200.0), checked_by="reference photos")
    if snr >= DOUBTFUL_DECIBELS:
        return found
    worst = int(gains.held_out_snr.argmin())
    reason = Reason(
        "not-linear",
        f"no gains of the lamps explain the reference photos, {stage.reference_names[worst]} "
        f"least of all ({gains.held_out_snr[worst]:.1f} dB): check which lamps it shows, that "
        f"nothing moved, and that the photos are linear and without ambient light.",
    )
    grade: Grade = "wrong" if snr < WRONG_DECIBELS else "doubtful"
    return KeptVerdict(grade, (reason,), snr, checked_by=found.checked_by)


def _blocks(
    stage: LightStage, gains: LampGains | None, verdict: KeptVerdict, progress: Report
) -> Iterator[Transport]:
    lamps, height = len(stage.names), len(stage.black)
    projector = Size(1, lamps)
    basis = basis_of_every_frequency(projector)
    factors = np.ones(lamps) if gains is None else gains.gains
    noise = np.zeros(stage.black.shape) if gains is None else _noise(stage, gains)
    provenance = _provenance(stage, gains)
    at_once = min(ROWS_AT_ONCE, int(BYTES_AT_ONCE // stage.photos[:, 0].nbytes))
    for rows in blocks(height, at_once):
        light = np.moveaxis(stage.photos[:, rows], 0, 3) * factors.astype(np.float32)
        camera = light.shape[:2]
        yield Transport(
            projector=projector,
            correspondence=np.full((*camera, 2), np.nan, np.float32),
            direct=np.zeros(light.shape[:3], np.float32),
            near=np.zeros((*light.shape[:3], 0, 0), np.float32),
            far=light @ basis.patterns.T,
            far_basis=basis,
            black=stage.black[rows],
            noise=noise[rows].astype(np.float32),
            parts=("free",),
            posterior=None if gains is None else _posterior(stage, gains, camera),
            provenance=provenance,
            quality=Quality(np.zeros(camera, np.float32), stage.saturated[rows]),
            verdict=verdict,
        )
        progress("writing", min(rows.stop, height) / height)


def _posterior(stage: LightStage, gains: LampGains, camera: tuple[int, ...]) -> FreePosterior:
    """Return the posterior of photos of single lamps, each multiplied by its gain."""
    kept = np.flatnonzero(gains.gains > 0)
    lamps = len(gains.gains)
    relative = np.zeros_like(gains.errors)
    relative[:, kept] = gains.errors[:, kept] / gains.gains[kept]
    modes, strengths = np.eye(lamps)[kept], 1.0 / gains.gains[kept]
    if stage.has_black:
        # The noise of the black photo is in all lamps' light alike.
        modes = np.concatenate([modes, gains.gains[None]])
        strengths = np.append(strengths, 1.0)
    return FreePosterior(
        modes=modes.astype(np.float32),
        strengths=strengths.astype(np.float32),
        mean=np.zeros(lamps, np.float32),
        mean_variance=0.0,
        gain_errors=relative.astype(np.float32),
        variance_ratio=np.full(camera, LEAST_SQUARES),
    )


def _noise(stage: LightStage, gains: LampGains) -> Floats:
    """Return the standard deviation of a photo, (Cy, Cx, channels), by what references leave.

    The variance is that of read and shot noise, a constant and a share of the mean photo.
    """
    light = gains.exposures[:, None] * stage.lit * gains.gains
    spreads = spread_of(light, share_black=stage.has_black)
    level = stage.photos.mean(axis=0, dtype=np.float64)
    squared = np.zeros(level.shape)
    for reference, mine, spread in zip(stage.references, light, spreads, strict=True):
        foretold = np.tensordot(mine.astype(np.float32), stage.photos, axes=1)
        # The noise of the photos that it is foretold from is in the difference too.
        squared += (reference - foretold) ** 2 / spread
    squared /= len(light)
    found = np.empty(level.shape)
    good = ~stage.saturated
    for channel in range(level.shape[2]):
        order = np.argsort(level[good][:, channel])
        means = [
            (level[good][part, channel].mean(), squared[good][part, channel].mean())
            for part in np.array_split(order, min(LEVELS, len(order)))
        ]
        x, y = np.array(means).T
        design = np.stack([np.ones_like(x), np.maximum(x, 0.0)], axis=1)
        constant, share = nnls(design, y)[0]
        found[..., channel] = np.sqrt(constant + share * np.maximum(level[..., channel], 0.0))
    return found


def _provenance(stage: LightStage, gains: LampGains | None) -> dict[str, Any]:
    fitted = {}
    if gains is not None:
        fitted = {
            "lamp_gains": [round(float(gain), 6) for gain in gains.gains],
            "lamp_gain_errors": [round(float(error), 6) for error in gains.deviations],
            "references": {
                name: {"exposure": round(float(exposure), 6), "held_out_dB": round(float(snr), 2)}
                for name, exposure, snr in zip(
                    stage.reference_names, gains.exposures, gains.held_out_snr, strict=True
                )
            },
        }
    directions = (
        None if stage.directions is None else stage.directions.astype(np.float64).round(4).tolist()
    )
    return {
        "nearfar": version(),
        "method": METHOD,
        "square": False,
        "lamps": list(stage.names),
        **fitted,
        "directions": directions,
    }
