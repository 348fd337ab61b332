"""Whites and blacks throughout a plan, so that no pattern needs its inverse.

b(0.5 + 0.5 s) = 0.5 b(1) + 0.5 b(s): one white and one black determine the offset of every
sinusoid. They are repeated at the start, the end and in between, so that the drift of lamp and
ambient light, and the noise, can be estimated.
"""

from collections.abc import Sequence

from nearfar.errors import PlanError
from nearfar.illumination.frequencies import DC
from nearfar.plan.patterns import Pattern, Purpose, Sinusoid

# Other photos from one white and black to the next.
INTERVAL = 18
# Whites, and blacks, from which noise and drift can be estimated.
FEWEST = 2


def reference_count(photos: int) -> int:
    """Return the number of whites, and of blacks, for a number of other photos."""
    return max(FEWEST, round(photos / INTERVAL) + 1)


def with_references(
    patterns: Sequence[Pattern], whites: int | None = None, blacks: int | None = None
) -> tuple[Pattern, ...]:
    """Spread whites and blacks evenly through patterns, from the start to the end.

    Parameters
    ----------
    patterns : sequence of patterns
        Everything but white and black, in the order to shoot; stripes as well.
    whites, blacks : int, optional
        How many; `reference_count` if left out. Where one is fewer, each of it is next to one of
        the other.

    Returns
    -------
    tuple of patterns
        `patterns` in their order, and the references between them. The first white measures DC
        and has the purpose far, all others have the purpose reference.

    Raises
    ------
    PlanError
        If there are fewer than two whites or two blacks.
    """
    counts = [reference_count(len(patterns)) if n is None else n for n in (whites, blacks)]
    if min(counts) < FEWEST:
        raise PlanError(
            f"{counts[0]} whites and {counts[1]} blacks are too few to estimate noise and "
            f"drift from: plan for at least {FEWEST} of each."
        )
    places = max(counts)
    at_white, at_black = (set(_spread(count, places - 1)) for count in counts)
    # How many patterns come before each place.
    before = [_between_pairs(patterns, upto) for upto in _spread(places, len(patterns))]
    found: list[Pattern] = []
    done = 0
    for place, upto in enumerate(before):
        found += patterns[done:upto]
        done = upto
        white = [_uniform("far" if place == 0 else "reference", black=False)]
        black = [_uniform("reference", black=True)] if place in at_black else []
        if place not in at_white:
            found += black
        else:
            # The first and the last reference are black: ambient light is known at every white.
            found += [*black, *white] if place == 0 else [*white, *black]
    return tuple(found)


def _spread(count: int, last: int) -> list[int]:
    """Spread `count` whole numbers evenly from 0 to `last`."""
    return [(2 * i * last + count - 1) // (2 * (count - 1)) for i in range(count)]


def _between_pairs(patterns: Sequence[Pattern], upto: int) -> int:
    """Move a place that would part a pair, such as a cosine and its sine, behind the pair.

    So all measurements are complete wherever white and black are projected.
    """
    return upto + parts_a_pair(patterns, upto)


def parts_a_pair(patterns: Sequence[Pattern], place: int) -> bool:
    """Return whether a place is between a cosine and its sine, or a check pattern and its inverse.

    Parameters
    ----------
    patterns : sequence of patterns
    place : int
        The number of patterns before it.
    """
    if not 0 < place < len(patterns):
        return False
    before, after = patterns[place - 1], patterns[place]
    if before.purpose == "check":
        return after == before.model_copy(update={"inverse": True})
    if not (isinstance(before, Sinusoid) and isinstance(after, Sinusoid)):
        return False
    return (before.kind, after.kind) == ("cosine", "sine") and before.frequency == after.frequency


def _uniform(purpose: Purpose, *, black: bool) -> Sinusoid:
    return Sinusoid(kind="cosine", frequency=DC, inverse=black, purpose=purpose)
