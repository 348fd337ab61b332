"""The two-dimensional Haar wavelet transform of any size, orthonormal, many pictures at once.

At each level neighbours along each axis are turned into a scaled sum, which goes on to the next
level, and a scaled difference, which stays. A value that stands for a pixels meets one that
stands for b pixels by the rotation with cosine sqrt(a / (a + b)); where a side is odd its last
value goes on alone. At powers of two this is the standard Haar transform (Mallat 1989), at other
sizes its unbalanced kind (Fryzlewicz 2007): still orthonormal, each wavelet still a difference of
two means, the first still constant.

Index convention: pictures and coefficients are (..., Py, Px); coefficients have the scaling
function at [0, 0] and the finest wavelets in the lower and right halves.
"""

from typing import NamedTuple

import numpy as np

from nearfar.arrays import Floats, Size


class _Step(NamedTuple):
    """One level along one axis: the block that it rotates, and cosines and sines of its pairs."""

    axis: int
    block: Size
    cosine: Floats
    sine: Floats


def haar(pictures: Floats) -> Floats:
    """Return Haar coefficients of pictures.

    Parameters
    ----------
    pictures : ndarray, shape (..., Py, Px)

    Returns
    -------
    ndarray, shape (..., Py, Px)
        Of the pictures' dtype (float64 for whole numbers). [..., 0, 0] is the sum over pixels
        divided by sqrt(P).
    """
    values = np.array(pictures, dtype=np.result_type(pictures.dtype, np.float16), order="C")
    for step in _steps(Size(*values.shape[-2:])):
        block = _block_of(values, step)
        pairs = block.shape[-1] // 2
        first, second = block[..., 0 : 2 * pairs : 2], block[..., 1 : 2 * pairs : 2]
        cosine, sine = step.cosine.astype(values.dtype), step.sine.astype(values.dtype)
        difference = sine * first - cosine * second
        total = cosine * first + sine * second
        alone = block[..., 2 * pairs :].copy()
        block[..., :pairs] = total
        block[..., pairs : block.shape[-1] - pairs] = alone
        block[..., block.shape[-1] - pairs :] = difference
    return values


def inverse_haar(coefficients: Floats) -> Floats:
    """Return pictures from Haar coefficients: inverse and adjoint of `haar`.

    Parameters
    ----------
    coefficients : ndarray, shape (..., Py, Px)

    Returns
    -------
    ndarray, shape (..., Py, Px)
    """
    values = np.array(coefficients, dtype=np.result_type(coefficients.dtype, np.float16), order="C")
    for step in reversed(_steps(Size(*values.shape[-2:]))):
        block = _block_of(values, step)
        pairs = block.shape[-1] // 2
        total = block[..., :pairs].copy()
        alone = block[..., pairs : block.shape[-1] - pairs].copy()
        difference = block[..., block.shape[-1] - pairs :].copy()
        cosine, sine = step.cosine.astype(values.dtype), step.sine.astype(values.dtype)
        block[..., 0 : 2 * pairs : 2] = cosine * total + sine * difference
        block[..., 1 : 2 * pairs : 2] = sine * total - cosine * difference
        block[..., 2 * pairs :] = alone
    return values


def _block_of(values: Floats, step: _Step) -> Floats:
    """Return a view of the block that a step rotates, its axis last."""
    block = values[..., : step.block.height, : step.block.width]
    return block.swapaxes(-1, -2) if step.axis == 0 else block


def _steps(size: Size) -> list[_Step]:
    """List the steps from the finest level to the coarsest."""
    steps = []
    sides = list(size)
    # How many pixels each value along an axis stands for.
    counts = [np.ones(side) for side in sides]
    while max(sides) > 1:
        block = Size(*sides)
        for axis in (0, 1):
            pairs = sides[axis] // 2
            if pairs:
                first = counts[axis][0 : 2 * pairs : 2]
                second = counts[axis][1 : 2 * pairs : 2]
                both = first + second
                steps.append(_Step(axis, block, np.sqrt(first / both), np.sqrt(second / both)))
                counts[axis] = np.concatenate([both, counts[axis][2 * pairs :]])
                sides[axis] -= pairs
    return steps
