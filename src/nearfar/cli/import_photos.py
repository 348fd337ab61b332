"""``nearfar import``."""

from pathlib import Path
from typing import Annotated, NamedTuple

import typer

from nearfar.cli.flags import with_flags
from nearfar.cli.options import Force, Quiet, keep_input
from nearfar.cli.saying import say, say_captured, warn
from nearfar.progress import progress_bar


def import_photos(
    paths: Annotated[
        list[Path],
        typer.Argument(
            metavar="[PLAN.json] PHOTOS_DIR CAPTURE.zarr",
            help="Plan that was shot, folder of the photos, capture to make; with --patterns, no "
            "plan; with --lamps, nothing but TRANSPORT.zarr.",
        ),
    ],
    patterns: Annotated[
        Path | None,
        typer.Option(
            help="Folder of the pictures that were shown, one for each photo, in place of a plan: "
            "Gray code, fringes, Hadamard, single pixels, random ones, or any others.",
            metavar="PATTERNS_DIR",
        ),
    ] = None,
    lamps: Annotated[
        Path | None,
        typer.Option(
            help="Folder of photos, one under each lamp of a light stage or panel, which are a "
            "transport already.",
            metavar="LAMPS_DIR",
        ),
    ] = None,
    references: Annotated[
        Path | None,
        typer.Option(
            help="List of photos of several lamps, to fit the lamps' gains to: lines such as "
            "'all.png: all' or 'left.png: 0-7'.",
            metavar="FILE",
        ),
    ] = None,
    black: Annotated[
        Path | None,
        typer.Option(help="Photo without any lamp, of --lamps.", metavar="PHOTO"),
    ] = None,
    directions: Annotated[
        Path | None,
        typer.Option(help="Table of x, y, z of each lamp, of --lamps.", metavar="FILE"),
    ] = None,
    list_file: Annotated[
        Path | None,
        typer.Option("--list", help="Text file that names the photos in order.", metavar="FILE"),
    ] = None,
    full_scale: Annotated[
        float | None,
        typer.Option(
            help="Value of the photos at full scale, such as 16383 for 14 bits.", metavar="VALUE"
        ),
    ] = None,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Bring in photos taken elsewhere, one per pattern, in natural order of their names.

    Example: nearfar import plan.json photos capture.zarr --full-scale 16383

    Example: nearfar import --patterns patterns photos capture.zarr

    Example: nearfar import --lamps lamps TRANSPORT.zarr --references references.txt
    """
    if lamps is not None:
        refused = {"--patterns": patterns, "--list": list_file}
        _refuse(refused, "is not for --lamps.")
        files = _Files(lamps, references, black, directions)
        _import_lamps(files, paths, full_scale, force=force, quiet=quiet)
        return
    _refuse(
        {"--references": references, "--black": black, "--directions": directions},
        "goes with --lamps.",
    )
    _import_capture(paths, patterns, list_file, full_scale, force=force, quiet=quiet)


def _refuse(options: dict[str, Path | None], why: str) -> None:
    for option, given in options.items():
        if given is not None:
            raise typer.BadParameter(why, param_hint=option)


def _import_capture(
    paths: list[Path],
    patterns: Path | None,
    list_file: Path | None,
    full_scale: float | None,
    *,
    force: bool,
    quiet: bool,
) -> None:
    """Bring in the photos of patterns."""
    from nearfar.capture import import_photos as bring_in
    from nearfar.capture import pair, read_shown
    from nearfar.files import check_output
    from nearfar.plan import read_plan
    from nearfar.plan.recognition import summarise

    source, photos, output = _three(paths, patterns)
    keep_input(output, source, photos)
    shown = None
    if patterns is None:
        made = read_plan(source)
        check_output(output, force=force)
        named = pair(made, photos, list_file)
    else:
        check_output(output, force=force)
        with progress_bar("patterns", quiet=quiet) as report:
            shown = read_shown(patterns, report)
        made = shown.plan
        named = pair(made, photos, list_file, source=str(patterns))
    with progress_bar("photos", quiet=quiet) as report:
        summary = bring_in(
            made,
            named,
            output,
            full_scale=full_scale,
            shown=shown,
            force=force,
            progress=report,
        )
    if shown is not None:
        say("\n".join(["recognised:", *summarise(shown.recognised)]), quiet=quiet)
    say(f"first: {summary.first}\nlast: {summary.last}", quiet=quiet)
    say_captured(summary.capture, output, quiet=quiet)


def _three(paths: list[Path], patterns: Path | None) -> tuple[Path, Path, Path]:
    """Return the plan or the folder of patterns, the folder of photos, and the capture to make."""
    if patterns is not None:
        paths = [patterns, *paths]
    if len(paths) != 3:
        needed = (
            "PHOTOS_DIR and CAPTURE.zarr" if patterns else "PLAN.json, PHOTOS_DIR, CAPTURE.zarr"
        )
        named = len(paths) - (patterns is not None)
        raise typer.BadParameter(f"{needed} are needed, {named} were given.")
    return paths[0], paths[1], paths[2]


class _Files(NamedTuple):
    """What a light stage is read from."""

    lamps: Path
    references: Path | None
    black: Path | None
    directions: Path | None


def _import_lamps(
    files: _Files, paths: list[Path], full_scale: float | None, *, force: bool, quiet: bool
) -> None:
    """Make the transport of a light stage."""
    from nearfar.files import check_output
    from nearfar.workflow.light_stage import import_light_stage
    from nearfar.workflow.light_stage_photos import read_light_stage

    if len(paths) != 1:
        raise typer.BadParameter(f"TRANSPORT.zarr alone is needed, {len(paths)} were given.")
    output = paths[0]
    keep_input(output, *(path for path in files if path is not None))
    check_output(output, force=force)
    with progress_bar("photos", quiet=quiet) as report:
        stage = read_light_stage(
            files.lamps,
            references=files.references,
            black=files.black,
            directions=files.directions,
            full_scale=full_scale,
            scratch=output.parent,
            progress=report,
        )
        gains, verdict = import_light_stage(stage, output, force=force, progress=report)
    if files.black is None:
        warn("no photo without lamps was given: what is black in the photos stands in T as light.")
    if gains is not None:
        for name in (n for n, gain in zip(stage.names, gains.gains, strict=True) if gain == 0):
            warn(f"the references show no light of lamp {name}: its gain is 0.")
        say(
            f"gains of {len(gains.gains)} lamps from {gains.gains.min():.3g} to "
            f"{gains.gains.max():.3g}, each +- {gains.deviations.mean():.2g}, by "
            f"{len(stage.reference_names)} reference photos",
            quiet=quiet,
        )
    camera = "x".join(map(str, stage.black.shape[:2]))
    say(f"transport of {len(stage.names)} lamps to {camera} written to {output}", quiet=quiet)
    say(with_flags(str(verdict)), quiet=quiet)
