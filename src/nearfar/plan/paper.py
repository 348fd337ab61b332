"""The paper's plan: checkerboard, uniform near set, low far set (sections 4.1 to 4.3, 5.1)."""

from collections.abc import Callable, Iterable, Iterator
from typing import Literal

from nearfar.arrays import AnySize, as_size
from nearfar.checks import as_count
from nearfar.errors import PlanError
from nearfar.illumination.frequencies import (
    CHECKERBOARD,
    DC,
    Frequency,
    default_dropped,
    far_frequencies,
    near_frequencies,
    representatives,
)
from nearfar.plan.correspondence import CORRESPONDENCE_METHODS
from nearfar.plan.model import LARGEST_SIDE, Plan
from nearfar.plan.patterns import Exponential, Purpose, Sinusoid
from nearfar.plan.references import with_references

Offset = Literal["inverse", "reference", "none"]


def paper_plan(
    projector: AnySize,
    window: int,
    far: AnySize,
    *,
    dropped: AnySize | None = None,
    offset: Offset = "inverse",
    correspondence: str = "stripes",
) -> Plan:
    """Plan the patterns of the paper.

    Parameters
    ----------
    projector : Size or (height, width)
        Pattern grid Py x Px.
    window : int
        W; the near set is W x W.
    far : Size or (height, width)
        Far band, in DFT frequencies of the pattern grid.
    dropped : Size or (height, width), optional
        Block of lowest near frequencies to leave out, odd by odd. By default those with both
        ``|k| <= k_far``, at least DC.
    offset : {"inverse", "reference", "none"}
        Each pattern with its inverse; each once, with whites and blacks at intervals to take the
        offset out; or the theory's complex patterns (simulation only).
    correspondence : str
        Name of a correspondence method: "stripes", "gray", "phase", "none", or one that another
        package adds. Stripes take photos of their own, Py + Px, and Gray code with its inverse
        2 log2 Py + 2 log2 Px.

    Returns
    -------
    Plan
        With inverse pairs, ``2 (1 + W^2 - dropped + |K_far|)`` photos of transport for odd bands;
        half as many by reference.

    Raises
    ------
    PlanError
        If the projector has a side over `LARGEST_SIDE`, if W or the far band is larger than it, or
        if the dropped block is even or larger than W.
    InputError
        If a size or W is not made of whole numbers, or there is no such correspondence method.
    ExtensionError
        If the package that adds the correspondence method cannot be loaded.

    Examples
    --------
    >>> plan = nearfar.paper_plan((128, 128), window=19, far=(13, 13))
    >>> plan.transport_photos  # as in the paper's figure 2
    1060
    """
    projector, far = as_size(projector, "projector"), as_size(far, "far band")
    window = as_count(window, "window")
    method = CORRESPONDENCE_METHODS[correspondence]
    if max(projector) > LARGEST_SIDE:
        raise PlanError(
            f"a projector of {projector} has a side over {LARGEST_SIDE}: give the pattern grid, of "
            f"which a pixel may be a block of the projector's."
        )
    if not 1 <= window <= min(projector):
        raise PlanError(
            f"W = {window} does not fit a projector of {projector}: choose `window` between 1 and "
            f"{min(projector)}."
        )
    if far.height > projector.height or far.width > projector.width:
        raise PlanError(
            f"the far band {far} is larger than the projector {projector}: choose `far` at most "
            f"{projector}."
        )
    dropped = (
        default_dropped(window, far, projector)
        if dropped is None
        else as_size(dropped, "block of dropped frequencies")
    )
    if dropped.height % 2 == 0 or dropped.width % 2 == 0 or max(dropped) > window:
        raise PlanError(
            f"`dropped={tuple(dropped)}` is not a block of near frequencies around DC: both "
            f"sides must be odd, from 1 to W = {window}."
        )
    patterns_of = _SHAPES[offset]
    patterns = (
        *patterns_of([CHECKERBOARD], "direct"),
        *patterns_of(far_frequencies(far, projector), "far"),
        *patterns_of(near_frequencies(window, dropped), "near"),
        *method.patterns(projector),
    )
    return Plan(
        projector=projector,
        window=window,
        far=far,
        dropped=dropped,
        offset=offset,
        correspondence=correspondence,
        patterns=with_references(patterns) if offset == "reference" else patterns,
    )


def _exponentials(frequencies: Iterable[Frequency], purpose: Purpose) -> Iterator[Exponential]:
    for frequency in frequencies:
        yield Exponential(frequency=frequency, purpose=purpose)


def _inverse_pairs(frequencies: Iterable[Frequency], purpose: Purpose) -> Iterator[Sinusoid]:
    # A pair is projected together, so that drift of the lamp hardly affects its difference.
    for frequency in representatives(frequencies):
        kinds: tuple[Literal["cosine", "sine"], ...] = ("cosine", "sine")
        for kind in kinds[:1] if frequency.is_own_negative else kinds:
            for inverse in (False, True):
                yield Sinusoid(kind=kind, frequency=frequency, inverse=inverse, purpose=purpose)


def sinusoids(frequencies: Iterable[Frequency], purpose: Purpose) -> Iterator[Sinusoid]:
    """Yield the cosine and the sine of each frequency, or only the cosine of its own negative.

    DC is left out: its photo is white, which `with_references` adds.
    """
    wanted = (frequency for frequency in frequencies if frequency != DC)
    return (pattern for pattern in _inverse_pairs(wanted, purpose) if not pattern.inverse)


_SHAPES: dict[
    Offset, Callable[[Iterable[Frequency], Purpose], Iterator[Exponential | Sinusoid]]
] = {
    "inverse": _inverse_pairs,
    "reference": sinusoids,
    "none": _exponentials,
}
