"""Tables of numbers: a line of text for each row, with blanks or commas between; or .npy."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from nearfar.errors import InputError, MissingFileError, UnreadableFileError
from nearfar.files.arrays import read_arrays
from nearfar.files.images import require_finite

TEXT_ENDINGS = (".csv", ".txt", ".tsv")


def is_table(path: Path) -> bool:
    """Return whether a name is that of a table of text."""
    return path.suffix.lower() in TEXT_ENDINGS


def read_table(path: Path) -> NDArray[np.float32]:
    """Read a table of text or an .npy, (rows, columns), float32.

    Blank lines and lines that begin with # are skipped.

    Raises
    ------
    MissingFileError, UnreadableFileError, InputError
        If it is not there, cannot be read, or is no table of finite numbers.
    """
    if path.suffix.lower() == ".npy":
        found = read_arrays(path)["array"]
        if found.dtype.kind not in "fiu" or found.ndim not in {1, 2} or not found.size:
            raise InputError(f"{path} is no table of numbers: give an array of rows of numbers.")
        table = found.reshape(len(found), -1).astype(np.float32)
    else:
        table = _parsed(path, read_text(path))
    require_finite(table, str(path))
    return table


def read_text(path: Path) -> str:
    """Read a file of text; raises MissingFileError or UnreadableFileError."""
    try:
        return path.read_text(encoding="utf-8-sig")
    except FileNotFoundError:
        raise MissingFileError(f"{path} is not there: check its name.") from None
    except (OSError, UnicodeDecodeError) as error:
        raise UnreadableFileError(
            f"{path} cannot be read as text ({error}): give a text file."
        ) from error


def _parsed(path: Path, text: str) -> NDArray[np.float32]:
    rows: list[list[float]] = []
    for number, line in enumerate(text.splitlines(), start=1):
        words = line.replace(",", " ").replace(";", " ").split()
        if not words or words[0].startswith("#"):
            continue
        try:
            rows.append([float(word) for word in words])
        except ValueError:
            raise InputError(
                f"line {number} of {path} is not of numbers: give a row of numbers on each line."
            ) from None
        if len(rows[-1]) != len(rows[0]):
            raise InputError(
                f"line {number} of {path} has {len(rows[-1])} numbers, the first one has "
                f"{len(rows[0])}: give as many on each."
            )
    if not rows:
        raise InputError(f"{path} has no numbers: give a row of numbers on each line.")
    return np.array(rows, dtype=np.float32)
