"""Photos that several projectors shared, taken apart: what each projector alone would have made.

By the Hadamard matrix h of `nearfar.plan.sharing`, the m photos S_j of a pattern p are

    S_j = k + sum over i of (W_i / 2 + h_ji a_i),   a_i = T_i (p - 1/2),

with the photo under black k, and W_i what white of projector i adds. The mean over j of h_ji S_j is
a_i, and the first, for which all h are 1, has k and half of all whites besides. So with means of k
and W_i over all whites and blacks of the plan, k + W_i / 2 + a_i is the photo by projector i alone.

These means are the same in every photo of a capture, so that they drop out where photos are
measured against its whites and blacks. What is left is the noise of the mean of m photos; whites
and blacks show it, for they are taken apart as all others are.

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
    white, black, saturated = _levels(shared, plan, columns)
    # What the pattern adds by each projector, as it goes from half of white to white.
    whites = white - black
    middle = (white[0] + black[0]) / 2
    dark = middle - whites.sum(axis=0) / 2
    offsets = [whites[0] / 2 + dark - middle, *(dark + own / 2 for own in whites[1:])]
    return [
        PhotosOfOneProjector(plan, shared, own, offset, saturated)
        for own, offset in zip(columns.T, offsets, strict=True)
    ]


def _levels(shared: Photos, plan: Plan, columns: Integers) -> tuple[Floats, Floats, Booleans]:
    """Return a_i of white and of black, the first with the rest, (i, Cy, Cx, channels); saturation.

    They are means over all whites and blacks of the plan.
    """
    shape = (*shared.camera, shared.channels)
    sums = np.zeros((2, columns.shape[1], *shape))
    counts = [0, 0]
    saturated = np.zeros(shape, dtype=bool)
    for index, pattern in enumerate(plan.patterns):
        level = _level(pattern)
        if level is not None:
            group = _group(shared, index, len(columns), slice(0, shared.camera.height))
            sums[level] += np.einsum("ji,jyxc->iyxc", columns, group) / len(columns)
            counts[level] += 1
            saturated |= (group >= 1.0).any(axis=0)
    return sums[1] / counts[1], sums[0] / counts[0], saturated


def _group(shared: Photos, index: int, length: int, rows: slice) -> Floats:
    """Read the photos of one pattern, float64, (m, rows, Cx, channels)."""
    numbers = range(length * index, length * (index + 1))
    return shared.read(list(numbers), rows).astype(np.float64)


def _level(pattern: Pattern) -> int | None:
    """Return 1 of white, 0 of black, None of other patterns."""
    if isinstance(pattern, Sinusoid) and pattern.frequency == DC:
        return 0 if pattern.inverse else 1
    return None
