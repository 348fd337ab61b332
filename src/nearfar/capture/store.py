"""A capture: the raw photos of a plan on the disk, one chunk each, large ones in rows."""

import json
import math
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any, TypeGuard

import numpy as np
import zarr
from numpy.typing import NDArray

from nearfar.arrays import AnyPath, Size
from nearfar.errors import InputError, UnreadableFileError
from nearfar.files import (
    add_array,
    create_durable_store,
    full_scale_of,
    new_output,
    open_array,
    open_store,
    read_array,
    read_selection,
    require_finite,
)
from nearfar.illumination.frequencies import DC
from nearfar.plan.model import Plan, Sinusoid, parse_plan
from nearfar.version import version

# Bytes of a chunk at most: rows of a large camera are read without the rest of it.
CHUNK_BYTES = 2**22
KIND = "nearfar capture"
FORMAT_VERSION = 1
DTYPES = (np.dtype(np.uint8), np.dtype(np.uint16), np.dtype(np.float32))


@dataclass(frozen=True)
class Capture:
    """A capture open for reading; photos are read when asked for.

    Attributes
    ----------
    path : Path
    plan : Plan
    photos : zarr.Array
        Raw numbers, shape (photos, Cy, Cx, channels); `read` gives them in photo units.
    full_scale : float
        Raw value of full scale.
    rig : dict
        What took the photos, free JSON.
    exposure : float or None
        Exposure time in seconds, where known.
    times : array
        When each photo was written, float64 seconds since the epoch.
    saturated : array
        Share of values at full scale or above in each photo, float64.
    """

    path: Path
    plan: Plan
    photos: zarr.Array[Any]
    full_scale: float
    rig: dict[str, Any]
    exposure: float | None
    times: NDArray[np.float64]
    saturated: NDArray[np.float64]

    @property
    def camera(self) -> Size:
        """Camera pixels Cy x Cx."""
        return Size(*self.photos.shape[1:3])

    @property
    def channels(self) -> int:
        """Camera channels."""
        return int(self.photos.shape[3])

    @property
    def saturated_share(self) -> float:
        """Share of all values of all photos that are at full scale or above."""
        return float(self.saturated.mean())

    def read(
        self, photos: slice | Sequence[int] | NDArray[np.integer[Any]], rows: slice = slice(None)
    ) -> NDArray[np.float32]:
        """Read photos in photo units: linear, full scale = 1.

        Parameters
        ----------
        photos : slice or integers
            Which photos.
        rows : slice
            Which rows of the camera. A photo of more than `CHUNK_BYTES` lies in chunks of rows, of
            which only those asked for are read.

        Returns
        -------
        array
            float32, shape (photos, rows, Cx, channels).

        Raises
        ------
        UnreadableFileError
            If a photo is missing or damaged.
        InputError
            If there is no such photo.
        """
        chosen = photos if isinstance(photos, slice) else np.asarray(photos, dtype=np.intp)
        raw = read_selection(self.photos, (chosen, rows))
        scaled = raw.astype(np.float32, copy=False)
        scaled /= np.float32(self.full_scale)
        return scaled


def open_capture(path: AnyPath) -> Capture:
    """Open a capture.

    Raises
    ------
    MissingFileError
        If it is not there.
    UnreadableFileError
        If it is damaged, something else, or it or its plan of another version.
    """
    path = Path(path)
    group = open_store(path, KIND, FORMAT_VERSION)
    attributes = dict(group.attrs)
    plan = parse_plan(json.dumps(attributes.get("plan")), source=f"the plan in {path}")
    photos = open_array(group, "photos")
    times, saturated = read_array(group, "time"), read_array(group, "saturated")
    full_scale, rig = attributes.get("full_scale"), attributes.get("rig")
    exposure = attributes.get("exposure")
    if (
        not _is_positive(full_scale)
        or (exposure is not None and not _is_positive(exposure))
        or not isinstance(rig, dict)
        or photos.ndim != 4
        or photos.dtype not in DTYPES
    ):
        raise UnreadableFileError(
            f"{path} is damaged: its zarr.json does not describe photos; copy or make it again."
        )
    counts = {photos.shape[0], len(plan.patterns), times.size, saturated.size}
    if len(counts) > 1:
        raise UnreadableFileError(
            f"{path} is damaged: it has {photos.shape[0]} photos for the {len(plan.patterns)} "
            f"patterns of its plan; copy or make it again."
        )
    return Capture(
        path=path,
        plan=plan,
        photos=photos,
        full_scale=float(full_scale),
        rig=rig,
        exposure=exposure,
        times=times,
        saturated=saturated,
    )


