"""``nearfar depth``."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from nearfar.cli.opening import open_reconstructed
from nearfar.cli.options import AsJson, Force, Quiet, keep_input
from nearfar.cli.saying import say, warn
from nearfar.progress import Report, progress_bar

if TYPE_CHECKING:
    from nearfar.applications.depth import Depth
    from nearfar.workflow.depth import Seen


def depth(
    source: Annotated[
        Path,
        typer.Argument(metavar="CAPTURE|TRANSPORT", help="Photos of a plan, or a transport."),
    ],
    output: Annotated[
        Path,
        typer.Argument(
            metavar="OUT", help=".ply, points with colour and error bar; or .npy, camera x 3."
        ),
    ],
    calibration: Annotated[
        Path,
        typer.Option(
            metavar="STEREO.yml",
            help="Where camera and projector stand: of calibrate --geometry, or of OpenCV.",
        ),
    ],
    least_confidence: Annotated[
        float,
        typer.Option(
            metavar="C", min=0.0, max=1.0, help="Leave out camera pixels whose q is less sure."
        ),
    ] = 0.0,
    colour: Annotated[
        Literal["direct", "white"] | None,
        typer.Option(
            help="Colour of the points: direct light, the default of a transport, or the picture "
            "under white, that of a capture."
        ),
    ] = None,
    scale: Annotated[
        int | None,
        typer.Option(
            metavar="N",
            min=1,
            help="Projector pixels along each side of a pattern pixel; if left out, as many as the "
            "rig tells, or as fit.",
        ),
    ] = None,
    as_json: AsJson = False,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Find the depth of what the camera sees: points by triangulation, with error bars.

    Points are in the camera's frame, x to the right, y down, z forwards, in the calibration's unit.
    Those whose rays miss each other by more than chance are left out.

    Example: nearfar depth capture.zarr cloud.ply --calibration stereo.yml
    """
    from nearfar.files import check_output
    from nearfar.files.point_clouds import check_cloud_ending, write_cloud
    from nearfar.stereo import read_stereo_calibration

    check_cloud_ending(output)
    keep_input(output, source, calibration)
    check_output(output, force=force)
    stereo = read_stereo_calibration(calibration)
    with progress_bar("depth", quiet=quiet) as report:
        seen = _seen(source, colour, report)
        found = seen.depth(stereo, scale, least_confidence)
    for sentence in (*seen.warnings, *found.warnings()):
        warn(sentence)
    write_cloud(
        output, found.points, seen.colours(), found.confidence, found.deviation, force=force
    )
    if as_json:
        print(json.dumps(found.as_json(), allow_nan=False))
    else:
        say(f"{_summary(found)}\nwritten to {output}", quiet=quiet)


def _seen(source: Path, colour: Literal["direct", "white"] | None, report: Report) -> "Seen":
    from nearfar.capture import open_capture
    from nearfar.files import kind_of_store
    from nearfar.workflow.depth import seen_in_capture, seen_in_stored

    if kind_of_store(source) == "nearfar capture":
        if colour == "direct":
            raise typer.BadParameter(
                "direct light is known of a transport alone: leave it out, or give a transport.",
                param_hint="--colour",
            )
        return seen_in_capture(open_capture(source), report)
    return seen_in_stored(open_reconstructed(source), colour or "direct")


def _summary(found: "Depth") -> str:
    numbers = found.as_json()
    lines = [f"{found.kept} points of {found.lit} camera pixels with q"]
    if found.kept:
        lines[0] += f", standard deviation {numbers['median_deviation']:.3g} (median)"
    if found.missed:
        lines.append(
            f"{found.missed} left out, whose rays miss each other by more than chance: their q is "
            f"wrong, or of two surfaces"
        )
    if found.behind:
        lines.append(f"{found.behind} left out, whose rays meet behind the camera or nowhere")
    if found.unsure:
        lines.append(f"{found.unsure} left out, whose q is not sure enough")
    return "\n".join(lines)
