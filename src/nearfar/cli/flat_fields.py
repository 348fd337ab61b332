"""Options of flat fields, and what they name."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from nearfar.arrays import Size
from nearfar.cli.lights import read_grey
from nearfar.errors import InputError

if TYPE_CHECKING:
    from nearfar.arrays import Floats

CameraFlat = Annotated[
    Path | None,
    typer.Option(
        metavar="PICTURE",
        help="Flat field of the camera, which is divided out of dual views; linear.",
    ),
]
ProjectorFlat = Annotated[
    Path | None,
    typer.Option(
        metavar="PICTURE",
        help="Flat field of the projector, which is divided out of dual views; linear.",
    ),
]


def read_flat(path: Path | None, size: Size) -> "Floats | None":
    """Read a flat field of a size; None if none is given.

    Raises
    ------
    InputError
        If it has another size, or is black somewhere.
    """
    if path is None:
        return None
    flat = read_grey(path, size)
    if flat.min() <= 0:
        raise InputError(
            f"{path} is black somewhere, so that it is no flat field: give one that is bright "
            f"everywhere."
        )
    return flat
