"""The prior component and scale of each camera pixel's error bars, chosen with its neighbours.

Under much noise the photos of one camera pixel hardly tell prior components apart, and the most
probable by chance has bars that are too narrow about as often as too wide. What many camera pixels
beside each other say together is surer. The posterior probability of a component and scale, each as
likely as any other before the photos, is averaged over the neighbourhood; a power of that mean is
the probability before the camera pixel's own photos.

Index convention: arrays are (Cy, Cx, k), k over prior components and scales.
"""

import numpy as np
from array_api_compat import device

from nearfar.arrays import Floats, Integers, Size, beside, namespace
from nearfar.estimate.joint.evidence import PriorSet
from nearfar.estimate.joint.problem import ComponentChoice, Model
from nearfar.parallel import in_batches
from nearfar.priors.fitted import PRIOR_SCALES

# Camera pixels on each side that have a say: fewer than the rows beside a tile.
REACH = 2
# The mean of probabilities that are all unsure is hardly surer than they are. What shares of the
# components make the photos of the neighbourhood most probable comes out near this power of it.
POWER = 4
# Camera rows of a block.
ROWS_AT_ONCE = 8


def no_probabilities(number: int, model: Model, like: Floats) -> Floats:
    """Return zeros for the probabilities of all components and scales, beside an array.

    Returns
    -------
    ndarray, shape (number, components, scales), float32
        Components are those of `model.lit` and then of `model.unlit`.
    """
    xp = namespace(like)
    shape = (number, len(model.numbers), len(PRIOR_SCALES))
    zeros: Floats = xp.zeros(shape, dtype=xp.float32, device=device(like))
    return zeros


def put_probabilities(
    found: Floats, selected: Integers, evidence: Floats, candidates: PriorSet, model: Model
) -> None:
    """Set the probabilities of some camera pixels, in proportion to evidence; 0 off the candidates.

    Parameters
    ----------
    found : ndarray, shape (n, components, scales)
        As `no_probabilities` returns them.
    selected : ndarray of int, shape (m,)
    evidence : ndarray, shape (candidates, m, scales)
        Its logarithm.
    candidates : PriorSet
        `model.lit` or `model.unlit`.
    model : Model
    """
    xp = namespace(evidence)
    relative = xp.exp(evidence - xp.max(evidence, axis=(0, 2), keepdims=True))
    relative /= xp.sum(relative, axis=(0, 2), keepdims=True)
    whole = no_probabilities(len(selected), model, found)
    first = model.numbers.index(candidates.numbers[0])
    whole[:, first : first + len(relative)] = xp.permute_dims(relative, (1, 0, 2))
    found[selected] = whole


def pooled_choice(own: Floats, model: Model, camera: Size) -> ComponentChoice:
    """Choose for each camera pixel by its own photos and those of its neighbours.

    Parameters
    ----------
    own : ndarray, shape (C, components, scales), float32
        Probabilities by each camera pixel's own photos.
    model : Model
    camera : Size
    """
    xp = namespace(own)
    best = _most_probable(own.reshape((*camera, -1)))
    component, scale = best // len(PRIOR_SCALES), best % len(PRIOR_SCALES)
    numbers, scales = (beside(np.array(each), own) for each in (model.numbers, PRIOR_SCALES))
    return ComponentChoice(numbers[component], xp.astype(scales[scale], xp.float32))


def _most_probable(own: Floats) -> Integers:
    """Return the index of the most probable at each camera pixel, with its neighbours, (C,)."""
    xp = namespace(own)
    found: Integers = xp.argmax(own, axis=2)

    def work(rows: slice) -> None:
        first, last = max(rows.start - REACH, 0), min(rows.stop + REACH, len(own))
        around = sum_of_neighbours(own[first:last], REACH)[rows.start - first : rows.stop - first]
        pooled = around**POWER
        found[rows] = xp.argmax(own[rows] * pooled, axis=2)

    in_batches(work, len(own), ROWS_AT_ONCE, own)
    return found.reshape(-1)


def sum_of_neighbours(values: Floats, reach: int) -> Floats:
    """Return the sums over squares of 2 reach + 1 camera pixels a side, (Cy, Cx, k)."""
    return _sum_along(_sum_along(values, 0, reach), 1, reach)


def _sum_along(values: Floats, axis: int, reach: int) -> Floats:
    """Return sums over what lies within reach along an axis, 0 or 1."""
    xp = namespace(values)
    along = xp.moveaxis(values, axis, 0)
    total = xp.asarray(along, copy=True)
    for step in range(1, min(reach, len(along) - 1) + 1):
        total[step:] += along[:-step]
        total[:-step] += along[step:]
    summed: Floats = xp.moveaxis(total, 0, axis)
    return summed
