"""Transports in files: factors in chunks of camera rows."""

import json
import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from nearfar.arrays import AnyPath, Floats, Size, as_size, blocks
from nearfar.checks import require_instance
from nearfar.deprecation import path_after_content
from nearfar.errors import UnreadableFileError
from nearfar.files import new_output
from nearfar.files.stores import (
    add_array,
    add_to_store,
    open_array,
    open_durable_store,
    open_store,
    read_selection,
)
from nearfar.illumination.frequencies import frequency_from_text, frequency_to_text
from nearfar.illumination.near_basis import basis_of
from nearfar.illumination.real_basis import RealBasis, real_basis
from nearfar.transport.gains import gains_of
from nearfar.transport.matrix_store import rows_of_chunk
from nearfar.transport.model import Transport
from nearfar.transport.parts import USUAL_PARTS, Parts, parts_from_json
from nearfar.transport.posterior import Posterior
from nearfar.transport.posterior_store import (
    SharedPosterior,
    array_name,
    described,
    listed,
    shared_posterior,
    write_shared,
)
from nearfar.transport.quality import Quality
from nearfar.transport.rows import (
    FACTORS,
    FIELDS,
    OPTIONAL_FACTORS,
    OPTIONAL_PARTS,
    QUALITY_FIELDS,
    stacked,
    thinned_blocks,
)
from nearfar.transport.verdict import KeptVerdict, verdict_from_json, verdict_to_json

KIND = "nearfar transport"
# Version 2 added functions of near-range light that are of several projector pixels, and
# footprints. Version 3 added transports without direct, near- or far-range light, and posteriors of
# estimates from any patterns and of free rows. Other transports of single pixels are still written
# as version 1, which older versions of nearfar read.
VERSION_OF_PIXELS, VERSION_OF_HATS, VERSION_OF_OTHERS = 1, 2, 3
READABLE_VERSIONS = (VERSION_OF_PIXELS, VERSION_OF_HATS, VERSION_OF_OTHERS)

# Of a projector or a camera in a file, in pixels.
LARGEST_SIDE = 2**20

# Characters of a message that are quoted from a file.
MAXIMUM_REASON = 200

# Memory of a block of a transport that is read block by block.
READ_BYTES = 2**28

# Attribute of the verdict on a transport, which is not there where none was passed.
VERDICT = "verdict"
# That of the parts of a transport that has not the usual ones.
PARTS_OF_T = "parts"

# An optional part of a transport is stored as a mapping in the attributes and as arrays named
# PART_FIELD. The posterior and some of its fields have older names in the format.
POSTERIOR, QUALITY = "belief", "quality"
STORED_PARTS = {"posterior": POSTERIOR, "quality": QUALITY}


@path_after_content
def save_transport(transport: Transport, path: AnyPath, *, force: bool = False) -> None:
    """Write a transport as a Zarr group, whole or not at all.

    Parameters
    ----------
    transport : Transport
    path : str or Path
        Folder to make, ending in ``.zarr`` by custom.
    force : bool
        Replace a transport that is there.

    Raises
    ------
    ExistingOutputError, MissingFileError, StorageError
        As `nearfar.files.new_output`.

    Examples
    --------
    >>> nearfar.save_transport(transport, "transport.zarr")
    """
    require_instance(transport, Transport, "transport", "nearfar.reconstruct")
    write_transport(path, [transport], transport.camera.height, force=force)


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


def factors_of(parts: Parts) -> tuple[str, ...]:
    """Return the factors that a transport of some parts has in a file."""
    has_far = not {"far", "free"}.isdisjoint(parts)
    absent = {"near": "near" not in parts, "far": not has_far}
    absent |= dict.fromkeys(("correspondence", "direct"), "direct" not in parts)
    return tuple(name for name in FACTORS if not absent.get(name, False))


def _version(transport: Transport) -> int:
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


