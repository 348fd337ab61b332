"""``nearfar relight``."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from nearfar.cli.gains import MODEL, PHYSICAL, gains_of
from nearfar.cli.lights import Resize, Srgb, read_light_for, say_resized
from nearfar.cli.looks import Channel, Exposure, Gamma, look_for
from nearfar.cli.options import Force, Quiet, TransportPath, keep_input
from nearfar.cli.other_projectors import open_transports, others_of
from nearfar.cli.saying import say
from nearfar.progress import progress_bar

if TYPE_CHECKING:
    from nearfar.arrays import Floats
    from nearfar.transport.stored import StoredTransport

    Relighting = Callable[[StoredTransport, Floats, Mapping[str, float]], Floats]


def _relighting(gains: dict[str, float], *, error_bars: bool) -> "Relighting":
    """Return the function that relights by the split that gains are of.

    Direct light alone is the model's. Gains of both splits are refused, and error bars of the
    physical one.
    """
    from nearfar.workflow import relight as workflow

    physical = [name for name in gains if name not in MODEL]
    others = [name for name in gains if name not in PHYSICAL]
    if physical and others:
        raise typer.BadParameter(
            f"{others[0]} and {physical[0]} are components of two splits: give gains of the "
            f"model's split (direct, near, far; free for lamps) or of the physical split (direct, "
            f"subsurface, interreflection).",
            param_hint="--gain",
        )
    if physical:
        return (
            workflow.physical_error_bars_of_stored
            if error_bars
            else workflow.relight_stored_physically
        )
    return workflow.error_bars_of_stored if error_bars else workflow.relight_stored


def relight(
    transport: TransportPath,
    light: Annotated[
        Path,
        typer.Argument(
            metavar="LIGHT",
            help="Light, of the projector's size; of lamps also a list of weights, .npy, .csv or "
            ".txt.",
        ),
    ],
    output: Annotated[Path, typer.Argument(metavar="OUT", help=".npy, .exr, .tiff or .png.")],
    gain: Annotated[
        list[str] | None,
        typer.Option(
            help="Gain of a component: direct=1, near=2 or far=0 of the model's split, for lamps "
            "free=2; or direct=1, subsurface=2 or interreflection=0 of the physical split.",
            metavar="NAME=VALUE",
        ),
    ] = None,
    other: Annotated[
        list[str] | None,
        typer.Option(
            "--and",
            help="Transport of a further projector before the same camera, and its light.",
            metavar="TRANSPORT.zarr=LIGHT",
        ),
    ] = None,
    srgb: Srgb = False,
    resize: Resize = False,
    error_bars: Annotated[
        bool,
        typer.Option(
            "--error-bars",
            help="Write the picture's standard deviation instead of the picture, infinite where "
            "the camera is saturated.",
        ),
    ] = False,
    exposure: Exposure = 0.0,
    gamma: Gamma = 1.0,
    channel: Channel = None,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Relight the scene: what the camera would see under a light, without ambient light.

    Example: nearfar relight transport.zarr light.png relit.exr --srgb --gain near=2
    """
    from nearfar.applications.several_projectors import added_deviations, added_pictures
    from nearfar.files import (
        check_output,
        check_picture_ending,
        write_picture,
    )

    gains = gains_of(gain or [])
    make = _relighting(gains, error_bars=error_bars)
    others = others_of(other, "RIGHT.zarr=RIGHT_LIGHT")
    paths = [transport, *(each.path for each in others)]
    lights = [light, *(each.beside for each in others)]
    check_picture_ending(output)
    look = look_for(output, exposure, gamma, channel)
    keep_input(output, *paths, *lights)
    check_output(output, force=force)
    with progress_bar("relighting", quiet=quiet):
        opened = open_transports(paths)
        read = [
            read_light_for(one, path, srgb=srgb, resize=resize)
            for one, path in zip(opened, lights, strict=True)
        ]
        pictures = [
            make(one, projected, gains) for one, (projected, _) in zip(opened, read, strict=True)
        ]
        picture = (added_deviations if error_bars else added_pictures)(pictures)
        write_picture(output, look.of(picture), force=force, may_be_infinite=error_bars)
    for path, one, (_, given) in zip(lights, opened, read, strict=True):
        say_resized(path, given, one.projector, quiet=quiet)
    what = "standard deviation of the relit picture" if error_bars else "relit picture"
    say(f"{what} of {opened[0].camera} written to {output}", quiet=quiet)
