"""Writing a capture: every photo is on the disk, and noted, before the next is asked for."""

import json
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Self

import numpy as np
import zarr
from numpy.typing import NDArray

from nearfar.arrays import AnyPath
from nearfar.capture.checks import (
    as_photo,
    check_count,
    check_full_scale,
    check_order,
    check_photo,
    check_white_and_black,
)
from nearfar.capture.observing import CaptureObserver, is_enough, with_predicate
from nearfar.capture.store import (
    CHUNK_BYTES,
    FORMAT_VERSION,
    KIND,
    SHOWN,
    Capture,
    is_positive,
    open_capture,
    white_and_black,
)
from nearfar.capture.unfinished import LOG_NAME, Taken, other_plan, plan_as_now, require_same_rig
from nearfar.checks import require_instance
from nearfar.deprecation import path_after_content
from nearfar.errors import InputError, UnreadableFileError, UselessPhotosError
from nearfar.files import full_scale_of, new_output
from nearfar.files.logs import note, read_notes
from nearfar.files.output import synchronise_entry
from nearfar.files.stores import (
    add_array,
    create_durable_store,
    open_array,
    open_durable_store,
    open_store,
    read_selection,
)
from nearfar.plan.model import Plan
from nearfar.progress import OldReport, Report, as_report
from nearfar.release import version


