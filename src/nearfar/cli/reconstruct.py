"""``nearfar reconstruct``."""

from collections.abc import Mapping
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from nearfar.arrays import Size, parse_bytes
from nearfar.cli.options import (
    CapturePath,
    Force,
    Quiet,
    ReportPath,
    Where,
    keep_for_page,
    keep_input,
)
from nearfar.cli.saying import say, warn
from nearfar.progress import progress_bar

if TYPE_CHECKING:
    from nearfar.capture import Capture
    from nearfar.correspondence import Correspondence
    from nearfar.transport.model import Transport


class Method(StrEnum):
    """How the transport is estimated."""

    JOINT = "joint"
    PAPER = "paper"


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
        typer.Option(
            help="Memory to work in, but for --square: blocks of camera rows that fit.",
            metavar="2GB",
        ),
    ] = "2GB",
    device: Annotated[
        Where, typer.Option(help="Where the estimate is made; cuda needs PyTorch.")
    ] = Where.CPU,
    half: Annotated[
        bool,
        typer.Option("--half", help="Keep windows and bands in float16: half the bytes."),
    ] = False,
    scheduler: Annotated[
        str | None,
        typer.Option(
            help="Dask scheduler whose workers do the work; they see both files by these names.",
            metavar="ADDRESS",
        ),
    ] = None,
    resume: Annotated[
        bool,
        typer.Option(
            "--resume", help="Go on with the blocks of a reconstruction that was stopped."
        ),
    ] = False,
    report: ReportPath = None,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Reconstruct direct, near-range and far-range transport from a capture.

    Example: nearfar reconstruct capture.zarr transport.zarr
    """
    from nearfar.capture import open_capture
    from nearfar.correspondence import read_correspondence
    from nearfar.files import check_output, check_resumable
    from nearfar.transport.store import save_transport
    from nearfar.workflow.reconstruct import reconstruct as rebuild
    from nearfar.workflow.resuming import reconstruct_into

    if square and scheduler is not None:
        raise typer.BadParameter("is not for --square.", param_hint="--scheduler")
    if square and half:
        raise typer.BadParameter("is not for --square.", param_hint="--half")
    if device is Where.CUDA and scheduler is not None:
        raise typer.BadParameter("is not for --scheduler.", param_hint="--device")
    available = parse_bytes(memory, name="--memory")
    keep_input(output, capture, *([correspondence] if correspondence else []))
    if report is not None:
        keep_for_page(
            report, capture, output, *([correspondence] if correspondence else []), force=force
        )
    if resume and (square or scheduler is not None):
        raise typer.BadParameter("is not for --square or --scheduler.", param_hint="--resume")
    if square or scheduler is not None:
        check_output(output, force=force)
    else:
        check_resumable(output, resume=resume, force=force)
    opened = open_capture(capture)
    given = None
    if correspondence is not None:
        given = read_correspondence(correspondence, opened.camera, opened.plan.projector)
    seen = Seen()
    with progress_bar("reconstructing", quiet=quiet) as told:
        if scheduler is not None:
            from nearfar.workflow.cluster import reconstruct_on

            done = reconstruct_on(
                scheduler,
                opened,
                output,
                given,
                method=method.value,
                memory=available,
                half=half,
                force=force,
                progress=told,
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
                progress=told,
            )
            seen.add(transport, found)
            save_transport(transport, output, force=force)
        else:
            made = reconstruct_into(
                output,
                opened,
                given,
                method=method.value,
                memory=available,
                device=device.value,
                half=half,
                resume=resume,
                force=force,
                progress=told,
            )
            seen.lit, seen.pixels, seen.provenance = made
            seen.camera = opened.camera
    seen.conclude(opened, output, quiet=quiet)
    if report is not None:
        _write_report(report, output, opened, force=force)
        say(f"report written to {report}", quiet=quiet)


def _write_report(report: Path, output: Path, capture: "Capture", *, force: bool) -> None:
    from nearfar.report.page import write_page
    from nearfar.report.reconstruction import reconstruction_page
    from nearfar.transport.store import open_transport

    write_page(report, reconstruction_page(open_transport(output), capture), force=force)


class Seen:
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

    def conclude(self, capture: "Capture", output: Path, *, quiet: bool) -> None:
        """Say what was made, and what is wrong with the photos."""
        from nearfar.faults.of_capture import find_faults

        for fault in find_faults(capture, self.provenance):
            warn(str(fault))
        say(
            f"transport of {self.camera} camera pixels with {capture.channels} "
            f"channel{'s' if capture.channels > 1 else ''}, "
            f"{self.lit / self.pixels:.1%} of the camera's directly lit, written to {output}",
            quiet=quiet,
        )
