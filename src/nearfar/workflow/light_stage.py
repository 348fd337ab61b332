"""Light stages and panels: a transport of a photo under each lamp, and gains from references.

Index convention: n runs over lamps, k over references; photos are [y, x, channel].
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import nnls

from nearfar.arrays import Booleans, Floats, Size, blocks
from nearfar.errors import InputError
from nearfar.estimate.light_stage import LampGains, Sums, fit_gains, spread_of, sums_of
from nearfar.files import list_pictures
from nearfar.files.images import read_linear
from nearfar.files.references import read_references
from nearfar.files.tables import read_table
from nearfar.progress import Report, ignore_progress
from nearfar.release import version
from nearfar.transport.free_posterior import LEAST_SQUARES, FreePosterior
from nearfar.transport.model import Transport
from nearfar.transport.quality import Quality
from nearfar.transport.store import write_transport
from nearfar.transport.verdict import Grade, KeptVerdict, Reason
from nearfar.workflow.free_rows import MOST_LAMPS, free_basis
from nearfar.workflow.verdict.verdict import DOUBTFUL_DECIBELS, WRONG_DECIBELS

METHOD = "light stage"
# Bands of camera rows between which the gains are compared.
BANDS = 16
# Bytes of photos that are held.
MOST_BYTES = 8 * 10**9
# A lamp with less light than this share of the usual one's is dark.
DARK = 1e-3
# Levels by which the noise is fitted, each of as many values.
LEVELS = 32
# Camera rows that are made into a transport at once.
ROWS_AT_ONCE = 64


@dataclass(frozen=True, eq=False)
class LightStage:
    """Photos of lamps, one by one, and of several at once.

    Attributes
    ----------
    names : tuple of str
        Of the lamps: those of their photos.
    photos : ndarray, shape (n, Cy, Cx, channels), float32
        Without black, full scale = 1.
    black : ndarray, shape (Cy, Cx, channels), float32
        The photo without any lamp; 0 where there is none.
    has_black : bool
    saturated : ndarray of bool, shape (Cy, Cx)
        Whether any photo is at full scale.
    references : ndarray, shape (k, Cy, Cx, channels), float32
        Without black.
    reference_names : tuple of str
    lit : ndarray, shape (k, n)
        Share at which each lamp is lit in each reference.
    directions : ndarray, shape (n, 3), or None
        Unit vectors to the lamps.
    """

    names: tuple[str, ...]
    photos: Floats
    black: Floats
    has_black: bool
    saturated: Booleans
    references: Floats
    reference_names: tuple[str, ...]
    lit: Floats
    directions: Floats | None


def read_light_stage(
    folder: Path,
    *,
    references: Path | None = None,
    black: Path | None = None,
    directions: Path | None = None,
    full_scale: float | None = None,
    progress: Report = ignore_progress,
) -> LightStage:
    """Read the photos of a light stage.

    Parameters
    ----------
    folder : Path
        A photo under each lamp, in natural order of their names.
    references : Path, optional
        List of reference photos; see `nearfar.files.references`.
    black : Path, optional
        The photo without any lamp.
    directions : Path, optional
        Table of x, y, z for each lamp, in the order of the photos.
    full_scale : float, optional
        Raw value of full scale.
    progress : callable
        Called with "photos" and the share that is read.

    Raises
    ------
    InputError
        If photos differ in size, lamps are too many or dark, or a table does not fit.
    NearfarError
        As `nearfar.files.read_picture`.
    """
    paths = [path for path in list_pictures(folder) if black is None or not _same(path, black)]
    if not 1 <= len(paths) <= MOST_LAMPS:
        raise InputError(
            f"{folder} has {len(paths)} photos: give a photo for each lamp, of 1 to {MOST_LAMPS}."
        )
    names = tuple(path.stem for path in paths)
    listed, lit = (
        ([], np.zeros((0, len(paths))))
        if references is None
        else read_references(references, names)
    )
    if again := [path.name for path in listed if any(_same(path, lamp) for lamp in paths)]:
        raise InputError(
            f"{references} lists {again[0]}, which is among the photos of single lamps in "
            f"{folder}: keep references in a folder of their own."
        )
    every = [*paths, *listed, *([black] if black is not None else [])]
    photos, saturated = _read(every, full_scale, progress)
    dark = photos[-1].copy() if black is not None else np.zeros_like(photos[0])
    photos = photos[: len(paths) + len(listed)]
    photos -= dark
    _require_light(paths, photos[: len(paths)])
    return LightStage(
        names=names,
        photos=photos[: len(paths)],
        black=dark,
        has_black=black is not None,
        saturated=saturated,
        references=photos[len(paths) :],
        reference_names=tuple(path.name for path in listed),
        lit=lit,
        directions=None if directions is None else _directions(directions, len(paths)),
    )


def _same(path: Path, other: Path) -> bool:
    return path.resolve() == other.resolve()


def _read(
    paths: Sequence[Path], full_scale: float | None, progress: Report
) -> tuple[Floats, Booleans]:
    """Return photos (n, Cy, Cx, channels), and where any is at full scale."""
    found: Floats | None = None
    saturated: Booleans | None = None
    for number, path in enumerate(paths):
        photo = read_linear(path, full_scale=full_scale)
        photo = photo[..., None] if photo.ndim == 2 else photo
        if found is None:
            if len(paths) * photo.nbytes > MOST_BYTES:
                raise InputError(
                    f"{len(paths)} photos such as {path} take "
                    f"{len(paths) * photo.nbytes / 1e9:.0f} GB: give smaller photos."
                )
            found = np.empty((len(paths), *photo.shape), dtype=np.float32)
            saturated = np.zeros(photo.shape[:2], dtype=bool)
        if photo.shape != found.shape[1:]:
            one, other = (" x ".join(map(str, shape)) for shape in (photo.shape, found.shape[1:]))
            raise InputError(
                f"{path} is of {one} values, {paths[0].name} of {other} (height, width, channels): "
                f"give photos of one camera."
            )
        found[number] = photo
        assert saturated is not None
        saturated |= photo.max(axis=2) >= 1.0
        progress("photos", (number + 1) / len(paths))
    assert found is not None
    assert saturated is not None
    return found, saturated


def _require_light(paths: Sequence[Path], photos: Floats) -> None:
    light = photos.mean(axis=(1, 2, 3), dtype=np.float64)
    dark = np.flatnonzero(light <= DARK * np.median(light))
    if len(dark):
        raise InputError(
            f"{paths[dark[0]]} is as dark as without its lamp: shoot it again, or take the photo "
            f"out."
        )


def _directions(path: Path, lamps: int) -> Floats:
    table = read_table(path)
    if table.shape != (lamps, 3):
        raise InputError(
            f"{path} has {len(table)} rows of {table.shape[1]} numbers: give x, y and z for each "
            f"of {lamps} lamps."
        )
    lengths = np.linalg.norm(table, axis=1)
    if not lengths.all():
        raise InputError(
            f"row {int(lengths.argmin()) + 1} of {path} is no direction: it is 0 long."
        )
    return np.asarray(table / lengths[:, None])


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
    basis = free_basis(projector)
    factors = np.ones(lamps) if gains is None else gains.gains
    noise = np.zeros(stage.black.shape) if gains is None else _noise(stage, gains)
    provenance = _provenance(stage, gains)
    for rows in blocks(height, ROWS_AT_ONCE):
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
            free_posterior=None if gains is None else _posterior(stage, gains, camera),
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
        ratio=np.full(camera, LEAST_SQUARES),
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
