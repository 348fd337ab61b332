"""Photos of a light stage or panel: one under each lamp, and references of several lamps.

Index convention: n runs over lamps, k over references; photos are [y, x, channel].
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from nearfar.arrays import Booleans, Floats
from nearfar.errors import InputError
from nearfar.files import list_pictures
from nearfar.files.images import read_linear
from nearfar.files.references import read_references
from nearfar.files.room import room_for
from nearfar.files.tables import read_table
from nearfar.progress import Report, ignore_progress
from nearfar.workflow.free_rows import MOST_LAMPS

# Bytes of photos that are held in memory; more are kept in a temporary file.
DEFAULT_MEMORY_BYTES = 2 * 10**9
# A lamp with less light than this share of the usual one's is dark.
DARK = 1e-3


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
    memory: int = DEFAULT_MEMORY_BYTES,
    scratch: Path | None = None,
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
    memory : int
        Bytes of photos in memory. More photos are kept in a temporary file.
    scratch : Path, optional
        Folder of the temporary file; by default the system's.
    progress : callable
        Called with "photos" and the share that is read.

    Raises
    ------
    InputError
        If photos differ in size, lamps are too many or dark, or a table does not fit.
    NearfarError
        As `nearfar.files.read_picture`.
    StorageError
        If there is no room for the temporary file.
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
    photos, saturated = _read(every, full_scale, memory, scratch, progress)
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
    paths: Sequence[Path],
    full_scale: float | None,
    memory: int,
    scratch: Path | None,
    progress: Report,
) -> tuple[Floats, Booleans]:
    """Return photos (n, Cy, Cx, channels), and where any is at full scale."""
    found: Floats | None = None
    saturated: Booleans | None = None
    for number, path in enumerate(paths):
        photo = read_linear(path, full_scale=full_scale)
        photo = photo[..., None] if photo.ndim == 2 else photo
        if found is None:
            found = room_for((len(paths), *photo.shape), np.float32, memory, scratch)
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
