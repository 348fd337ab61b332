"""Description of a plan."""

from nearfar.plan import Plan


def describe_plan(plan: Plan) -> str:
    """Return a description of a plan, in lines: sizes, photos, and savings over brute force.

    Parameters
    ----------
    plan : Plan

    Returns
    -------
    str
    """
    counts = ", ".join(f"{count} {purpose}" for purpose, count in plan.counts.items() if count)
    return "\n".join(
        [
            f"projector {plan.projector}, W = {plan.window}, far band {plan.far}, "
            f"near frequencies dropped {plan.dropped}, offset {plan.offset}",
            f"{len(plan.patterns)} photos: {counts}",
            f"{plan.projector.pixels / len(plan.patterns):.2f} times fewer than the "
            f"{plan.projector.pixels} of brute force; counting the {plan.transport_photos} of "
            f"transport alone, {plan.savings:.2f} times",
        ]
    )
