"""Array types, sizes, and slices that divide camera pixels or rows.

Everywhere: images are [y, x] or [y, x, channel], a size AxB is height x width, and camera or
projector pixels are flattened row by row.
"""

import math
import os
from collections.abc import Iterator, Sequence
from functools import cache
from importlib import import_module
from operator import index
from typing import Any, NamedTuple, SupportsIndex

import numpy as np
from array_api_compat import array_namespace, device, is_numpy_array, to_device
from numpy.typing import NDArray

from nearfar.errors import InputError

# What public functions take as the path of a file.
AnyPath = str | os.PathLike[str]

Floats = NDArray[np.floating[Any]]
Complexes = NDArray[np.complexfloating[Any, Any]]
Integers = NDArray[np.integer[Any]]
Booleans = NDArray[np.bool_]

# Multiplications up to which OpenBLAS takes kernels for small matrices.
FEW_MULTIPLICATIONS = 100**3
# A multiple of the rows that its kernels take at once.
ROWS_OF_KERNELS = 48


class Size(NamedTuple):
    """Height and width of a grid of pixels.

    A plain ``(height, width)`` does wherever a size is asked for.

    Attributes
    ----------
    height, width : int
        In pixels.

    Examples
    --------
    >>> size = nearfar.Size(68, 100)
    >>> size.pixels
    6800
    >>> print(size)
    68x100
    """

    height: int
    width: int

    @property
    def pixels(self) -> int:
        """Number of pixels."""
        return self.height * self.width

    def __str__(self) -> str:
        return f"{self.height}x{self.width}"


# What public functions take as a size.
AnySize = Size | Sequence[SupportsIndex]


def as_size(value: AnySize, name: str = "size") -> Size:
    """Return a size given as a `Size` or as any two whole numbers.

    Parameters
    ----------
    value : Size, or (height, width)
        Python's or NumPy's integers, both at least 1.
    name : str
        What the size is of, for the message.

    Returns
    -------
    Size
        Of Python's integers.

    Raises
    ------
    InputError
        If it is anything else.
    """
    sides: tuple[Any, ...] = () if isinstance(value, str | bytes) else _listed(value)
    if any(isinstance(side, bool | np.bool_) for side in sides) or len(sides) != 2:
        sides = ()
    try:
        height, width = (index(side) for side in sides)
    except (TypeError, ValueError):
        raise InputError(
            f"the {name} {value!r} is not a size: give two whole numbers, (height, width), for "
            f"instance (68, 100)."
        ) from None
    if height < 1 or width < 1:
        raise InputError(f"the {name} {value!r} has a side under 1: both must be at least 1.")
    return Size(height, width)


def _listed(value: Any) -> tuple[Any, ...]:
    try:
        return tuple(value)
    except TypeError:
        return ()


def parse_size(text: str, *, name: str = "size") -> Size:
    """Read a size written as ``HxW``.

    Parameters
    ----------
    text : str
        Height and width in pixels, for instance ``"68x100"`` (68 rows).
    name : str
        What the size is of, for the message.

    Returns
    -------
    Size

    Raises
    ------
    InputError
        If the text is no size or a side is under 1.

    Examples
    --------
    >>> nearfar.parse_size("68x100")
    Size(height=68, width=100)
    """
    parts = text.lower().replace("×", "x").split("x")
    try:
        height, width = (int(part) for part in parts)
    except ValueError:
        raise InputError(
            f"the {name} {text!r} is not HxW: write height x width, for instance 68x100."
        ) from None
    if height < 1 or width < 1:
        raise InputError(f"the {name} {text!r} has a side under 1: both must be at least 1.")
    return Size(height, width)


# Bytes in each unit of memory.
_UNITS = {"KB": 10**3, "MB": 10**6, "GB": 10**9, "TB": 10**12}


def parse_bytes(text: str) -> int:
    """Read an amount of memory written as ``2GB`` or ``500MB``.

    Raises
    ------
    InputError
        If the text is no amount above 0 in KB, MB, GB or TB.
    """
    plain = text.strip().upper()
    try:
        amount = float(plain[:-2]) * _UNITS[plain[-2:]]
    except (ValueError, KeyError):
        amount = -1.0
    if not 0 < amount < math.inf:
        raise InputError(
            f"`memory` {text!r} is not an amount of memory: write for instance 2GB or 500MB."
        )
    return int(amount)


def processors() -> int:
    """Return the number of processors that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def namespace(*values: Any) -> Any:
    """Return the array-API functions for arrays: NumPy's, PyTorch's or CuPy's."""
    # Asked for often, and finding it out takes as long as work on a few camera pixels.
    if all(type(value) is np.ndarray for value in values):
        return _of_numpy()
    return array_namespace(*values)


@cache
def _of_numpy() -> Any:
    """Return NumPy's array-API functions, whose import takes longer than NumPy's own."""
    return import_module("array_api_compat.numpy")


def beside(constant: NDArray[Any], values: Any) -> Any:
    """Return a NumPy array as an array of the library and on the device of `values`."""
    if is_numpy_array(values):
        return constant
    return namespace(values).asarray(constant, device=device(values))


def fetch(values: Any) -> NDArray[Any]:
    """Return an array of any library as a NumPy array."""
    if is_numpy_array(values):
        return np.asarray(values)
    return np.from_dlpack(to_device(values, "cpu"))


def product(values: Floats, matrix: Floats) -> Floats:
    """Return (..., a) @ (a, b) as one matrix product; NumPy computes one for each leading index."""
    flat = values.reshape((math.prod(values.shape[:-1]), values.shape[-1])) @ matrix
    return flat.reshape((*values.shape[:-1], matrix.shape[1]))


def product_by_row(values: NDArray[Any], matrix: NDArray[Any]) -> NDArray[Any]:
    """Return `product` of NumPy arrays; a row's rounding does not depend on the rows after it.

    OpenBLAS multiplies by other kernels where there are few multiplications or a single row, and
    where rows are left over that fill no kernel, so these are followed by zeros.
    """
    flat = values.reshape((math.prod(values.shape[:-1]), values.shape[-1]))
    number, whole = len(flat), len(flat) // ROWS_OF_KERNELS * ROWS_OF_KERNELS
    least = FEW_MULTIPLICATIONS // max(1, matrix.size) + 1
    if whole < least:
        whole = 0
    found = np.empty((number, matrix.shape[1]), dtype=np.result_type(values, matrix))
    if whole:
        np.matmul(flat[:whole], matrix, out=found[:whole])
    if whole < number:
        rows = -(-max(least, number - whole) // ROWS_OF_KERNELS) * ROWS_OF_KERNELS
        filled = np.zeros((rows, flat.shape[1]), dtype=flat.dtype)
        filled[: number - whole] = flat[whole:]
        found[whole:] = (filled @ matrix)[: number - whole]
    return found.reshape((*values.shape[:-1], matrix.shape[1]))


def blocks(count: int, length: int) -> Iterator[slice]:
    """Divide ``range(count)`` into slices of at most `length`."""
    for start in range(0, count, max(1, length)):
        yield slice(start, min(count, start + max(1, length)))


def middles(count: int, length: int) -> Integers:
    """Return the middle of each slice of ``blocks(count, length)``, int64.

    Thinning a picture to them keeps each pixel in the middle of its cell.
    """
    return np.array([(b.start + b.stop - 1) // 2 for b in blocks(count, length)], dtype=np.int64)
