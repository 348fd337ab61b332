"""Transports in files, whose camera rows are read on demand."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from nearfar.arrays import AnyPath, Floats, Size, blocks
from nearfar.errors import UnreadableFileError
from nearfar.files.stores import open_array, open_store, read_selection
from nearfar.illumination.frequencies import frequency_from_text
from nearfar.illumination.near_basis import basis_of
from nearfar.illumination.real_basis import RealBasis, real_basis
from nearfar.transport.edits import edits_of
from nearfar.transport.gains import gains_of
from nearfar.transport.model import Transport
from nearfar.transport.parts import USUAL_PARTS, Parts, parts_from_json
from nearfar.transport.posterior_store import SharedPosterior, listed, shared_posterior
from nearfar.transport.quality import Quality
from nearfar.transport.rows import QUALITY_FIELDS, stacked, thinned_blocks
from nearfar.transport.store_format import (
    KIND,
    MAXIMUM_REASON,
    PARTS_OF_T,
    POSTERIOR,
    QUALITY,
    READABLE_VERSIONS,
    SECOND,
    VERDICT,
    factors_of,
    mapped,
    stored_pitch,
    stored_size,
)
from nearfar.transport.verdict import KeptVerdict, verdict_from_json

# Memory of a block of a transport that is read block by block.
READ_BYTES = 2**28


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
    def has_error_bars(self) -> bool:
        """Whether error bars follow from its estimate."""
        return self._posterior is not None

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
        provenance = dict(mapped(group.attrs["provenance"]))
        gains_of(provenance)
        edits_of(provenance)
        if POSTERIOR in group.attrs:
            described_as = mapped(group.attrs[POSTERIOR])
            posterior = shared_posterior(described_as, group, POSTERIOR, projector)
        if VERDICT in group.attrs:
            verdict = verdict_from_json(mapped(group.attrs[VERDICT]))
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
    optional = {
        "footprint": (*each[:2], 4) if near_basis.pitch > 1 else None,
        "second_place": (*each[:2], 2) if SECOND in group.attrs else None,
        "second_direct": each if SECOND in group.attrs else None,
    }
    there = {name: shape for name, shape in optional.items() if shape is not None}
    arrays |= {name: open_array(group, name) for name in there}
    shapes |= there
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
