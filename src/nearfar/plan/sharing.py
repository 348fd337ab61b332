"""Photos that several projectors share: each shows the pattern of a plan, or its inverse.

With n projectors, each pattern of a plan is photographed m times, m being the power of two that is
not below n. In photo j projector i shows the pattern where the Hadamard matrix h, of order m, has
h[j, i] = 1, and its inverse where it has -1. The columns of h are orthogonal, so that the mean of
h[j, i] times photo j is what the pattern less half of white adds by projector i alone, from m
photos instead of one. For two projectors these are two photos: (p, p) and (p, white - p).

Schechner, Nayar and Belhumeur, "Multiplexing for Optimal Lighting", PAMI 2007.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import hadamard

from nearfar.arrays import Size
from nearfar.errors import PlanError
from nearfar.illumination.frequencies import DC
from nearfar.plan.model import Plan
from nearfar.plan.patterns import Pattern, Shown, SideBySide, Sinusoid

FEWEST, MOST = 2, 16


def signs(projectors: int) -> NDArray[np.int64]:
    """Return the signs of the patterns that projectors show: 1 a pattern, -1 its inverse.

    Returns
    -------
    ndarray, shape (photos, projectors)
        Its columns are orthogonal. In the first photo all show the pattern.
    """
    order = 1 << (projectors - 1).bit_length()
    return np.asarray(hadamard(order, dtype=np.int64)[:, :projectors])


def shared_plan(plan: Plan, projectors: int) -> Plan:
    """Return a plan whose photos several projectors share, their pattern grids side by side.

    Parameters
    ----------
    plan : Plan
        What is to be known of each projector; all have its pattern grid.
    projectors : int
        Two or more.

    Returns
    -------
    Plan
        For a pattern grid as wide as all together. For two projectors it has as many photos as
        two captures of `plan`.

    Raises
    ------
    PlanError
        If the plan has complex patterns or somebody else's pictures, lacks white or black, or is
        shared already; or if there are too many projectors.
    """
    plan.require_real("share")
    if not FEWEST <= projectors <= MOST:
        raise PlanError(
            f"photos are to be shared by {projectors} projectors: share them by {FEWEST} to {MOST}."
        )
    levels = {
        pattern.inverse
        for pattern in plan.patterns
        if isinstance(pattern, Sinusoid) and pattern.frequency == DC
    }
    if len(levels) < 2 or any(isinstance(p, SideBySide | Shown) for p in plan.patterns):
        raise PlanError(
            "photos are shared by patterns of a plan that shows white and black, and this one does "
            "not, or is shared already: plan with `offset='reference'` or `offset='inverse'`."
        )
    patterns = [
        SideBySide(
            pattern=pattern,
            inverted=tuple(bool(sign < 0) for sign in of_photo),
            purpose=pattern.purpose,
        )
        for pattern in plan.patterns
        for of_photo in signs(projectors)
    ]
    wide = Size(plan.projector.height, projectors * plan.projector.width)
    return plan.model_copy(update={"projector": wide, "patterns": tuple(patterns)})


def projectors_of(plan: Plan) -> int:
    """Return how many projectors share the photos of a plan; 1 if they are not shared."""
    first = plan.patterns[0]
    return len(first.inverted) if isinstance(first, SideBySide) else 1


def plan_of_each(shared: Plan) -> Plan:
    """Return the plan of which several projectors share the photos, those of whole patterns.

    Raises
    ------
    PlanError
        If the plan is not shared, or its photos are not in the order of `shared_plan`.
    """
    projectors = projectors_of(shared)
    each = signs(projectors)
    expected = [tuple(bool(sign < 0) for sign in of_photo) for of_photo in each]
    whole = len(shared.patterns) // len(each) * len(each)
    patterns: list[Pattern] = []
    for number, pattern in enumerate(shared.patterns[:whole]):
        photo = number % len(each)
        if (
            not isinstance(pattern, SideBySide)
            or pattern.inverted != expected[photo]
            or (photo and pattern.pattern != patterns[-1])
        ):
            raise PlanError(
                f"pattern {number} is not one of a plan whose photos several projectors share: "
                f"give a capture that several projectors shared."
            )
        if not photo:
            patterns.append(pattern.pattern)
    own = Size(shared.projector.height, shared.projector.width // projectors)
    return shared.model_copy(update={"projector": own, "patterns": tuple(patterns)})
