"""``nearfar separate``."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, get_args

import typer

from nearfar.arrays import Size
from nearfar.cli import separation_steps as steps
from nearfar.cli.choices import choice
from nearfar.cli.options import AsJson, Force, Quiet, keep_input, scene_names, size
from nearfar.cli.saying import say, say_memory, warn
from nearfar.cli.separation_of_capture import Told, separate_capture
from nearfar.progress import progress_bar
from nearfar.scenes import SCENES

if TYPE_CHECKING:
    from nearfar.baselines.separation_methods import Method


Pattern = Literal["checkerboard", "sinusoid", "any"]
# Where there are photos to separate, and where the patterns are nearfar's.
TAKEN = ("--rig", "--photos", "--capture")
DRAWN = ("--rig", "--photos", "--export")


def separate(
    output: Annotated[Path, typer.Argument(metavar="OUT", help="Folder to make.")],
    rig: Annotated[
        str | None,
        typer.Option(
            help=f"Shoot on this rig: a scene ({', '.join(SCENES)}), stored transport (.npy, .npz, "
            "Zarr), or RIG.toml.",
            metavar="RIG",
            autocompletion=scene_names,
        ),
    ] = None,
    photos: Annotated[
        Path | None,
        typer.Option(
            help="Separate your own photos, one per pattern in natural order of their names; one "
            "more, the last, may be under black.",
            metavar="DIR",
        ),
    ] = None,
    capture: Annotated[
        Path | None,
        typer.Option(
            help="Separate a capture: of anybody's patterns, by those of them that serve, or of a "
            "plan.",
            metavar="CAPTURE.zarr",
        ),
    ] = None,
    export: Annotated[
        bool,
        typer.Option("--export", help="Write the patterns, and a last one black, to project."),
    ] = False,
    projector: Annotated[
        Size | None,
        typer.Option(
            parser=size,
            metavar="HxW",
            help="Pattern grid; a scene's or a stored transport's own if left out with --rig.",
        ),
    ] = None,
    pattern: Annotated[
        Pattern | None,
        choice(
            get_args(Pattern),
            help="Shifted checkerboards, which suit projectors that are not linear, too, and are "
            "taken if left out; shifted sinusoids; or any fine patterns that light half of the "
            "pixels, known by their photos only.",
        ),
    ] = None,
    side: Annotated[
        int | None,
        typer.Option(
            help="Side of a checkerboard's square, pixels; 2 if left out. 1 is better where each "
            "camera pixel sees one projector pixel, and useless elsewhere.",
            metavar="N",
        ),
    ] = None,
    step: Annotated[
        int | None,
        typer.Option(help="Shift of the checkerboard; half a square if left out.", metavar="N"),
    ] = None,
    period: Annotated[
        int | None,
        typer.Option(
            help="Period of the sinusoid, pixels; 3 if left out. With --capture, about the period "
            "of the patterns to use, if not of the finest.",
            metavar="N",
        ),
    ] = None,
    shifts: Annotated[
        int | None,
        typer.Option(help="Phases of the sinusoid, 3 or more; 4 if left out.", metavar="N"),
    ] = None,
    ambient: Annotated[
        Path | None,
        typer.Option(help="Photo with the projector covered or off.", metavar="PHOTO"),
    ] = None,
    black: Annotated[
        Path | None,
        typer.Option(help="Photo under a black pattern, if it is not in DIR.", metavar="PHOTO"),
    ] = None,
    black_level: Annotated[
        float | None,
        typer.Option(
            help="Light of a black pixel as a share of a white one's, 0 if left out; a photo "
            "under black is better.",
            metavar="SHARE",
        ),
    ] = None,
    full_scale: Annotated[
        float | None, typer.Option(help="Value of the photos at full scale.", metavar="VALUE")
    ] = None,
    scale: Annotated[
        int | None, typer.Option(min=1, help="Export each pattern pixel as N x N.", metavar="N")
    ] = None,
    native: Annotated[
        Size | None,
        typer.Option(
            parser=size, metavar="HxW", help="Centre exported patterns on a frame, black around."
        ),
    ] = None,
    truth: Annotated[
        Path | None,
        typer.Option(
            help="Compare with what render wrote of the scene, or with a dense T of any origin, "
            "split as the model fits it best.",
            metavar="TRUTH",
        ),
    ] = None,
    transport: Annotated[
        Path | None,
        typer.Option(
            help="Compare with the direct light, and the near and far light together, of a "
            "reconstruction.",
            metavar="TRANSPORT.zarr",
        ),
    ] = None,
    as_json: AsJson = False,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Separate direct from global light under full white (Nayar et al. 2006).

    OUT gets direct and global as .npy and .exr, in photo units, and .png for looking; their sum
    is photo(white) - photo(black). OUT/numbers.json says what was used.

    Example: nearfar separate separated --rig corner

    Example: nearfar separate separated --capture capture.zarr
    """
    from nearfar.baselines.separation_photos import separate as take_apart
    from nearfar.files import check_output
    from nearfar.workflow.separate import (
        describe_separation,
        find_separation_faults,
        is_separation,
        summarise_separation,
        write_separation,
    )

    source = _source(rig=rig, photos=photos, capture=capture, export=export or None)
    _refuse(source, ("--photos", "--capture"), ambient=ambient, black=black)
    _refuse(source, ("--photos", "--capture"), black_level=black_level)
    _refuse(source, ("--photos",), full_scale=full_scale)
    _refuse(source, ("--export",), scale=scale, native=native)
    _refuse(source, TAKEN, truth=truth, transport=transport, json=as_json or None)
    _refuse(source, DRAWN, pattern=pattern, side=side, step=step, shifts=shifts)
    if pattern == "any" and source != "--photos":
        raise typer.BadParameter("any goes with --photos only.", param_hint="--pattern")
    world = Path(rig) if rig and rig not in SCENES else None
    inputs = (photos, capture, ambient, black, truth, transport, world)
    keep_input(output, *(path for path in inputs if path is not None))
    check_output(output, force=force, replaceable=is_separation)
    if capture is not None:
        told = Told(ambient, black, black_level, truth, transport, projector)
        separate_capture(capture, output, told, period, as_json=as_json, force=force, quiet=quiet)
        return
    method = _method(pattern or "checkerboard", side=side, step=step, period=period, shifts=shifts)
    if export:
        steps.export_patterns(output, method, projector, scale, native, force=force, quiet=quiet)
        return
    # Only a simulated rig knows how its photos relate to the truth.
    exposure: float | None = None
    if rig is not None:
        say_memory(rig, projector, quiet=quiet or as_json)
    with progress_bar("separating", quiet=quiet) as report:
        if photos is not None:
            taken = steps.read_photos(
                photos, method, ambient, black, black_level, full_scale, report
            )
            described: dict[str, Any] = {"photos": str(photos)}
        else:
            assert rig is not None
            taken, rig_says = steps.shoot_photos(rig, projector, method, report)
            described, exposure = {"rig": rig_says}, rig_says.get("transport_exposure")
        found = take_apart(
            taken, method.separate, progress=lambda share: report("separating", share)
        )
        numbers = describe_separation(found, taken, method) | described
        compared = steps.compare(found, truth, transport, exposure, projector)
        numbers["snr"] = compared.snr
        write_separation(output, found, numbers, force=force)
    for fault in [*find_separation_faults(taken, method, rig or str(photos)), *compared.faults]:
        warn(fault)
    if as_json:
        print(json.dumps(numbers, allow_nan=False))
    else:
        say(f"{summarise_separation(numbers)}, written to {output}", quiet=quiet)


