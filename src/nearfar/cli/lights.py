"""Lights that commands project."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from nearfar.arrays import Size
from nearfar.cli.saying import say
from nearfar.errors import InputError

if TYPE_CHECKING:
    from nearfar.arrays import Floats
    from nearfar.capture import Capture
    from nearfar.transport.stored import StoredTransport

Srgb = Annotated[bool, typer.Option("--srgb", help="LIGHT is an ordinary sRGB picture.")]
Resize = Annotated[bool, typer.Option("--resize", help="Resize LIGHT to the projector's size.")]


def read_light_for(
    transport: "StoredTransport", path: Path, *, srgb: bool, resize: bool
) -> "tuple[Floats, Size]":
    """Read a light as the channels of a transport see it, and the size that its file has.

    Raises
    ------
    InputError
        If it has another size than the projector and is not to be resized.
    """
    from nearfar.transport.colour import as_channels_see

    light = _read(path, transport, srgb=srgb)
    given = Size(*light.shape[:2])
    light = (_resized if resize else _of_size)(light, path, transport.projector)
    return as_channels_see(light, transport.channels, transport.provenance), given


def require_light(light: Path | None, *, srgb: bool, resize: bool) -> None:
    """Refuse --srgb and --resize without --light."""
    if light is None and (srgb or resize):
        raise typer.BadParameter(
            "goes with --light only.", param_hint="--srgb" if srgb else "--resize"
        )


def light_or_white(
    transport: "StoredTransport", path: Path | None, *, srgb: bool, resize: bool
) -> "tuple[Floats, Size]":
    """Read a light as `read_light_for` does; white where none is named."""
    from nearfar.illumination.pictures import white

    if path is None:
        return white(transport.projector), transport.projector
    return read_light_for(transport, path, srgb=srgb, resize=resize)


def read_light_for_capture(
    capture: "Capture", path: Path, *, srgb: bool, resize: bool
) -> "tuple[Floats, Size]":
    """Read a light as the channels of a capture's camera see it, and the size that its file has.

    Raises
    ------
    InputError
        If it has another size than the projector and is not to be resized.
    """
    from nearfar.files import read_light_of_any_size
    from nearfar.transport.colour import as_channels_see

    light = read_light_of_any_size(path, srgb=srgb)
    given = Size(*light.shape[:2])
    light = (_resized if resize else _of_size)(light, path, capture.plan.projector)
    return as_channels_see(light, capture.channels, {"rig": capture.rig}), given


def read_camera_picture(path: Path, camera: Size, channels: int, *, srgb: bool) -> "Floats":
    """Read a picture of the camera's size; grey of a colour picture for a camera of one channel.

    Raises
    ------
    InputError
        If it has another size.
    """
    import numpy as np

    from nearfar.files import luminance, read_light_of_any_size

    picture = read_light_of_any_size(path, srgb=srgb)
    if picture.shape[:2] != camera:
        raise InputError(
            f"{path} is {Size(*picture.shape[:2])} but the camera is {camera} (height x width): "
            f"give a picture of {camera}."
        )
    return np.asarray(luminance(picture) if picture.ndim == 3 and channels == 1 else picture)


def read_grey(path: Path, size: Size) -> "Floats":
    """Read a linear picture of a size as grey.

    Raises
    ------
    InputError
        If it has another size.
    """
    import numpy as np

    from nearfar.files import luminance, read_light_of_any_size

    picture = read_light_of_any_size(path, srgb=False)
    if picture.shape[:2] != size:
        raise InputError(
            f"{path} is {Size(*picture.shape[:2])}: give a picture of {size} (height x width)."
        )
    return np.asarray(luminance(picture) if picture.ndim == 3 else picture)


def say_resized(path: Path, given: Size, projector: Size, *, quiet: bool) -> None:
    """Print that a light was resized, if it was."""
    if given != projector:
        say(f"{path} of {given} was resized to {projector}", quiet=quiet)


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
