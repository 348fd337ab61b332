"""``nearfar acquire --and``: a capture for each of several projectors before one camera."""

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from nearfar.cli.opening import check_rig
from nearfar.cli.options import keep_apart, keep_input
from nearfar.cli.other_projectors import OtherProjector
from nearfar.cli.saying import say, say_captured, say_time, warn, warn_each
from nearfar.progress import Report, progress_bar

# What shared photos must gain: what is said is up to 0.9 dB more than relighting gains, and a lamp
# that drifts spoils the photos of all projectors that share them.
LEAST_GAIN_DECIBELS = 1.0

if TYPE_CHECKING:
    from nearfar.capture import Capture
    from nearfar.plan import Plan
    from nearfar.rigs.real.rig import RealRig
    from nearfar.rigs.simulated.rig import SimulatedRig


class Projector(NamedTuple):
    """A projector: the capture to make, and its rig."""

    output: Path
    rig: str


class Manner(NamedTuple):
    """How captures are made: resumed, replaced, in silence."""

    resume: bool
    force: bool
    quiet: bool


def acquire_projectors(
    plan_file: Path, given: list[OtherProjector], shared: Path | None, manner: Manner
) -> None:
    """Shoot a plan by several projectors: in turn, or at once where that is worth it."""
    from nearfar.plan import read_plan

    projectors = [Projector(each.path, str(each.beside)) for each in given]
    made = read_plan(plan_file)
    made.require_real("shoot")
    outputs = [each.output for each in projectors] + ([] if shared is None else [shared])
    keep_apart(outputs)
    for output in outputs:
        keep_input(output, plan_file, *(Path(each.rig) for each in projectors))
    for each in projectors:
        _check(each, manner)
    with progress_bar("opening the rig", quiet=manner.quiet) as report:
        if shared is None or not _share(made, projectors, shared, manner, report):
            for each in projectors:
                _shoot_alone(made, each, manner, report)
            _warn_of_exposures([each.output for each in projectors])


def _check(projector: Projector, manner: Manner) -> None:
    """Check, before the photos of any projector, that its rig is there and its capture is not."""
    from nearfar.capture.unfinished import RESUMABLE_CAPTURE
    from nearfar.files import check_resumable

    check_rig(projector.rig)
    begun = manner.resume and _unfinished(projector.output).exists()
    if begun or not (manner.resume and projector.output.exists()):
        check_resumable(projector.output, RESUMABLE_CAPTURE, resume=begun, force=manner.force)


def _shoot_alone(made: "Plan", projector: Projector, manner: Manner, report: Report) -> None:
    """Shoot a plan by one projector; a capture that is whole is kept when resuming."""
    from nearfar.capture.unfinished import unfinished_capture
    from nearfar.rigs.opening import open_rig
    from nearfar.workflow.acquire import acquire

    output = projector.output
    begun = manner.resume and _unfinished(output).exists()
    if manner.resume and not begun and _is_there(output, manner):
        return
    before, exposure = unfinished_capture(output) if begun else (0, None)
    with open_rig(
        projector.rig,
        made.projector,
        exposure=exposure,
        progress=report,
        on_alarm=warn,
        on_start=partial(say_time, len(made.patterns) - before, quiet=manner.quiet),
    ) as rig:
        warn_each(rig.notes)
        taken = acquire(
            made,
            output,
            rig,
            resume=begun,
            force=manner.force,
            progress=report,
            on_alarm=warn,
        )
    say_captured(taken, output, quiet=manner.quiet)


def _warn_of_exposures(outputs: list[Path]) -> None:
    """Warn of captures whose light does not add up, for their exposures differ."""
    from nearfar.applications.several_projectors import exposures_differ
    from nearfar.capture import open_capture

    first, *others = [open_capture(output).exposure for output in outputs]
    for output, exposure in zip(outputs[1:], others, strict=True):
        if exposures_differ(first, exposure):
            warn(
                f"{outputs[0]} was exposed for {first:g} s and {output} for {exposure:g} s, and "
                f"light adds up at one exposure: write it under [camera] of both rigs, and "
                f"photograph again."
            )


def _share(
    made: "Plan", projectors: list[Projector], shared: Path, manner: Manner, report: Report
) -> bool:
    """Shoot a plan by all projectors at once, unless that loses; return whether it was done."""
    from nearfar.capture import open_capture
    from nearfar.capture.unfinished import RESUMABLE_CAPTURE, unfinished_capture
    from nearfar.files import check_output, check_resumable
    from nearfar.rigs.side_by_side import open_side_by_side
    from nearfar.workflow.acquire_shared import acquire_shared, take_apart

    outputs, rigs = [each.output for each in projectors], [each.rig for each in projectors]
    begun = manner.resume and _unfinished(shared).exists()
    if manner.resume and not begun and shared.exists():
        missing = [None if _is_there(output, manner) else output for output in outputs]
        taken = take_apart(open_capture(shared), missing, progress=report)
        _say_written(taken, list(filter(None, missing)), manner)
        return True
    if manner.resume and not begun and any(_is_begun(output) for output in outputs):
        # Photos in turn were found to be better before.
        return False
    for output in outputs:
        check_output(output, force=manner.force)
    check_resumable(shared, RESUMABLE_CAPTURE, resume=begun, force=manner.force)
    before, exposure = unfinished_capture(shared) if begun else (0, None)
    with open_side_by_side(
        rigs,
        made.projector,
        exposure=exposure,
        progress=report,
        on_alarm=warn,
        on_start=partial(say_time, len(rigs) * len(made.patterns) - before, quiet=manner.quiet),
    ) as rig:
        warn_each(rig.notes)
        if not begun and not _is_worth_it(rig, rigs, manner):
            return False
        taken = acquire_shared(
            made,
            shared,
            outputs,
            rig,
            resume=begun,
            force=manner.force,
            progress=report,
            on_alarm=warn,
        )
    say_captured(open_capture(shared), shared, quiet=manner.quiet)
    _say_written(taken, outputs, manner)
    return True


def _is_worth_it(rig: "SimulatedRig | RealRig", rigs: list[str], manner: Manner) -> bool:
    """Print how many dB shared photos gain, and return whether they are worth it."""
    from nearfar.rigs.simulated.rig import SimulatedRig
    from nearfar.workflow.acquire_shared import gain_of_sharing

    exposures = (1 / rig.exposure, 1.0) if isinstance(rig, SimulatedRig) else None
    gain = gain_of_sharing(rig, len(rigs), exposures=exposures).decibels
    if gain >= LEAST_GAIN_DECIBELS:
        say(f"shared photos have {gain:.1f} dB less noise than photos in turn", quiet=manner.quiet)
        return True
    what = f"{-gain:.1f} dB more noise" if gain < 0 else f"no more than {gain:.1f} dB less noise"
    say(
        f"shared photos would have {what}: each projector is photographed while the others are "
        f"dark",
        quiet=manner.quiet,
    )
    return False


def _unfinished(output: Path) -> Path:
    from nearfar.files import UNFINISHED

    return output.with_name(f"{output.name}{UNFINISHED}")


def _is_there(output: Path, manner: Manner) -> bool:
    """Return whether a capture is there, which is kept when resuming; if so, print it."""
    if output.exists():
        say(f"{output} is there already", quiet=manner.quiet)
    return output.exists()


def _is_begun(output: Path) -> bool:
    return output.exists() or _unfinished(output).exists()


def _say_written(taken: "list[Capture]", outputs: list[Path], manner: Manner) -> None:
    for capture, output in zip(taken, outputs, strict=True):
        say_captured(capture, output, quiet=manner.quiet)
