"""``nearfar reconstruct``, ``nearfar relight`` and ``nearfar convert``."""

from collections.abc import Mapping
from enum import StrEnum
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from nearfar.arrays import Size, parse_bytes
from nearfar.cli.options import CapturePath, Force, Quiet, TransportPath, keep_input
from nearfar.cli.progress import SATURATED, progress_bar, say, warn
from nearfar.errors import InputError

if TYPE_CHECKING:
    from nearfar.capture import Capture
    from nearfar.correspondence import Correspondence
    from nearfar.transport.model import Transport

# Lamp or ambient light that changed by more than this share of the lamp's is worth a warning.
DRIFT = 0.05
# Pairs that sum to more or less than white and black by this share of white are worth a warning.
NOT_LINEAR = 0.01


class Method(StrEnum):
    """How the transport is estimated."""

    JOINT = "joint"
    PAPER = "paper"


class Where(StrEnum):
    """Where the work is done."""

    CPU = "cpu"
    CUDA = "cuda"


def reconstruct(
    capture: CapturePath,
    output: Annotated[Path, typer.Argument(metavar="TRANSPORT.zarr", help="Transport to make.")],
    method: Annotated[
        Method,
        typer.Option(help="All in one model with what is known of light, or as the paper does."),
    ] = Method.JOINT,
    correspondence: Annotated[
        Path | None,
        typer.Option(
            help="q as a .npy of H x W x 2, (y, x), NaN without direct light; from the photos "
            "otherwise.",
            metavar="Q.npy",
        ),
    ] = None,
    square: Annotated[
        bool,
        typer.Option(
            "--square", help="Average the camera pixels of each projector pixel: the paper's T."
        ),
    ] = False,
    memory: Annotated[
        str,
        typer.Option(help="Memory to work in, but for --square: blocks of camera rows that fit."),
    ] = "2GB",
    device: Annotated[
        Where, typer.Option(help="Where the joint estimate is made; cuda needs PyTorch.")
    ] = Where.CPU,
    scheduler: Annotated[
        str | None,
        typer.Option(
            help="Dask scheduler whose workers do the work; they see both files by these names.",
            metavar="ADDRESS",
        ),
    ] = None,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Reconstruct direct, near-range and far-range transport from a capture.

    Example: nearfar reconstruct capture.zarr transport.zarr
    """
    from nearfar.capture import open_capture
    from nearfar.correspondence import read_correspondence
    from nearfar.files import check_output
    from nearfar.transport.store import save_transport, write_transport
    from nearfar.workflow.reconstruct import reconstruct as rebuild
    from nearfar.workflow.reconstruct import reconstruct_in_blocks

    if square and scheduler is not None:
        raise typer.BadParameter("is not for --square.", param_hint="--scheduler")
    if device is Where.CUDA and scheduler is not None:
        raise typer.BadParameter("is not for --scheduler.", param_hint="--device")
    available = parse_bytes(memory, name="--memory")
    keep_input(output, capture, *([correspondence] if correspondence else []))
    check_output(output, force=force)
    opened = open_capture(capture)
    given = None
    if correspondence is not None:
        given = read_correspondence(correspondence, opened.camera, opened.plan.projector)
    seen = _Seen()
    with progress_bar("reconstructing", quiet=quiet) as report:
        if scheduler is not None:
            from nearfar.workflow.cluster import reconstruct_on

            done = reconstruct_on(
                scheduler,
                opened,
                output,
                given,
                method=method.value,
                memory=available,
                force=force,
                progress=report,
            )
            seen.lit, seen.pixels, seen.provenance = done
            seen.camera = opened.camera
        elif square:
            transport, found = rebuild(
                opened,
                given,
                method=method.value,
                square=True,
                device=device.value,
                progress=report,
            )
            seen.add(transport, found)
            save_transport(output, transport, force=force)
        else:
            parts = reconstruct_in_blocks(
                opened,
                given,
                method=method.value,
                memory=available,
                device=device.value,
                progress=report,
            )
            transports = (seen.add(*part) for part in parts)
            write_transport(output, transports, opened.camera.height, force=force)
    _warn_of_faults(opened, seen.provenance)
    say(
        f"transport of {seen.camera} camera pixels with {opened.channels} "
        f"channel{'s' if opened.channels > 1 else ''}, "
        f"{seen.lit / seen.pixels:.1%} of the camera's directly lit, written to {output}",
        quiet=quiet,
    )


class _Seen:
    """What is said of a transport that goes by in blocks."""

    def __init__(self) -> None:
        self.provenance: Mapping[str, Any] = {}
        self.camera, self.lit, self.pixels = Size(0, 0), 0, 0

    def add(self, transport: "Transport", correspondence: "Correspondence") -> "Transport":
        """Take note of a block, and hand its transport on."""
        self.provenance = transport.provenance
        camera = transport.camera
        self.camera = Size(self.camera.height + camera.height, camera.width)
        self.lit += int(correspondence.lit.sum())
        self.pixels += correspondence.lit.size
        return transport


COMPONENTS = ("direct", "near", "far")


def _warn_of_faults(capture: "Capture", provenance: Mapping[str, Any]) -> None:
    """Say what the photos themselves tell of a rig that is not linear or not steady."""
    excess = float(provenance["excess_of_sums"])
    if abs(excess) > NOT_LINEAR:
        warn(
            f"in {capture.path} a pattern and its inverse sum to {abs(excess):.1%} "
            f"{'more' if excess > 0 else 'less'} than white and black: projector or camera is not "
            f"linear, or the lamp drifts; relighting will be wrong by about as much."
        )
    drift = provenance["drift"]
    if drift is not None and max(drift.values()) > DRIFT:
        warn(
            f"in {capture.path} the lamp changed by {drift['lamp']:.1%}, and ambient light by "
            f"{drift['ambient']:.1%} of white: both were followed by the references and taken out, "
            f"but what changes between two of them is not seen."
        )
    if capture.saturated_share > SATURATED:
        warn(
            f"{capture.saturated_share:.2%} of the values in {capture.path} are saturated: their "
            f"camera pixels will be wrong."
        )


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
        if name not in COMPONENTS or not isfinite(number):
            raise typer.BadParameter(
                f"{text!r} is no gain: write direct=1, near=2 or far=0, one per --gain.",
                param_hint="--gain",
            )
        gains[name] = number
    return gains


def relight(
    transport: TransportPath,
    light: Annotated[Path, typer.Argument(metavar="LIGHT", help="Light, the projector's size.")],
    output: Annotated[Path, typer.Argument(metavar="OUT", help=".npy, .exr, .tiff or .png.")],
    gain: Annotated[
        list[str] | None,
        typer.Option(help="Gain of a component: direct=1, near=2, far=0.", metavar="NAME=VALUE"),
    ] = None,
    srgb: Annotated[
        bool, typer.Option("--srgb", help="LIGHT is an ordinary sRGB picture.")
    ] = False,
    error_bars: Annotated[
        bool,
        typer.Option(
            "--error-bars", help="Write the picture's standard deviation instead of the picture."
        ),
    ] = False,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Relight the scene under a light: what the camera would see, ambient light apart.

    Example: nearfar relight transport.zarr light.png relit.exr --srgb --gain near=2
    """
    import numpy as np

    from nearfar.estimate.joint import ErrorBars
    from nearfar.files import (
        check_output,
        check_picture_ending,
        luminance,
        read_light,
        write_picture,
    )
    from nearfar.transport.store import load_transport

    gains = _gains(gain or [])
    check_picture_ending(output)
    keep_input(output, transport, light)
    check_output(output, force=force)
    with progress_bar("relighting", quiet=quiet):
        opened = load_transport(transport)
        shown = read_light(light, opened.projector, srgb=srgb)
        if shown.ndim == 3 and opened.channels == 1:
            shown = luminance(shown)
        if error_bars:
            picture = ErrorBars(opened).picture(shown, **gains)
        else:
            picture = opened.relight(shown, **gains)
        write_picture(output, picture.astype(np.float32), force=force)
    what = "standard deviation of the relit picture" if error_bars else "relit picture"
    say(f"{what} of {opened.camera} written to {output}", quiet=quiet)


def convert(
    transport: TransportPath,
    output: Annotated[Path, typer.Argument(metavar="OUT.npy", help="Array to write.")],
    correspondence: Annotated[
        bool,
        typer.Option("--correspondence", help="Write q, H x W x 2, instead of the dense T."),
    ] = False,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Write a transport as a dense array T, (C, P) or (C, P, channels), or its correspondence.

    Example: nearfar convert transport.zarr T.npy
    """
    import numpy as np

    from nearfar.files import check_output, new_output
    from nearfar.transport.store import load_transport

    if output.suffix.lower() != ".npy":
        raise InputError(f"{output} does not end in .npy: choose a name that does.")
    keep_input(output, transport)
    check_output(output, force=force)
    with progress_bar("converting", quiet=quiet):
        opened = load_transport(transport)
        if correspondence:
            array, what = opened.correspondence, "correspondence"
        else:
            array, what = np.moveaxis(opened.dense(), 1, 2), "dense transport"
            array = array[..., 0] if opened.channels == 1 else array
        array = np.ascontiguousarray(array)
        with new_output(output, force=force) as partial, partial.open("wb") as file:
            header = np.lib.format.header_data_from_array_1_0(array)
            np.lib.format.write_array_header_1_0(file, header)
            # numpy's own writing does not tell a full disk from other faults.
            file.write(array.data)
    shape = " x ".join(map(str, array.shape))
    say(f"{what}, {shape} {array.dtype}, written to {output}", quiet=quiet)