class CaptureWriter:
    """Writes the photos of a plan into a folder, in order; another writer may go on with it.

    Parameters
    ----------
    folder : Path
        To make; within `nearfar.files.new_output` or `nearfar.files.resumable_output`.
    plan : Plan
    full_scale : float, optional
        Raw value of full scale; by default that of the numbers' type.
    rig : mapping, optional
        What takes the photos, free JSON.
    exposure : float, optional
        Exposure time in seconds.
    names : sequence of str, optional
        What to call each photo in a message.

    Raises
    ------
    PlanError
        If the plan's patterns are complex.
    InputError
        If full scale or exposure are not above 0.
    """

    def __init__(
        self,
        folder: Path,
        plan: Plan,
        *,
        full_scale: float | None = None,
        rig: Mapping[str, Any] | None = None,
        exposure: float | None = None,
        names: Sequence[str] | None = None,
    ) -> None:
        plan.require_real("capture")
        for name, value in (("full scale", full_scale), ("exposure", exposure)):
            if value is not None and not is_positive(value):
                raise InputError(f"the {name} {value} is not a positive number: give one above 0.")
        self._folder, self._plan, self._scale = folder, plan, full_scale
        self._attributes = {
            "plan": json.loads(plan.to_json()),
            "rig": dict(rig or {}),
            "exposure": exposure,
            "nearfar": version(),
        }
        count = len(plan.patterns)
        self._called = [f"photo {i}" for i in range(count)]
        if names:
            check_count(len(names), count, more=len(names) > count)
            self._called = [
                f"{photo} ({name})" for photo, name in zip(self._called, names, strict=True)
            ]
        self._white_black = white_and_black(plan)
        self._means = np.full(count, np.nan)
        self._taken: list[Taken] = []
        self._first: NDArray[Any] | None = None
        self._group: zarr.Group | None = None
        self._photos: zarr.Array[Any] | None = None

    @classmethod
    def resume(
        cls,
        folder: Path,
        plan: Plan,
        *,
        full_scale: float | None = None,
        rig: Mapping[str, Any] | None = None,
        exposure: float | None = None,
    ) -> Self:
        """Resume a capture that another writer started.

        Parameters
        ----------
        folder : Path
            The unfinished capture.
        plan, full_scale, rig, exposure
            As they were.

        Raises
        ------
        InputError
            If they are not as they were.
        UnreadableFileError
            If it is damaged, or something else.
        """
        group = open_store(folder, KIND, FORMAT_VERSION)
        writer = cls(folder, plan, full_scale=full_scale, rig=rig, exposure=exposure)
        writer._take_up(group)
        return writer

    @property
    def taken(self) -> int:
        """Number of photos on the disk."""
        return len(self._taken)

    @property
    def ended(self) -> bool:
        """Whether all photos are there, or the capture has ended before all were."""
        count = len(self._plan.patterns)
        if self.taken == count or self._group is None:
            return self.taken == count
        ended: object = json.loads(self._plan.first(self.taken).to_json())
        return plan_as_now(self._group.attrs.get("plan")) == ended

    def read(self, number: int) -> NDArray[Any]:
        """Read a photo that is there, raw."""
        assert self._photos is not None
        return read_selection(self._photos, (number,))

    def add(
        self,
        photo: NDArray[Any] | None,
        conditions: Mapping[str, float] | None = None,
        alarms: Sequence[str] = (),
    ) -> NDArray[Any]:
        """Write the next photo, and wait for the disk.

        Parameters
        ----------
        photo : ndarray, shape (Cy, Cx) or (Cy, Cx, channels)
            uint8, uint16 or float32; none where photos end before patterns do.
        conditions : mapping, optional
            What may change from photo to photo, such as temperatures.
        alarms : sequence of str
            Alarms since the photo before, a sentence each.

        Returns
        -------
        ndarray, shape (Cy, Cx, channels)

        Raises
        ------
        InputError
            If there is none, or it does not fit the others, holds NaN, infinities or whole numbers
            above full scale, or is much darker than black or brighter than white; it is not kept
            then.
        UselessPhotosError
            If white is no brighter than black.
        """
        number = self.taken
        called = self._called[number]
        if photo is None and number:
            check_count(number, len(self._called), more=False)
        photo = as_photo(photo, called) if self._first is None else np.atleast_3d(np.asarray(photo))
        first = photo if self._first is None else self._first
        scale = full_scale_of(first.dtype) if self._scale is None else float(self._scale)
        check_photo(photo, first, scale, called)
        is_white = self._white_black is not None and number == self._white_black[0]
        check_full_scale(photo, scale, called, is_white=is_white)
        if self._photos is None:
            self._photos = self._create_arrays(first, scale)
        self._first, self._scale = first, scale
        self._photos[number] = photo
        mean = float(photo.mean(dtype=np.float64))
        self._means[number] = mean
        # A photo that is refused here is not noted, so it is taken again.
        check_white_and_black(self._white_black, self._means, self._called)
        check_order(self._white_black, self._means, self._called)
        saturated = float(np.mean(photo >= scale))
        same = bool(np.array_equal(photo, first))
        taken = Taken(time.time(), saturated, mean, same, dict(conditions or {}), list(alarms))
        note(self._folder / LOG_NAME, taken._asdict())
        self._taken.append(taken)
        return photo

    def finish(self, alarms: Sequence[str] = ()) -> None:
        """Make a capture of the photos there are, and a plan of their patterns.

        Parameters
        ----------
        alarms : sequence of str
            Alarms after the last photo, a sentence each.

        Raises
        ------
        UselessPhotosError
            If all photos are the same.
        """
        assert self._group is not None
        assert self._photos is not None
        count = self.taken
        if all(taken.same for taken in self._taken):
            assert self._first is not None
            what = "the same" if self._first.any() else "black"
            raise UselessPhotosError(
                f"all {count} photos are {what}: check that the projector shows the patterns and "
                f"the camera sees them."
            )
        if count < len(self._plan.patterns):
            # The plan first: by it, a writer that resumes here sees that no photo is missing.
            self._group.attrs["plan"] = json.loads(self._plan.first(count).to_json())
            self._photos.resize((count, *self._photos.shape[1:]))
        names = {name for taken in self._taken for name in taken.conditions}
        self._group.attrs["conditions"] = {
            name: [taken.conditions.get(name) for taken in self._taken] for name in sorted(names)
        }
        earlier = [text for taken in self._taken for text in taken.alarms]
        self._group.attrs["alarms"] = [*earlier, *alarms]
        for name in ("time", "saturated"):
            values = np.array([getattr(taken, name) for taken in self._taken])
            add_array(self._group, name, (count,), np.float64, (count,))[:] = values

    def keep_shown(self, pictures: Iterable[NDArray[Any]]) -> None:
        """Keep the pictures that were shown, one for each photo, all of one shape and type.

        Parameters
        ----------
        pictures : iterable of ndarray, shape (Py, Px) or (Py, Px, 3)
            uint8, uint16 or float32.
        """
        assert self._group is not None
        kept: zarr.Array[Any] | None = None
        for number, picture in enumerate(pictures):
            if kept is None:
                shape = (len(self._plan.patterns), *picture.shape)
                chunk = (1, _rows_of_a_chunk(picture), *picture.shape[1:])
                kept = add_array(self._group, SHOWN, shape, picture.dtype, chunk)
            kept[number] = picture

    def _take_up(self, group: zarr.Group) -> None:
        """Resume from the photos on the disk."""
        folder, before = self._folder, dict(group.attrs)
        self._taken = read_notes(folder / LOG_NAME, lambda words: Taken(**words))
        now = json.loads(json.dumps(self._attributes))
        # A capture that ended early has the plan of its photos.
        ended = json.loads(self._plan.first(self.taken).to_json())
        known = plan_as_now(before.get("plan"))
        if known not in (now["plan"], ended):
            raise InputError(other_plan(folder, known, now["plan"]))
        require_same_rig(folder, before.get("rig"), now["rig"], "start anew with `force=True`")
        photos, scale = open_array(group, "photos"), before.get("full_scale")
        many = self.taken > min(photos.shape[0], len(self._plan.patterns))
        if many or not is_positive(scale):
            raise UnreadableFileError(f"{folder} is damaged: start anew with `force=True`.")
        if self._scale is not None and float(self._scale) != float(scale):
            raise InputError(
                f"{folder} was begun with a full scale of {scale:g}, and is to be resumed with "
                f"{self._scale:g}: set the camera as it was, or start anew with `force=True`."
            )
        self._scale = float(scale)
        self._means[: self.taken] = [taken.mean for taken in self._taken]
        if self._taken:
            self._first = read_selection(photos, (0,))
        self._group = open_durable_store(folder)
        self._photos = add_array(self._group, "photos", photos.shape, photos.dtype, photos.chunks)

    def _create_arrays(self, first: NDArray[Any], scale: float) -> zarr.Array[Any]:
        """Create the arrays for photos of the first one's shape and type."""
        count = len(self._plan.patterns)
        self._group = create_durable_store(
            self._folder, KIND, FORMAT_VERSION, {**self._attributes, "full_scale": scale}
        )
        chunk = (1, _rows_of_a_chunk(first), *first.shape[1:])
        photos = add_array(self._group, "photos", (count, *first.shape), first.dtype, chunk)
        synchronise_entry(self._folder)
        synchronise_entry(self._folder.parent)
        return photos


