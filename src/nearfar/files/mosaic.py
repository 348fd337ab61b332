"""From a colour filter mosaic to colour without inventing any: each 2x2 cell becomes one pixel.

Index convention: a mosaic is (2 Cy, 2 Cx), a photo (Cy, Cx, 3) in red, green, blue.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from nearfar.errors import InputError

# Where the filters of a cell are, row by row.
CELLS = ("RGGB", "GRBG", "GBRG", "BGGR")


def bin_mosaic(mosaic: NDArray[Any], cell: str, full_scale: float | None = None) -> NDArray[Any]:
    """Make each 2x2 cell of a mosaic a pixel of red, green and blue.

    Linear and exact, and no cell affects another. The two greens are averaged, halves
    rounded to even; an odd last row or column is left out.

    Parameters
    ----------
    mosaic : array, shape (2 Cy, 2 Cx)
    cell : str
        Colours of a cell, row by row, such as ``RGGB``.
    full_scale : float, optional
        Level at which a value is saturated. A cell with a saturated green keeps it, unaveraged.

    Returns
    -------
    array, shape (Cy, Cx, 3)
        Of the same type.

    Raises
    ------
    InputError
        If there is no such cell, or the mosaic has none.
    """
    if cell not in CELLS:
        raise InputError(f"there is no mosaic {cell!r}: choose one of {', '.join(CELLS)}.")
    height, width = (side // 2 for side in mosaic.shape[:2])
    if mosaic.ndim != 2 or not height or not width:
        raise InputError(f"an array of shape {mosaic.shape} is no mosaic of 2x2 cells.")
    cells = mosaic[: 2 * height, : 2 * width].reshape(height, 2, width, 2)
    red, blue = (cells[:, i // 2, :, i % 2] for i in (cell.index("R"), cell.index("B")))
    first, second = (cells[:, i // 2, :, i % 2] for i in (cell.index("G"), cell.rindex("G")))
    green = (first.astype(np.float64) + second) / 2
    if full_scale is not None:
        higher = np.maximum(first, second)
        green = np.where(higher >= full_scale, higher, green)
    if mosaic.dtype.kind in "iu":
        green = np.rint(green)
    return np.stack([red, green.astype(mosaic.dtype), blue], axis=-1)
