"""What a plan holds, in lines."""

from nearfar.plan import Plan


def describe_plan(made: Plan) -> str:
    """Return in lines what a plan holds: sizes, photos, and what brute force would take.

    Parameters
    ----------
    made : Plan

    Returns
    -------
    str
    """
    counts = ", ".join(f"{count} {purpose}" for purpose, count in made.counts.items() if count)
    return "\n".join(
        [
            f"projector {made.projector}, W = {made.window}, far band {made.far}, "
            f"near frequencies dropped {made.dropped}, offset {made.offset}",
            f"{len(made.patterns)} photos: {counts}",
            f"{made.transport_photos} photos of transport against {made.projector.pixels} by brute "
            f"force: {made.savings:.2f} times fewer",
        ]
    )
