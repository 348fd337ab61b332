"""``nearfar acquire``."""

import time
from collections.abc import Mapping
from contextlib import ExitStack
from functools import partial
from math import nan
from os.path import realpath
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from nearfar.arrays import parse_bytes
from nearfar.cli.acquire_together import Manner, acquire_projectors
from nearfar.cli.choices import choice
from nearfar.cli.flags import with_flags
from nearfar.cli.options import Force, NewCapture, PlanFile, Quiet, keep_input, scene_names
from nearfar.cli.other_projectors import OtherProjector, others_of
from nearfar.cli.reshoot import photo_numbers, take_again
from nearfar.cli.saying import (
    say,
    say_captured,
    say_memory,
    say_reconstructed,
    say_time,
    warn,
    warn_each,
)
from nearfar.devices import Device
from nearfar.errors import InputError
from nearfar.progress import Report, progress_bar
from nearfar.scenes import SCENES

if TYPE_CHECKING:
    from nearfar.capture import Capture
    from nearfar.plan import Plan
    from nearfar.rigs.base import Rig
    from nearfar.workflow.observers.estimate import EstimateObserver
    from nearfar.workflow.observers.quality import CaptureQuality, QualityObserver
    from nearfar.workflow.reconstruction.options import ReconstructionOptions

# No photo of a real camera reaches this SNR.
MAXIMUM_DECIBELS = 120.0
CURE_OF_LIMIT = {
    "noise": "Most of the error is the photos' noise: expose longer, or plan for more photos",
    "model": "Most of the error is light that direct, near and far do not hold as planned: plan "
    "with a larger --near, and look at edges and moving things in the scene",
    "photos": "Most of the error is at frequencies that were not measured: plan for more photos",
}


def decibels(text: str) -> float:
    """Read an SNR written 35dB or 35; another text is wrong usage."""
    try:
        value = float(text.strip().lower().removesuffix("db"))
    except ValueError:
        value = nan
    if not 0 < value < MAXIMUM_DECIBELS:
        raise typer.BadParameter(f"{text!r} is no SNR to reach: write it as 35dB.")
    return value


