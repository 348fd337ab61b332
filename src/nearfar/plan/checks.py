"""Pictures among a plan's patterns that no estimate sees, to tell how well it relights."""

from collections import Counter

from nearfar.errors import PlanError
from nearfar.illumination.frequencies import DC, Frequency
from nearfar.plan.model import Plan
from nearfar.plan.patterns import Pattern, Picture, Sinusoid

# Not those that `nearfar evaluate` relights under.
SEEDS = (101, 102, 103)
# Two photos of each: what they have in common is no noise.
TIMES = 2


def with_checks(plan: Plan) -> Plan:
    """Put pictures to check by behind the first white and black of a plan.

    Raises
    ------
    PlanError
        If the plan is not one whose first photos can be estimated from.
    """
    if plan.offset != "reference" or plan.counts["correspondence"]:
        raise PlanError(
            "a plan of inverse pairs, or with photos of its own for correspondence such as stripes "
            "or Gray code, can be estimated from only after its last photo, so that there is "
            "nothing to check on the way: make the plan with `photos`."
        )
    start = next(i for i, pattern in enumerate(plan.patterns) if not is_reference(pattern))
    checks = tuple(Picture(seed=seed) for _ in range(TIMES) for seed in SEEDS)
    patterns = (*plan.patterns[:start], *checks, *plan.patterns[start:])
    return plan.model_copy(update={"patterns": patterns})


def is_reference(pattern: Pattern) -> bool:
    """Tell white and black from other patterns."""
    return isinstance(pattern, Sinusoid) and pattern.frequency == DC


def check_photos(plan: Plan) -> dict[int, list[int]]:
    """List the photos of each picture by its seed."""
    found: dict[int, list[int]] = {}
    for number, pattern in enumerate(plan.patterns):
        if isinstance(pattern, Picture):
            found.setdefault(pattern.seed, []).append(number)
    return found


def ends(plan: Plan) -> list[int]:
    """Numbers of photos after which a plan may end.

    Every cosine has its sine, stripes or Gray code that were begun are whole, and white and black
    have just been shown for the second time or later; or every pattern has its inverse, white
    among them.
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
    shown: set[tuple[Frequency, str]] = set()
    surplus: Counter[tuple[Frequency, str, str]] = Counter()
    without_other: set[Frequency] = set()
    for i, pattern in enumerate(plan.patterns):
        if isinstance(pattern, Sinusoid):
            frequency, kind = pattern.frequency, pattern.kind
            surplus[frequency, kind, pattern.purpose] += -1 if pattern.inverse else 1
            if (frequency, kind) not in shown and not frequency.is_own_negative:
                without_other ^= {frequency}
            shown |= {(frequency, kind)}
        if (DC, "cosine") in shown and not without_other and not any(surplus.values()):
            found.append(i + 1)
    return found
