"""Codes that light about half of a projector's pixels: rows of a cyclic S-matrix.

All codes of an order tell every projector pixel apart, with the least noise that photos of one
brightness can (Harwit and Sloane, Hadamard Transform Optics, 1979). If a few are left out, some
sums of pixels remain unknown, or nearly so.
"""

import math
from itertools import count

from nearfar.arrays import Size
from nearfar.illumination import patterns
from nearfar.plan.patterns import LampCode

# Projector pixels whose codes can be turned into rows.
MOST_PIXELS = 4096
# Share of the order from one row to the next: few photos are of rows that lie far apart.
STEP = 0.382


def order_of_codes(least: int) -> int:
    """Return the smallest order of codes that is at least as large: a prime 4 m + 3."""
    return next(
        order for order in count(max(3, least)) if order % 4 == 3 and patterns.is_prime(order)
    )


def code(number: int, order: int) -> LampCode:
    """Return the code that is shown as the given one; none comes again before all of its order."""
    return LampCode(order=order, row=number * max(1, round(STEP * order)) % order)


def count_of_codes(projector: Size) -> float:
    """Return how many codes tell all pixels of a projector apart; infinite for too many pixels."""
    return order_of_codes(projector.pixels) if projector.pixels <= MOST_PIXELS else math.inf
