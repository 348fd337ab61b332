"""``nearfar plan``."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple, cast

import typer

from nearfar.arrays import Size
from nearfar.cli.choices import choice
from nearfar.cli.options import (
    AsJson,
    Force,
    NoFar,
    NoNear,
    Quiet,
    both_ranges_left_out,
    size,
)
from nearfar.cli.saying import say
from nearfar.errors import InputError
from nearfar.progress import progress_bar

if TYPE_CHECKING:
    from nearfar.plan import Plan
    from nearfar.plan.look import Look
    from nearfar.plan.paper import Offset
    from nearfar.progress import Report


def plan(
    projector: Annotated[
        Size,
        typer.Option(
            parser=size,
            metavar="HxW",
            help="The projector's pixels, height x width; or a smaller grid, shown in blocks.",
        ),
    ],
    photos: Annotated[
        int | None,
        typer.Option(min=1, help="Choose the best plan of at most N photos.", metavar="N"),
    ] = None,
    near: Annotated[
        int | None,
        typer.Option(
            min=1,
            help="W of the near-range window: projector pixels, or, by --photos for fine "
            "projectors, functions several pixels apart.",
            metavar="W",
        ),
    ] = None,
    far: Annotated[
        Size | None, typer.Option(parser=size, metavar="HxW", help="Far band, height x width.")
    ] = None,
    drop: Annotated[
        Size | None,
        typer.Option(
            parser=size,
            metavar="HxW",
            help="Lowest near frequencies to leave out, odd x odd; by default those up to k_far.",
        ),
    ] = None,
    offset: Annotated[
        str | None,
        choice(
            "nearfar.plan.paper:Offset",
            help="Each pattern with its inverse, or once with white and black at intervals; none "
            "is for counting and simulation only. By default inverse with --far, else reference.",
        ),
    ] = None,
    correspondence: Annotated[
        str | None,
        choice(
            "nearfar.plan:CORRESPONDENCE_METHODS",
            help="Photos of black stripes or of Gray code, the patterns' own phase, or none; or a "
            "method of another package. By default stripes with --far, else phase.",
        ),
    ] = None,
    look: Annotated[
        Path | None,
        typer.Option(
            help="Plan for one scene: a transport reconstructed from few photos of it, by --method "
            "joint.",
            metavar="TRANSPORT.zarr",
        ),
    ] = None,
    no_near: NoNear = False,
    no_far: NoFar = False,
    no_check: Annotated[
        bool,
        typer.Option(
            "--no-check",
            help="Leave out the check photos, from which nothing is estimated and which tell how "
            "far the result can be trusted.",
        ),
    ] = False,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", help="Write the plan to this file.", metavar="FILE"),
    ] = None,
    as_json: AsJson = False,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Plan what to project: the best patterns for a number of photos, or the paper's.

    Example: nearfar plan --projector 1080x1920 --photos 200 -o plan.json

    The paper's: nearfar plan --projector 128x128 --near 19 --far 13x13 -o plan.json
    """
    from nearfar.plan import paper_plan
    from nearfar.report.plan import describe_plan

    chosen = None
    if photos is None and (look is not None or no_check):
        flag = "--no-check" if look is None else "--look"
        raise typer.BadParameter(f"{flag} goes with --photos N only")
    if output is not None:
        from nearfar.files import check_output, new_output

        check_output(output, force=force)
    if both_ranges_left_out(no_near=no_near, no_far=no_far):
        made = _of_lamps(projector, photos, near, look, no_check=no_check)
    elif photos is not None:
        _refuse_with_photos(far, drop, offset, correspondence)
        with progress_bar("choosing patterns", quiet=quiet or as_json) as report:
            chosen = _choose(projector, photos, near, look, checks=not no_check, progress=report)
        made = chosen.plan
    elif near is None or far is None:
        raise typer.BadParameter("give --photos N, or --near W and --far HxW for the paper's plan")
    else:
        made = paper_plan(
            projector,
            near,
            far,
            dropped=drop,
            offset=cast("Offset", offset or "inverse"),
            correspondence=correspondence or "stripes",
        )
    if output is not None:
        with new_output(output, force=force) as partial:
            partial.write_text(made.to_json(), encoding="utf-8")
    if as_json:
        print(json.dumps({**made.summary(), **_numbers(chosen)}))
    else:
        said = [describe_plan(made), *(() if chosen is None else chosen.sentences())]
        if made.pitch > 1:
            said.append(_on_blocks(made.projector))
        said += [] if output is None else [f"plan written to {output}"]
        for line in said:
            say(line, quiet=quiet)


