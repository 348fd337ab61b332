"""``nearfar reconstruct``."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, cast

import typer

from nearfar.arrays import parse_bytes
from nearfar.cli.choices import choice
from nearfar.cli.command_line import command_line
from nearfar.cli.flags import with_flags
from nearfar.cli.options import (
    AsJson,
    CapturePath,
    Force,
    NoFar,
    NoNear,
    Quiet,
    ReportPath,
    both_ranges_left_out,
    check_report_page,
    keep_input,
)
from nearfar.cli.saying import say, say_reconstructed, warn
from nearfar.progress import progress_bar

if TYPE_CHECKING:
    from nearfar.capture import Capture
    from nearfar.devices import Device
    from nearfar.workflow.verdict.verdict import Verdict


def reconstruct(
    capture: CapturePath,
    output: Annotated[Path, typer.Argument(metavar="TRANSPORT.zarr", help="Transport to make.")],
    method: Annotated[
        str,
        choice(
            "nearfar.estimate.base:ESTIMATORS",
            help="All in one model with what is known of light, or as the paper does.",
        ),
    ] = "joint",
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
    no_near: NoNear = False,
    no_far: NoFar = False,
    memory: Annotated[
        str,
        typer.Option(
            help="Memory to work in: tiles of camera rows that fit.",
            metavar="2GB",
        ),
    ] = "2GB",
    device: Annotated[
        str,
        choice(("cpu", "cuda"), help="Where the estimate is made; cuda needs PyTorch."),
    ] = "cpu",
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
        typer.Option("--resume", help="Go on with the tiles of a reconstruction that was stopped."),
    ] = False,
    report: ReportPath = None,
    as_json: AsJson = False,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Reconstruct direct, near-range and far-range transport from a capture.

    Example: nearfar reconstruct capture.zarr transport.zarr
    """
    from nearfar.capture import open_capture
    from nearfar.correspondence import read_correspondence
    from nearfar.files import check_resumable
    from nearfar.workflow.reconstruction.options import ReconstructionOptions
    from nearfar.workflow.reconstruction.reconstruct import reconstruct_to_file
    from nearfar.workflow.reconstruction.sinks import RESUMABLE_TRANSPORT
    from nearfar.workflow.verdict.keeping import judge_transport

    if device == "cuda" and scheduler is not None:
        raise typer.BadParameter("is not for --scheduler.", param_hint="--device")
    available = parse_bytes(memory)
    inputs = [capture, *([correspondence] if correspondence else [])]
    keep_input(output, *inputs)
    if report is not None:
        check_report_page(report, output, *inputs, force=force)
    check_resumable(output, RESUMABLE_TRANSPORT, resume=resume, force=force)
    opened = open_capture(capture)
    is_free = both_ranges_left_out(no_near=no_near, no_far=no_far)
    if is_free or opened.plan.offset == "shown":
        refused = {"--method": method != "joint", "--square": square, "--resume": resume}
        refused |= {"--half": half, "--scheduler": scheduler is not None}
        (_free_rows if is_free else _from_patterns)(
            opened,
            output,
            correspondence,
            available,
            refused,
            as_json=as_json,
            force=force,
            report=report,
            quiet=quiet,
        )
        return
    given = None
    if correspondence is not None:
        given = read_correspondence(correspondence, opened.camera, opened.plan.projector)
    options = ReconstructionOptions(method, square, available, cast("Device", device), half)
    quiet = quiet or as_json
    with progress_bar("reconstructing", quiet=quiet) as progress:
        summary = reconstruct_to_file(
            opened,
            output,
            given,
            options,
            scheduler=scheduler,
            resume=resume,
            force=force,
            progress=progress,
        )
        verdict = judge_transport(output, opened, progress=progress)
    say_reconstructed(summary, opened, output, quiet=quiet)
    if report is not None:
        _write_report(
            report, output, opened, verdict, given=given is not None, force=force, quiet=quiet
        )
        say(f"report written to {report}", quiet=quiet)
    if as_json:
        print(json.dumps(verdict.as_json()))
    say(str(verdict), quiet=quiet)


