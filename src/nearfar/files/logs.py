"""Logs: a line of JSON for each thing that is on the disk, whole or not there."""

import json
import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypeVar

from nearfar.files.output import synchronise_entry

T = TypeVar("T")


def note(log: Path, words: Mapping[str, Any]) -> None:
    """Add a line to a log, and wait for the disk."""
    is_new = not log.exists()
    with log.open("ab") as file:
        file.write((json.dumps(words) + "\n").encode())
        file.flush()
        os.fsync(file.fileno())
    if is_new:
        synchronise_entry(log.parent)


def read_notes(log: Path, understood: Callable[[Mapping[str, Any]], T]) -> list[T]:
    """Read a log; what a crash tore off its last line is cut away.

    Parameters
    ----------
    log : Path
    understood : callable
        Makes of a line's words what is returned; where it raises ValueError or TypeError the
        log ends.

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
            words = json.loads(line)
            if not (line.endswith(b"\n") and isinstance(words, dict)):
                break
            notes.append(understood(words))
        except (ValueError, TypeError):
            break
        whole += len(line)
    if whole < len(data):
        os.truncate(log, whole)
    return notes
