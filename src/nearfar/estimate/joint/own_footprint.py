"""Footprints of camera pixels at edges, which are not those of their neighbours.

Where an edge or a shadow crosses a camera pixel, it sees less of the projector than q moves from
one camera pixel to the next, or more. Where direct light of the footprint that neighbours voted for
leaves much of the highest frequencies unexplained, q and the footprint's four numbers are searched
for that explain most of the camera pixel's own responses.
"""

import numpy as np

from nearfar.arrays import Booleans, Floats, Integers, blocks
from nearfar.estimate.joint.box_waves import WaveTable, wave_table
from nearfar.estimate.joint.footprint import BATCH_PIXELS, HighResponses, high_responses
from nearfar.estimate.joint.footprint_search import best_shapes, descend
from nearfar.illumination.near_basis import NearBasis
from nearfar.parallel import side_by_side
from nearfar.photometry.measurements import Measurements
from nearfar.transport import near
from nearfar.transport.seen import reach_of

# Unexplained power of a response, in units of its noise, above which a footprint is searched for.
LEAST_MISFIT = 3.0
# Least gain in log likelihood of a footprint of a camera pixel's own.
LEAST_GAIN = 25.0
# Steps of the search, as shares of the mean of the box's sides and a projector pixel.
STEPS = (0.25, 0.12, 0.06)
# Shapes that the search starts from, in the sides of the voted box: the sides, and how far the
# middles of both boxes are from q.
SHAPES = np.array(
    [
        [1.0, 0.5, 0.0, 0.0],
        [0.5, 1.0, 0.0, 0.0],
        [0.5, 0.5, 0.0, 0.0],
        [1.0, 0.4, 0.0, 0.45],
        [0.4, 1.0, 0.45, 0.0],
        [0.5, 0.5, 0.3, 0.3],
        [0.5, 0.5, 0.3, -0.3],
    ]
)
# Times that each step is tried in each direction.
ROUNDS = 2
# Sides and middles of boxes grow by at most as many times a side and a projector pixel: all steps
# together come to 0.86 of half of that, and the sides that they are shares of to 1.6 times theirs.
MOST_GROWTH = 2.0
# Camera pixels that are searched at once.
SEARCHED_PIXELS = 1024
# Voted footprints are blurred as they are.
UNBLURRED = np.zeros(1)
# Sides of a box are no narrower, in projector pixels; and q moves by at most as much.
NARROWEST, FARTHEST = 0.1, 1.0


def own_footprints(
    measurements: Measurements, correspondence: Floats, footprints: Floats, near_basis: NearBasis
) -> tuple[Floats, Floats]:
    """Return q and footprints, changed where camera pixels have a footprint of their own.

    Parameters
    ----------
    measurements : Measurements
    correspondence : ndarray, shape (Cy, Cx, 2)
        q; NaN where there is no direct light.
    footprints : ndarray, shape (C, 4), float32
        As neighbours voted for them.
    near_basis : NearBasis

    Returns
    -------
    correspondence : ndarray, shape (Cy, Cx, 2)
    footprints : ndarray, shape (C, 4), float32
    """
    high = high_responses(measurements, near_basis)
    if high is None:
        return correspondence, footprints
    q = correspondence.reshape(-1, 2).astype(np.float64)
    found = footprints.copy()
    lit: Booleans = np.asarray(np.isfinite(q).all(axis=1))
    centres = near.centre(correspondence, measurements.projector)
    last = np.array(measurements.projector) - 1.0

    before, power = np.zeros(len(q)), np.zeros(len(q))
    count = measurements.channels * high.centred.basis.count

    def explain(batch: slice) -> None:
        selected = batch.start + np.flatnonzero(lit[batch])
        middles = q[selected] - centres[selected]
        responses = high.at(selected, centres[selected])
        before[selected] = high.explained(responses, middles, footprints[selected], UNBLURRED)[:, 0]
        power[selected] = np.sum(responses.astype(np.float64) ** 2, axis=(1, 2))

    side_by_side(explain, blocks(len(q), BATCH_PIXELS))
    doubted = np.flatnonzero(power - before > LEAST_MISFIT * count)

    def search_in(batch: slice) -> None:
        selected = doubted[batch]
        responses = high.at(selected, centres[selected])
        numbers = np.concatenate(
            [q[selected] - centres[selected], footprints[selected]], axis=1, dtype=np.float64
        )
        search, by_q = _Search(high, numbers.copy()), before[selected]
        # What another q explains needs no other footprint.
        search.move(responses, numbers, by_q)
        shaped = np.flatnonzero(power[selected] - by_q > LEAST_MISFIT * count)
        own, best = numbers[shaped], by_q[shaped]
        search.only(shaped).reshape(responses[shaped], own, best)
        accepted = best - by_q[shaped] > 2 * LEAST_GAIN
        numbers[shaped[accepted]], by_q[shaped[accepted]] = own[accepted], best[accepted]
        accepted = by_q - before[selected] > 2 * LEAST_GAIN
        selected, numbers = selected[accepted], numbers[accepted]
        q[selected] = np.clip(centres[selected] + numbers[:, :2], 0.0, last)
        found[selected] = numbers[:, 2:]

    side_by_side(search_in, blocks(len(doubted), SEARCHED_PIXELS))
    return q.reshape(correspondence.shape), found


class _Search:
    """Searches for q and the footprint's four numbers, (n, 6), that explain most.

    Parameters
    ----------
    high : HighResponses
    before : ndarray, shape (n, 6)
        About which q is searched for.
    """

    def __init__(self, high: HighResponses, before: Floats) -> None:
        self._high, self._before = high, before
        self._lowest, self._highest = np.full_like(before, -np.inf), np.full_like(before, np.inf)
        self._lowest[:, :2], self._highest[:, :2] = (
            before[:, :2] - FARTHEST,
            before[:, :2] + FARTHEST,
        )
        self._lowest[:, 2:4] = np.minimum(NARROWEST, before[:, 2:4])

    def only(self, selected: Integers) -> "_Search":
        """Return the search for some of the camera pixels."""
        return _Search(self._high, self._before[selected])

    def move(self, responses: Floats, numbers: Floats, best: Floats) -> None:
        """Overwrite q, and what it explains, by the best that falling steps lead to."""
        self._descend(responses, numbers, best, 2)

    def reshape(self, responses: Floats, numbers: Floats, best: Floats) -> None:
        """Overwrite all numbers by the best that falling steps lead to from the best shape."""
        table = self._table(numbers)
        bounds = self._lowest, self._highest
        best_shapes(responses, self._high.roots, SHAPES, *bounds, *table, numbers, best)
        self._descend(responses, numbers, best, 6)

    def _descend(self, responses: Floats, numbers: Floats, best: Floats, coordinates: int) -> None:
        table = self._table(numbers)
        bounds = self._lowest, self._highest
        steps = np.repeat(STEPS, ROUNDS)
        descend(responses, self._high.roots, steps, coordinates, *bounds, *table, numbers, best)

    def _table(self, numbers: Floats) -> WaveTable:
        """Return waves over all pixels that a search from these numbers may touch."""
        side = float(numbers[:, 2:4].max(initial=0.0))
        margin = FARTHEST + MOST_GROWTH * (1.0 + side)
        return wave_table(self._high.centred, reach_of(numbers[:, 2:], margin))
