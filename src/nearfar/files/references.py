"""Lists of reference photos: which lamps each of them shows."""

import json
import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from nearfar.arrays import Floats
from nearfar.errors import InputError
from nearfar.files.tables import read_text

RANGE = re.compile(r"(\d+)-(\d+)")
ALL = "all"


def read_references(path: Path, lamps: Sequence[str]) -> tuple[list[Path], Floats]:
    """Read which lamps each reference photo shows.

    A line of text is ``PHOTO: LAMPS``, the photo relative to the file. Lamps are ``all``, names of
    their photos without the ending, numbers from 0, or ranges such as ``0-7``; ``3*0.5`` is lamp 3
    at half its light. JSON is an object of the same, ``{"PHOTO": "LAMPS"}``.

    Parameters
    ----------
    path : Path
    lamps : sequence of str
        Names of the lamps.

    Returns
    -------
    photos : list of Path
    lit : ndarray, shape (k, n)
        Share at which each lamp is lit.

    Raises
    ------
    MissingFileError, UnreadableFileError, InputError
        If the list cannot be read, or names no photo or lamp.
    """
    found = _pairs(path, read_text(path))
    if not found:
        raise InputError(f"{path} lists no reference photo: give lines such as 'all.png: all'.")
    lit = np.array([_lit(path, photo, which, lamps) for photo, which in found])
    return [path.parent / photo for photo, _ in found], lit


def _pairs(path: Path, text: str) -> list[tuple[str, str]]:
    if text.lstrip().startswith("{"):
        try:
            pairs = json.loads(text).items()
        except (ValueError, RecursionError) as error:
            raise InputError(f"{path} is no JSON ({error}): mend it, or give lines.") from None
        return [(str(photo), str(which)) for photo, which in pairs]
    found = []
    for number, line in enumerate(text.splitlines(), start=1):
        photo, colon, which = line.partition(":")
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        if not colon:
            raise InputError(
                f"line {number} of {path} has no colon: give lines such as 'all.png: all'."
            )
        found.append((photo.strip(), which))
    return found


def _lit(path: Path, photo: str, which: str, lamps: Sequence[str]) -> Floats:
    lit = np.zeros(len(lamps))
    for word in which.replace(",", " ").split():
        name, _, share = word.partition("*")
        try:
            level = float(share) if share else 1.0
        except ValueError:
            level = float("nan")
        chosen = _lamps_of(name, lamps)
        if not chosen or not 0 <= level < np.inf:
            raise InputError(
                f"{path} says that {photo} shows {word!r}, which is no lamp: name one of the "
                f"{len(lamps)}, from {lamps[0]} (or 0) to {lamps[-1]} (or {len(lamps) - 1}), a "
                f"range such as 0-7, or all."
            )
        lit[chosen] = level
    if not lit.any():
        raise InputError(f"{path} names no lamp of {photo}: give lines such as 'all.png: all'.")
    return lit


def _lamps_of(name: str, lamps: Sequence[str]) -> list[int]:
    """Return the lamps that a word names; none if it names none."""
    if name == ALL:
        return list(range(len(lamps)))
    if name in lamps:
        return [lamps.index(name)]
    if found := RANGE.fullmatch(name):
        first, last = int(found[1]), int(found[2])
        return list(range(first, last + 1)) if first <= last < len(lamps) else []
    return [int(name)] if name.isdecimal() and int(name) < len(lamps) else []
