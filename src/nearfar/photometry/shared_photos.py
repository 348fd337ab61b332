"""Photos that several projectors shared, taken apart: a photo of each pattern by each projector.

By the Hadamard matrix h of `nearfar.plan.sharing`, the m photos S_j of a pattern p are

    S_j = k + sum over i of (W_i / 2 + h_ji a_i),   a_i = T_i (p - 1/2),

with the photo under black k, and W_i what white of projector i adds. The mean over j of h_ji S_j is
a_i, and the first, for which all h are 1, has k and half of all whites besides. So with the mean of
that first over all whites and blacks of the plan, which is k + sum of W_i / 2,

    k + (half of the whites of the others) + T_i p

is the photo of p by projector i, the others' light being ambient light. It is left in, for the
photo's noise is that of the light that was there: a line through the levels of black and white, as
photometry fits it, is right at every camera pixel, also where the others alone light it. Of a
response, which is measured against white and black, it is no part.

Index convention: photos are (n, rows, Cx, channels); i runs over projectors, j over the photos of
one pattern.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from nearfar.arrays import Booleans, Floats, Integers, Size
from nearfar.illumination.frequencies import DC
from nearfar.photometry.photos import Photos
from nearfar.plan import Pattern, Plan, Sinusoid
from nearfar.plan.sharing import plan_of_each, projectors_of, signs


@dataclass(frozen=True, eq=False)
class PhotosOfOneProjector:
    """Photos of a plan by one of the projectors that shared them; read as any others.

    Half of the light of white by the other projectors is in them, as ambient light.

    Attributes
    ----------
    plan : Plan
        Of this projector.
    shared : Photos
        As they were taken.
    signs : ndarray, shape (m,)
        What the projector showed in the photos of each pattern: 1 the pattern, -1 its inverse.
    offset : ndarray, shape (Cy, Cx, channels)
        What is added to the mean of `signs` times the photos.
    saturated : ndarray of bool, shape (Cy, Cx, channels)
        Where white of all projectors together is at full scale.
    """

    plan: Plan
    shared: Photos
    signs: Integers
    offset: Floats
    saturated: Booleans

    @property
    def camera(self) -> Size:
        """Height and width of the photos."""
        return self.shared.camera

    @property
    def channels(self) -> int:
        """Channels of the photos."""
        return self.shared.channels

    def read(self, indices: Sequence[int], rows: slice = slice(None)) -> Floats:
        """Photos `indices` as float32, (n, len(rows), Cx, channels).

        Where one of the photos that were taken is at full scale, so is what is made of it.
        """
        found = []
        for index in indices:
            group = _group(self.shared, index, len(self.signs), rows)
            mean = np.einsum("j,jyxi->yxi", self.signs, group) / len(self.signs)
            photo = (mean + self.offset[rows]).astype(np.float32)
            clipped = (group >= 1.0).any(axis=0)
            if _level(self.plan.patterns[index]) == 1:
                clipped |= self.saturated[rows]
            found.append(np.where(clipped, np.float32(1.0), photo))
        return np.stack(found)


def photos_of_each(shared: Photos) -> list[PhotosOfOneProjector]:
    """Take the photos that several projectors shared apart, one set for each projector.

    Parameters
    ----------
    shared : Photos
        A capture of a plan of `nearfar.plan.sharing.shared_plan`.

    Returns
    -------
    list of PhotosOfOneProjector

    Raises
    ------
    PlanError
        If it is of another plan.
    """
    plan, columns = plan_of_each(shared.plan), signs(projectors_of(shared.plan))
    middle, saturated = _middle(shared, plan, len(columns))
    return [
        PhotosOfOneProjector(plan, shared, own, middle if number else 0 * middle, saturated)
        for number, own in enumerate(columns.T)
    ]


def _middle(shared: Photos, plan: Plan, length: int) -> tuple[Floats, Booleans]:
    """Return black and half of all whites, the mean over all whites and blacks; saturation.

    Both are (Cy, Cx, channels).
    """
    shape = (*shared.camera, shared.channels)
    sums, counts = np.zeros((2, *shape)), [0, 0]
    saturated = np.zeros(shape, dtype=bool)
    for index, pattern in enumerate(plan.patterns):
        level = _level(pattern)
        if level is not None:
            group = _group(shared, index, length, slice(0, shared.camera.height))
            sums[level] += group.mean(axis=0)
            counts[level] += 1
            saturated |= (group >= 1.0).any(axis=0)
    return (sums[0] / counts[0] + sums[1] / counts[1]) / 2, saturated


def _group(shared: Photos, index: int, length: int, rows: slice) -> Floats:
    """Read the photos of one pattern, float64, (m, rows, Cx, channels)."""
    numbers = range(length * index, length * (index + 1))
    return shared.read(list(numbers), rows).astype(np.float64)


def _level(pattern: Pattern) -> int | None:
    """Return 1 of white, 0 of black, None of other patterns."""
    if isinstance(pattern, Sinusoid) and pattern.frequency == DC:
        return 0 if pattern.inverse else 1
    return None