def acquire(
    plan_file: PlanFile,
    output: NewCapture,
    rig: Annotated[
        str,
        typer.Option(
            help=f"Scene ({', '.join(SCENES)}), Mitsuba 3 scene (.xml), stored transport (.npy, "
            ".npz, Zarr), or RIG.toml.",
            metavar="RIG",
            autocompletion=scene_names,
        ),
    ],
    other: Annotated[
        list[str] | None,
        typer.Option(
            "--and",
            help="Capture of a further projector before the same camera, and its rig; each "
            "projector is photographed while the others are dark.",
            metavar="CAPTURE.zarr=RIG",
        ),
    ] = None,
    shared: Annotated[
        Path | None,
        typer.Option(
            help="With --and, let projectors share photos where that lowers the noise, and keep "
            "these as they were taken here.",
            metavar="SHARED.zarr",
        ),
    ] = None,
    until: Annotated[
        float | None,
        typer.Option(
            help="Stop as soon as check photos, from which nothing is estimated, are relit this "
            "well.",
            metavar="35dB",
            parser=decibels,
        ),
    ] = None,
    transport: Annotated[
        Path | None,
        typer.Option(
            help="Make the transport too, by the joint method; part of the work is done while "
            "photos are taken.",
            metavar="TRANSPORT.zarr",
        ),
    ] = None,
    resume: Annotated[
        bool,
        typer.Option("--resume", help="Go on with the photos of a capture that was stopped."),
    ] = False,
    reshoot: Annotated[
        str | None,
        typer.Option(help="Take these photos of a finished capture again.", metavar="12,40-60"),
    ] = None,
    memory: Annotated[
        str | None, typer.Option(help="Memory for --transport.", metavar="2GB")
    ] = None,
    device: Annotated[
        Device | None,
        choice(("cpu", "cuda"), help="Where --transport is made; cuda needs PyTorch."),
    ] = None,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Shoot a plan on a real rig or a simulated one.

    Example: nearfar acquire plan.json capture.zarr --rig cornell --transport transport.zarr
    """
    from nearfar.capture.unfinished import RESUMABLE_CAPTURE, unfinished_capture
    from nearfar.files import check_resumable
    from nearfar.rigs.opening import open_rig
    from nearfar.workflow.acquire import acquire as shoot
    from nearfar.workflow.reconstruction.options import ReconstructionOptions

    given = {"--until": until, "--transport": transport, "--memory": memory, "--device": device}
    if others := others_of(other, "RIGHT.zarr=RIGHT.toml"):
        _refuse(given | {"--reshoot": reshoot}, "does not go with --and.")
        others.insert(0, OtherProjector(output, Path(rig)))
        acquire_projectors(plan_file, others, shared, Manner(resume, force, quiet))
        return
    _refuse({"--shared": shared}, "is for photos of several projectors, given by --and.")
    if reshoot is not None:
        _refuse(given | {"--resume": resume, "--force": force}, "does not go with --reshoot.")
        take_again(plan_file, output, rig, photo_numbers(reshoot), quiet=quiet)
        return
    if transport is None:
        _refuse({"--memory": memory, "--device": device}, "is for --transport.")
    options = ReconstructionOptions(memory=parse_bytes(memory or "2GB"), device=device or "cpu")
    made = _plan_to_shoot(plan_file, with_check_photos=until is not None)
    keep_input(output, plan_file, Path(rig))
    check_resumable(output, RESUMABLE_CAPTURE, resume=resume, force=force)
    if transport is not None:
        _check_transport(transport, output, plan_file, Path(rig), force=force)
    say_memory(rig, made.projector, quiet=quiet)
    with ExitStack() as stack:
        report = stack.enter_context(progress_bar("opening the rig", quiet=quiet))
        # A capture that is resumed keeps the exposure that it started with.
        before, exposure = unfinished_capture(output) if resume else (0, None)
        opened = open_rig(
            rig,
            made.projector,
            exposure=exposure,
            progress=report,
            on_alarm=warn,
            on_start=partial(say_time, len(made.patterns) - before, quiet=quiet),
        )
        stack.enter_context(opened)
        warn_each(opened.notes)
        check = None if until is None else _quality_observer(made, until, opened, quiet=quiet)
        estimate = None
        if transport is not None:
            estimate = stack.enter_context(_estimate_observer(made, opened, options))
        taken = shoot(
            made,
            output,
            opened,
            resume=resume,
            force=force,
            progress=report,
            observers=[each for each in (estimate, check) if each is not None],
            on_alarm=warn,
        )
        say_captured(taken, output, quiet=quiet)
        if estimate is not None and transport is not None:
            _finish(estimate, taken, transport, report, force=force, quiet=quiet)
    _say_exposure(opened, quiet=quiet)
    if until is not None and check is not None and check.quality is not None:
        _say_what_limits(check.quality, until, made, quiet=quiet)


def _plan_to_shoot(plan_file: Path, *, with_check_photos: bool) -> "Plan":
    """Read a plan that can be shot, and add photos to check by if they are asked for."""
    from nearfar.plan import read_plan
    from nearfar.plan.checks import with_checks

    made = read_plan(plan_file)
    made.require_real("shoot")
    return with_checks(made) if with_check_photos else made


# Estimates take long to import, and most captures are made without them.
def _quality_observer(made: "Plan", until: float, rig: "Rig", *, quiet: bool) -> "QualityObserver":
    """Return what stops a capture as soon as it is good enough."""
    from nearfar.workflow.observers.quality import QualityObserver

    return QualityObserver(made, until, rig.full_scale, partial(_say_quality, quiet=quiet))


def _estimate_observer(
    made: "Plan", rig: "Rig", options: "ReconstructionOptions"
) -> "EstimateObserver":
    """Return what estimates the transport while photos are taken."""
    from nearfar.workflow.observers.estimate import EstimateObserver

    return EstimateObserver(made, rig.full_scale, options)


def _finish(
    estimate: "EstimateObserver",
    taken: "Capture",
    transport: Path,
    report: Report,
    *,
    force: bool,
    quiet: bool,
) -> None:
    """Make and write the transport, most of whose work was done while photos were taken."""
    from nearfar.workflow.reconstruction.executors import SerialExecutor, execute
    from nearfar.workflow.reconstruction.sinks import new_file
    from nearfar.workflow.verdict.keeping import judge_transport

    start = time.monotonic()
    work = estimate.finish(taken)
    with new_file(transport, work.tiling, force=force) as sink:
        summary = execute(work, SerialExecutor(), sink, report)
    say_reconstructed(summary, taken, transport, quiet=quiet)
    say(f"{time.monotonic() - start:.1f} s after the last photo", quiet=quiet)
    say(str(judge_transport(transport, taken, progress=report)), quiet=quiet)


def _say_exposure(rig: "Rig", *, quiet: bool) -> None:
    """Print the factor from a simulated scene's transport to that of the photos, if not 1."""
    from nearfar.rigs.simulated.rig import SimulatedRig

    if isinstance(rig, SimulatedRig) and rig.exposure != 1.0:
        say(f"transport of {rig.name} exposed by {rig.exposure:.6g}", quiet=quiet)


def _refuse(given: Mapping[str, object], why: str) -> None:
    """Refuse options that mean nothing beside the others."""
    for name, value in given.items():
        if value:
            raise typer.BadParameter(why, param_hint=name)


def _check_transport(transport: Path, capture: Path, *inputs: Path, force: bool) -> None:
    """Refuse, before a photo is taken, a transport that could not be written."""
    from nearfar.files import check_output

    keep_input(transport, *inputs)
    if realpath(transport) == realpath(capture):
        raise InputError(
            f"{capture} cannot be both capture and transport: choose another name for one."
        )
    check_output(transport, force=force)


def _say_quality(quality: "CaptureQuality", *, quiet: bool) -> None:
    if quality.fault is not None:
        text = with_flags(quality.fault)
    elif quality.snr > 0:
        text = f"{quality.snr:.1f} dB under pictures to check by"
    else:
        text = "too few to relight by"
    say(f"after {quality.photos} photos: {text}", quiet=quiet)


def _say_what_limits(
    quality: "CaptureQuality", target: float, plan: "Plan", *, quiet: bool
) -> None:
    """Print whether a capture reached what it was to reach, beside what was to be hoped for."""
    from nearfar.transport.verdict import beside_held_out

    # The plan was chosen for what all of its photos reach, and a capture may end before.
    every = len(plan.patterns)
    beside = beside_held_out(
        quality.expected_snr,
        None if (planned := plan.expected_snr) is None else planned.pictures,
        quality.noise_snr,
        photos_planned=every if quality.photos < every else None,
    )
    if quality.snr >= target:
        found = ", ".join([f"{quality.snr:.1f} dB under pictures to check by", *beside])
        say(f"{target:g} dB is reached after {quality.photos} photos: {found}", quiet=quiet)
        return
    if quality.fault is not None:
        warn(f"{target:g} dB could not be checked to the end: {quality.fault}")
        return
    warn(
        f"{target:g} dB is not reached: all {quality.photos} photos relight pictures at "
        f"{', '.join([f'{quality.snr:.1f} dB', *beside])}. {CURE_OF_LIMIT[quality.limit]}."
    )
