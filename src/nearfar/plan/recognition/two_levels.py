"""Pictures of two levels: stripes, bands, codes, blocks, checkerboards, rows of Hadamard matrices.

A binary picture is a boolean array (Py, Px), True where it is bright.
"""

from typing import NamedTuple

import numpy as np

from nearfar.arrays import Booleans, Integers
from nearfar.plan.recognition.contents import (
    Axis,
    Band,
    Binary,
    Block,
    Checkerboard,
    Code,
    Content,
    HadamardRow,
    Stripes,
)

# Changes between stripes that a row of stripes has at least: with fewer it is a band.
FEWEST_CHANGES = 3


class AxisCode(NamedTuple):
    """A binary picture that differs along one axis alone: its bright rows or columns."""

    axis: Axis
    bright: Booleans  # (Py,) or (Px,)


def code_of_axis(binary: Booleans) -> AxisCode | None:
    """Return the bright rows or columns of a picture that consists of whole ones, or None."""
    if (binary == binary[:1]).all():
        return AxisCode("columns", binary[0])
    if (binary == binary[:, :1]).all():
        return AxisCode("rows", binary[:, 0])
    return None


def name_code(code: AxisCode) -> Content:
    """Return stripes, a band or a code."""
    axis, bright = code
    changes = np.flatnonzero(bright[1:] != bright[:-1]) + 1
    runs = np.diff(changes, prepend=0, append=len(bright))
    inner = runs[1:-1]
    width = int(inner[0]) if len(inner) else int(runs.max())
    are_equal = (inner == width).all() and max(runs[0], runs[-1]) <= width
    is_half = len(changes) == 1 and runs[0] == runs[1]
    if (len(changes) >= FEWEST_CHANGES and are_equal) or is_half:
        return Stripes(axis=axis, width=width, first=int(runs[0]), is_first_white=bool(bright[0]))
    if len(changes) == 2:
        start, stop = changes
        return Band(axis=axis, start=int(start), stop=int(stop), is_white=bool(bright[start]))
    if len(changes) == 1:
        # Of the two parts, the band is the smaller.
        edge = int(changes[0])
        first, after = (0, edge) if runs[0] < runs[1] else (edge, len(bright))
        return Band(axis=axis, start=first, stop=after, is_white=bool(bright[first]))
    return Code(axis=axis, white_share=float(bright.mean()))


def name_picture(binary: Booleans) -> Content:
    """Return a block, a checkerboard, or a binary picture without a name."""
    if (block := _block(binary, is_white=True)) is not None:
        return block
    if (block := _block(~binary, is_white=False)) is not None:
        return block
    if (binary[:1] ^ binary[:, :1] ^ binary[0, 0] == binary).all():
        down = name_code(AxisCode("rows", binary[:, 0]))
        across = name_code(AxisCode("columns", binary[0]))
        if isinstance(down, Stripes) and isinstance(across, Stripes):
            return Checkerboard(
                height=down.width,
                width=across.width,
                top=None if down.first == down.width else down.first,
                left=None if across.first == across.width else across.first,
                is_first_white=bool(binary[0, 0]),
            )
    return Binary(white_share=float(binary.mean()))


def _block(binary: Booleans, *, is_white: bool) -> Block | None:
    """Return the rectangle that all bright pixels fill, if they fill one."""
    rows, columns = (np.flatnonzero(binary.any(axis=axis)) for axis in (1, 0))
    if not len(rows) or len(rows) * len(columns) != np.count_nonzero(binary):
        return None
    if rows[-1] - rows[0] >= len(rows) or columns[-1] - columns[0] >= len(columns):
        return None
    return Block(
        top=int(rows[0]),
        left=int(columns[0]),
        height=len(rows),
        width=len(columns),
        is_white=is_white,
    )


def hadamard_row(binary: Booleans) -> HadamardRow | None:
    """Return the row of Sylvester's Hadamard matrix that a picture shows, or None.

    Its bits are where the sign differs between pixel 0 and pixel 2^i.
    """
    flat = binary.ravel()
    if len(flat) & (len(flat) - 1):
        return None
    places = 1 << np.arange(len(flat).bit_length() - 1)
    row = int(places[flat[places] != flat[0]].sum())
    if ((walsh(row, len(flat)) == 0) ^ flat ^ flat[0]).all():
        return HadamardRow(row=row, inverse=not flat[0])
    return None


def walsh(row: int, length: int) -> Integers:
    """Return 0 where a row of Sylvester's Hadamard matrix is 1, and 1 where it is -1."""
    shared = np.arange(length, dtype=np.uint64) & np.uint64(row)
    return np.asarray(np.bitwise_count(shared) & 1)
