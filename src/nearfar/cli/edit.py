"""``nearfar edit``."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import numpy as np
import typer

from nearfar.cli.lights import read_grey
from nearfar.cli.opening import load_reconstructed
from nearfar.cli.options import Force, Quiet, TransportPath, keep_input
from nearfar.cli.saying import say
from nearfar.progress import progress_bar

if TYPE_CHECKING:
    from nearfar.transport.model import Transport


def _colour(text: str) -> tuple[str, list[float]]:
    """Read COMPONENT=R,G,B; a single number is for all channels."""
    name, equals, values = text.partition("=")
    try:
        numbers = [float(value) for value in values.split(",")]
    except ValueError:
        numbers = []
    if not equals or not numbers or not np.isfinite(numbers).all():
        raise typer.BadParameter(
            f"{text!r} is no colour: write COMPONENT=R,G,B, such as near=1,0.8,0.6.",
            param_hint="--recolour",
        )
    return name, numbers


def _masks(text: str) -> tuple[Path, Path]:
    """Read CAMERA_MASK:PROJECTOR_MASK."""
    camera, colon, projector = text.rpartition(":")
    if not colon or not camera or not projector:
        raise typer.BadParameter(
            f"{text!r} are no two masks: write CAMERA_MASK:PROJECTOR_MASK.", param_hint="--cut-far"
        )
    return Path(camera), Path(projector)


def edit(
    transport: TransportPath,
    output: Annotated[Path, typer.Argument(metavar="OUT.zarr", help="Edited transport to make.")],
    widen: Annotated[
        float | None,
        typer.Option(
            metavar="FACTOR",
            help="Let light travel so many times as far under translucent surfaces; under 1 less "
            "far.",
        ),
    ] = None,
    recolour: Annotated[
        str | None,
        typer.Option(
            metavar="COMPONENT=R,G,B",
            help="Multiply direct, near, far or subsurface light by a factor for each channel.",
        ),
    ] = None,
    cut_far: Annotated[
        str | None,
        typer.Option(
            metavar="CAMERA_MASK:PROJECTOR_MASK",
            help="Cut far-range light from where the projector's mask is white to where the "
            "camera's is.",
        ),
    ] = None,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Change a transport: light under surfaces, a component's colour, light between regions.

    OUT.zarr is a transport as any other. It remembers that it was edited, and has no error bars.

    Example: nearfar edit transport.zarr waxen.zarr --widen 1.5
    """
    from nearfar.files import check_output
    from nearfar.transport.store import save_transport

    if sum(value is not None for value in (widen, recolour, cut_far)) != 1:
        raise typer.BadParameter("give one of --widen, --recolour and --cut-far.")
    colour = None if recolour is None else _colour(recolour)
    masks = None if cut_far is None else _masks(cut_far)
    keep_input(output, transport, *(masks or ()))
    check_output(output, force=force)
    with progress_bar("editing", quiet=quiet):
        opened = load_reconstructed(transport)
        edited, words = _edited(opened, widen, colour, masks)
        save_transport(edited, output, force=force)
    say(f"{words}\nedited transport written to {output}", quiet=quiet)


def _edited(
    transport: "Transport",
    widen: float | None,
    colour: tuple[str, list[float]] | None,
    masks: tuple[Path, Path] | None,
) -> "tuple[Transport, str]":
    """Return the edited transport, and what was done in words."""
    from nearfar.applications import editing

    if widen is not None:
        return (
            editing.widen_subsurface(transport, widen),
            f"light travels {widen:g} times as far under surfaces",
        )
    if colour is not None:
        name, numbers = colour
        each = numbers * transport.channels if len(numbers) == 1 else numbers
        return editing.recolour(transport, name, each), f"{name} light recoloured"
    assert masks is not None
    sizes = (transport.camera, transport.projector)
    cut = editing.cut_far(transport, *(read_grey(*pair) for pair in zip(masks, sizes, strict=True)))
    return cut.transport, (
        f"far-range light cut; {cut.error:.0%} off an exact cut at single projector pixels, as "
        f"far-range light has no sharp edges"
    )