def _free_rows(
    capture: "Capture",
    output: Path,
    correspondence: Path | None,
    memory: int,
    refused: dict[str, bool],
    *,
    as_json: bool,
    force: bool,
    report: Path | None,
    quiet: bool,
) -> None:
    """Reconstruct free rows: lamps without a neighbourhood."""
    from nearfar.correspondence import read_correspondence
    from nearfar.workflow.free_rows import reconstruct_free_rows_to_file

    for option, is_given in {**refused, "--report": report is not None}.items():
        if is_given:
            raise typer.BadParameter("is not for --no-near --no-far.", param_hint=option)
    given = None
    if correspondence is not None:
        given = read_correspondence(correspondence, capture.camera, capture.plan.projector)
    with progress_bar("reconstructing", quiet=quiet or as_json) as progress:
        verdict, has_black = reconstruct_free_rows_to_file(
            capture, output, given, memory=memory, force=force, progress=progress
        )
    if not has_black:
        warn(
            f"{capture.path} has no photo under black, so that black was taken as 0: what is black "
            f"in the photos stands in T as light."
        )
    say(
        f"transport of {capture.camera} camera pixels and {capture.plan.projector.pixels} lamps "
        f"written to {output}",
        quiet=quiet or as_json,
    )
    if as_json:
        print(json.dumps(verdict.as_json()))
    say(str(verdict), quiet=quiet or as_json)


def _from_patterns(
    capture: "Capture",
    output: Path,
    correspondence: Path | None,
    memory: int,
    refused: dict[str, bool],
    *,
    as_json: bool,
    force: bool,
    report: Path | None,
    quiet: bool,
) -> None:
    """Reconstruct from photos of anybody's patterns."""
    from nearfar.correspondence import read_correspondence
    from nearfar.transport.store import save_transport
    from nearfar.workflow.from_patterns import reconstruct_from_patterns
    from nearfar.workflow.pattern_faults import find_turns

    for option, is_given in refused.items():
        if is_given:
            raise typer.BadParameter("is for photos of a plan.", param_hint=option)
    if report is not None:
        raise typer.BadParameter(
            "is for photos of a plan: nearfar info says the verdict, and nearfar view shows maps "
            "and error bars.",
            param_hint="--report",
        )
    if output.suffix.lower() == ".npy":
        _invert(capture, output, force=force, quiet=quiet or as_json)
        return
    given = None
    if correspondence is not None:
        given = read_correspondence(correspondence, capture.camera, capture.plan.projector)
    with progress_bar("reconstructing", quiet=quiet or as_json) as progress:
        transport = reconstruct_from_patterns(capture, given, memory=memory, progress=progress)
    save_transport(transport, output, force=force)
    for fault in find_turns(transport.correspondence):
        warn(fault)
    verdict = transport.verdict
    assert verdict is not None
    say(
        f"transport of {capture.camera} camera pixels, {transport.lit.mean():.1%} directly lit, "
        f"written to {output}",
        quiet=quiet or as_json,
    )
    if as_json:
        print(json.dumps(verdict.as_json()))
    say(str(verdict), quiet=quiet or as_json)


def _invert(capture: "Capture", output: Path, *, force: bool, quiet: bool) -> None:
    """Write the dense T of a complete set of patterns."""
    from nearfar.workflow.complete_sets import write_complete

    with progress_bar("inverting", quiet=quiet) as progress:
        found = write_complete(capture, output, force=force, progress=progress)
    if not found.has_black:
        warn(
            f"{capture.path} has no photo under black, so that black was taken as 0: what is black "
            f"in the photos stands in T as light."
        )
    say(
        f"T of {' x '.join(map(str, found.shape))} written to {output}: least squares, without any "
        f"prior. An entry's noise is {found.noise_gain:.3g} times that of a photo's pixel",
        quiet=quiet,
    )


def _write_report(
    report: Path,
    output: Path,
    capture: "Capture",
    verdict: "Verdict",
    *,
    given: bool,
    force: bool,
    quiet: bool,
) -> None:
    from nearfar.report.page import write_page
    from nearfar.report.reconstruction import reconstruction_page
    from nearfar.transport.stored import open_transport
    from nearfar.workflow.diagnosis.misfit_maps import measure_misfit

    transport = open_transport(output)
    misfit = verdict.misfit
    if misfit is None:
        with progress_bar("reporting", quiet=quiet) as progress:
            misfit = measure_misfit(transport, capture, progress)
    text = reconstruction_page(
        transport,
        capture,
        verdict,
        with_flags,
        misfit=misfit,
        correspondence_given=given,
        command=command_line(),
    )
    write_page(report, text, force=force)
