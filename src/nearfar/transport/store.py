"""Transports on the disk: factors in chunks of camera rows."""

import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from nearfar.arrays import AnyPath, Floats, Size
from nearfar.errors import UnreadableFileError
from nearfar.files import add_array, add_to_store, new_output, open_store, read_array
from nearfar.illumination.frequencies import frequency_from_text, frequency_to_text
from nearfar.transport.belief import Belief
from nearfar.transport.far import RealBasis, real_basis
from nearfar.transport.kinds import Kind
from nearfar.transport.model import Transport
from nearfar.transport.rows import BELIEVED, FACTORS

KIND = "nearfar transport"
FORMAT_VERSION = 1
# Bytes of a chunk: large enough for the disk, small enough to read a few rows.
CHUNK_BYTES = 8 * 2**20

# Of the belief, where there is one: a mapping of its own in the attributes, and arrays.
BELIEF = "belief"


def save_transport(path: AnyPath, transport: Transport, *, force: bool = False) -> None:
    """Write a transport as a Zarr group, whole or not at all.

    Raises
    ------
    ExistingOutputError, MissingFileError, StorageError
        As `nearfar.files.new_output`.
    """
    write_transport(path, [transport], transport.camera.height, force=force)


def write_transport(
    path: AnyPath, parts: Iterable[Transport], height: int, *, force: bool = False
) -> None:
    """Write a transport block by block, whole or not at all; each is asked for in its turn.

    Parameters
    ----------
    path : str or Path
    parts : iterable of Transport
        Blocks of camera rows, in order, at least one, all but the last of one height. Provenance
        is the last one's.
    height : int
        Rows of the whole camera.
    force : bool
        Replace a transport that is there.

    Raises
    ------
    ExistingOutputError, MissingFileError, StorageError
        As `nearfar.files.new_output`.
    """
    with new_output(Path(path), force=force) as partial:
        first, rows = 0, 0
        for part in parts:
            rows = rows or part.camera.height
            write_rows(partial, part, first, rows=rows, height=height)
            first += part.camera.height
            write_provenance(partial, part.provenance)


def write_rows(folder: Path, part: Transport, first: int, *, rows: int, height: int) -> None:
    """Write some rows of a transport into a folder within `nearfar.files.new_output`.

    Several may do so at once, from other processes and machines too: whoever is first lays the
    arrays out, all in the same way, and every chunk belongs to one block of rows.

    Parameters
    ----------
    folder : Path
    part : Transport
    first : int
        Its first row, a multiple of `rows`.
    rows : int
        Rows of all blocks but the last.
    height : int
        Rows of the whole camera.
    """
    values = {name: np.asarray(getattr(part, name), np.float32) for name in FACTORS}
    if part.belief is not None:
        values |= {f"{BELIEF}_{name}": getattr(part.belief, name) for name in BELIEVED}
    group = add_to_store(folder, KIND, FORMAT_VERSION, _attributes(part))
    for name, one in values.items():
        # A single block has its chunks to itself, whatever their rows.
        most = min(height, rows_of_chunk(one))
        chunk = (most if rows >= height else _dividing(rows, most), *one.shape[1:])
        array = add_array(group, name, (height, *one.shape[1:]), one.dtype, chunk)
        array[first : first + len(one)] = one


def write_provenance(folder: Path, provenance: Mapping[str, Any]) -> None:
    """Say of a transport, all rows of which are written, how it was made."""
    group = add_to_store(folder, KIND, FORMAT_VERSION)
    group.attrs["provenance"] = json.loads(json.dumps(dict(provenance)))


def _attributes(transport: Transport) -> dict[str, Any]:
    """Lay out for JSON what all camera pixels share."""
    attributes = {
        "projector": list(transport.projector),
        "far_frequencies": [frequency_to_text(k) for k in transport.far_basis.frequencies],
    }
    if transport.belief is not None:
        attributes[BELIEF] = _described(transport.belief)
    return attributes


