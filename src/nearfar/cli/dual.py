"""``nearfar dual``."""

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from nearfar.cli.flat_fields import CameraFlat, ProjectorFlat, read_flat
from nearfar.cli.gains import MODEL, gains_of
from nearfar.cli.lights import Srgb, read_camera_picture, require_light
from nearfar.cli.opening import open_reconstructed
from nearfar.cli.options import Force, Quiet, TransportPath, keep_input
from nearfar.cli.saying import say
from nearfar.progress import progress_bar

if TYPE_CHECKING:
    from nearfar.applications.reciprocity import Reciprocity


def dual(
    transport: TransportPath,
    output: Annotated[Path, typer.Argument(metavar="OUT", help=".npy, .exr, .tiff or .png.")],
    light: Annotated[
        Path | None,
        typer.Option(
            metavar="CAMERA_PICTURE",
            help="Light that the camera sends, of its size; white if left out.",
        ),
    ] = None,
    gain: Annotated[
        list[str] | None,
        typer.Option(
            help="Gain of a component: direct=1, near=2 or far=0; for lamps free=2.",
            metavar="NAME=VALUE",
        ),
    ] = None,
    camera_flat: CameraFlat = None,
    projector_flat: ProjectorFlat = None,
    transpose: Annotated[
        bool,
        typer.Option(
            "--transpose",
            help="Send far-range light back as it was measured, smooth, and not by reciprocity.",
        ),
    ] = False,
    srgb: Srgb = False,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Show the scene as the projector sees it, lit from the camera (dual photography).

    Example: nearfar dual transport.zarr dual.png --light photo.png --srgb
    """
    from nearfar.applications.dual import dual_view_of_stored
    from nearfar.applications.reciprocity import find_reciprocity
    from nearfar.files import check_output, check_picture_ending, write_picture

    require_light(light, srgb=srgb, resize=False)
    gains = gains_of(gain or [], MODEL)
    check_picture_ending(output)
    keep_input(output, transport, *filter(None, (light, camera_flat, projector_flat)))
    check_output(output, force=force)
    with progress_bar("making the dual view", quiet=quiet):
        opened = open_reconstructed(transport)
        camera, channels = opened.camera, opened.channels
        sent = None if light is None else read_camera_picture(light, camera, channels, srgb=srgb)
        flats = {
            "camera_flat": read_flat(camera_flat, camera),
            "projector_flat": read_flat(projector_flat, opened.projector),
        }
        is_direct = all(gains.get(part, 1.0) == 0 for part in ("near", "far"))
        found = None if transpose or is_direct else find_reciprocity(opened)
        view = dual_view_of_stored(opened, sent, gains, **flats, reciprocity=found)
        write_picture(output, view, force=force)
    told = "" if gains.get("far", 1.0) == 0 else _told(found)
    say(f"dual view of {opened.projector} written to {output}{told}", quiet=quiet)


def _told(reciprocity: "Reciprocity | None") -> str:
    """Say how far-range light was found."""
    if reciprocity is None or reciprocity.complete or not math.isfinite(reciprocity.disagreement):
        return ""
    share = f"{100 * reciprocity.disagreement:.0f} %"
    if reciprocity.holds:
        return (
            f"; far-range light is by reciprocity, which differs by {share} from what was measured"
        )
    return f"; far-range light is smooth, as measured: by reciprocity it would differ by {share}"
