"""Checks of the arguments of public functions; `nearfar.arrays.as_size` checks sizes.

Each returns the argument in the form that the code behind works with, or raises `InputError`
naming the argument, what is wrong with it, and the cure.

Index convention: c runs over camera pixels and p over projector pixels, both row by row; l runs
over lights.
"""

from operator import index
from typing import Any, ClassVar, cast

import numpy as np
from array_api_compat import is_array_api_obj, is_numpy_array
from numpy.typing import ArrayLike, NDArray

from nearfar.arrays import Floats, Size, namespace
from nearfar.errors import InputError


def as_count(value: Any, name: str, least: int | None = None) -> int:
    """Return a whole number, Python's or NumPy's.

    Raises
    ------
    InputError
        If it is a fraction, a bool or anything else, or below `least`.
    """
    try:
        number = None if isinstance(value, bool | np.bool_) else index(value)
    except TypeError:
        number = None
    if number is None:
        raise InputError(f"{name} is {value!r}, not a whole number: give an int.")
    if least is not None and number < least:
        raise InputError(f"{name} is {number}, and must be at least {least}.")
    return number


def as_number(value: Any, name: str) -> float:
    """Return a finite real number, Python's or NumPy's.

    Raises
    ------
    InputError
        If it is anything else.
    """
    number = np.asarray(value) if isinstance(value, int | float | np.generic) else None
    if number is None or number.dtype.kind not in "biuf" or not np.isfinite(number):
        raise InputError(f"{name} is {value!r}, not a finite number: give a float.")
    return float(number)


def as_place(y: Any, x: Any, grid: Size, name: str) -> tuple[int, int]:
    """Return row and column of a pixel that lies on a grid.

    Raises
    ------
    InputError
        If they are not whole numbers, or lie off the grid.
    """
    row, column = (
        as_count(y, f"the row of the {name}'s pixel"),
        as_count(x, f"the column of the {name}'s pixel"),
    )
    if not (0 <= row < grid.height and 0 <= column < grid.width):
        raise InputError(
            f"({row}, {column}) is no pixel of the {name} of {grid}: give a row and a column from "
            f"(0, 0) to ({grid.height - 1}, {grid.width - 1})."
        )
    return row, column


def as_pixels(pixels: Any, count: int) -> slice:
    """Return a slice of camera pixels, of which there are `count`.

    Raises
    ------
    InputError
        If it is no slice of whole numbers.
    """
    try:
        pixels.indices(count)
    except (AttributeError, TypeError, ValueError):
        raise InputError(
            f"the camera pixels are {pixels!r}, not a slice: give slice(c, c + 1) for pixel c."
        ) from None
    return cast("slice", pixels)


def real_numbers(values: ArrayLike, name: str) -> NDArray[Any]:
    """Return an array of real numbers, NaN and infinities among them; lists are accepted.

    An array of real numbers is returned unchanged, memory maps included.

    Raises
    ------
    InputError
        If it holds anything else.
    """
    try:
        # asarray would return the array behind a memory map, which no longer knows its file.
        array = values if isinstance(values, np.memmap) else np.asarray(values)
    except (TypeError, ValueError) as error:
        raise InputError(f"{name} is not an array ({error}): give one of numbers.") from None
    if array.dtype.kind not in "biuf":
        raise InputError(
            f"{name} holds {array.dtype}, not real numbers: give an array of floats or integers."
        )
    return array


def finite_numbers(values: ArrayLike, name: str) -> Floats:
    """Return an array of finite floats; lists are accepted, and whole numbers become float32.

    Raises
    ------
    InputError
        If it holds anything else.
    """
    array = real_numbers(values, name)
    if array.dtype.kind != "f":
        array = array.astype(np.float32)
    if not np.isfinite(array).all():
        raise InputError(f"{name} holds NaN or infinite values: replace them with numbers first.")
    return array