def _described(belief: Belief) -> dict[str, Any]:
    """Lay what all camera pixels share of a belief out for JSON."""
    return {
        "kinds": [list(kind) for kind in belief.kinds],
        "frequencies": [frequency_to_text(k) for k in belief.frequencies],
        "repeats": [float(count) for count in belief.repeats],
    }


def _read_belief(group: Any, described: dict[str, Any]) -> Belief:
    return Belief(
        kinds=tuple(Kind(*(float(value) for value in kind)) for kind in described["kinds"]),
        frequencies=tuple(frequency_from_text(k) for k in listed(described["frequencies"])),
        repeats=np.array([float(count) for count in described["repeats"]], dtype=np.float32),
        **{name: read_array(group, f"{BELIEF}_{name}") for name in BELIEVED},
    )


def _belief_fits(belief: Belief, basis: RealBasis, shape: tuple[int, ...]) -> bool:
    count = real_basis(belief.frequencies, basis.projector).count
    flat = (belief.kind.shape, belief.strength.shape) == (shape[:2], shape[:2])
    full = all(getattr(belief, name).shape == shape for name in BELIEVED[2:])
    places = belief.kind.dtype == np.uint8 and int(belief.kind.max(initial=0)) < len(belief.kinds)
    return flat and full and places and belief.repeats.shape == (count,)


def rows_of_chunk(values: Floats) -> int:
    """Rows of an array that make some megabytes."""
    return max(1, CHUNK_BYTES // max(1, values[:1].nbytes))


def _dividing(rows: int, most: int) -> int:
    """Return the largest number up to `most` that divides `rows`."""
    return next(count for count in range(min(most, rows), 0, -1) if rows % count == 0)


def write_in_rows(group: Any, name: str, values: Floats) -> None:
    """Write an array in chunks of rows of some megabytes."""
    rows = min(len(values), rows_of_chunk(values))
    add_array(group, name, values.shape, values.dtype, (rows, *values.shape[1:]))[:] = values


def load_transport(path: AnyPath) -> Transport:
    """Read a transport.

    Raises
    ------
    MissingFileError, UnreadableFileError
        If it is not there, damaged, of another kind or of another version.
    """
    path = Path(path)
    group = open_store(path, KIND, FORMAT_VERSION)
    factors = {name: read_array(group, name) for name in FACTORS}
    try:
        height, width = (int(side) for side in listed(group.attrs["projector"]))
        frequencies = [frequency_from_text(k) for k in listed(group.attrs["far_frequencies"])]
        provenance = dict(_mapped(group.attrs["provenance"]))
        belief = (
            _read_belief(group, _mapped(group.attrs[BELIEF])) if BELIEF in group.attrs else None
        )
    except (KeyError, TypeError, ValueError) as error:
        raise UnreadableFileError(
            f"{path} is damaged: its zarr.json does not describe a transport ({error}); "
            f"reconstruct it again."
        ) from None
    projector = Size(height, width)
    basis = real_basis(frequencies, projector)
    camera_and_channels = factors["direct"].shape
    window = factors["near"].shape[-1]
    shapes = {
        "correspondence": (*camera_and_channels[:2], 2),
        "near": (*camera_and_channels, window, window),
        "far": (*camera_and_channels, basis.count),
        "black": camera_and_channels,
        "noise": camera_and_channels,
    }
    for name, shape in shapes.items():
        if len(camera_and_channels) != 3 or factors[name].shape != shape:
            raise UnreadableFileError(
                f"{path} is damaged: its {name} has shape {factors[name].shape}, not {shape}; "
                f"reconstruct it again."
            )
    if belief is not None and not _belief_fits(belief, basis, camera_and_channels):
        raise UnreadableFileError(
            f"{path} is damaged: what its error bars follow from does not fit the transport; "
            f"reconstruct it again."
        )
    return Transport(
        projector=projector, far_basis=basis, provenance=provenance, belief=belief, **factors
    )


def listed(value: Any) -> list[Any]:
    """Return a JSON list; TypeError if it is none."""
    if not isinstance(value, list):
        raise TypeError(f"{value!r} is no list")
    return value


def _mapped(value: Any) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise TypeError(f"{value!r} is no mapping")
    return value
