"""Correspondence by the sequence of levels that each projector pixel shows.

Over the photos of any patterns, each projector pixel p shows a sequence of levels a(p), its code. A
camera pixel that p lights directly sees

    offset + d a(p) + far-range light + noise,

d its direct light. Far-range light is a smooth share of all projector pixels, so that its sequence
is that of the patterns' lowest frequencies: the mean level and a few slow waves over the projector.
The offset may have any strength. A large strength is expected of the mean level, and a moderate one
of the waves. The place whose code leaves the least of a camera pixel's sequence unexplained is q.
This serves Gray code, fringes of any periods and steps, micro phase shifting (Gupta and Nayar
2012), stripes, sinusoids and random codes alike.

Patterns of two levels and patterns of many, such as Gray code and fringes, each have an offset and
a d of their own: a projector that is not linear shows them with different contrast.

Index convention: arrays are (C, N) and (places, N); c runs over camera pixels, n over photos.
"""

from typing import NamedTuple

import numpy as np

from nearfar.arrays import Floats, Integers, Size
from nearfar.errors import InputError

# Slow waves along each axis, and the strength that is expected of each, and of the mean level, over
# that of direct light.
SLOW_WAVES = 3
SLOW_STRENGTH = 0.5
MEAN_STRENGTH = 20.0
# Standard deviation of all else over the direct light.
RELATIVE_NOISE = 0.05
# Photos beyond those that offset and mean level take, which a place needs: a phase takes two.
FEWEST_PHOTOS = 2
# Codes with a correlation above this are not told apart by noise alone.
ALIKE = 0.5
# Codes this close to each other are the same.
SAME_CODE = 1e-6
# Values of codes that are held at most, 4 bytes each.
MOST_CODE_VALUES = 2**28


class Codes(NamedTuple):
    """Codes of places, whitened, in groups of photos that share an offset and a d.

    Attributes
    ----------
    whitening : tuple of ndarray, shapes (N', N), float32
        For each group: removes the offset, and weighs the rest by what is expected of far-range
        light.
    unit : tuple of ndarray, shapes (places, N'), float32
        For each group: whitened codes, each of norm 1.
    norms : tuple of ndarray, shapes (places,), float32
        For each group: their norms before.
    grid : Size
        Places down and across; one is 1 for codes of one axis.
    places : tuple of ndarray, shapes (down,) and (across,)
        Projector pixels, the middles of those that share a code.
    reach : tuple of int
        Places down and across within which codes are alike.
    """

    whitening: tuple[Floats, ...]
    unit: tuple[Floats, ...]
    norms: tuple[Floats, ...]
    grid: Size
    places: tuple[Floats, Floats]
    reach: tuple[int, int]

    @property
    def steps(self) -> tuple[float, float]:
        """Projector pixels from a place to the next, down and across, at most."""
        down, across = (np.diff(axis).max(initial=1.0) for axis in self.places)
        return float(down), float(across)

    @property
    def degrees(self) -> int:
        """Photos beyond those that offsets, places and the groups' d take."""
        return max(0, sum(len(each) for each in self.whitening) - 1 - len(self.whitening))


