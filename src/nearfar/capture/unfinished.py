"""Captures that are being taken or were stopped: what is known of their photos."""

import json
from collections.abc import Mapping, Sequence
from os.path import realpath
from pathlib import Path
from typing import Any, NamedTuple

from nearfar.arrays import AnyPath
from nearfar.capture.store import FORMAT_VERSION, KIND, is_positive
from nearfar.errors import InputError, UnreadableFileError
from nearfar.files import UNFINISHED, ResumableKind
from nearfar.files.stores import open_store
from nearfar.plan.model import parse_plan

# A line for each photo that is on the disk; gone once the capture is whole.
LOG_NAME = "photos.jsonl"


class Taken(NamedTuple):
    """Log entry of one photo; the fields are named as in the log."""

    time: float
    saturated: float
    mean: float
    # Whether it is the first photo again.
    same: bool
    # What may change from photo to photo, such as temperatures.
    conditions: Mapping[str, float] = {}
    # Alarms since the photo before, a sentence each.
    alarms: Sequence[str] = ()


def count_photos(folder: Path) -> int:
    """Return how many photos of a capture that is not finished are on the disk."""
    try:
        return (folder / LOG_NAME).read_bytes().count(b"\n")
    except FileNotFoundError:
        return 0


def has_photos(folder: Path) -> bool:
    """Return whether any photo of a capture that is not finished is on the disk."""
    return count_photos(folder) > 0


RESUMABLE_CAPTURE = ResumableKind(LOG_NAME, has_photos)


class UnfinishedCapture(NamedTuple):
    """Log of a capture that was started and not finished.

    Attributes
    ----------
    photos : int
        How many are on the disk.
    exposure : float or None
        In seconds.
    """

    photos: int
    exposure: float | None


def unfinished_capture(path: AnyPath) -> UnfinishedCapture:
    """Read the log of an unfinished capture; the result has no exposure if there are no photos.

    Raises
    ------
    UnreadableFileError
        If what is there is no such capture.
    """
    folder = Path(f"{realpath(path)}{UNFINISHED}")
    if not has_photos(folder):
        return UnfinishedCapture(0, None)
    exposure = open_store(folder, KIND, FORMAT_VERSION).attrs.get("exposure")
    return UnfinishedCapture(count_photos(folder), exposure if is_positive(exposure) else None)


def plan_as_now(kept: object) -> object:
    """Return the JSON of a plan that an earlier nearfar kept as this one writes it.

    What is no plan is returned as it is.
    """
    try:
        return json.loads(parse_plan(json.dumps(kept)).to_json())
    except UnreadableFileError:
        return kept


def other_plan(folder: Path, before: object, now: Mapping[str, Any]) -> str:
    """Return the message that refuses another plan; it names the option if that differs alone."""

    def patterns_of(plan: object) -> list[Any]:
        patterns = plan.get("patterns") if isinstance(plan, Mapping) else None
        return patterns if isinstance(patterns, list) else []

    def of_transport(plan: object) -> list[Any]:
        return [
            p for p in patterns_of(plan) if not isinstance(p, dict) or p.get("purpose") != "check"
        ]

    if of_transport(before) and of_transport(before) == of_transport(now):
        if len(patterns_of(before)) > len(patterns_of(now)):
            return (
                f"{folder} was started with `with_checks(plan)`: give `with_checks(plan)` with "
                f"`resume=True`."
            )
        return f"{folder} was started without `with_checks(plan)`: leave out `with_checks(plan)`."
    return (
        f"{folder} was started with another plan: give that one, or start anew with `force=True`."
    )


def require_same_rig(path: Path, before: object, now: Mapping[str, Any], otherwise: str) -> None:
    """Refuse to go on with a rig that is not as it was.

    Parameters
    ----------
    path : Path
        The capture.
    before, now : mapping
        Descriptions of the rig.
    otherwise : str
        What else can be done, in words.

    Raises
    ------
    InputError
    """
    now = json.loads(json.dumps(now))
    if before != now:
        raise InputError(
            f"{path} was started with another rig ({_different(before, now)}): set it up as it "
            f"was, or {otherwise}."
        )


def _different(before: object, now: Mapping[str, Any]) -> str:
    if not isinstance(before, Mapping):
        return "its description is damaged"
    return ", ".join(
        name for name in {**before, **now} if before.get(name, ...) != now.get(name, ...)
    )
