"""Check pictures: patterns whose photos no estimate uses, to measure how well it relights."""

from collections import Counter

from nearfar.errors import PlanError
from nearfar.illumination.frequencies import DC, Frequency
from nearfar.plan.model import Plan
from nearfar.plan.patterns import Pattern, Picture, Sinusoid

# Seeds of the pictures, other than those that `nearfar evaluate` relights under.
PICTURE_SEEDS = (101, 102, 103)
# Photos of each picture: what two have in common is not noise.
PHOTOS_OF_EACH = 2


def with_checks(plan: Plan) -> Plan:
    """Insert check pictures after the first white and black of a plan.

    Raises
    ------
    PlanError
        If an estimate needs all photos of the plan.
    """
    if plan.offset != "reference" or plan.counts["correspondence"]:
        raise PlanError(
            "a plan of inverse pairs, or with photos of its own for correspondence such as stripes "
            "or Gray code, can be estimated from only after its last photo, so that there is "
            "nothing to check on the way: make the plan with `photos`."
        )
    start = next(i for i, pattern in enumerate(plan.patterns) if not is_reference(pattern))
    checks = tuple(Picture(seed=seed) for _ in range(PHOTOS_OF_EACH) for seed in PICTURE_SEEDS)
    patterns = (*plan.patterns[:start], *checks, *plan.patterns[start:])
    return plan.model_copy(update={"patterns": patterns})


def is_reference(pattern: Pattern) -> bool:
    """Return whether a pattern is white or black."""
    return isinstance(pattern, Sinusoid) and pattern.frequency == DC


def check_photos(plan: Plan) -> dict[int, list[int]]:
    """Return the photo numbers of each check picture by its seed."""
    found: dict[int, list[int]] = {}
    for number, pattern in enumerate(plan.patterns):
        if isinstance(pattern, Picture):
            found.setdefault(pattern.seed, []).append(number)
    return found


def ends(plan: Plan) -> list[int]:
    """Return the numbers of photos after which a capture of a plan may end.

    By then every cosine has its sine, patterns for correspondence are complete or not started, and
    white and black have just been projected for the second time or later; or, in a plan of inverse
    pairs, every pattern has its inverse, white among them.
    """
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
