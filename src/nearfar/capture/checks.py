"""Checks of photos: each has the shape and type of the first, and all together fit their plan."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Size
from nearfar.capture.store import PHOTO_DTYPES
from nearfar.errors import InputError, UselessPhotosError
from nearfar.files import full_scale_of, require_finite

# Floats may be above full scale, and a white far below; beyond these shares the full scale is not
# theirs, and single precision does not reach.
MAXIMUM_OF_FULL_SCALE = 1e3
MINIMUM_OF_FULL_SCALE = 1e-4


def as_photo(photo: NDArray[Any] | None, name: str) -> NDArray[Any]:
    """Bring a photo to (Cy, Cx, channels).

    Raises
    ------
    InputError
        If there is none, or its kind or shape is not a photo's.
    """
    if photo is None:
        raise InputError("there are no photos: give one for each pattern of the plan.")
    if photo.dtype not in PHOTO_DTYPES or photo.ndim not in {2, 3} or photo.size == 0:
        raise InputError(
            f"{name} is an array of {photo.dtype} and shape {photo.shape}: a photo is uint8, "
            f"uint16 or float32, height x width or height x width x channels."
        )
    return np.atleast_3d(photo)


def _describe(photo: NDArray[Any]) -> str:
    height, width, channels = photo.shape
    plural = "" if channels == 1 else "s"
    return f"{Size(height, width)} with {channels} channel{plural} of {photo.dtype}"


def check_photo(photo: NDArray[Any], first: NDArray[Any], scale: float, name: str) -> None:
    """Refuse a photo of another shape or type than the first, or beyond full scale.

    Raises
    ------
    InputError
    """
    if photo.shape != first.shape or photo.dtype != first.dtype:
        raise InputError(
            f"{name} is {_describe(photo)}, but the first photo is {_describe(first)}: "
            f"take all photos with the same camera settings."
        )
    if photo.dtype.kind == "f":
        require_finite(photo, name)
    elif photo.max() > scale:
        raise InputError(
            f"{name} has values up to {photo.max()}, above the full scale of {scale:g}: give the "
            f"camera's true full scale."
        )


def check_full_scale(photo: NDArray[Any], scale: float, name: str, *, is_white: bool) -> None:
    """Refuse a photo that is of another full scale, such as floats of any unit.

    Raises
    ------
    InputError
    """
    largest = float(photo.max())
    if largest > MAXIMUM_OF_FULL_SCALE * scale:
        raise InputError(
            f"{name} has values up to {largest:g}, of a full scale of {scale:g}: give the camera's "
            f"true full scale."
        )
    # A dark photo of whole numbers may be out of order, which other checks tell.
    possible = largest if photo.dtype.kind == "f" else full_scale_of(photo.dtype)
    if is_white and 0 < possible < MINIMUM_OF_FULL_SCALE * scale:
        raise InputError(
            f"{name}, of the white pattern, has values up to {largest:g}, of a full scale of "
            f"{scale:g}: expose longer, or give the camera's true full scale."
        )


def check_count(written: int, count: int, *, more: bool) -> None:
    """Refuse fewer photos than patterns, or more.

    Raises
    ------
    InputError
    """
    if written < count or more:
        there = f"only {written}" if written < count else f"more than {count}"
        raise InputError(
            f"there are {there} photos for the {count} patterns of the plan: give one for each."
        )


def check_white_and_black(
    pair: tuple[int, int] | None, means: NDArray[np.float64], called: list[str]
) -> None:
    """Refuse white that is no brighter than black; photos that are not there yet have mean NaN.

    Raises
    ------
    UselessPhotosError
    """
    if pair is None:
        return
    white, black = pair
    if means[white] <= means[black]:
        raise UselessPhotosError(
            f"{called[white]}, of the white pattern, is no brighter than {called[black]}, of the "
            f"black one: the photos seem to be out of order, or the projector was off."
        )


def check_order(
    pair: tuple[int, int] | None, means: NDArray[np.float64], called: list[str]
) -> None:
    """Refuse photos darker than black or brighter than white, once both are there.

    Raises
    ------
    InputError
    """
    # No pattern gives less light than black or more than white; half their difference is far
    # above any noise or drift.
    if pair is None:
        return
    white, black = pair
    if np.isnan(means[white]) or np.isnan(means[black]):
        return
    margin = (means[white] - means[black]) / 2
    darkest, brightest = int(np.nanargmin(means)), int(np.nanargmax(means))
    for bad, word, reference, name in (
        (means[darkest] < means[black] - margin, "darker", black, "black"),
        (means[brightest] > means[white] + margin, "brighter", white, "white"),
    ):
        if bad:
            other = darkest if reference == black else brightest
            raise InputError(
                f"{called[other]} is much {word} than {called[reference]}, of the {name} pattern: "
                f"the photos seem to be out of order."
            )
