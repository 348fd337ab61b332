"""Photos that follow their patterns in another order, told by their brightness.

White, black and half-screens come again and again through a plan, so that the mean of each photo
tells whether all photos are in reverse, or late by some from one of them on.

Index convention: n runs over photos in the order of the plan.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Floats
from nearfar.faults.of_single_photos import ShowsOtherPattern
from nearfar.illumination.frequencies import DC
from nearfar.plan import Plan, Sinusoid

# Photos by which others may be late or early.
MOST_LATE = 3
# In squares of white's brightness: what another order has to explain at least, and as a share of
# what the plan's leaves.
LEAST_EXPLAINED, LEAST_SHARE = 1.0, 0.7
# Moments that leave as much more as this are as good: sinusoids are all as bright.
AS_GOOD = 0.1


class Order(NamedTuple):
    """Another order of photos.

    Attributes
    ----------
    photos, others : tuple of int
        As `nearfar.faults.of_single_photos.ShowsOtherPattern` has them.
    left : float
        Squared brightness that it does not explain, in squares of white's.
    """

    photos: tuple[int, ...]
    others: tuple[int, ...]
    left: float


def find_other_order(photos: Floats, plan: Plan) -> list[ShowsOtherPattern]:
    """Find whether all photos are in reverse, or late or early from one of them on.

    Parameters
    ----------
    photos : ndarray, shape (photos, rows, columns, channels)
        Of a sample, in photo units.
    plan : Plan

    Returns
    -------
    list of ShowsOtherPattern
        Empty, or one.
    """
    seen = photos.mean(axis=(1, 2, 3), dtype=np.float64)
    shown = np.array([_brightness(plan, number) for number in range(len(seen))])
    # Whatever the order, the brightest photo is of the brightest pattern.
    line = np.polynomial.Polynomial.fit(np.sort(shown), np.sort(seen), 1).convert()
    if len(line.coef) < 2 or line.coef[1] <= 0:
        return []
    level = (seen - line.coef[0]) / line.coef[1]
    as_planned = float(np.sum((level - shown) ** 2))
    best = min(_orders(level, shown), key=lambda order: order.left)
    if as_planned - best.left < max(LEAST_EXPLAINED, LEAST_SHARE * as_planned):
        return []
    return [ShowsOtherPattern(best.photos, best.others)]


def _brightness(plan: Plan, number: int) -> float:
    """Return the mean of a pattern, from 0 to 1, without drawing what is known."""
    pattern = plan.patterns[number]
    if isinstance(pattern, Sinusoid):
        return 0.5 if pattern.frequency != DC else float(not pattern.inverse)
    return float(plan.draw(number).mean() / 255)


def _orders(level: NDArray[np.float64], shown: NDArray[np.float64]) -> Iterator[Order]:
    """Yield reverse order, then each number of photos to be late or early by, at its best."""
    count = len(level)
    everyone = np.arange(count)
    reverse = tuple(range(count))[::-1]
    yield Order(tuple(range(count)), reverse, float(np.sum((level - shown[::-1]) ** 2)))
    planned = np.cumsum((level - shown) ** 2)
    for late in (*range(1, MOST_LATE + 1), *range(-MOST_LATE, 0)):
        other = np.clip(everyone - late, 0, count - 1)
        moved = (level - shown[other]) ** 2
        # What is left if photos from each one on are late; the last that serves is certain.
        left = np.append(0.0, planned)[:-1] + moved[::-1].cumsum()[::-1]
        first = int(np.flatnonzero(left <= left.min() + AS_GOOD)[-1])
        inside = everyone[first:][other[first:] == everyone[first:] - late]
        if len(inside):
            yield Order(tuple(inside.tolist()), tuple((inside - late).tolist()), float(left[first]))
