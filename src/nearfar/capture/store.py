"""A capture: the raw photos of a plan on the disk, one chunk each, large ones in rows."""

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeGuard

import numpy as np
import zarr
from numpy.typing import NDArray

from nearfar.arrays import AnyPath, Size
from nearfar.errors import UnreadableFileError
from nearfar.files import UNFINISHED, full_scale_of
from nearfar.files.stores import open_array, open_store, read_array, read_selection
from nearfar.illumination.frequencies import DC
from nearfar.markup import card, picture
from nearfar.plan import Pattern, Plan, Sinusoid, parse_plan
from nearfar.plan.patterns import Shown, SideBySide
from nearfar.plan.recognition.contents import Fringes, Uniform

# Bytes of a chunk at most: rows of a large camera are read without the rest of it.
CHUNK_BYTES = 2**20
# Pixels along the longer side of a photo that a notebook shows.
THUMBNAIL_PIXELS = 256
KIND = "nearfar capture"
# Name of the array of pictures that were shown.
SHOWN = "shown"
FORMAT_VERSION = 1
PHOTO_DTYPES = (np.dtype(np.uint8), np.dtype(np.uint16), np.dtype(np.float32))


@dataclass(frozen=True, repr=False, eq=False)
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
    conditions : dict
        What may change from photo to photo, by name: a list with a value for each photo, such as
        its exposure in seconds or a temperature in degrees Celsius, or None where it is unknown.
    alarms : tuple of str
        What went wrong while the photos were taken, a sentence each.
    shown : zarr.Array or None
        The pictures that were shown, where they are somebody else's: (photos, Py, Px) or (photos,
        Py, Px, 3); `pattern` gives one as light.

    Examples
    --------
    >>> capture.camera, capture.channels
    (Size(height=8, width=8), 1)
    >>> capture.read([0, 1]).shape  # the first two photos, linear, full scale = 1
    (2, 8, 8, 1)
    """

    path: Path
    plan: Plan
    photos: zarr.Array[Any]
    full_scale: float
    rig: dict[str, Any]
    exposure: float | None
    times: NDArray[np.float64]
    saturated: NDArray[np.float64]
    conditions: dict[str, list[float | None]]
    alarms: tuple[str, ...]
    shown: zarr.Array[Any] | None = None

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

    def pattern(self, index: int) -> NDArray[np.float32]:
        """Return the pattern of photo `index` as light: linear, full white = 1.

        Returns
        -------
        array
            float32, shape (Py, Px), or (Py, Px, 3) of colour pictures that were shown.

        Raises
        ------
        UnreadableFileError
            If a picture that was shown is damaged.
        PlanError
            If the plan's patterns are complex.
        """
        if self.shown is None:
            return self.plan.draw(index).astype(np.float32) / np.float32(255)
        drawn = read_selection(self.shown, (index,))
        light = drawn.astype(np.float32) / np.float32(full_scale_of(drawn.dtype))
        pattern = self.plan.patterns[index]
        if isinstance(pattern, Shown) and isinstance(pattern.content, Fringes):
            # What the projector makes of values that were raised to a power for it.
            light **= np.float32(pattern.content.exponent)
        return light

    def __repr__(self) -> str:
        return f"<nearfar capture: {len(self.plan.patterns)} photos of {self.camera}, {self.path}>"

    def _repr_html_(self) -> str:
        """Show the capture in a notebook: its first photo, and white and black."""
        step = -(-max(self.camera) // THUMBNAIL_PIXELS)
        names = {"first photo": 0}
        if (found := white_and_black(self.plan)) is not None:
            names |= {"white": found[0], "black": found[1]}
        images = []
        for name, number in names.items():
            photo = self.read([number])[0, ::step, ::step]
            shown = photo if self.channels == 3 else photo.mean(axis=-1)
            images.append((name, picture(shown, name)))
        rows = [
            ("file", str(self.path)),
            ("photos", f"{len(self.plan.patterns)} of {self.camera}, {self.channels} channels"),
            ("numbers", f"{self.photos.dtype}, full scale {self.full_scale:g}"),
            ("saturated", f"{self.saturated_share:.3%}"),
            *(("alarm", text) for text in self.alarms),
        ]
        return card("capture", rows, images)

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


def _shown(path: Path, group: zarr.Group, plan: Plan) -> zarr.Array[Any] | None:
    """Return the pictures of a plan that were shown, or None if it has none."""
    if plan.offset != "shown":
        return None
    shown = open_array(group, SHOWN)
    if (
        shown.shape[:3] != (len(plan.patterns), *plan.projector)
        or shown.shape[3:] not in {(), (3,)}
        or shown.dtype not in PHOTO_DTYPES
    ):
        raise UnreadableFileError(
            f"{path} is damaged: it does not hold the pictures that its plan names; "
            f"copy or make it again."
        )
    return shown


def open_capture(path: AnyPath) -> Capture:
    """Open a capture.

    Raises
    ------
    MissingFileError
        If it is not there.
    UnreadableFileError
        If it is damaged, not finished, something else, or it or its plan of another version.

    Examples
    --------
    >>> nearfar.open_capture("capture.zarr")
    <nearfar capture: 52 photos of 8x8, capture.zarr>
    """
    path = Path(path)
    group = open_store(path, KIND, FORMAT_VERSION)
    attributes = dict(group.attrs)
    plan = parse_plan(json.dumps(attributes.get("plan")), source=f"the plan in {path}")
    if path.suffix == UNFINISHED:
        raise UnreadableFileError(
            f"{path} is a capture that was not finished: go on with it by `acquire(resume=True)`."
        )
    photos = open_array(group, "photos")
    times, saturated = read_array(group, "time"), read_array(group, "saturated")
    full_scale, rig = attributes.get("full_scale"), attributes.get("rig")
    exposure = attributes.get("exposure")
    # Imported captures and older ones have none.
    conditions, alarms = attributes.get("conditions", {}), attributes.get("alarms", [])
    if (
        not is_positive(full_scale)
        or (exposure is not None and not is_positive(exposure))
        or not isinstance(rig, dict)
        or photos.ndim != 4
        or photos.dtype not in PHOTO_DTYPES
        or any(values.dtype != np.float64 for values in (times, saturated))
        or not _are_conditions(conditions, times.size)
        or not isinstance(alarms, list)
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
        conditions=conditions,
        alarms=tuple(map(str, alarms)),
        shown=_shown(path, group, plan),
    )


def _are_conditions(found: object, photos: int) -> TypeGuard[dict[str, list[float | None]]]:
    """Return whether a value is a mapping of lists with a number or None for each photo."""
    return isinstance(found, dict) and all(
        isinstance(values, list)
        and len(values) == photos
        and all(value is None or isinstance(value, int | float) for value in values)
        for values in found.values()
    )


def is_positive(value: object) -> TypeGuard[float]:
    """Return whether a value is a finite number above 0."""
    return isinstance(value, int | float) and 0 < value < math.inf


def white_and_black(plan: Plan) -> tuple[int, int] | None:
    """Find the first white and the first black pattern, if the plan has both."""
    levels = {i: level for i, p in enumerate(plan.patterns) if (level := _level(p)) is not None}
    if not levels or max(levels.values()) == min(levels.values()):
        return None
    return max(levels, key=lambda i: (levels[i], -i)), min(levels, key=lambda i: (levels[i], i))


def _level(pattern: Pattern) -> float | None:
    """Return the level of a pattern that is the same everywhere, None of others."""
    if isinstance(pattern, Sinusoid) and pattern.kind == "cosine" and pattern.frequency == DC:
        return 0.0 if pattern.inverse else 1.0
    if isinstance(pattern, Shown) and isinstance(pattern.content, Uniform):
        return pattern.content.level
    if isinstance(pattern, SideBySide) and len(set(pattern.inverted)) == 1:
        level = _level(pattern.pattern)
        return 1.0 - level if level is not None and pattern.inverted[0] else level
    return None
