"""Every other camera pixel: sweeps over the even and the odd fields of a chessboard by turns.

A camera pixel that starts from what its neighbours have just found needs no sweep by its own photos
alone, and what is found spreads twice as quickly as where all camera pixels read the last sweep's.
"""

from typing import NamedTuple

import numpy as np

from nearfar.arrays import Booleans, Integers, Size
from nearfar.estimate.joint.problem import ComponentChoice, Problem
from nearfar.priors.fitted import LIT_AT_PITCH, LIT_COMPONENTS

# Half sweeps that shift q, two of each colour: a third shift gains 0.05 dB at most under a random
# light, and loses as much elsewhere.
SHIFTING_SWEEPS = 4


class Part(NamedTuple):
    """The camera pixels that a sweep estimates, and those that were estimated before.

    Attributes
    ----------
    selected : ndarray of int, shape (n,)
        Indices of the former, ascending.
    known : ndarray of bool, shape (Cy, Cx)
        The latter.
    moves_q : bool
        Whether the sweep shifts q of these camera pixels.
    """

    selected: Integers
    known: Booleans
    moves_q: bool


def part_of_sweep(problem: Problem, number: int) -> Part:
    """Return the part of a sweep, counted from 0: even fields, odd ones, even ones ..."""
    even = problem.pixels.is_even
    known = even if number < 2 else np.ones_like(even)
    selected = np.flatnonzero(even == (number % 2 == 0))
    moves_q = number < SHIFTING_SWEEPS
    return Part(selected, known.reshape(problem.measurements.camera), moves_q)


def every_choice(
    first: ComponentChoice, is_even: Booleans, lit: Booleans, camera: Size
) -> ComponentChoice:
    """Return the first sweep's choices, those of odd fields from a camera pixel beside them.

    It is one that is lit alike, if there is any.

    Parameters
    ----------
    first : ComponentChoice
    is_even, lit : ndarray of bool, shape (C,)
        The camera pixels that the first sweep chose for, and those with direct light.
    camera : Size
    """
    found = first.of(slice(None))
    (odd,) = np.nonzero(~is_even)
    y, x = np.divmod(odd, camera.width)
    wanted = lit[odd]
    # A camera pixel that is lit like none of its neighbours has the first component of its kind.
    found.prior_component[odd] = np.where(wanted, LIT_AT_PITCH[0], len(LIT_COMPONENTS))
    found.prior_scale[odd] = first.prior_scale[np.where(x > 0, odd - 1, odd - camera.width)]
    is_lit = first.prior_component < len(LIT_COMPONENTS)
    is_found = np.zeros(len(odd), dtype=bool)
    for down, across in ((0, -1), (-1, 0), (0, 1), (1, 0)):
        within = ((y + down >= 0) & (y + down < camera.height) & (x + across >= 0)) & (
            x + across < camera.width
        )
        beside = np.where(within, odd + down * camera.width + across, odd)
        taken = within & ~is_found & (is_lit[beside] == wanted)
        for values, chosen in zip(found, first, strict=True):
            values[odd[taken]] = chosen[beside[taken]]
        is_found |= taken
    return found
