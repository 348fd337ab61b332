"""Display a plan's patterns on a rig and keep the photos, on the disk or in memory."""

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import AnyPath
from nearfar.capture import Capture, CaptureWriter, open_capture
from nearfar.capture.observing import CaptureObserver, is_enough, with_predicate
from nearfar.capture.replacing import replace_photos
from nearfar.capture.unfinished import (
    RESUMABLE_CAPTURE,
    count_photos,
    has_photos,
    require_same_rig,
)
from nearfar.checks import require_instance
from nearfar.deprecation import warn_of
from nearfar.errors import InputError, KeptInterrupt, NearfarError, UselessPhotosError
from nearfar.faults.while_capturing import FaultsWhileCapturing
from nearfar.files import resumable_output
from nearfar.photometry.in_memory import PhotosInMemory
from nearfar.plan import Plan
from nearfar.progress import OldReport, Report, as_report, ignore_progress
from nearfar.rigs.base import Photo, Rig


def acquire(
    plan: Plan,
    path: AnyPath,
    rig: Rig,
    *,
    resume: bool = False,
    force: bool = False,
    progress: Report | OldReport | None = None,
    observers: Sequence[CaptureObserver] = (),
    on_alarm: Callable[[str], None] | None = None,
    enough: Callable[[int, NDArray[Any]], bool] | None = None,
    told: Callable[[str], None] | None = None,
) -> Capture:
    """Shoot a plan.

    Every photo is written to disk before the next pattern is displayed. Until the last photo is
    written, the photos lie in a folder with the capture's name and ``.unfinished`` appended, from
    which a stopped capture can be resumed.

    Parameters
    ----------
    plan : Plan
    path : str or Path
        Capture to make.
    rig : Rig
    resume : bool
        Keep the photos of a stopped capture, and take the others; plan and rig must be the same.
    force : bool
        Replace a capture that is there and, without `resume`, the photos of a stopped one.
    progress : callable, optional
        Called after each photo with "photos" and the share of them that is taken, 0 to 1.
    observers : sequence of CaptureObserver
        Each is called with every photo, including those of a stopped capture. The capture ends
        when one returns ``Decision.ENOUGH``.
    on_alarm : callable, optional
        Called with each alarm about a photo, a sentence; a rig reports its own. The capture
        stores both.
    enough, told : callable, optional
        .. deprecated:: 0.1
            Use `observers` and `on_alarm`.

    Returns
    -------
    Capture

    Raises
    ------
    PlanError
        If the plan's patterns are complex.
    InputError
        If the rig's projector is not the plan's; if plan or rig are not those of the photos there;
        if a photo has another shape or type than the others.
    UselessPhotosError
        If the photos show that the projector is off; they are removed, except those of a stopped
        capture.
    NearfarError
        As `nearfar.files.resumable_output`. The message says where the photos are kept.
    KeptInterrupt
        If the user interrupted it; the message says the same.

    Examples
    --------
    >>> with nearfar.open_rig("scene.npy", size) as rig:
    ...     nearfar.acquire(plan, "taken.zarr", rig)
    <nearfar capture: 52 photos of 8x8, taken.zarr>
    """
    path = Path(path)
    _require(plan, rig)
    observers = with_predicate(observers, enough, "nearfar.acquire")
    if told is not None:
        warn_of("told of nearfar.acquire", "give on_alarm")
        on_alarm = on_alarm or told
    count = len(plan.patterns)
    report = as_report(progress, count)
    kept = _Kept(path, count, resume=resume)
    try:
        with resumable_output(
            path, RESUMABLE_CAPTURE, kept.is_worth_keeping, resume=resume, force=force
        ) as folder:
            writer = _writer(folder, plan, rig)
            kept.folder = folder
            ended, taken, alarms_of_rig = writer.ended, writer.taken, 0
            finder = FaultsWhileCapturing(plan, rig.full_scale)
            finder.recall(writer.read, taken)
            alarms: list[str] = []
            if taken:
                # The capture was stopped before the alarms of its last photo could be stored.
                last = writer.read(taken - 1)
                alarms = [str(fault) for fault in finder.examine(taken - 1, last)]
            for number in range(taken):
                enough_now = is_enough(observers, number, writer.read(number))
                # Only the last photo may end the capture: no photo is removed.
                ended = ended or (enough_now and number + 1 == taken)
            photos = iter(()) if ended else _photos(plan, rig, taken)
            while not ended:
                photo = next(photos, None)
                alarms += rig.alarms[alarms_of_rig:]
                alarms_of_rig = len(rig.alarms)
                photo = writer.add(photo, rig.conditions(), alarms)
                # The photo is written by now: its alarms are stored with the next.
                alarms = [str(fault) for fault in finder.examine(writer.taken - 1, photo)]
                if on_alarm is not None:
                    for alarm in alarms:
                        on_alarm(alarm)
                report("photos", writer.taken / count)
                ended = is_enough(observers, writer.taken - 1, photo) or writer.taken == count
            writer.finish(alarms)
    except KeyboardInterrupt as error:
        if not kept.photos:
            raise
        raise KeptInterrupt(f"interrupted; {kept}.") from error
    except NearfarError as error:
        if not kept.photos:
            raise
        raise type(error)(f"{str(error).removesuffix('.')}; {kept}.") from error
    return open_capture(path)


