"""Photos to separate: shot on a rig or read from a folder, checked, and separated by rows.

Photos stay as they came, (Cy, Cx, channels) each; a few camera rows at a time become floats.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from os.path import realpath
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Floats, Size, blocks
from nearfar.baselines.separation import Separation, black_over_white_less_black
from nearfar.capture.checks import as_photo, check_photo
from nearfar.errors import InputError
from nearfar.files import full_scale_of, list_pictures, read_picture
from nearfar.files.images import PICTURE_KINDS
from nearfar.rigs.base import Rig

# Values of all photos that are separated at once: some tens of megabytes.
VALUES_AT_ONCE = 1 << 23


@dataclass(frozen=True, eq=False)
class PhotosToSeparate:
    """Photos of half-lit patterns, and one to subtract from each.

    Attributes
    ----------
    photos : tuple of ndarray, each (Cy, Cx, channels)
        Raw, in the order of the patterns.
    full_scale : float
        Raw value of full scale.
    dark : ndarray, shape (Cy, Cx, channels), optional
        Raw photo to subtract.
    dark_shows : str
        What the dark photo shows: ``"black"``, a black pattern; ``"ambient"``, the projector
        covered or off; ``"nothing"`` where there is none.
    black_level : float
        Light of a black pixel, as a share of a white one's, that is left once the dark photo is
        subtracted: 0 where that was under black.
    """

    photos: tuple[NDArray[Any], ...]
    full_scale: float
    dark: NDArray[Any] | None = None
    dark_shows: Literal["black", "ambient", "nothing"] = "nothing"
    black_level: float = 0.0

    @property
    def camera(self) -> Size:
        """Height and width of the photos."""
        return Size(*self.photos[0].shape[:2])

    @property
    def channels(self) -> int:
        """Camera channels."""
        return int(self.photos[0].shape[2])

    @property
    def saturated_share(self) -> float:
        """Share of all values of the patterns' photos that are at full scale or above."""
        return float(np.mean([np.mean(photo >= self.full_scale) for photo in self.photos]))

    def blocks(self) -> Iterator[slice]:
        """Split the camera into blocks of rows, each read into memory at once."""
        row = len(self.photos) * self.photos[0][0].size
        return blocks(self.camera.height, VALUES_AT_ONCE // row)

    def read(self, rows: slice) -> Floats:
        """Read camera rows in photo units less the dark photo: (n, rows, Cx, channels)."""
        raw = np.stack([photo[rows] for photo in self.photos]).astype(np.float32)
        if self.dark is not None:
            raw -= self.dark[rows].astype(np.float32)
        return np.asarray(raw / np.float32(self.full_scale))


def shoot_to_separate(
    rig: Rig,
    patterns: NDArray[np.uint8],
    *,
    progress: Callable[[int], None] | None = None,
) -> PhotosToSeparate:
    """Shoot patterns, then black.

    Parameters
    ----------
    rig : Rig
    patterns : ndarray, shape (n, Py, Px), uint8
    progress : callable, optional
        Called with the number of photos taken.

    Returns
    -------
    PhotosToSeparate

    Raises
    ------
    InputError
        If all photos are the same, or no brighter than that of black.
    """
    shot = []
    for photo in rig.shoot([*patterns, np.zeros_like(patterns[0])]):
        shot.append(photo)
        if progress is not None:
            progress(len(shot))
    *photos, dark = shot
    taken = PhotosToSeparate(tuple(photos), rig.full_scale, dark, "black")
    _check_light(taken, "the rig")
    return taken


def read_to_separate(
    folder: Path,
    patterns: int | None,
    *,
    ambient: Path | None = None,
    black: Path | None = None,
    black_level: float | None = None,
    full_scale: float | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> PhotosToSeparate:
    """Read photos from a folder in natural order of their names.

    Parameters
    ----------
    folder : Path
        One photo for each pattern. One more, the last, is that under black, where neither
        `ambient` nor `black` is given.
    patterns : int, optional
        How many patterns there are; if left out any number, and none of them black.
    ambient : Path, optional
        Photo with the projector covered or off; it may lie in the folder, as `black` may.
    black : Path, optional
        Photo under a black pattern.
    black_level : float, optional
        Light of a black pixel as a share of a white one's, for photos without one under black.
    full_scale : float, optional
        Raw value of full scale; by default that of the numbers' type.
    progress : callable, optional
        Called with the number of photos read and how many there are.

    Returns
    -------
    PhotosToSeparate

    Raises
    ------
    MissingFileError, UnreadableFileError
        If the folder or a photo is not there or cannot be read.
    InputError
        If options contradict each other or are out of range, the number of photos does not fit
        the patterns, a photo does not fit the first, all are the same, or they are no brighter
        than the dark one.
    """
    if full_scale is not None and not 0 < full_scale < np.inf:
        raise InputError(f"the full scale {full_scale} is not a positive number: give one above 0.")
    if ambient is not None and black is not None:
        raise InputError(
            f"{ambient} is ambient light and {black} is under black, and only one of them can be "
            f"subtracted: give the one under black."
        )
    # Before any photo is read.
    black_over_white_less_black(black_level or 0.0)
    dark = ambient or black
    paths = list_pictures(folder)
    if dark is not None:
        paths = [path for path in paths if realpath(path) != realpath(dark)]
    _check_count(folder, len(paths), patterns, with_dark=dark is not None)
    ends_in_black = patterns is not None and len(paths) > patterns
    if black_level is not None and (black is not None or ends_in_black):
        raise InputError(
            f"{black or paths[-1]}, the photo under black, holds the black level already: leave "
            f"out `black_level`, or give a photo of ambient light."
        )
    if dark is not None:
        paths = [*paths, dark]
    photos: list[NDArray[Any]] = []
    for number, path in enumerate(paths, start=1):
        photo = as_photo(read_picture(path), str(path))
        scale = full_scale_of(photo.dtype) if full_scale is None else float(full_scale)
        check_photo(photo, photos[0] if photos else photo, scale, str(path))
        photos.append(photo)
        if progress is not None:
            progress(number, len(paths))
    if dark is None and not ends_in_black:
        taken = PhotosToSeparate(tuple(photos), scale, black_level=black_level or 0.0)
    else:
        *shown, last = photos
        shows: Literal["black", "ambient"] = "ambient" if ambient is not None else "black"
        taken = PhotosToSeparate(tuple(shown), scale, last, shows, black_level or 0.0)
    _check_light(taken, str(folder), str(paths[-1]))
    return taken


def _check_count(folder: Path, there: int, patterns: int | None, *, with_dark: bool) -> None:
    if patterns is None:
        if there < 2:
            raise InputError(
                f"{folder} has {there} photo{'' if there == 1 else 's'}: give one for each "
                f"pattern, two or more, as {PICTURE_KINDS}."
            )
    elif there != patterns and (with_dark or there != patterns + 1):
        last = "" if with_dark else ", and if you like a last one under black"
        raise InputError(
            f"{folder} has {there} photos, but there are {patterns} patterns: give one photo for "
            f"each{last}, or the pattern's options as they were."
        )


def _check_light(taken: PhotosToSeparate, source: str, dark: str = "that of black") -> None:
    """Refuse photos that show no pattern."""
    first, *others = taken.photos
    if all(np.array_equal(first, other) for other in others):
        what = "the same" if first.any() else "black"
        raise InputError(
            f"all {len(taken.photos)} photos of {source} are {what}: check that the projector "
            f"shows the patterns and the camera sees them."
        )
    if taken.dark is not None:
        brightness = np.mean([photo.mean(dtype=np.float64) for photo in taken.photos])
        if brightness <= taken.dark.mean(dtype=np.float64):
            raise InputError(
                f"the photos of {source} are on average no brighter than the dark one, {dark}: "
                f"check their order, and that the projector was on."
            )


def separate(
    taken: PhotosToSeparate,
    method: Callable[[Floats, float], Separation],
    *,
    progress: Callable[[float], None] | None = None,
) -> Separation:
    """Separate photos a few camera rows at a time.

    Parameters
    ----------
    taken : PhotosToSeparate
    method : callable
        From photos (n, rows, Cx, channels) and black level to their separation.
    progress : callable, optional
        Called with the share done.
    """
    height = taken.camera.height
    parts = []
    for rows in taken.blocks():
        parts.append(method(taken.read(rows), taken.black_level))
        if progress is not None:
            progress(rows.stop / height)
    return Separation(*(np.concatenate(pictures) for pictures in zip(*parts, strict=True)))


def spread_of_groups(taken: PhotosToSeparate, groups: int) -> float:
    """Return the root-mean-square deviation of the groups' means, as a share of their mean.

    Each group's patterns sum to the same grey: a pair of a pattern and its inverse, all phases
    of a sinusoid. Photos out of order, a lamp that drifts and a response that is not linear
    make their means differ.

    Parameters
    ----------
    taken : PhotosToSeparate
    groups : int
        Number of groups, one after the other.
    """
    scatter = level = 0.0
    for rows in taken.blocks():
        photos = taken.read(rows)
        means = photos.reshape(groups, -1, *photos.shape[1:]).mean(axis=1, dtype=np.float64)
        middle = means.mean(axis=0)
        scatter += float(((means - middle) ** 2).mean(axis=0).sum())
        level += float((middle**2).sum())
    return float(np.sqrt(scatter / level)) if level > 0 else 0.0