def _source(**sources: Any) -> str:
    given = [f"--{name}" for name, value in sources.items() if value is not None]
    if len(given) != 1:
        every = ", ".join(f"--{name}" for name in sources)
        raise typer.BadParameter(f"give one of {every}, and only one.", param_hint="--rig")
    return given[0]


def _refuse(source: str, sources: tuple[str, ...], **options: Any) -> None:
    for name, value in options.items():
        if value is not None and source not in sources:
            raise typer.BadParameter(
                f"goes with {' or '.join(sources)}, not with {source}.",
                param_hint=f"--{name.replace('_', '-')}",
            )


def _method(pattern: Pattern, **numbers: int | None) -> "Method":
    from nearfar.baselines.separation_methods import (
        by_any_patterns,
        by_checkerboards,
        by_sinusoids,
    )

    own = {"checkerboard": ("side", "step"), "sinusoid": ("period", "shifts")}
    for name, value in numbers.items():
        if value is not None and name not in own.get(pattern, ()):
            raise typer.BadParameter(f"is not for --pattern {pattern}.", param_hint=f"--{name}")
    match pattern:
        case "checkerboard":
            return by_checkerboards(numbers["side"], numbers["step"])
        case "sinusoid":
            return by_sinusoids(numbers["period"], numbers["shifts"])
        case _:
            return by_any_patterns()