def prepare_codes(patterns: Floats, groups: Integers, steps: tuple[int, int] = (1, 1)) -> Codes:
    """Prepare the codes of all projector pixels, or of all rows or columns.

    Parameters
    ----------
    patterns : ndarray, shape (N, down, across)
        Levels from 0 to 1; down or across is 1 for patterns of one axis.
    groups : ndarray of int, shape (N,)
        Patterns of one number share an offset and a d.
    steps : tuple of int
        Places down and across from one that is compared to the next.

    Returns
    -------
    Codes

    Raises
    ------
    InputError
        If there are too few patterns, or too many values, or all places show the same.
    """
    number = len(patterns)
    down, across = (_without_repeats(patterns, axis) for axis in (1, 2))
    kept = patterns[:, down.first[:, None], across.first]
    if kept.size > MOST_CODE_VALUES:
        raise InputError(
            f"{number} patterns of {Size(*kept.shape[1:])} are too many to compare every camera "
            f"pixel with: give patterns of larger blocks, or Gray code or fringes of rows and of "
            f"columns."
        )
    thinned = [_every(step, side) for step, side in zip(steps, kept.shape[1:], strict=True)]
    compared = kept[:, thinned[0][:, None], thinned[1]]
    whitening, units, norms = [], [], []
    for group in np.unique(groups):
        mine = np.flatnonzero(groups == group)
        of_group = _whitening(kept[mine])
        whitened = compared[mine].reshape(len(mine), -1).T @ of_group.T
        norm = np.linalg.norm(whitened, axis=1)
        # What is as good as the same everywhere tells no place.
        if not len(of_group) or norm.max() <= SAME_CODE:
            continue
        norm = np.maximum(norm, SAME_CODE * norm.max())
        among_all = np.zeros((len(of_group), number))
        among_all[:, mine] = of_group
        whitening.append(among_all.astype(np.float32))
        units.append((whitened / norm[:, None]).astype(np.float32))
        norms.append(norm.astype(np.float32))
    if sum(len(each) for each in whitening) < FEWEST_PHOTOS:
        raise InputError(
            f"{number} patterns are too few to tell places by: give more, at least three that are "
            f"not inverse to each other."
        )
    together = np.concatenate(units, axis=1) / np.sqrt(len(units))
    return Codes(
        tuple(whitening),
        tuple(units),
        tuple(norms),
        Size(*compared.shape[1:]),
        (down.middle[thinned[0]], across.middle[thinned[1]]),
        _reach(together.reshape(*compared.shape[1:], -1)),
    )


def _every(step: int, side: int) -> Integers:
    """Return places about a step from each other, the first and the last among them."""
    return np.rint(np.linspace(0, side - 1, -(-(side - 1) // step) + 1)).astype(np.int64)


class _Repeats(NamedTuple):
    """Lines of the projector of which neighbours show the same: the first, and their middle."""

    first: Integers
    middle: Floats


def _without_repeats(patterns: Floats, axis: int) -> _Repeats:
    """Join neighbouring lines that show the same in all patterns."""
    others = tuple(other for other in range(3) if other != axis)
    changes = (np.abs(np.diff(patterns, axis=axis)) > SAME_CODE).any(axis=others)
    first = np.concatenate([[0], np.flatnonzero(changes) + 1])
    after = np.concatenate([first[1:], [patterns.shape[axis]]])
    return _Repeats(first, np.asarray(0.5 * (first + after - 1)))


def _whitening(patterns: Floats) -> Floats:
    """Return the matrix that whitens sequences, (N', N)."""
    number, *grid = patterns.shape
    down, across = (
        np.cos(np.pi * np.arange(SLOW_WAVES + 1)[:, None] * (np.arange(side) + 0.5) / side)
        if side > 1
        else np.ones((1, 1))
        for side in grid
    )
    slow = np.einsum("nyx,ay,bx->abn", patterns, down, across, optimize=True)
    order = np.add.outer(np.arange(len(down)), np.arange(len(across)))
    slow = slow[(order > 0) & (order <= SLOW_WAVES)] / (grid[0] * grid[1])
    mean = patterns.reshape(number, -1).mean(axis=1)
    # The offset may have any strength: only what is orthogonal to it counts.
    free = np.linalg.svd(np.ones((number, 1)))[0][:, 1:].T
    waves = np.concatenate([SLOW_STRENGTH * slow, MEAN_STRENGTH * mean[None]]) @ free.T
    covariance = RELATIVE_NOISE**2 * np.eye(len(free)) + waves.T @ waves
    # In units of the noise alone, so that residuals stay comparable.
    return np.asarray(RELATIVE_NOISE * np.linalg.solve(np.linalg.cholesky(covariance), free))


def _reach(unit: Floats) -> tuple[int, int]:
    """Return how many places down and across codes stay alike, typically."""
    found = []
    for axis in (0, 1):
        lines = np.moveaxis(unit, axis, 0)
        side = len(lines)
        # A few lines along this axis tell.
        chosen = lines.reshape(side, -1, unit.shape[-1])
        chosen = chosen[:, np.linspace(0, chosen.shape[1] - 1, 9).astype(int)]
        reach = 0
        while reach + 1 < side:
            step = reach + 1
            alike = np.einsum("plk,plk->pl", chosen[step:], chosen[:-step])
            if np.median(alike) < ALIKE:
                break
            reach = step
        found.append(max(reach, 1))
    return found[0], found[1]
