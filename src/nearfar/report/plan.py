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
            f"{_against(plan)}; counting the {plan.transport_photos} of transport alone, "
            f"{plan.savings:.2f} times fewer",
        ]
    )


def _against(plan: Plan) -> str:
    """Compare all photos with those of brute force."""
    photos, brute_force = len(plan.patterns), plan.projector.pixels
    if photos > brute_force:
        return f"{photos / brute_force:.2f} times more than the {brute_force} of brute force"
    return f"{brute_force / photos:.2f} times fewer than the {brute_force} of brute force"
