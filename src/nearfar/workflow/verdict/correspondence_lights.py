"""Lights to check by that the photos for correspondence show.

Stripes and Gray code tell q; no response is estimated from them. A weighted sum of their photos is
the picture under a light that no estimate has seen. Coarse lights, such as half of the screen, are
relit about as well as pictures are. Fine ones, such as a single row of the projector, hold
frequencies that were never measured.

The weights sum to 0, so that black and ambient light cancel. What is left of stripes is then
independent of the mean of all stripes, from which white is estimated.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from nearfar.arrays import Floats
from nearfar.illumination.patterns import gray_bits
from nearfar.plan import GrayCode, Plan, Stripe

# Bits of the Gray code of each axis that are compared with: the coarsest, and the finest.
COARSE_BITS = 2
FINE_BITS = 2
# Single rows, and single columns, that are compared with.
SINGLE_LINES = 3
# Rows or columns below which nothing is coarse.
FEWEST_LINES = 2 ** (COARSE_BITS + 1)


class WeighedLight(NamedTuple):
    """A light, and the weighted sum of photos that shows it.

    Attributes
    ----------
    description : str
    light : ndarray, shape (Py, Px), float32
        From 0 to 1.
    level : float
        The sum is the picture under the light less this level.
    photos : tuple of int
        Numbers of the photos.
    weights : tuple of float
        They sum to 0.
    has_inverse : bool
        Whether the photos are one of the light and one of its inverse, which sum to white.
    is_fine : bool
    """

    description: str
    light: Floats
    level: float
    photos: tuple[int, ...]
    weights: tuple[float, ...]
    has_inverse: bool
    is_fine: bool


def correspondence_lights(plan: Plan) -> list[WeighedLight]:
    """Return the lights to check by that a plan's stripes and Gray code show.

    Of each axis at most `COARSE_BITS` coarse ones, and `FINE_BITS` or `SINGLE_LINES` fine ones,
    whatever the size of the projector.
    """
    return [
        light
        for axis, side in enumerate(plan.projector)
        if side >= FEWEST_LINES
        for light in (*_of_stripes(plan, axis), *_of_gray_code(plan, axis))
    ]


def _of_stripes(plan: Plan, axis: int) -> Iterator[WeighedLight]:
    """Yield the lights of the stripes along one axis, if there is one for each line."""
    kind = ("black row", "black column")[axis]
    side = plan.projector[axis]
    number_of = {
        pattern.index: number
        for number, pattern in enumerate(plan.patterns)
        if isinstance(pattern, Stripe) and pattern.kind == kind
    }
    if len(number_of) != side:
        return
    photos = tuple(number_of[line] for line in range(side))
    bits = gray_bits(side)
    for bit in range(bits - COARSE_BITS, bits):
        shown = _bit(bit, axis, plan)
        yield _by_stripes(f"coarse {_LINES[axis]}s", shown, axis, photos, is_fine=False)
    for line in ((2 * np.arange(SINGLE_LINES) + 1) * side // (2 * SINGLE_LINES)).tolist():
        shown = np.zeros(plan.projector, dtype=np.float32)
        np.moveaxis(shown, axis, 0)[line] = 1.0
        yield _by_stripes(f"{_LINES[axis]} {line}", shown, axis, photos, is_fine=True)


_LINES = ("row", "column")


def _by_stripes(
    what: str, shown: Floats, axis: int, photos: tuple[int, ...], *, is_fine: bool
) -> WeighedLight:
    """Weigh the stripes so that they show a light whose lines are each of one value."""
    of_line = np.moveaxis(shown, axis, 0)[:, 0].astype(np.float64)
    level = float(of_line.mean())
    weights = tuple((level - of_line).tolist())
    return WeighedLight(f"{what}, by black stripes", shown, level, photos, weights, False, is_fine)


def _of_gray_code(plan: Plan, axis: int) -> Iterator[WeighedLight]:
    """Yield the lights of the Gray code along one axis: its coarsest and its finest bits."""
    kind = ("gray rows", "gray columns")[axis]
    number_of = {
        (pattern.bit, pattern.inverse): number
        for number, pattern in enumerate(plan.patterns)
        if isinstance(pattern, GrayCode) and pattern.kind == kind
    }
    bits = gray_bits(plan.projector[axis])
    fine = range(min(FINE_BITS, bits - COARSE_BITS))
    for bit in (*fine, *range(bits - COARSE_BITS, bits)):
        if (bit, False) in number_of and (bit, True) in number_of:
            photos = (number_of[bit, False], number_of[bit, True])
            shown = _bit(bit, axis, plan)
            yield WeighedLight(
                f"{kind}, bit {bit}", shown, 0.5, photos, (0.5, -0.5), True, bit in fine
            )


def _bit(bit: int, axis: int, plan: Plan) -> Floats:
    """Draw a bit of the Gray code of one axis."""
    kind = ("gray rows", "gray columns")[axis]
    pattern = GrayCode.model_validate({"kind": kind, "bit": bit})
    return np.asarray(pattern.draw(plan.projector) / np.float32(255))
