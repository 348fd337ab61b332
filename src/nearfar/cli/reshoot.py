"""``nearfar acquire --reshoot``: photos of a finished capture, once more."""

from pathlib import Path

import typer

from nearfar.cli.saying import say, warn
from nearfar.progress import progress_bar


def take_again(plan_file: Path, output: Path, rig: str, numbers: list[int], *, quiet: bool) -> None:
    """Take photos of a finished capture again."""
    from nearfar.capture import open_capture
    from nearfar.plan import read_plan
    from nearfar.plan.checks import with_checks
    from nearfar.rigs.opening import open_rig
    from nearfar.workflow.acquire import shoot_again

    made, before = read_plan(plan_file), open_capture(output)
    if before.plan.counts["check"] > made.counts["check"]:
        # It was taken with --until, which added them to the plan.
        made = with_checks(made)
    with (
        progress_bar("opening the rig", quiet=quiet) as report,
        open_rig(
            rig, made.projector, exposure=before.exposure, progress=report, on_alarm=warn
        ) as opened,
    ):
        for note in opened.notes:
            warn(note)
        shoot_again(made, output, opened, numbers, progress=report)
    say(f"{len(numbers)} photos of {output} taken again", quiet=quiet)


def photo_numbers(text: str) -> list[int]:
    """Read 12,40-60."""
    found: list[int] = []
    for part in text.split(","):
        first, dash, last = part.strip().partition("-")
        is_range = first.isdecimal() and last.isdecimal() and int(first) <= int(last)
        if not (is_range if dash else first.isdecimal()):
            raise typer.BadParameter(
                f"{part.strip()!r} is no photo's number: write them as 12,40-60.",
                param_hint="--reshoot",
            )
        found += range(int(first), int(last or first) + 1)
    return sorted(set(found))
