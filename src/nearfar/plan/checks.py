"""Check photos: photos that no estimate uses, to measure how well it relights.

Check patterns come with their inverses. What a pattern and its inverse show sums to white, which is
measured anyway, so that the noise of a pair is known without a model of it.
"""

from collections import Counter
from collections.abc import Sequence
from typing import NamedTuple

from nearfar.arrays import Size
from nearfar.errors import PlanError
from nearfar.illumination.frequencies import DC, Frequency
from nearfar.plan.model import Plan
from nearfar.plan.patterns import HalfScreen, Pattern, Picture, Sinusoid
from nearfar.plan.references import parts_a_pair

# Seeds of the pictures, other than those that `nearfar evaluate` relights under, start here.
FIRST_PICTURE_SEED = 101
# Share of all photos of a plan that are check photos, at least one pair.
CHECK_SHARE = 0.04
# Pictures to check by while a capture is taken.
PICTURES_ON_THE_WAY = 3


class CheckLight(NamedTuple):
    """A check pattern and its photos.

    Attributes
    ----------
    pattern : Pattern
        Not the inverse.
    photos, inverses : tuple of int
        Numbers of the photos of the pattern, and of its inverse.
    """

    pattern: Pattern
    photos: tuple[int, ...]
    inverses: tuple[int, ...]


def check_pairs(photos: int) -> int:
    """Return the number of check patterns, each with its inverse, for a plan of some photos."""
    return max(1, round(CHECK_SHARE * photos / 2))


def check_patterns(pairs: int, projector: Size) -> list[Pattern]:
    """Return check patterns, each followed by its inverse: pictures, and half-screens among them.

    Every second pattern is a half-screen as long as there are some. A single row or column has no
    halves across.
    """
    halves: list[Pattern] = []
    if projector.width > 1:
        halves.append(HalfScreen(kind="left half-screen"))
    if projector.height > 1:
        halves.append(HalfScreen(kind="top half-screen"))
    chosen: list[Pattern] = []
    seed = FIRST_PICTURE_SEED
    for number in range(pairs):
        if number % 2 and halves:
            chosen.append(halves.pop(0))
        else:
            chosen.append(Picture(seed=seed))
            seed += 1
    return [p for pattern in chosen for p in (pattern, _inverse(pattern))]


def _inverse(pattern: Pattern) -> Pattern:
    return pattern.model_copy(update={"inverse": True})


def spread_checks(patterns: Sequence[Pattern], checks: Sequence[Pattern]) -> list[Pattern]:
    """Spread pairs of check patterns evenly through others; no cosine is parted from its sine."""
    pairs = [checks[i : i + 2] for i in range(0, len(checks), 2)]
    places = [i for i in range(len(patterns) + 1) if not parts_a_pair(patterns, i)]
    found: list[Pattern] = []
    done = 0
    for number, pair in enumerate(pairs):
        wanted = (2 * number + 1) * len(patterns) / (2 * len(pairs))
        place = min(places, key=lambda i: abs(i - wanted))
        found += [*patterns[done:place], *pair]
        done = place
    return [*found, *patterns[done:]]


def with_checks(plan: Plan) -> Plan:
    """Move the check patterns of a plan after its first white and black, and add pictures to three.

    So what the photos so far are worth can be measured from the first photos on.

    Raises
    ------
    PlanError
        If an estimate needs all photos of the plan.
    """
    if plan.is_by_codes:
        raise PlanError(
            f"a plan of codes can be estimated from only after its last photo, so that there is "
            f"nothing to check on the way: plan sinusoids, with `photos` no more than the "
            f"{plan.projector.pixels} projector pixels."
        )
    if plan.offset != "reference" or plan.counts["correspondence"]:
        raise PlanError(
            "a plan of inverse pairs, or with photos of its own for correspondence such as stripes "
            "or Gray code, can be estimated from only after its last photo, so that there is "
            "nothing to check on the way: make the plan with `photos`."
        )
    checks = [pattern for pattern in plan.patterns if pattern.purpose == "check"]
    for seed in range(FIRST_PICTURE_SEED, FIRST_PICTURE_SEED + PICTURES_ON_THE_WAY):
        picture = Picture(seed=seed)
        if picture not in checks:
            checks += [picture, _inverse(picture)]
    others = [pattern for pattern in plan.patterns if pattern.purpose != "check"]
    start = next(i for i, pattern in enumerate(others) if not is_reference(pattern))
    patterns = (*others[:start], *checks, *others[start:])
    return plan.model_copy(update={"patterns": patterns})


def is_reference(pattern: Pattern) -> bool:
    """Return whether a pattern is white or black."""
    return isinstance(pattern, Sinusoid) and pattern.frequency == DC


def is_black(pattern: Pattern) -> bool:
    """Return whether a pattern is black."""
    return isinstance(pattern, Sinusoid) and pattern.frequency == DC and pattern.inverse


def check_lights(plan: Plan) -> list[CheckLight]:
    """Return the check patterns of a plan with the numbers of their photos."""
    found: dict[Pattern, tuple[list[int], list[int]]] = {}
    for number, pattern in enumerate(plan.patterns):
        if isinstance(pattern, Picture | HalfScreen):
            light = pattern.model_copy(update={"inverse": False})
            found.setdefault(light, ([], []))[pattern.inverse].append(number)
    return [
        CheckLight(light, tuple(photos), tuple(inverses))
        for light, (photos, inverses) in found.items()
    ]


def ends(plan: Plan) -> list[int]:
    """Return the numbers of photos after which a capture of a plan may end.

    By then every cosine has its sine, patterns for correspondence are complete or not started, and
    white and black have just been projected for the second time or later; or, in a plan of inverse
    pairs, every pattern has its inverse, white among them. Codes measure nothing before the last.
    """
    if plan.is_by_codes:
        return [len(plan.patterns)]
    own = [i for i, p in enumerate(plan.patterns) if p.purpose == "correspondence"]
    first, last = (own[0], own[-1]) if own else (0, -1)
    return [end for end in _ends_of(plan) if end <= first or end > last]


def _ends_of(plan: Plan) -> list[int]:
    if plan.offset != "reference":
        return _ends_of_pairs(plan)
    found: list[int] = []
    times, open_pairs = 0, set[Frequency]()
    for i, pattern in enumerate(plan.patterns):
        if not is_reference(pattern):
            if isinstance(pattern, Sinusoid) and not pattern.frequency.is_own_negative:
                open_pairs ^= {pattern.frequency}
            continue
        if i + 1 < len(plan.patterns) and is_reference(plan.patterns[i + 1]):
            continue
        times += 1
        if times > 1 and not open_pairs:
            found.append(i + 1)
    return found


def _ends_of_pairs(plan: Plan) -> list[int]:
    found: list[int] = []
    projected: set[tuple[Frequency, str]] = set()
    surplus: Counter[tuple[Frequency, str, str]] = Counter()
    without_other: set[Frequency] = set()
    for i, pattern in enumerate(plan.patterns):
        if isinstance(pattern, Sinusoid):
            frequency, kind = pattern.frequency, pattern.kind
            surplus[frequency, kind, pattern.purpose] += -1 if pattern.inverse else 1
            if (frequency, kind) not in projected and not frequency.is_own_negative:
                without_other ^= {frequency}
            projected |= {(frequency, kind)}
        if (DC, "cosine") in projected and not without_other and not any(surplus.values()):
            found.append(i + 1)
    return found
