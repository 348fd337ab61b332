"""A plan of nearfar's own patterns for pictures that are nothing else."""

from collections.abc import Callable, Iterator
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Size
from nearfar.illumination.frequencies import DC, Frequency, far_frequencies, wrap
from nearfar.plan.correspondence import CORRESPONDENCE_METHODS
from nearfar.plan.model import LARGEST_SIDE, Plan
from nearfar.plan.patterns import GrayCode, HalfScreen, Pattern, Shown, Sinusoid, Stripe
from nearfar.plan.recognition.contents import (
    Band,
    Checkerboard,
    Content,
    Fringes,
    GrayBit,
    Stripes,
    Uniform,
)
from nearfar.plan.recognition.recognise import Recognised
from nearfar.plan.window import default_window, pitch_of

# Frequencies that a plan of sinusoids has at least: with fewer, they are fringes to find q by.
FEWEST_FREQUENCIES = 16
LARGEST_DENOMINATOR = 1024
FAR_SIDE = 13


def plan_of_pictures(recognised: Recognised, read: Callable[[int], NDArray[Any]]) -> Plan:
    """Return a plan of recognised pictures.

    It is one of sinusoids by inverse pairs or by reference where every picture is, to the last bit,
    one of nearfar's own patterns and they make such a plan; otherwise one with offset "shown".

    Parameters
    ----------
    recognised : Recognised
    read : callable
        Reads a picture by its number, as it is stored.

    Returns
    -------
    Plan
    """
    own = _own_patterns(recognised, read)
    offset = None if own is None else _offset_of(own)
    if own is not None and offset is not None:
        return _plan(recognised.size, own, offset)
    shown = tuple(
        Shown(content=content, inverse_of=inverse)
        for content, inverse in zip(recognised.contents, recognised.inverse_of, strict=True)
    )
    return _plan(recognised.size, shown, "shown")


def recognised_in(plan: Plan) -> Recognised:
    """Return the recognised contents of a plan with offset "shown"."""
    shown = [pattern for pattern in plan.patterns if isinstance(pattern, Shown)]
    return Recognised(
        plan.projector,
        tuple(pattern.content for pattern in shown),
        tuple(pattern.inverse_of for pattern in shown),
    )


def _plan(projector: Size, patterns: tuple[Pattern, ...], offset: Any) -> Plan:
    # Somebody else's patterns are estimated from with windows of single pixels.
    pitch = 1 if offset == "shown" else pitch_of(projector)
    return Plan(
        projector=projector,
        window=default_window(projector, pitch),
        pitch=pitch,
        far=Size(*(min(FAR_SIDE, side) for side in projector)),
        dropped=Size(1, 1),
        offset=offset,
        correspondence=_correspondence_of(patterns),
        patterns=patterns,
    )


def _correspondence_of(patterns: tuple[Pattern, ...]) -> str:
    kinds = {type(pattern) for pattern in patterns}
    found = "stripes" if Stripe in kinds else "gray" if GrayCode in kinds else "phase"
    assert found in CORRESPONDENCE_METHODS
    return found


def _offset_of(patterns: tuple[Pattern, ...]) -> str | None:
    """Return how the offset of sinusoids is removed, None if they make no plan."""
    waves = {(p.frequency, p.kind, p.inverse): p for p in patterns if isinstance(p, Sinusoid)}
    frequencies = {frequency for frequency, _, _ in waves} - {DC}
    along = (any(k.fy for k in frequencies), any(k.fx for k in frequencies))
    if len(frequencies) < FEWEST_FREQUENCIES or along != (True, True):
        return None
    if not {(DC, "cosine", False), (DC, "cosine", True)} <= waves.keys():
        return None
    for frequency in frequencies:
        shown = {(kind, inverse) for k, kind, inverse in waves if k == frequency}
        if {kind for kind, _ in shown} != {"cosine", "sine"} and not frequency.is_own_negative:
            return None
    paired = all((k, kind, not inverse) in waves for k, kind, inverse in waves)
    return "inverse" if paired else "reference"


def _own_patterns(
    recognised: Recognised, read: Callable[[int], NDArray[Any]]
) -> tuple[Pattern, ...] | None:
    """Return nearfar's own pattern of each picture, or None if one is none."""
    if max(recognised.size) > LARGEST_SIDE:
        return None
    low = set(far_frequencies(Size(*(min(FAR_SIDE, s) for s in recognised.size)), recognised.size))
    found: list[Pattern] = []
    for number, content in enumerate(recognised.contents):
        candidates = list(_candidates(content, recognised.size, low))
        if not candidates:
            return None
        picture = read(number)
        grey = picture[..., 0] if picture.ndim == 3 else picture
        same = (c for c in candidates if np.array_equal(c.draw(recognised.size), grey))
        pattern = next(same, None)
        if pattern is None:
            return None
        found.append(pattern)
    return tuple(found)


def _candidates(content: Content, size: Size, low: set[Frequency]) -> Iterator[Pattern]:
    """Yield patterns of nearfar's own that may be a picture's."""
    half = Fraction(1, 2)
    match content:
        case Uniform():
            inverse = content.level < 0.5
            yield Sinusoid(kind="cosine", frequency=DC, inverse=inverse, purpose="reference")
        case Fringes():
            yield from _sinusoids(content, size, low)
        case Checkerboard():
            yield from _alternating(wrap(half, half))
        case Stripes():
            rows = content.axis == "rows"
            yield from _alternating(wrap(half * rows, half * (not rows)))
            for inverse in (False, True):
                kind = "top half-screen" if rows else "left half-screen"
                yield HalfScreen.model_validate({"kind": kind, "inverse": inverse})
        case GrayBit(cell=1, first=0):
            kind = "gray rows" if content.axis == "rows" else "gray columns"
            yield GrayCode.model_validate(
                {"kind": kind, "bit": content.bit, "inverse": content.inverse}
            )
        case Band(is_white=False) if content.stop - content.start == 1:
            kind = "black row" if content.axis == "rows" else "black column"
            yield Stripe.model_validate({"kind": kind, "index": content.start})


def _alternating(frequency: Frequency) -> Iterator[Pattern]:
    for inverse in (False, True):
        yield Sinusoid(kind="cosine", frequency=frequency, inverse=inverse, purpose="near")


def _sinusoids(fringes: Fringes, size: Size, low: set[Frequency]) -> Iterator[Pattern]:
    """Yield cosines and sines of the frequency, and their inverses."""
    parts = [
        dict.fromkeys(
            (
                Fraction(round(value * side), side),
                Fraction(value).limit_denominator(LARGEST_DENOMINATOR),
            )
        )
        for value, side in zip((fringes.fy, fringes.fx), size, strict=True)
    ]
    quarter = round(4 * fringes.phase) % 4
    # cos(a), cos(a + 90 degrees) = -sin(a), and so on.
    kind, inverse = (("cosine", False), ("sine", True), ("cosine", True), ("sine", False))[quarter]
    for fy in parts[0]:
        for fx in parts[1]:
            frequency = wrap(fy, fx)
            purpose = "far" if frequency in low or -frequency in low else "near"
            # The negative has the opposite sine. Cosine and sine get the same of the two.
            opposite = inverse ^ (kind == "sine")
            waves = {frequency: inverse, -frequency: opposite}
            for wave in sorted(waves, reverse=True):
                flipped = waves[wave]
                yield Sinusoid.model_validate(
                    {"kind": kind, "frequency": wave, "inverse": flipped, "purpose": purpose}
                )
