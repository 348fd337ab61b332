"""Photos of a finished capture that are taken again."""

import os
import shutil
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import AnyPath
from nearfar.capture.checks import (
    as_photo,
    check_count,
    check_full_scale,
    check_order,
    check_photo,
)
from nearfar.capture.store import Capture, open_capture, white_and_black
from nearfar.errors import InputError
from nearfar.files import new_output
from nearfar.files.stores import add_array, open_durable_store, read_selection
from nearfar.progress import Report, ignore_progress


def replace_photos(
    path: AnyPath,
    numbers: Sequence[int],
    photos: Iterable[NDArray[Any]],
    *,
    conditions: Callable[[], Mapping[str, float]] = dict,
    alarms: Callable[[], Sequence[str]] = list,
    progress: Report = ignore_progress,
) -> Capture:
    """Put new photos in the places of old ones; the capture changes as a whole or not at all.

    Parameters
    ----------
    path : str or Path
        A finished capture.
    numbers : sequence of int
        Which photos.
    photos : iterable of arrays
        One for each of them, in that order, of the shape and type of the capture's.
    conditions, alarms : callable
        Return the conditions of the last photo, and all alarms so far.
    progress : callable, optional
        Called with "photos" and the share of them that is replaced, 0 to 1, after each.

    Returns
    -------
    Capture

    Raises
    ------
    InputError
        If there is no such photo in the capture, or a new one has another shape or type.
    MissingFileError, UnreadableFileError, StorageError
    """
    path = Path(path)
    capture = open_capture(path)
    count = len(capture.plan.patterns)
    beyond = [n for n in numbers if not 0 <= n < count]
    if beyond:
        raise InputError(f"{path} has no photo {beyond[0]}: its photos are 0 to {count - 1}.")
    first = read_selection(capture.photos, (0,))
    ends = white_and_black(capture.plan)
    means = np.full(count, np.nan)
    for number in ends or ():
        means[number] = read_selection(capture.photos, (number,)).mean(dtype=np.float64)
    with new_output(path, force=True) as partial:
        # Files are replaced and never written into, so that the old capture's stay as they are.
        shutil.copytree(path.resolve(), partial, copy_function=_link)
        group = open_durable_store(partial)
        old = capture.photos
        stored = add_array(group, "photos", old.shape, old.dtype, old.chunks)
        times, saturated = capture.times.copy(), capture.saturated.copy()
        by_name = {name: list(values) for name, values in capture.conditions.items()}
        remaining = iter(photos)
        for done, number in enumerate(numbers, start=1):
            name = f"photo {number}"
            photo = next(remaining, None)
            if photo is None:
                check_count(done - 1, len(numbers), more=False)
            photo = as_photo(photo, name)
            check_photo(photo, first, capture.full_scale, name)
            is_white = ends is not None and number == ends[0]
            check_full_scale(photo, capture.full_scale, name, is_white=is_white)
            means[number] = photo.mean(dtype=np.float64)
            check_order(ends, means, [f"photo {i}" for i in range(count)])
            stored[number] = photo
            times[number] = time.time()
            saturated[number] = np.mean(photo >= capture.full_scale)
            for condition, value in conditions().items():
                by_name.setdefault(condition, [None] * count)[number] = value
            progress("photos", done / len(numbers))
        for name, values in (("time", times), ("saturated", saturated)):
            add_array(group, name, (count,), np.float64, (count,))[:] = values
        group.attrs["conditions"] = by_name
        group.attrs["alarms"] = [*capture.alarms, *alarms()]
    return open_capture(path)


def _link(source: str, target: str) -> None:
    """Give a file a second name; copy it where the file system has no hard links."""
    try:
        os.link(source, target)
    except OSError:
        shutil.copy2(source, target)