def as_light(
    light: ArrayLike,
    projector: Size,
    channels: int,
    *,
    name: str = "light",
    side: str = "projector",
) -> Floats:
    """Return a light as (Py, Px), for all channels, or (Py, Px, channels).

    Parameters
    ----------
    light : array_like
    projector : Size
    channels : int
    name, side : str
        What the light and the grid it lies on are called in messages.

    Raises
    ------
    InputError
        If it does not hold finite numbers, or has another size or other channels.
    """
    array = finite_numbers(light, f"the {name}")
    _require_light(array.shape, projector, channels, name, side)
    return array


def as_lights(lights: Any, projector: Size, channels: int) -> Any:
    """Return lights (n, Py, Px) or (n, Py, Px, channels), as an array of the library they are of.

    Raises
    ------
    InputError
        As `as_light`.
    """
    foreign = is_array_api_obj(lights) and not is_numpy_array(lights)
    array = _finite_elsewhere(lights) if foreign else finite_numbers(lights, "the lights")
    if array.ndim == 0:
        raise InputError(f"the lights are one number: give n x {projector}.")
    if tuple(array.shape) in {projector, (*projector, channels)}:
        raise InputError(
            f"one light of {projector} was given where several are expected: give n x {projector}, "
            f"`light[None]` for one."
        )
    _require_light(tuple(array.shape[1:]), projector, channels)
    return array


def _finite_elsewhere(values: Any) -> Any:
    xp = namespace(values)
    if not xp.isdtype(values.dtype, "real floating"):
        raise InputError(
            f"the lights hold {values.dtype}, not floats: convert them on their device first."
        )
    if not bool(xp.all(xp.isfinite(values))):
        raise InputError("the lights hold NaN or infinite values: replace them first.")
    return values


def _require_light(
    shape: tuple[int, ...],
    projector: Size,
    channels: int,
    name: str = "light",
    side: str = "projector",
) -> None:
    if shape[:2] != projector or len(shape) not in (2, 3):
        raise InputError(
            f"the {name} is {_by(shape)}, this transport's {side} is {projector}: resize the "
            f"{name} to {projector}."
        )
    if len(shape) == 3 and shape[2] not in (1, channels):
        raise InputError(
            f"the {name} has {shape[2]} channels, this transport {channels}: give a grey {name} "
            f"of {projector}, or one with {channels} channels."
        )


def as_image(image: ArrayLike, camera: Size, channels: int) -> Floats:
    """Return an image of the camera as (C, channels).

    Raises
    ------
    InputError
        If it does not hold finite numbers, or has another size or other channels.
    """
    array = finite_numbers(image, "the image")
    if array.shape != (*camera, channels) and not (channels == 1 and array.shape == camera):
        raise InputError(
            f"the image is {_by(array.shape)}, this transport's photos are {camera} with "
            f"{channels} channels: give an image of that shape."
        )
    return array.reshape(-1, channels)


def _by(shape: tuple[int, ...]) -> str:
    return "x".join(map(str, shape)) if shape else "one number"


def require_instance(value: Any, expected: type, name: str, source: str) -> None:
    """Refuse an object of another type, such as a path where the object read from it is meant.

    Parameters
    ----------
    value : object
    expected : type
    name : str
        Name of the argument.
    source : str
        Public function that returns such objects.

    Raises
    ------
    InputError
    """
    if not isinstance(value, expected):
        raise InputError(
            f"a {type(value).__name__} was given for the {name}, and not a {expected.__name__}: "
            f"give what {source} returns."
        )


class NoArray:
    """Base of operators, which NumPy would turn into an array of one object."""

    _instead: ClassVar[str] = "multiply it with a light, or take its rows by rows(slice(None))"
    # NumPy's own numbers and arrays leave products with an operator to the operator.
    __array_ufunc__ = None

    def __array__(self, _dtype: object = None, _copy: object = None) -> NDArray[Any]:
        """Refuse.

        Raises
        ------
        InputError
        """
        raise InputError(
            f"this {type(self).__name__} is an operator and not an array: {self._instead}."
        )
