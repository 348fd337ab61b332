"""Frames that a projector displays: a pattern, each pixel as a block, centred on black."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Size
from nearfar.errors import InputError


class FrameLayout(NamedTuple):
    """How a frame shows a pattern: its size, and the side of a pattern pixel in frame pixels."""

    frame: Size
    scale: int


def fit_frame(projector: Size, scale: int | None, native: Size | None) -> FrameLayout:
    """Return the frame and scale at which a pattern grid is displayed.

    Parameters
    ----------
    projector : Size
        Pattern grid.
    scale : int, optional
        Side of a pattern pixel on the frame; 1, or the largest that fits on `native`.
    native : Size, optional
        Frame to centre the pattern on, black around.

    Raises
    ------
    InputError
        If the pattern does not fit on `native`.
    """
    if native is None:
        scale = scale or 1
        return FrameLayout(Size(projector.height * scale, projector.width * scale), scale)
    largest = min(native.height // projector.height, native.width // projector.width)
    if largest < (scale or 1):
        raise InputError(
            f"a pattern of {projector} at `scale={scale or 1}` does not fit on "
            f"`native={tuple(native)}`: choose a larger frame or a smaller scale."
        )
    return FrameLayout(native, scale or largest)


def draw_frame(pattern: NDArray[np.uint8], layout: FrameLayout) -> NDArray[np.uint8]:
    """Draw a pattern on a frame, each pixel as a block, centred, black around."""
    enlarged = pattern.repeat(layout.scale, axis=0).repeat(layout.scale, axis=1)
    frame = np.zeros(layout.frame, dtype=np.uint8)
    top, left = (
        (outer - inner) // 2 for outer, inner in zip(layout.frame, enlarged.shape, strict=True)
    )
    frame[top : top + enlarged.shape[0], left : left + enlarged.shape[1]] = enlarged
    return frame
