"""Logs: one line of JSON for each thing that is on the disk, whole or absent."""

import json
import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypeVar

from nearfar.files.output import synchronise_entry

T = TypeVar("T")


def note(log: Path, entry: Mapping[str, Any]) -> None:
    """Add a line to a log, and wait for the disk."""
    is_new = not log.exists()
    with log.open("ab") as file:
        file.write((json.dumps(entry) + "\n").encode())
        file.flush()
        os.fsync(file.fileno())
    if is_new:
        synchronise_entry(log.parent)


def read_notes(log: Path, convert: Callable[[Mapping[str, Any]], T]) -> list[T]:
    """Read a log; a last line that a crash left incomplete is cut away.

    Parameters
    ----------
    log : Path
    convert : callable
        Turns the JSON object of a line into what is returned; where it raises ValueError or
        TypeError, the log ends.

    Returns
    -------
    list
        Nothing where there is no log.
    """
    try:
        data = log.read_bytes()
    except FileNotFoundError:
        return []
    notes: list[T] = []
    whole = 0
    for line in data.splitlines(keepends=True):
        try:
            entry = json.loads(line)
            if not (line.endswith(b"\n") and isinstance(entry, dict)):
                break
            notes.append(convert(entry))
        except (ValueError, TypeError):
            break
        whole += len(line)
    if whole < len(data):
        os.truncate(log, whole)
    return notes
