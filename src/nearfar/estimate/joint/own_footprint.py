"""Footprints of camera pixels at edges, which are not those of their neighbours.

Where an edge or a shadow crosses a camera pixel, it sees less of the projector than q moves from
one camera pixel to the next, or more. Where direct light of the footprint that neighbours voted for
leaves much of the highest frequencies unexplained, q and the footprint's four numbers are searched
for that explain most of the camera pixel's own responses.
"""

import numpy as np

from nearfar.arrays import Booleans, Floats, blocks
from nearfar.estimate.joint.footprint import BATCH_PIXELS, high_responses
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
# Times that each step is tried in each direction.
ROUNDS = 2
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

    def work(batch: slice) -> None:
        selected = batch.start + np.flatnonzero(lit[batch])
        middles = q[selected] - centres[selected]
        responses = high.at(selected, centres[selected])
        before = high.explained(responses, middles, footprints[selected])
        power = np.sum(responses.astype(np.float64) ** 2, axis=(1, 2))
        count = responses.shape[1] * responses.shape[2]
        doubted = np.flatnonzero(power - before > LEAST_MISFIT * count)
        if not len(doubted):
            return
        selected, responses, before = selected[doubted], responses[doubted], before[doubted]
        start = np.concatenate([middles[doubted], footprints[selected]], axis=1)
        lowest, highest = np.full_like(start, -np.inf), np.full_like(start, np.inf)
        lowest[:, :2], highest[:, :2] = start[:, :2] - FARTHEST, start[:, :2] + FARTHEST
        lowest[:, 2:4] = NARROWEST
        numbers, best = start, before

        def attempt(tried: Floats) -> None:
            """Keep what explains more."""
            nonlocal numbers, best
            tried = np.clip(tried, lowest, highest)
            explained = high.explained(responses, tried[:, :2], tried[:, 2:])
            better = explained > best
            numbers = np.where(better[:, None], tried, numbers)
            best = np.where(better, explained, best)

        for shape in SHAPES:
            shaped = np.tile(start[:, 2:4], 2) * shape
            attempt(np.concatenate([start[:, :2], shaped], axis=1))
        for step in STEPS:
            for along in [*DIRECTIONS] * ROUNDS:
                size = 0.5 * (1.0 + numbers[:, 2:4].mean(axis=1, keepdims=True))
                attempt(numbers + step * size * along)
        accepted = best - before > 2 * LEAST_GAIN
        selected, numbers = selected[accepted], numbers[accepted]
        q[selected] = np.clip(centres[selected] + numbers[:, :2], 0.0, last)
        found[selected] = numbers[:, 2:]

    side_by_side(work, blocks(len(q), BATCH_PIXELS))
    return q.reshape(correspondence.shape), found