def _of_lamps(
    projector: Size, photos: int | None, near: int | None, look: Path | None, *, no_check: bool
) -> "Plan":
    """Plan for lamps without a neighbourhood."""
    from nearfar.plan.lamps import plan_lamps

    if photos is None:
        raise typer.BadParameter("--no-near and --no-far go with --photos N.")
    for flag, given in (("--near", near), ("--look", look)):
        if given is not None:
            raise typer.BadParameter("is not for --no-near --no-far.", param_hint=flag)
    return plan_lamps(projector, photos, checked=not no_check)


def _on_blocks(projector: Size) -> str:
    """Return how a plan for blocks of a projector's pixels is made and shown."""
    from nearfar.plan.window import side_of_blocks

    block = side_of_blocks(projector)
    grid = Size(*(max(1, side // block) for side in projector))
    return (
        f"blocks of {block} x {block} pixels: --projector {grid}, and "
        f"nearfar export --native {projector}"
    )


class _Chosen(NamedTuple):
    """A plan that was chosen, and the look that it was chosen by."""

    plan: "Plan"
    look: "Look | None"
    photos_for_window: int | None

    def sentences(self) -> list[str]:
        """Return the lines about the choice that the command prints."""
        from nearfar.report.plan import describe_expected, describe_look

        found = []
        if self.look is not None:
            found.append(describe_look(self.look, self.plan, self.photos_for_window))
        if self.plan.expected_snr is not None:
            is_looked_at = self.look is not None
            found.append(describe_expected(self.plan.expected_snr, is_looked_at=is_looked_at))
        return found


def _numbers(chosen: _Chosen | None) -> dict[str, Any]:
    """Return the entries of `--json` about a chosen plan; None each for the paper's plan."""
    if chosen is None:
        return {"expected_dB": None, "look": None}
    look = chosen.look and {
        "window": chosen.plan.window,
        "reach": chosen.look.reach,
        "photos_for_window": chosen.photos_for_window,
        "free_share": chosen.look.free_share,
        "model_holds": chosen.look.model_holds,
    }
    expected = chosen.plan.expected_snr
    return {"expected_dB": expected and expected.model_dump(mode="json"), "look": look}


def _choose(
    projector: Size,
    photos: int,
    window: int | None,
    look: Path | None,
    *,
    checks: bool,
    progress: "Report",
) -> _Chosen:
    """Choose a plan, for the scene of a look if there is one."""
    from nearfar.plan import choose_plan
    from nearfar.plan.by_look import plan_by_look
    from nearfar.plan.look import photos_for_window

    if look is None:
        plan, _ = choose_plan(
            projector, photos, window=window, checks=None if checks else 0, progress=progress
        )
        return _Chosen(plan, None, None)
    seen = _looked_at(look, projector)
    plan = plan_by_look(projector, photos, seen, window=window, checked=checks, progress=progress)
    needed = None
    if seen.model_holds and plan.window > seen.window:
        needed = photos_for_window(seen, projector, photos, plan.window)
    return _Chosen(plan, seen, needed)


def _looked_at(look: Path, projector: Size) -> "Look":
    """Read the first estimate of a scene and summarise it."""
    from nearfar.plan.look import look_at
    from nearfar.transport.store import load_transport

    seen = load_transport(look)
    if seen.projector != projector:
        raise InputError(
            f"{look} is of a projector {seen.projector}, the plan of {projector}: look with the "
            f"same pattern grid."
        )
    try:
        return look_at(seen)
    except InputError as error:
        raise InputError(f"{look}: {error}") from None


def _refuse_with_photos(
    far: Size | None,
    drop: Size | None,
    offset: str | None,
    correspondence: str | None,
) -> None:
    """Refuse options that only the paper's plan has."""
    if far is not None or drop is not None:
        raise typer.BadParameter("--far and --drop belong to the paper's plan: leave --photos out")
    if offset not in (None, "reference"):
        raise typer.BadParameter("--photos chooses plans by reference: leave --offset out")
    if correspondence not in (None, "phase"):
        raise typer.BadParameter(
            "--photos needs no photos for correspondence: leave --correspondence out"
        )