def _rows_of_a_chunk(picture: NDArray[Any]) -> int:
    bytes_of_a_row = picture.nbytes // len(picture)
    return max(1, min(len(picture), CHUNK_BYTES // max(1, bytes_of_a_row)))


@path_after_content
def write_capture(
    plan: Plan,
    path: AnyPath,
    photos: Iterable[NDArray[Any]],
    *,
    full_scale: float | None = None,
    rig: Mapping[str, Any] | None = None,
    exposure: float | None = None,
    names: Sequence[str] | None = None,
    force: bool = False,
    progress: Report | OldReport | None = None,
    observers: Sequence[CaptureObserver] = (),
    shown: Iterable[NDArray[Any]] | None = None,
    enough: Callable[[int, NDArray[Any]], bool] | None = None,
) -> Capture:
    """Write photos that are there, one for each pattern of a plan; whole or not at all.

    Parameters
    ----------
    plan : Plan
    path : str or Path
        Folder to make, ending in ``.zarr`` by custom.
    photos : iterable of arrays
        Raw photos in the order of the plan, all uint8, uint16 or float32 and of one shape,
        (Cy, Cx) or (Cy, Cx, channels).
    full_scale, rig, exposure, names
        As `CaptureWriter`.
    force : bool
        Replace a capture that is there.
    progress : callable, optional
        Called with "photos" and the share of them that is written, 0 to 1, after each.
    observers : sequence of CaptureObserver
        Each is called with every photo; where one returns ``Decision.ENOUGH``, the capture and its
        plan end with that photo.
    shown : iterable of arrays, optional
        The pictures that were shown, of a plan with offset "shown": one for each photo, all uint8,
        uint16 or float32 and of one shape, (Py, Px) or (Py, Px, 3).
    enough : callable, optional
        .. deprecated:: 0.1
            Use `observers`.

    Returns
    -------
    Capture
        The capture, open for reading.

    Raises
    ------
    PlanError
        If the plan's patterns are complex.
    InputError
        If a photo does not fit the others, holds NaN, infinities or whole numbers above full
        scale, if there are too few or too many, if all are the same, or white is no brighter
        than black.
    ExistingOutputError, MissingFileError, StorageError
        As `nearfar.files.new_output`; nothing is left behind.

    Examples
    --------
    >>> photos = capture.read(slice(None))  # or those of your own camera
    >>> nearfar.write_capture(plan, "own.zarr", photos, full_scale=1.0)
    <nearfar capture: 52 photos of 8x8, own.zarr>
    """
    require_instance(plan, Plan, "plan", "nearfar.read_plan")
    # One stack frame more than elsewhere: the decorator that accepts either order of arguments.
    observers = with_predicate(observers, enough, "nearfar.write_capture", stacklevel=5)
    path = Path(path)
    count = len(plan.patterns)
    report = as_report(progress, count, stacklevel=5)
    with new_output(path, force=force) as partial:
        writer = CaptureWriter(
            partial, plan, full_scale=full_scale, rig=rig, exposure=exposure, names=names
        )
        remaining = iter(photos)
        ended = False
        while writer.taken < count and not ended:
            photo = writer.add(next(remaining, None))
            report("photos", writer.taken / count)
            ended = is_enough(observers, writer.taken - 1, photo)
        if not ended:
            check_count(count, count, more=next(remaining, None) is not None)
        writer.finish()
        if shown is not None:
            writer.keep_shown(shown)
        (partial / LOG_NAME).unlink()
    return open_capture(path)
