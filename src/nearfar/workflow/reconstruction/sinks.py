"""Sinks for the tiles of a transport: memory, or a file of which a stopped job can be resumed."""

import hashlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from nearfar.capture import Capture
from nearfar.correspondence import Correspondence, joined
from nearfar.errors import InputError, KeptInterrupt, NearfarError, UselessPhotosError
from nearfar.files import UNFINISHED, ResumableKind, new_output, resumable_output
from nearfar.files.logs import note, read_notes
from nearfar.release import version
from nearfar.transport.model import Transport
from nearfar.transport.rows import stacked
from nearfar.transport.store_writing import write_provenance, write_rows
from nearfar.workflow.reconstruction.job import ReconstructedTile
from nearfar.workflow.reconstruction.options import ReconstructionOptions
from nearfar.workflow.reconstruction.summary import Summary
from nearfar.workflow.reconstruction.tiles import Tiling

# Its first line is the identity of the job; each further line is the summary of a written tile. It
# is removed once the transport is complete.
LOG_NAME = "blocks.jsonl"


def _has_tiles(folder: Path) -> bool:
    # Of a job that may be at work: its log is not read as one's own, which is mended.
    try:
        return (folder / LOG_NAME).read_bytes().count(b"\n") > 1
    except FileNotFoundError:
        return False


RESUMABLE_TRANSPORT = ResumableKind(LOG_NAME, _has_tiles)


class Store(Protocol):
    """Stores tiles, from several threads at a time."""

    def put(self, tile: slice, part: ReconstructedTile) -> Summary:
        """Store a tile and return its summary."""
        ...


class Sink(Protocol):
    """Collects the tiles of one transport."""

    @property
    def store(self) -> Store:
        """Where executors store tiles."""
        ...

    def stored(self) -> Mapping[int, Summary]:
        """Return the summaries of the tiles that are stored already, by their first row."""
        ...

    def note(self, tile: slice, summary: Summary) -> None:
        """Record that a tile is stored."""
        ...

    def finish(self, whole: Summary) -> None:
        """Complete the transport with its summary, once all tiles are stored."""
        ...


class MemorySink:
    """Keeps a transport in memory."""

    def __init__(self) -> None:
        self._parts: dict[int, ReconstructedTile] = {}
        self._provenance: Mapping[str, Any] = {}

    @property
    def store(self) -> Store:
        """The sink itself."""
        return self

    def put(self, tile: slice, part: ReconstructedTile) -> Summary:
        """Keep a tile."""
        self._parts[tile.start] = part
        return summary_of(part)

    def stored(self) -> Mapping[int, Summary]:
        """Return an empty mapping: no tile is there before the job."""
        return {}

    def note(self, tile: slice, summary: Summary) -> None:
        """Do nothing: the tile itself is the record."""

    def finish(self, whole: Summary) -> None:
        """Keep the provenance of the whole."""
        self._provenance = whole.provenance

    def collected(self) -> tuple[Transport, Correspondence]:
        """Return the transport and the correspondence of all tiles."""
        parts = [self._parts[first] for first in sorted(self._parts)]
        transport = stacked([part.transport for part in parts])
        transport = replace(transport, provenance=self._provenance)
        return transport, joined([part.correspondence for part in parts])


@dataclass(frozen=True)
class TileWriter:
    """Writes tiles into the folder of a transport, from any process that has access to it.

    Attributes
    ----------
    folder : Path
    tiling : Tiling
    """

    folder: Path
    tiling: Tiling

    def put(self, tile: slice, part: ReconstructedTile) -> Summary:
        """Write a tile; the first one also creates the arrays of the transport."""
        rows, height = self.tiling.rows, self.tiling.height
        write_rows(self.folder, part.transport, tile.start, rows=rows, height=height)
        return summary_of(part)


class FileSink:
    """Writes a transport into a folder, tile by tile, and records the tiles that are there.

    Parameters
    ----------
    folder : Path
        Where the tiles are written; it becomes the transport once all of them are.
    tiling : Tiling
    """

    def __init__(self, folder: Path, tiling: Tiling) -> None:
        self._folder, self._tiling = folder, tiling

    @property
    def store(self) -> TileWriter:
        """Writer of the tiles into the folder."""
        return TileWriter(self._folder, self._tiling)

    def stored(self) -> Mapping[int, Summary]:
        """Read the summaries of the written tiles from the log."""
        return stored_tiles(self._folder)

    def note(self, tile: slice, summary: Summary) -> None:
        """Add a written tile to the log."""
        note(self._folder / LOG_NAME, {"start": tile.start, **summary._asdict()})

    def finish(self, whole: Summary) -> None:
        """Write the provenance, and remove chunks that lost workers left half-written."""
        for left in self._folder.rglob(".*.partial"):
            left.unlink()
        write_provenance(self._folder, whole.provenance)


