"""Write transports into files, block by block of camera rows."""

import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from nearfar.arrays import AnyPath, Floats
from nearfar.files import new_output
from nearfar.files.stores import add_array, add_to_store, open_durable_store
from nearfar.illumination.frequencies import frequency_to_text
from nearfar.transport.matrix_store import rows_of_chunk
from nearfar.transport.model import Transport
from nearfar.transport.parts import USUAL_PARTS
from nearfar.transport.posterior import Posterior
from nearfar.transport.posterior_store import array_name, described, write_shared
from nearfar.transport.rows import FIELDS, OPTIONAL_FACTORS, OPTIONAL_PARTS
from nearfar.transport.store_format import (
    KIND,
    PARTS_OF_T,
    POSTERIOR,
    QUALITY,
    SECOND,
    STORED_PARTS,
    VERDICT,
    VERSION_OF_HATS,
    VERSION_OF_OTHERS,
    VERSION_OF_PIXELS,
    VERSION_OF_SECOND_PLACES,
    factors_of,
)
from nearfar.transport.verdict import KeptVerdict, verdict_to_json


def write_transport(
    path: AnyPath, parts: Iterable[Transport], height: int, *, force: bool = False
) -> None:
    """Write a whole transport or nothing, block by block; `parts` may compute them one at a time.

    Parameters
    ----------
    path : str or Path
    parts : iterable of Transport
        Blocks of camera rows, in order, at least one. All but the last have the same height. The
        provenance is that of the last.
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

    Several processes, on several machines, may write at the same time: every chunk belongs to one
    block of rows, and the first to write creates the arrays, which are the same for all.

    Parameters
    ----------
    folder : Path
    part : Transport
    first : int
        First row of `part`, a multiple of `rows`.
    rows : int
        Rows of every block but the last.
    height : int
        Rows of the whole camera.
    """
    factors = [
        *factors_of(part.parts),
        *(name for name in OPTIONAL_FACTORS if getattr(part, name) is not None),
    ]
    values = {name: _as_stored(getattr(part, name)) for name in factors}
    for optional in OPTIONAL_PARTS:
        owner = getattr(part, optional)
        if owner is not None:
            names = FIELDS[type(owner)]
            part_name = STORED_PARTS[optional]
            values |= {array_name(part_name, name): getattr(owner, name) for name in names}
    group = add_to_store(folder, KIND, _version(part), _attributes(part))
    if part.posterior is not None and first == 0:
        write_shared(group, POSTERIOR, part.posterior)
    for name, one in values.items():
        # The chunks of a single block need not divide it.
        most = min(height, rows_of_chunk(one))
        chunk = (most if rows >= height else _dividing(rows, most), *one.shape[1:])
        array = add_array(group, name, (height, *one.shape[1:]), one.dtype, chunk)
        array[first : first + len(one)] = one


def _version(transport: Transport) -> int:
    if transport.second_place is not None:
        return VERSION_OF_SECOND_PLACES
    of_other_patterns = not isinstance(transport.posterior, Posterior | None)
    if of_other_patterns or transport.parts != USUAL_PARTS:
        return VERSION_OF_OTHERS
    return VERSION_OF_PIXELS if transport.pitch == 1 else VERSION_OF_HATS


def _as_stored(values: Floats) -> Floats:
    return values if values.dtype == np.float16 else np.asarray(values, np.float32)


def write_provenance(folder: Path, provenance: Mapping[str, Any]) -> None:
    """Write how a transport was made, once all of its rows are written."""
    group = add_to_store(folder, KIND, VERSION_OF_PIXELS)
    group.attrs["provenance"] = json.loads(json.dumps(dict(provenance)))


def write_verdict(folder: Path, verdict: KeptVerdict) -> None:
    """Keep a verdict with a transport, in place of the one that it has, in one step."""
    open_durable_store(folder).attrs[VERDICT] = verdict_to_json(verdict)


def _attributes(transport: Transport) -> dict[str, Any]:
    """Return the metadata that all camera pixels share, as JSON types."""
    attributes = {
        "projector": list(transport.projector),
        "far_frequencies": [frequency_to_text(k) for k in transport.far_basis.frequencies],
    }
    if transport.pitch > 1:
        attributes["pitch"] = transport.pitch
    if transport.second_place is not None:
        attributes[SECOND] = True
    if transport.posterior is not None:
        attributes[POSTERIOR] = described(transport.posterior)
    if transport.quality is not None:
        attributes[QUALITY] = {}
    if transport.parts != USUAL_PARTS:
        attributes[PARTS_OF_T] = list(transport.parts)
    if transport.verdict is not None:
        attributes[VERDICT] = verdict_to_json(transport.verdict)
    return attributes


def _dividing(rows: int, most: int) -> int:
    """Return the largest number up to `most` that divides `rows`."""
    return next(count for count in range(min(most, rows), 0, -1) if rows % count == 0)