def _is_positive(value: object) -> TypeGuard[float]:
    return isinstance(value, int | float) and 0 < value < math.inf


def write_capture(
    path: AnyPath,
    plan: Plan,
    photos: Iterable[NDArray[Any]],
    *,
    full_scale: float | None = None,
    rig: Mapping[str, Any] | None = None,
    exposure: float | None = None,
    names: Sequence[str] | None = None,
    force: bool = False,
    progress: Callable[[int], None] | None = None,
    enough: Callable[[int, NDArray[Any]], bool] | None = None,
) -> Capture:
    """Write the photos of a plan; each is on the disk before the next is asked for.

    Parameters
    ----------
    path : str or Path
        Folder to make, ending in ``.zarr`` by custom.
    plan : Plan
    photos : iterable of arrays
        Raw photos in the order of the plan, all uint8, uint16 or float32 and of one shape,
        (Cy, Cx) or (Cy, Cx, channels).
    full_scale : float, optional
        Raw value of full scale; by default that of the numbers' type.
    rig : mapping, optional
        What took the photos, free JSON.
    exposure : float, optional
        Exposure time in seconds.
    names : sequence of str, optional
        What to call each photo in a message.
    force : bool
        Replace a capture that is there.
    progress : callable, optional
        Told the number of photos written after each.
    enough : callable, optional
        Told each photo's number and the photo, (Cy, Cx, channels); where it says so, the capture
        ends there, and its plan with it.

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
    """
    path = Path(path)
    plan.require_real("capture")
    for name, value in (("full scale", full_scale), ("exposure", exposure)):
        if value is not None and not _is_positive(value):
            raise InputError(f"the {name} {value} is not a positive number: give one above 0.")
    count = len(plan.patterns)
    called = [f"photo {i}" for i in range(count)]
    if names:
        called = [f"{photo} ({name})" for photo, name in zip(called, names, strict=True)]
    with new_output(path, force=force) as partial:
        remaining = iter(photos)
        first = as_photo(next(remaining, None), called[0])
        scale = full_scale_of(first.dtype) if full_scale is None else float(full_scale)
        group = create_durable_store(
            partial,
            KIND,
            FORMAT_VERSION,
            {
                "plan": json.loads(plan.to_json()),
                "full_scale": scale,
                "rig": dict(rig or {}),
                "exposure": exposure,
                "nearfar": version(),
            },
        )
        rows = max(1, min(len(first), CHUNK_BYTES // max(1, first[0].nbytes)))
        chunk = (1, rows, *first.shape[1:])
        array = add_array(group, "photos", (count, *first.shape), first.dtype, chunk)
        times, saturated, means = np.zeros(count), np.zeros(count), np.full(count, np.nan)
        written, all_equal, white_black = 0, True, white_and_black(plan)
        for photo in _with_first(first, islice(remaining, count - 1)):
            check_photo(photo, first, scale, called[written])
            array[written] = photo
            times[written] = time.time()
            saturated[written] = np.mean(photo >= scale)
            means[written] = photo.mean(dtype=np.float64)
            _check_white_and_black(white_black, means, called)
            all_equal = all_equal and np.array_equal(photo, first)
            written += 1
            if progress is not None:
                progress(written)
            if enough is not None and enough(written - 1, photo) and written < count:
                plan, count = plan.first(written), written
                array.resize((count, *first.shape))
                group.attrs["plan"] = json.loads(plan.to_json())
                times, saturated, means = times[:count], saturated[:count], means[:count]
                remaining = iter(())
                break
        _check_count(written, count, next(remaining, None) is not None)
        _check_order(white_black, means, called)
        if all_equal:
            what = "black" if not first.any() else "the same"
            raise InputError(
                f"all {count} photos are {what}: check that the projector shows the patterns and "
                f"the camera sees them."
            )
        for name, values in (("time", times), ("saturated", saturated)):
            add_array(group, name, (count,), np.float64, (count,))[:] = values
    return open_capture(path)


def _with_first(first: NDArray[Any], others: Iterable[NDArray[Any]]) -> Iterable[NDArray[Any]]:
    yield first
    yield from (np.atleast_3d(photo) for photo in others)


def as_photo(photo: NDArray[Any] | None, name: str) -> NDArray[Any]:
    """Bring a photo to (Cy, Cx, channels).

    Raises
    ------
    InputError
        If there is none, or its kind or shape is not a photo's.
    """
    if photo is None:
        raise InputError("there are no photos: give one for each pattern of the plan.")
    if photo.dtype not in DTYPES or photo.ndim not in {2, 3} or photo.size == 0:
        raise InputError(
            f"{name} is an array of {photo.dtype} and shape {photo.shape}: a photo is uint8, "
            f"uint16 or float32, height x width or height x width x channels."
        )
    return np.atleast_3d(photo)


def _describe(photo: NDArray[Any]) -> str:
    height, width, channels = photo.shape
    plural = "" if channels == 1 else "s"
    return f"{Size(height, width)} with {channels} channel{plural} of {photo.dtype}"


def check_photo(photo: NDArray[Any], first: NDArray[Any], scale: float, name: str) -> None:
    """Refuse a photo that is not like the first, or is beyond its full scale.

    Raises
    ------
    InputError
    """
    if photo.shape != first.shape or photo.dtype != first.dtype:
        raise InputError(
            f"{name} is {_describe(photo)}, but the first photo is {_describe(first)}: "
            f"take all photos with the same camera settings."
        )
    if photo.dtype.kind == "f":
        require_finite(photo, name)
    elif photo.max() > scale:
        raise InputError(
            f"{name} has values up to {photo.max()}, above the full scale of {scale:g}: give the "
            f"camera's true full scale."
        )


def _check_count(written: int, count: int, more: bool) -> None:
    if written < count or more:
        there = f"only {written}" if written < count else f"more than {count}"
        raise InputError(
            f"there are {there} photos for the {count} patterns of the plan: give one for each."
        )


def white_and_black(plan: Plan) -> tuple[int, int] | None:
    """Find the first white and the first black pattern, if the plan has both."""
    found: dict[bool, int] = {}
    for index, pattern in enumerate(plan.patterns):
        uniform = isinstance(pattern, Sinusoid) and pattern.frequency == DC
        if uniform and isinstance(pattern, Sinusoid) and pattern.kind == "cosine":
            found.setdefault(pattern.inverse, index)
    return (found[False], found[True]) if len(found) == 2 else None


def _check_white_and_black(
    pair: tuple[int, int] | None, means: NDArray[np.float64], called: list[str]
) -> None:
    if pair is None:
        return
    white, black = pair
    if means[white] <= means[black]:
        raise InputError(
            f"{called[white]}, of the white pattern, is no brighter than {called[black]}, of the "
            f"black one: the photos seem to be out of order, or the projector was off."
        )


def _check_order(
    pair: tuple[int, int] | None, means: NDArray[np.float64], called: list[str]
) -> None:
    # No pattern gives less light than black or more than white; half their difference is far
    # above any noise or drift.
    if pair is None:
        return
    white, black = pair
    margin = (means[white] - means[black]) / 2
    darkest, brightest = int(means.argmin()), int(means.argmax())
    for bad, word, reference, name in (
        (means[darkest] < means[black] - margin, "darker", black, "black"),
        (means[brightest] > means[white] + margin, "brighter", white, "white"),
    ):
        if bad:
            other = darkest if reference == black else brightest
            raise InputError(
                f"{called[other]} is much {word} than {called[reference]}, of the {name} pattern: "
                f"the photos seem to be out of order."
            )
