"""``nearfar relight``."""

from collections.abc import Callable, Mapping
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from nearfar.arrays import Size
from nearfar.cli.options import Force, Quiet, TransportPath, keep_input, require_reconstructed
from nearfar.cli.saying import say, warn_if_wrong
from nearfar.errors import InputError
from nearfar.progress import progress_bar

if TYPE_CHECKING:
    from nearfar.arrays import Floats
    from nearfar.transport.stored import StoredTransport

    Relighting = Callable[[StoredTransport, Floats, Mapping[str, float]], Floats]

MODEL = ("direct", "near", "far", "free")
PHYSICAL = ("direct", "subsurface", "interreflection")


def _gains(texts: list[str]) -> dict[str, float]:
    gains: dict[str, float] = {}
    for text in texts:
        name, _, value = text.partition("=")
        if name in gains:
            raise typer.BadParameter(f"the gain of {name} is given twice.", param_hint="--gain")
        try:
            number = float(value)
        except ValueError:
            number = float("nan")
        if name not in MODEL + PHYSICAL or not isfinite(number):
            raise typer.BadParameter(
                f"{text!r} is no gain: write direct=1, near=2, far=0, subsurface=2, "
                f"interreflection=0 or free=1, one per --gain.",
                param_hint="--gain",
            )
        gains[name] = number
    return gains


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


def _of_size(light: "Floats", path: Path, projector: Size) -> "Floats":
    """Return a light of the projector's size, and refuse another one."""
    from nearfar.files import light_of_size

    return light_of_size(light, path, projector, other_cure=", or add --resize")


def _resized(light: "Floats", _path: Path, projector: Size) -> "Floats":
    """Return a light resized to the projector's size, where it has another one."""
    from nearfar.files.resizing import resize_light

    return light if light.shape[:2] == projector else resize_light(light, projector)


def _read(path: Path, transport: "StoredTransport", *, srgb: bool) -> "Floats":
    """Read a light: a picture, or a table of a weight, or red, green and blue, for each lamp."""
    from nearfar.files import read_light_of_any_size
    from nearfar.files.arrays import read_arrays
    from nearfar.files.tables import is_table, read_table

    lamps = transport.projector.pixels
    is_list = is_table(path) or ("free" in transport.parts and path.suffix.lower() == ".npy")
    if not is_list:
        return read_light_of_any_size(path, srgb=srgb)
    if not is_table(path) and read_arrays(path)["array"].shape[:2] == transport.projector:
        return read_light_of_any_size(path, srgb=srgb)
    weights = read_table(path)
    if weights.shape == (1, lamps):
        weights = weights.T
    if weights.shape not in {(lamps, 1), (lamps, 3)}:
        raise InputError(
            f"{path} has {len(weights)} rows of {weights.shape[1]} numbers: give a row for each of "
            f"{lamps} lamps, of one weight or of red, green and blue."
        )
    shaped = weights.reshape(*transport.projector, -1)
    return shaped[..., 0] if shaped.shape[2] == 1 else shaped


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
    srgb: Annotated[
        bool, typer.Option("--srgb", help="LIGHT is an ordinary sRGB picture.")
    ] = False,
    resize: Annotated[
        bool, typer.Option("--resize", help="Resize LIGHT to the projector's size.")
    ] = False,
    error_bars: Annotated[
        bool,
        typer.Option(
            "--error-bars",
            help="Write the picture's standard deviation instead of the picture, infinite where "
            "the camera is saturated.",
        ),
    ] = False,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Relight the scene: what the camera would see under a light, without ambient light.

    Example: nearfar relight transport.zarr light.png relit.exr --srgb --gain near=2
    """
    from nearfar.files import (
        check_output,
        check_picture_ending,
        write_picture,
    )
    from nearfar.transport.colour import as_channels_see
    from nearfar.transport.stored import open_transport

    gains = _gains(gain or [])
    make = _relighting(gains, error_bars=error_bars)
    check_picture_ending(output)
    keep_input(output, transport, light)
    check_output(output, force=force)
    with progress_bar("relighting", quiet=quiet):
        require_reconstructed(transport)
        opened = open_transport(transport)
        warn_if_wrong(transport, opened.verdict)
        projected = _read(light, opened, srgb=srgb)
        given = Size(*projected.shape[:2])
        projected = (_resized if resize else _of_size)(projected, light, opened.projector)
        projected = as_channels_see(projected, opened.channels, opened.provenance)
        picture = make(opened, projected, gains)
        write_picture(output, picture, force=force, may_be_infinite=error_bars)
    if given != opened.projector:
        say(f"{light} of {given} was resized to {opened.projector}", quiet=quiet)
    what = "standard deviation of the relit picture" if error_bars else "relit picture"
    say(f"{what} of {opened.camera} written to {output}", quiet=quiet)