def shoot_again(
    plan: Plan,
    path: AnyPath,
    rig: Rig,
    numbers: Sequence[int],
    *,
    progress: Report | None = None,
) -> Capture:
    """Take chosen photos of a finished capture again; all of them are replaced, or none.

    Parameters
    ----------
    plan : Plan
        The capture's.
    path : str or Path
        The capture.
    rig : Rig
        Set up as it was.
    numbers : sequence of int
        Numbers of the photos in the plan.
    progress : callable, optional
        Called after each photo with "photos" and the share of them that is taken, 0 to 1.

    Returns
    -------
    Capture

    Raises
    ------
    InputError
        If plan or rig are not the capture's, a number is not in the plan, or a new photo has
        another shape or type than the others.
    NearfarError
        As `nearfar.capture.replacing.replace_photos`.

    Examples
    --------
    >>> with nearfar.open_rig("scene.npy", size) as rig:
    ...     nearfar.shoot_again(plan, "capture.zarr", rig, [3, 4])
    <nearfar capture: 52 photos of 8x8, capture.zarr>
    """
    report = progress or ignore_progress
    _require(plan, rig)
    capture = open_capture(path)
    if capture.plan.patterns != plan.patterns[: len(capture.plan.patterns)]:
        raise InputError(f"{path} is of another plan: give that one.")
    require_same_rig(
        Path(path), capture.rig, rig.describe(), "take them all anew with `force=True`"
    )
    known = [number for number in numbers if 0 <= number < len(plan.patterns)]
    # One run of consecutive numbers at a time, so that the rig numbers photos as the plan does.
    runs = _runs(known)
    photos = (
        photo for run in runs for photo in rig.shoot((plan.draw(number) for number in run), run[0])
    )
    return replace_photos(
        path,
        numbers,
        photos,
        conditions=rig.conditions,
        alarms=lambda: rig.alarms,
        progress=report,
    )


def _runs(numbers: Sequence[int]) -> list[list[int]]:
    """Split numbers into runs of consecutive numbers."""
    runs: list[list[int]] = []
    for number in numbers:
        if runs and number == runs[-1][-1] + 1:
            runs[-1].append(number)
        else:
            runs.append([number])
    return runs


class _Kept:
    """The photos that are kept of a stopped capture, and a sentence about them."""

    def __init__(self, path: Path, count: int, *, resume: bool) -> None:
        self.folder: Path | None = None
        self._path, self._count, self._resume = path, count, resume

    @property
    def photos(self) -> int:
        """Number of photos that are kept."""
        return count_photos(self.folder) if self.folder is not None else 0

    def is_worth_keeping(self, folder: Path, error: BaseException) -> bool:
        """Return whether a folder is worth keeping: a single photo is taken again as quickly."""
        useless = isinstance(error, UselessPhotosError) or count_photos(folder) <= 1
        return (self._resume and has_photos(folder)) or not useless

    def __str__(self) -> str:
        again = "`resume=True, force=True`" if self._path.exists() else "`resume=True`"
        return (
            f"{self.photos} of {self._count} photos are kept in {self.folder}, and {again} goes on "
            f"with them"
        )


def _writer(folder: Path, plan: Plan, rig: Rig) -> CaptureWriter:
    begin = CaptureWriter.resume if has_photos(folder) else CaptureWriter
    about = rig.describe()
    return begin(folder, plan, full_scale=rig.full_scale, rig=about, exposure=about.get("exposure"))


def acquire_in_memory(plan: Plan, rig: Rig) -> PhotosInMemory:
    """Shoot a plan and keep its photos in memory, for simulations.

    Raises
    ------
    PlanError, InputError
        As `acquire`.
    """
    _require(plan, rig)
    return PhotosInMemory(plan, np.stack(list(_photos(plan, rig))), rig.full_scale)


def _require(plan: Plan, rig: Rig) -> None:
    require_instance(plan, Plan, "plan", "nearfar.choose_plan")
    if not hasattr(rig, "shoot"):
        raise InputError(
            f"a {type(rig).__name__} was given for the rig, and takes no photos: give what "
            f"nearfar.open_rig returns."
        )
    plan.require_real("shoot")
    if rig.projector != plan.projector:
        raise InputError(
            f"the plan is for a projector of {plan.projector}, the rig has {rig.projector}: make "
            f"the plan with `projector={tuple(rig.projector)}`."
        )


def _photos(plan: Plan, rig: Rig, first: int = 0) -> Iterator[Photo]:
    return rig.shoot((plan.draw(i) for i in range(first, len(plan.patterns))), first)
