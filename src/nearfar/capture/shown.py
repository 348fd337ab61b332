"""Pictures of somebody else's that were shown as patterns: read, recognise, make a plan of them."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import AnyPath, Floats, Size
from nearfar.errors import InputError, MissingFileError
from nearfar.files import full_scale_of, list_pictures, read_picture
from nearfar.files.images import PICTURE_KINDS
from nearfar.plan import Plan
from nearfar.plan.model import LARGEST_SIDE
from nearfar.plan.recognition import Recognised, recognise
from nearfar.plan.recognition.contents import AnyPicture
from nearfar.plan.recognition.own import plan_of_pictures
from nearfar.progress import Report, ignore_progress

# Photos that are looked at for being patterns.
FEW = 4
# Share of full scale by which the levels of a pattern differ.
LEAST_CONTRAST = 0.25


@dataclass(frozen=True, eq=False)
class ShownPictures:
    """A folder of pictures that were shown, and what they were recognised as.

    Attributes
    ----------
    paths : tuple of Path
        In the order in which they were shown.
    recognised : Recognised
    plan : Plan
        Of nearfar's own patterns where all pictures are such, with offset "shown" otherwise.
    """

    paths: tuple[Path, ...]
    recognised: Recognised
    plan: Plan

    def read(self) -> Iterator[NDArray[Any]]:
        """Read the pictures one by one, as a capture keeps them: all grey, or all in colour."""
        has_colours = any(
            isinstance(content, AnyPicture) and content.is_colour
            for content in self.recognised.contents
        )
        for path in self.paths:
            picture = _read(path)
            if has_colours and picture.ndim == 2:
                yield np.repeat(picture[..., None], 3, axis=2)
            elif picture.ndim == 3 and not has_colours:
                # Its channels differ by less than a step of 8 bits.
                yield picture[..., 1]
            else:
                yield picture


def read_shown(folder: AnyPath, progress: Report = ignore_progress) -> ShownPictures:
    """Recognise the pictures in a folder, in natural order of their names.

    Parameters
    ----------
    folder : str or Path
        Pictures of one size, grey or colour: a picture for each photo.
    progress : callable
        Called with "patterns" and the share of them that is recognised.

    Returns
    -------
    ShownPictures

    Raises
    ------
    MissingFileError, UnreadableFileError
        If the folder or a picture is not there, or cannot be read.
    InputError
        If pictures differ in size, or hold values outside 0 to 1.
    """
    folder = Path(folder)
    paths = list_pictures(folder)
    if not paths:
        raise MissingFileError(
            f"{folder} has no pictures: name the folder of the patterns, as {PICTURE_KINDS}."
        )
    recognised = recognise(_lights(paths), lambda count: progress("patterns", count / len(paths)))
    plan = plan_of_pictures(recognised, lambda number: _read(paths[number]))
    return ShownPictures(tuple(paths), recognised, plan)


def require_photos(shown: ShownPictures, photos: Sequence[Path]) -> None:
    """Refuse photos that are patterns: the pictures that were shown, or those of swapped folders.

    Parameters
    ----------
    shown : ShownPictures
    photos : sequence of Path
        A photo for each picture.

    Raises
    ------
    InputError
    """
    structured = [i for i, each in enumerate(shown.recognised.contents) if each.kind != "uniform"]
    looked_at = structured[:FEW]
    pairs = ((_read(shown.paths[i]), _read(photos[i])) for i in looked_at)
    if looked_at and all(np.array_equal(pattern, photo) for pattern, photo in pairs):
        raise InputError(
            f"{photos[looked_at[0]]} is the pattern itself, and no photo of it: name the folder "
            f"of the photos."
        )
    kinds = [each.kind for each in shown.recognised.contents]
    # A photo may be uniform by chance, as under black.
    if kinds.count("picture") < FEW or set(kinds) - {"picture", "uniform"}:
        return
    read = (_read(path) for path in photos[:FEW])
    lights = [photo / np.float32(full_scale_of(photo.dtype)) for photo in read]
    found = recognise(lights).contents
    # So may noise in the dark have two levels, of next to no contrast.
    has_contrast = max(float(np.ptp(light)) for light in lights) > LEAST_CONTRAST
    if has_contrast and all(each.kind != "picture" for each in found):
        raise InputError(
            f"{photos[0].parent} holds patterns, and {shown.paths[0].parent} none that are "
            f"recognised: the folders of patterns and photos seem to be swapped."
        )


def _lights(paths: list[Path]) -> Iterator[Floats]:
    """Yield pictures as light, and refuse what does not belong with the others."""
    size: Size | None = None
    for path in paths:
        picture = _read(path)
        mine = Size(*picture.shape[:2])
        if size is not None and mine != size:
            raise InputError(
                f"{path} is {mine}, but {paths[0].name} is {size} (height x width): give patterns "
                f"of one size, as the projector shows them."
            )
        if max(mine) > LARGEST_SIDE:
            raise InputError(f"{path} is {mine}: no projector has more than {LARGEST_SIDE} pixels.")
        size = mine
        light = picture.astype(np.float32) / np.float32(full_scale_of(picture.dtype))
        if light.min() < 0 or light.max() > 1:
            raise InputError(
                f"{path} has values from {light.min():g} to {light.max():g}: give patterns from 0, "
                f"black, to 1, white."
            )
        yield light


def _read(path: Path) -> NDArray[Any]:
    """Read a picture; one of three equal channels is grey."""
    picture = read_picture(path)
    if picture.ndim == 3 and (picture == picture[..., :1]).all():
        return picture[..., 0]
    return picture