@dataclass(frozen=True)
class StoredTransport:
    """A transport in a file, whose camera rows are read on demand.

    Attributes
    ----------
    path : Path
    projector : Size
    camera : Size
    far_basis : RealBasis
    provenance : mapping
    channels : int
    verdict : KeptVerdict or None
        Whether it can be trusted; None if it was not judged.
    pitch : int
        Projector pixels between the functions of near-range light.
    parts : tuple of str
        What T is split into.
    """

    path: Path
    projector: Size
    camera: Size
    far_basis: RealBasis
    provenance: Mapping[str, Any]
    channels: int
    verdict: KeptVerdict | None
    pitch: int
    _arrays: Mapping[str, Any]
    _posterior: SharedPosterior | None
    parts: Parts = USUAL_PARTS

    def rows(self, rows: slice = slice(None)) -> Transport:
        """Read some rows of the camera.

        Raises
        ------
        UnreadableFileError
            If their chunks are damaged.
        """
        read = {name: read_selection(array, (rows,)) for name, array in self._arrays.items()}
        try:
            posterior = None if self._posterior is None else self._posterior.of(read, POSTERIOR)
        except ValueError:
            raise _misfit(self.path) from None
        quality_fields: dict[str, Any] = {
            name: read.pop(f"{QUALITY}_{name}")
            for name in QUALITY_FIELDS
            if f"{QUALITY}_{name}" in read
        }
        each = read["black"].shape
        for name, shape in (("direct", each), ("near", (*each, 0, 0)), ("far", (*each, 0))):
            read.setdefault(name, np.zeros(shape, np.float32))
        read.setdefault("correspondence", np.full((*each[:2], 2), np.nan, np.float32))
        return Transport(
            projector=self.projector,
            far_basis=self.far_basis,
            provenance=self.provenance,
            posterior=posterior,
            quality=Quality(**quality_fields) if quality_fields else None,
            verdict=self.verdict,
            pitch=self.pitch,
            parts=self.parts,
            **read,
        )

    @property
    def nbytes(self) -> int:
        """Bytes that the whole transport takes in memory."""
        return self.camera.height * self._row_bytes

    @property
    def _row_bytes(self) -> int:
        return sum(
            array.dtype.itemsize * math.prod(array.shape[1:]) for array in self._arrays.values()
        )

    def blocks(self, size: int = READ_BYTES) -> Iterator[Transport]:
        """Yield the transport in blocks of camera rows of at most `size` bytes."""
        for rows in blocks(self.camera.height, size // self._row_bytes):
            yield self.rows(rows)

    def black(self) -> Floats:
        """Read the photo under black, (Cy, Cx, channels)."""
        return read_selection(self._arrays["black"], (slice(None),))

    def thinned(self, step: int) -> Transport:
        """Read the middle camera pixel of each cell of `step` rows and columns."""
        return stacked(list(thinned_blocks(self.blocks(), self.camera.height, step)))


def open_transport(path: AnyPath) -> StoredTransport:
    """Open a transport for reading some of its rows.

    Raises
    ------
    MissingFileError, UnreadableFileError
        If it is not there, damaged, of another kind or of another version.
    """
    path = Path(path)
    group = open_store(path, KIND, *READABLE_VERSIONS)
    posterior = verdict = None
    try:
        parts = parts_from_json(group.attrs.get(PARTS_OF_T, list(USUAL_PARTS)))
        arrays = {name: open_array(group, name) for name in factors_of(parts)}
        of_near = tuple(arrays["near"].shape[3:]) if "near" in arrays else (0, 0)
        near_basis = basis_of(of_near, stored_pitch(group.attrs))
        projector = stored_size(group.attrs["projector"])
        frequencies = [frequency_from_text(k) for k in listed(group.attrs["far_frequencies"])]
        provenance = dict(_mapped(group.attrs["provenance"]))
        gains_of(provenance)
        if POSTERIOR in group.attrs:
            described_as = _mapped(group.attrs[POSTERIOR])
            posterior = shared_posterior(described_as, group, POSTERIOR, projector)
        if VERDICT in group.attrs:
            verdict = verdict_from_json(_mapped(group.attrs[VERDICT]))
    except (KeyError, TypeError, ValueError, OverflowError) as error:
        raise UnreadableFileError(
            f"{path} is damaged: its zarr.json does not describe a transport "
            f"({str(error)[:MAXIMUM_REASON]}); reconstruct it again."
        ) from None
    basis = real_basis(frequencies, projector)
    each = tuple(int(side) for side in arrays["black"].shape)
    shapes = {
        "direct": each,
        "correspondence": (*each[:2], 2),
        "near": (*each, *near_basis.shape),
        "far": (*each, basis.count),
        "black": each,
        "noise": each,
    }
    if near_basis.pitch > 1:
        arrays |= {name: open_array(group, name) for name in OPTIONAL_FACTORS}
        shapes |= dict.fromkeys(OPTIONAL_FACTORS, (*each[:2], 4))
    _require_shapes(path, arrays, shapes)
    if posterior is not None:
        names = posterior.arrays(POSTERIOR)
        arrays |= {name: open_array(group, name) for name in names}
        if not posterior.fits(arrays, POSTERIOR, projector, each):
            raise _misfit(path)
    if QUALITY in group.attrs:
        quality = {
            f"{QUALITY}_{name}": open_array(group, f"{QUALITY}_{name}") for name in QUALITY_FIELDS
        }
        arrays |= quality
        layouts = [(array.shape, array.dtype.kind) for array in quality.values()]
        if layouts != [(each[:2], "f"), (each[:2], "b")]:
            raise UnreadableFileError(
                f"{path} is damaged: its quality maps do not fit the transport; "
                f"reconstruct it again."
            )
    return StoredTransport(
        path,
        basis.projector,
        Size(*each[:2]),
        basis,
        provenance,
        each[2],
        verdict,
        near_basis.pitch,
        arrays,
        posterior,
        parts,
    )


def _require_shapes(
    path: Path, arrays: Mapping[str, Any], shapes: Mapping[str, tuple[int, ...]]
) -> None:
    """Refuse arrays of other shapes than a transport has."""
    for name in shapes.keys() & arrays.keys():
        if len(shapes["black"]) != 3 or arrays[name].shape != shapes[name]:
            raise UnreadableFileError(
                f"{path} is damaged: its {name} has shape {arrays[name].shape}, not "
                f"{shapes[name]}; reconstruct it again."
            )


def _misfit(path: Path) -> UnreadableFileError:
    return UnreadableFileError(
        f"{path} is damaged: the posterior of its error bars does not fit the transport; "
        f"reconstruct it again."
    )


def load_transport(path: AnyPath) -> Transport:
    """Read all of a transport.

    Parameters
    ----------
    path : str or Path
        What `save_transport` or ``nearfar reconstruct`` wrote.

    Returns
    -------
    Transport

    Raises
    ------
    MissingFileError, UnreadableFileError
        If it is not there, damaged, of another kind or of another version.

    Examples
    --------
    >>> nearfar.save_transport(transport, "kept.zarr")
    >>> kept = nearfar.load_transport("kept.zarr")
    >>> bool(np.allclose(kept @ light, relit))
    True
    """
    return open_transport(path).rows()


def stored_size(value: Any) -> Size:
    """Return a size from JSON; ValueError or TypeError if it is none, or larger than any."""
    size = as_size(listed(value))
    if max(size) > LARGEST_SIDE:
        raise ValueError(f"a side is over {LARGEST_SIDE}")
    return size


def stored_pitch(attributes: Any) -> int:
    """Return the pitch of a transport from its attributes; ValueError if it is none."""
    pitch = attributes.get("pitch", 1)
    if not isinstance(pitch, int) or not 1 <= pitch <= LARGEST_SIDE:
        raise ValueError(f"{pitch!r} is no pitch")
    return pitch


def _mapped(value: Any) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise TypeError(f"{value!r} is no mapping")
    return value