@contextmanager
def resumable_file(
    output: Path, tiling: Tiling, identity: Mapping[str, Any], *, resume: bool, force: bool
) -> Iterator[FileSink]:
    """Yield a sink that writes a transport; if the body is stopped, its tiles are kept.

    Until the last tile is written, the tiles lie in a folder with the output's name and
    ``.unfinished`` appended.

    Parameters
    ----------
    output : Path
        Transport to write.
    tiling : Tiling
    identity : mapping
        What all tiles of a transport must have in common; see `identity_of`.
    resume : bool
        Keep the tiles that are there, and write the others; the identity must be the same.
    force : bool
        Replace a transport that is there and, without `resume`, the tiles of a stopped job.

    Raises
    ------
    InputError
        If the tiles that are there have another identity.
    NearfarError
        As `nearfar.files.resumable_output`, and as the body raises. The message adds how many tiles
        are kept, and where.
    KeptInterrupt
        If the body was interrupted; the message says the same.
    """

    def is_worth_keeping(folder: Path, fault: BaseException) -> bool:
        return bool(stored_tiles(folder)) and not isinstance(fault, UselessPhotosError)

    kept = _Kept(output)
    try:
        with resumable_output(
            output, RESUMABLE_TRANSPORT, is_worth_keeping, resume=resume, force=force
        ) as folder:
            if lines := _lines(folder):
                _require_same(folder, lines[0], identity)
            else:
                note(folder / LOG_NAME, identity)
            kept.is_at_work = True
            yield FileSink(folder, tiling)
    except KeyboardInterrupt as error:
        if kept.tiles:
            raise KeptInterrupt(f"interrupted; {kept}.") from error
        raise
    except NearfarError as error:
        if kept.tiles:
            raise type(error)(f"{str(error).removesuffix('.')}; {kept}.") from error
        raise


@contextmanager
def new_file(output: Path, tiling: Tiling, *, force: bool) -> Iterator[FileSink]:
    """Yield a sink that writes a whole transport or nothing; see `nearfar.files.new_output`."""
    with new_output(output, force=force) as folder:
        folder.mkdir()
        yield FileSink(folder, tiling)
        (folder / LOG_NAME).unlink(missing_ok=True)


def identity_of(
    capture: Capture,
    correspondence: Correspondence | None,
    options: ReconstructionOptions,
    tiling: Tiling,
) -> dict[str, Any]:
    """Return the metadata that all tiles of a transport must share, as JSON types."""
    metadata = (capture.path / "zarr.json").read_bytes()
    return {
        # Photos that were taken again have other times.
        "capture": hashlib.sha256(metadata + capture.times.tobytes()).hexdigest(),
        "correspondence": _digest(correspondence),
        "method": options.method,
        "square": options.square,
        "device": options.device,
        "half": options.half,
        "memory": tiling.rows,
        "nearfar": version(),
    }


def summary_of(part: ReconstructedTile) -> Summary:
    """Return the summary of a tile."""
    lit = part.transport.lit
    return Summary(int(lit.sum()), int(lit.size), dict(part.transport.provenance))


def stored_tiles(folder: Path) -> dict[int, Summary]:
    """Read the summaries of the tiles written into a folder, by their first row."""
    fields = Summary._fields
    return {
        line["start"]: Summary(*(line[name] for name in fields))
        for line in _lines(folder)
        if line.keys() >= {"start", *fields}
    }


def _lines(folder: Path) -> list[Mapping[str, Any]]:
    """Read the lines of the log: the identity, then the tiles."""
    return read_notes(folder / LOG_NAME, lambda line: line)


def _digest(correspondence: Correspondence | None) -> str:
    if correspondence is None:
        return ""
    return hashlib.sha256(np.ascontiguousarray(correspondence.q).tobytes()).hexdigest()


def _require_same(folder: Path, before: Mapping[str, Any], identity: Mapping[str, Any]) -> None:
    other = [name for name in identity if before.get(name) != identity[name]]
    if other:
        raise InputError(
            f"{folder} was started with another {', '.join(other)}: give the same, or start anew "
            f"with `force=True`."
        )


class _Kept:
    """The tiles of a stopped job that are kept, and the words for them in a message."""

    def __init__(self, output: Path) -> None:
        self._output = output
        self._folder = output.resolve().with_name(f"{output.resolve().name}{UNFINISHED}")
        # Before, the folder may be another job's.
        self.is_at_work = False

    @property
    def tiles(self) -> int:
        """Number of tiles that this job keeps."""
        return len(stored_tiles(self._folder)) if self.is_at_work else 0

    def __str__(self) -> str:
        count = self.tiles
        again = "`resume=True, force=True`" if self._output.exists() else "`resume=True`"
        are = "tile is" if count == 1 else "tiles are"
        return f"{count} {are} kept in {self._folder}, and {again} goes on with them"
