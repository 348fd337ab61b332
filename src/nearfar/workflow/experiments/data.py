"""Data of experiments: arrays with numbers beside them, kept on the disk from run to run."""

import hashlib
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nearfar.errors import NearfarError, UnreadableFileError
from nearfar.files import new_output, read_arrays
from nearfar.release import version
from nearfar.scenes.cache import cache_folder

FORMAT = "nearfar figure data"
FORMAT_VERSION = 1
ABOUT = "about"
# Layers that display what was measured, and measure nothing.
DISPLAY_LAYERS = ("cli", "report")


@dataclass(frozen=True, eq=False)
class Data:
    """The results of an experiment.

    Attributes
    ----------
    arrays : mapping of str to ndarray
    numbers : mapping
        Whatever JSON holds.
    """

    arrays: Mapping[str, NDArray[Any]] = field(default_factory=dict)
    numbers: Mapping[str, Any] = field(default_factory=dict)


def together(parts: Sequence[Data]) -> Data:
    """Join what several experiments found; each has names of its own."""
    return Data(
        {name: values for part in parts for name, values in part.arrays.items()},
        {name: value for part in parts for name, value in part.numbers.items()},
    )


def write_data(path: Path, name: str, data: Data) -> None:
    """Write data as .npz: its arrays, and ``about``, JSON text with the numbers.

    Parameters
    ----------
    path : Path
    name : str
        Which experiment or figure.
    data : Data

    Raises
    ------
    NearfarError
        As `nearfar.files.new_output`.
    """
    about = {
        "format": FORMAT,
        "version": FORMAT_VERSION,
        "name": name,
        "nearfar": version(),
        "code": code_fingerprint(),
        "numbers": data.numbers,
    }
    with new_output(path, force=True) as partial, partial.open("wb") as file:
        text = np.array(json.dumps(about, allow_nan=False))
        arrays: dict[str, Any] = {**data.arrays, ABOUT: text}
        np.savez_compressed(file, **arrays)


def read_data(path: Path, name: str) -> Data:
    """Read what `write_data` wrote.

    Raises
    ------
    MissingFileError, UnreadableFileError
        If it is not there, damaged, of something else, or written by another version.
    """
    try:
        arrays = read_arrays(path)
    except UnreadableFileError:
        raise UnreadableFileError(
            f"{path} is damaged: its data are measured again and it is replaced."
        ) from None
    try:
        about = json.loads(str(arrays.pop(ABOUT)))
        written = (about["format"], about["version"], about["name"])
        by = (about["nearfar"], about["code"])
        numbers = about["numbers"]
    except (KeyError, TypeError, ValueError):
        raise UnreadableFileError(
            f"{path} holds no data of a figure: they are measured again and it is replaced."
        ) from None
    if written != (FORMAT, FORMAT_VERSION, name) or by != (version(), code_fingerprint()):
        raise UnreadableFileError(
            f"{path} was written by another version of nearfar ({by[0]}, code {by[1]}): its data "
            f"are measured again and it is replaced."
        )
    return Data(arrays, numbers)


def kept(name: str, make: Callable[[], Data], *, note: Callable[[str], None]) -> Data:
    """Read an experiment's data from the cache, or make them and keep them.

    Parameters
    ----------
    name : str
        Which experiment.
    make : callable
    note : callable
        Called with a sentence on why data that are there cannot be used, or could not be kept.

    Returns
    -------
    Data
    """
    path = cache_folder() / f"figures-{name}.npz"
    if path.exists():
        try:
            return read_data(path, name)
        except NearfarError as error:
            note(str(error))
    data = make()
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_data(path, name, data)
    except (NearfarError, OSError) as error:
        # On a full or read-only disk the data are returned all the same.
        note(f"the data of {name} are not kept for the next run: {error}")
    return data


@cache
def code_fingerprint() -> str:
    """Return a name that changes with the code that measures: no stale data are drawn."""
    digest = hashlib.sha256()
    home = Path(__file__).parents[2]
    for source in sorted(home.rglob("*.py")):
        place = source.relative_to(home)
        if place.parts[0] in DISPLAY_LAYERS:
            continue
        digest.update(place.as_posix().encode())
        digest.update(source.read_bytes())
    return digest.hexdigest()[:12]
