"""Frames whose light is linear in the pattern's levels, whatever the projector's response.

Index convention: tables are (level 0..255, primary); frames (height, width, 3), 8 bits.
"""

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Floats
from nearfar.errors import InputError
from nearfar.illumination.frames import FrameLayout

LEVEL_COUNT = 256
PRIMARY_COUNT = 3
# Roberts' R2 sequence: fractional parts of multiples of these fill the unit square evenly.
R2_STEPS = (0.7548776662466927, 0.5698402909980532)


class LinearProjector:
    """Draws frames for a projector of known response.

    A pattern pixel is a block of the projector's. Some of its pixels show one level and the others
    the next, so that the block's mean light is the wanted one, to within one step over the number
    of its pixels.

    Parameters
    ----------
    response : array, shape (256, 3)
        Light of each level and primary over that of the highest; 0 at level 0, never falling.
    layout : FrameLayout
        Frame and scale of a pattern pixel.
    brightness : float
        Light of a white pattern over the projector's full white.

    Raises
    ------
    InputError
    """

    def __init__(self, response: Floats, layout: FrameLayout, brightness: float = 1.0) -> None:
        if response.shape != (LEVEL_COUNT, PRIMARY_COUNT) or (np.diff(response, axis=0) < 0).any():
            raise InputError(
                "a projector's response has 256 levels of 3 primaries and never falls."
            )
        if not 0 < brightness <= 1:
            raise InputError(
                f"the brightness {brightness} is not valid: choose more than 0, up to 1."
            )
        self._layout = layout
        wanted = brightness * np.arange(LEVEL_COUNT) / (LEVEL_COUNT - 1)
        tables = [_steps(response[:, i], wanted) for i in range(PRIMARY_COUNT)]
        self._level = np.stack([level for level, _ in tables], axis=-1)
        self._share = np.stack([share for _, share in tables], axis=-1)
        self._threshold = _thresholds(layout)

    def draw(self, pattern: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Draw the frame of an 8-bit pattern, (Py, Px) or (Py, Px, 3), black around."""
        scale = self._layout.scale
        blown = pattern.repeat(scale, axis=0).repeat(scale, axis=1)
        height, width = blown.shape[:2]
        top, left = ((a - b) // 2 for a, b in zip(self._layout.frame, blown.shape[:2], strict=True))
        frame = np.zeros((*self._layout.frame, PRIMARY_COUNT), dtype=np.uint8)
        inside = frame[top : top + height, left : left + width]
        threshold = self._threshold[:height, :width]
        for primary in range(PRIMARY_COUNT):
            own = blown if blown.ndim == 2 else blown[..., primary]
            more = self._share[:, primary][own] > threshold
            inside[..., primary] = self._level[:, primary][own] + more
        return frame


def identity() -> Floats:
    """Return the response of a linear projector, which a rig without a calibration is taken for."""
    return np.repeat(np.linspace(0.0, 1.0, LEVEL_COUNT)[:, np.newaxis], PRIMARY_COUNT, axis=1)


def _steps(response: Floats, wanted: Floats) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
    """Return the level just below each wanted light, and the share of the level above."""
    below = np.clip(np.searchsorted(response, wanted, side="right") - 1, 0, LEVEL_COUNT - 2)
    step = response[below + 1] - response[below]
    share = (wanted - response[below]) / np.where(step > 0, step, 1.0)
    return below.astype(np.uint8), np.clip(share, 0.0, 1.0).astype(np.float32)


def _thresholds(layout: FrameLayout) -> NDArray[np.float32]:
    """Thresholds of each pixel of the pattern: in each block the same, evenly spread."""
    scale = layout.scale
    y, x = np.mgrid[:scale, :scale]
    order = (R2_STEPS[0] * y + R2_STEPS[1] * x) % 1.0
    ranks = np.empty(scale * scale)
    ranks[np.argsort(order, axis=None)] = np.arange(scale * scale)
    block = ((ranks + 0.5) / scale**2).reshape(scale, scale)
    return np.tile(block, [-(-side // scale) for side in layout.frame]).astype(np.float32)
