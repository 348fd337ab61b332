"""Photograph by several projectors at once, and keep a capture for each."""

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from nearfar.arrays import AnyPath, Size
from nearfar.capture import Capture, open_capture, write_capture
from nearfar.errors import InputError
from nearfar.files import check_output
from nearfar.photometry.noise import NoiseModel, fit_noise, mean_of_few
from nearfar.photometry.shared_photos import photos_of_each
from nearfar.photometry.sharing import SharingGain, largest_exposures, sharing_gain
from nearfar.plan import Plan
from nearfar.plan.sharing import projectors_of, shared_plan
from nearfar.progress import Report, as_report
from nearfar.rigs.base import Rig
from nearfar.workflow.acquire import acquire

# Photos of each light by which the camera's noise is learnt beforehand.
REPEATS = 2


def acquire_shared(
    plan: Plan,
    path: AnyPath,
    outputs: Sequence[AnyPath],
    rig: Rig,
    *,
    resume: bool = False,
    force: bool = False,
    progress: Report | None = None,
    on_alarm: Callable[[str], None] | None = None,
) -> list[Capture]:
    """Shoot a plan by several projectors at once, and write a capture for each.

    The photos as they were taken lie in a capture of their own, which is durable photo by photo
    and resumed as any other. Those of each projector are computed from it.

    Parameters
    ----------
    plan : Plan
        What is to be known of each projector.
    path : str or Path
        Capture to make of the shared photos.
    outputs : sequence of str or Path
        Captures to make, one for each projector.
    rig : Rig
        What `nearfar.rigs.side_by_side.open_side_by_side` returns.
    resume, force, progress, on_alarm
        As `nearfar.acquire`.

    Returns
    -------
    list of Capture
        One for each projector, float32.

    Raises
    ------
    PlanError
        As `nearfar.plan.sharing.shared_plan`.
    NearfarError
        As `nearfar.acquire`.
    """
    together = shared_plan(plan, len(outputs))
    for output in outputs:
        check_output(Path(output), force=force)
    shared = acquire(
        together,
        path,
        rig,
        resume=resume,
        force=force,
        progress=progress,
        on_alarm=on_alarm,
    )
    return take_apart(shared, outputs, force=force, progress=progress)


def take_apart(
    shared: Capture,
    outputs: Sequence[AnyPath | None],
    *,
    force: bool = False,
    progress: Report | None = None,
) -> list[Capture]:
    """Write a capture for each of the projectors that shared photos.

    Parameters
    ----------
    shared : Capture
    outputs : sequence of str, Path or None
        Captures to make, one for each projector; None where none is to be made.
    force : bool
        Replace captures that are there.
    progress : callable, optional
        Called with what is being done and the share done, 0 to 1.

    Returns
    -------
    list of Capture
        Those that were made.

    Raises
    ------
    PlanError
        If no projectors share the photos.
    InputError
        If there is not an output for each projector.
    NearfarError
        As `nearfar.write_capture`.
    """
    report = as_report(progress)
    each = photos_of_each(shared)
    if len(outputs) != len(each):
        raise InputError(
            f"there are {len(outputs)} captures to make of {shared.path}, which is of "
            f"{len(each)} projectors: name one for each."
        )
    rigs = shared.rig.get("projectors") or [shared.rig] * len(each)
    written = []
    for number, (photos, output, rig) in enumerate(zip(each, outputs, rigs, strict=True)):
        if output is None:
            continue
        count = len(photos.plan.patterns)
        write_capture(
            photos.plan,
            output,
            (photos.read([index])[0] for index in range(count)),
            full_scale=1.0,
            rig={**rig, "shared_photos": projectors_of(shared.plan)},
            exposure=shared.exposure,
            force=force,
        )
        report("taking photos apart", (number + 1) / len(each))
        written.append(open_capture(output))
    return written


def gain_of_sharing(
    rig: Rig, projectors: int, *, exposures: tuple[float, float] | None = None
) -> SharingGain:
    """Photograph black, white by each projector and by all, and say what sharing gains.

    Parameters
    ----------
    rig : Rig
        What `nearfar.rigs.side_by_side.open_side_by_side` returns.
    projectors : int
    exposures : tuple of float, optional
        As `nearfar.photometry.sharing.sharing_gain` takes them; left out, that of `rig` for shared
        photos, and in turn as much more as the brightest white of one projector leaves room for.

    Returns
    -------
    SharingGain
    """
    grid = Size(rig.projector.height, rig.projector.width // projectors)
    lit = np.concatenate([np.zeros((1, projectors)), np.eye(projectors), np.ones((1, projectors))])
    patterns = [
        np.hstack([np.full(grid, 255 * on, dtype=np.uint8) for on in row])
        for row in lit
        for _ in range(REPEATS)
    ]
    photos = np.stack(list(rig.shoot(patterns))).astype(np.float32) / np.float32(rig.full_scale)
    photos = photos.reshape(len(lit), REPEATS, *photos.shape[1:])
    mean, variance = photos.mean(axis=1), photos.var(axis=1, ddof=1)
    noise: list[NoiseModel] = [
        fit_noise(
            mean[..., channel],
            variance[..., channel],
            float(np.median(mean[0, ..., channel])),
            photos=1,
            typical=mean_of_few,
        )
        for channel in range(mean.shape[-1])
    ]
    if exposures is None:
        in_turn, together = largest_exposures(mean[1:-1], mean[0])
        exposures = (in_turn / together, 1.0)
    return sharing_gain(mean[1:-1], mean[0], noise, exposures=exposures)
