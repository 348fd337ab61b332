"""Footprints of camera pixels at edges, which are not those of their neighbours.

Where an edge or a shadow crosses a camera pixel, it sees less of the projector than q moves from
one camera pixel to the next, or more. Where direct light of the footprint that neighbours voted for
leaves much of the highest frequencies unexplained, q and the footprint's four numbers are searched
for that explain most of the camera pixel's own responses.
"""

import numpy as np

from nearfar.arrays import Booleans, Floats, blocks
from nearfar.estimate.joint.footprint import BATCH_PIXELS, HighResponses, high_responses
from nearfar.illumination.near_basis import NearBasis
from nearfar.parallel import side_by_side
from nearfar.photometry.measurements import Measurements
from nearfar.transport import near

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
# Directions of the search: along each of q's and the footprint's four numbers.
DIRECTIONS = np.concatenate([np.eye(6), -np.eye(6)])
ALONG_Q = DIRECTIONS[[0, 1, 6, 7]]
# Times that each step is tried in each direction.
ROUNDS = 2
# Camera pixels that are searched at once.
SEARCHED_PIXELS = 1024
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
        before[selected] = high.explained(responses, middles, footprints[selected])
        power[selected] = np.sum(responses.astype(np.float64) ** 2, axis=(1, 2))

    side_by_side(explain, blocks(len(q), BATCH_PIXELS))
    doubted = np.flatnonzero(power - before > LEAST_MISFIT * count)

    def search_in(batch: slice) -> None:
        selected = doubted[batch]
        responses = high.at(selected, centres[selected])
        middles = q[selected] - centres[selected]
        start = np.concatenate([middles, footprints[selected]], axis=1)
        search = _Search(high, start)
        # What another q explains needs no other footprint.
        numbers, by_q = search.descend(responses, start, before[selected], ALONG_Q)
        shaped = np.flatnonzero(power[selected] - by_q > LEAST_MISFIT * count)
        search = _Search(high, start[shaped])
        own, best = search.start(responses[shaped], numbers[shaped], by_q[shaped])
        own, best = search.descend(responses[shaped], own, best, DIRECTIONS)
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
        self._high = high
        self._lowest, self._highest = np.full_like(before, -np.inf), np.full_like(before, np.inf)
        self._lowest[:, :2], self._highest[:, :2] = (
            before[:, :2] - FARTHEST,
            before[:, :2] + FARTHEST,
        )
        self._lowest[:, 2:4] = np.minimum(NARROWEST, before[:, 2:4])

    def start(self, responses: Floats, numbers: Floats, best: Floats) -> tuple[Floats, Floats]:
        """Return the best of the shapes that the search starts from, and what it explains."""
        sides = np.tile(numbers[:, 2:4], 2)
        for shape in SHAPES:
            tried = np.concatenate([numbers[:, :2], sides * shape], axis=1)
            numbers, best = self._better(responses, numbers, best, tried)
        return numbers, best

    def descend(
        self, responses: Floats, numbers: Floats, best: Floats, directions: Floats
    ) -> tuple[Floats, Floats]:
        """Return the best numbers that falling steps lead to, and what they explain."""
        for step in STEPS:
            for along in [*directions] * ROUNDS:
                size = 0.5 * (1.0 + numbers[:, 2:4].mean(axis=1, keepdims=True))
                tried = numbers + step * size * along
                numbers, best = self._better(responses, numbers, best, tried)
        return numbers, best

    def _better(
        self, responses: Floats, numbers: Floats, best: Floats, tried: Floats
    ) -> tuple[Floats, Floats]:
        tried = np.clip(tried, self._lowest, self._highest)
        explained = self._high.explained(responses, tried[:, :2], tried[:, 2:])
        better = explained > best
        return np.where(better[:, None], tried, numbers), np.where(better, explained, best)
