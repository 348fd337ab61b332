"""``nearfar reconstruct``."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NamedTuple, cast

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
    from nearfar.correspondence import Correspondence
    from nearfar.devices import Device
    from nearfar.transport.verdict import KeptVerdict
    from nearfar.workflow.reconstruction.options import ReconstructionOptions
    from nearfar.workflow.verdict.checked import Judged
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
    from nearfar.workflow.reconstruction.sinks import RESUMABLE_TRANSPORT

    if device == "cuda" and scheduler is not None:
        raise typer.BadParameter("is not for --scheduler.", param_hint="--device")
    options = ReconstructionOptions(
        method, square, parse_bytes(memory), cast("Device", device), half
    )
    outputs = _Outputs(output, report, as_json=as_json, force=force, quiet=quiet or as_json)
    inputs = [capture, *([correspondence] if correspondence else [])]
    keep_input(output, *inputs)
    if report is not None:
        check_report_page(report, output, *inputs, force=force)
    check_resumable(output, RESUMABLE_TRANSPORT, resume=resume, force=force)
    opened = open_capture(capture)
    is_free = both_ranges_left_out(no_near=no_near, no_far=no_far)
    is_shown = opened.plan.offset == "shown"
    if is_free or is_shown:
        _refuse(
            "is not for --no-near --no-far." if is_free else "is for photos of a plan.",
            {
                "--method": method != "joint",
                "--square": square,
                "--resume": resume,
                "--half": half,
                "--scheduler": scheduler is not None,
            },
        )
    if is_shown and not is_free and output.suffix.lower() == ".npy":
        unused = {"--correspondence": correspondence is not None, "--report": report is not None}
        _refuse("is not for a .npy, which is inverted without q: choose a .zarr.", unused)
        _invert(opened, outputs)
        return
    given = None
    if correspondence is not None:
        given = read_correspondence(correspondence, opened.camera, opened.plan.projector)
    if is_free or is_shown:
        _of_any_patterns(opened, given, options.memory, outputs, is_free=is_free)
    else:
        _of_plan(opened, given, options, scheduler, outputs, resume=resume)


class _Outputs(NamedTuple):
    """Where the results go, and how they are told."""

    transport: Path
    report: Path | None
    as_json: bool
    force: bool
    quiet: bool

    def write_report(self, page: str) -> None:
        """Write the report, if it is wanted."""
        from nearfar.report.page import write_page

        if self.report is not None:
            write_page(self.report, page, force=self.force)
            say(f"report written to {self.report}", quiet=self.quiet)

    def tell(self, verdict: "KeptVerdict") -> None:
        """Print the verdict."""
        if self.as_json:
            print(json.dumps(verdict.as_json()))
        say(str(verdict), quiet=self.quiet)


def _refuse(why: str, options: dict[str, bool]) -> None:
    """Refuse options that were given although they do not apply."""
    for option, is_given in options.items():
        if is_given:
            raise typer.BadParameter(why, param_hint=option)


def _of_plan(
    capture: "Capture",
    given: "Correspondence | None",
    options: "ReconstructionOptions",
    scheduler: str | None,
    outputs: _Outputs,
    *,
    resume: bool,
) -> None:
    """Reconstruct from photos of a plan."""
    from nearfar.workflow.reconstruction.reconstruct import reconstruct_to_file
    from nearfar.workflow.verdict.keeping import judge_transport

    with progress_bar("reconstructing", quiet=outputs.quiet) as progress:
        summary = reconstruct_to_file(
            capture,
            outputs.transport,
            given,
            options,
            scheduler=scheduler,
            resume=resume,
            force=outputs.force,
            progress=progress,
        )
    say_reconstructed(summary, capture, outputs.transport, quiet=outputs.quiet)
    with progress_bar("judging", quiet=outputs.quiet) as progress:
        verdict = judge_transport(outputs.transport, capture, progress=progress)
    if outputs.report is not None:
        outputs.write_report(_page_of_plan(capture, verdict, outputs, given=given is not None))
    outputs.tell(verdict.kept)


def _of_any_patterns(
    capture: "Capture",
    given: "Correspondence | None",
    memory: int,
    outputs: _Outputs,
    *,
    is_free: bool,
) -> None:
    """Reconstruct free rows, or from photos of anybody's patterns."""
    from nearfar.workflow.free_rows import reconstruct_free_rows_to_file
    from nearfar.workflow.from_patterns import reconstruct_from_patterns_to_file

    reconstruct = reconstruct_free_rows_to_file if is_free else reconstruct_from_patterns_to_file
    with progress_bar("reconstructing", quiet=outputs.quiet) as progress:
        found = reconstruct(
            capture,
            outputs.transport,
            given,
            memory=memory,
            force=outputs.force,
            progress=progress,
        )
    for warning in found.warnings:
        warn(warning)
    say(f"transport of {found.described}, written to {outputs.transport}", quiet=outputs.quiet)
    if outputs.report is not None:
        outputs.write_report(
            _page_of_any_patterns(capture, found.judged, outputs, given=given is not None)
        )
    outputs.tell(found.judged.verdict)


def _invert(capture: "Capture", outputs: _Outputs) -> None:
    """Write the dense T of a complete set of patterns."""
    from nearfar.workflow.complete_sets import write_complete
    from nearfar.workflow.free_rows import black_taken_as_0

    with progress_bar("inverting", quiet=outputs.quiet) as progress:
        found = write_complete(capture, outputs.transport, force=outputs.force, progress=progress)
    if not found.has_black:
        warn(black_taken_as_0(capture))
    say(
        f"T of {' x '.join(map(str, found.shape))} written to {outputs.transport}: least squares, "
        f"without any prior. An entry's noise is {found.noise_gain:.3g} times that of a photo's "
        f"pixel",
        quiet=outputs.quiet,
    )


def _page_of_plan(capture: "Capture", verdict: "Verdict", outputs: _Outputs, *, given: bool) -> str:
    from nearfar.report.reconstruction import reconstruction_page
    from nearfar.transport.stored import open_transport
    from nearfar.workflow.diagnosis.misfit_maps import measure_misfit

    transport = open_transport(outputs.transport)
    misfit = verdict.misfit
    if misfit is None:
        with progress_bar("reporting", quiet=outputs.quiet) as progress:
            misfit = measure_misfit(transport, capture, progress)
    return reconstruction_page(
        transport,
        capture,
        verdict,
        with_flags,
        misfit=misfit,
        correspondence_given=given,
        command=command_line(),
    )


def _page_of_any_patterns(
    capture: "Capture", judged: "Judged", outputs: _Outputs, *, given: bool
) -> str:
    from nearfar.report.any_patterns import any_patterns_page
    from nearfar.transport.stored import open_transport

    with progress_bar("reporting", quiet=outputs.quiet) as progress:
        return any_patterns_page(
            open_transport(outputs.transport),
            capture,
            judged,
            with_flags,
            correspondence_given=given,
            command=command_line(),
            progress=progress,
        )
