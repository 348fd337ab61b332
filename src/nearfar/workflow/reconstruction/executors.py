"""Executors within this process: one tile after another, or several tiles at a time."""

from collections.abc import Callable, Container, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass
from threading import Lock
from typing import Protocol

from nearfar.capture import Capture
from nearfar.correspondence import Correspondence
from nearfar.parallel import single_threaded_products
from nearfar.progress import Report
from nearfar.workflow.reconstruction.job import Job, reconstruct_tile
from nearfar.workflow.reconstruction.options import ReconstructionOptions
from nearfar.workflow.reconstruction.sinks import Sink, Store
from nearfar.workflow.reconstruction.summary import Summary
from nearfar.workflow.reconstruction.tiles import Tiling

# Called with the first row of a tile and the share of the tile that is done.
TileReport = Callable[[int, float], None]


@dataclass(frozen=True, eq=False)
class Work:
    """The work of an executor: all that it needs to reconstruct a transport.

    Attributes
    ----------
    capture : Capture
    options : ReconstructionOptions
    correspondence : Correspondence, optional
        Of the whole camera, if it is given and not to be found.
    tiling : Tiling
    prepare : callable
        Called with a report; reads what all tiles share, and returns the job.
    """

    capture: Capture
    options: ReconstructionOptions
    correspondence: Correspondence | None
    tiling: Tiling
    prepare: Callable[[Report], Job]

    def known_of(self, tile: slice) -> Correspondence | None:
        """Return the given correspondence of a tile and its halo; None where the job finds it."""
        if self.correspondence is None or self.options.square:
            return None
        return self.correspondence.of_rows(self.tiling.with_halo(tile))


class Executor(Protocol):
    """Reconstructs and stores tiles."""

    def run(
        self,
        work: Work,
        tiles: Sequence[slice],
        store: Store,
        report: Report,
        tile_report: TileReport,
    ) -> Iterator[tuple[slice, Summary]]:
        """Reconstruct and store tiles; yield each with its summary, in any order.

        Parameters
        ----------
        work : Work
        tiles : sequence of slice
            Rows of the tiles that are not stored yet.
        store : Store
        report : callable
            Called while the job is prepared.
        tile_report : callable
            Called while a tile is reconstructed; not by executors of other processes.
        """
        ...


class SerialExecutor:
    """One tile after another, on all processors."""

    def run(
        self,
        work: Work,
        tiles: Sequence[slice],
        store: Store,
        report: Report,
        tile_report: TileReport,
    ) -> Iterator[tuple[slice, Summary]]:
        """Reconstruct the tiles in their order."""
        job = work.prepare(report)
        with single_threaded_products():
            for tile in tiles:
                yield tile, _reconstructed(job, tile, work, store, tile_report)


@dataclass(frozen=True)
class ThreadExecutor:
    """Several tiles at a time, in threads that share the memory of the options.

    A single tile is read and measured on one processor, so several tiles at a time use more
    processors. Each tile is smaller in return, and more of its rows are halo.

    Attributes
    ----------
    tiles_at_once : int
    """

    tiles_at_once: int

    def run(
        self,
        work: Work,
        tiles: Sequence[slice],
        store: Store,
        report: Report,
        tile_report: TileReport,
    ) -> Iterator[tuple[slice, Summary]]:
        """Reconstruct each tile as soon as a thread is free."""
        job = work.prepare(report)
        waiting = iter(tiles)
        with (
            single_threaded_products(),
            ThreadPoolExecutor(max_workers=self.tiles_at_once) as pool,
        ):
            pending: dict[Future[Summary], slice] = {}
            try:
                while True:
                    for tile in waiting:
                        future = pool.submit(_reconstructed, job, tile, work, store, tile_report)
                        pending[future] = tile
                        if len(pending) == self.tiles_at_once:
                            break
                    if not pending:
                        return
                    done, _ = wait(pending, return_when=FIRST_COMPLETED)
                    for future in done:
                        yield pending.pop(future), future.result()
            finally:
                for future in pending:
                    future.cancel()


def _reconstructed(
    job: Job, tile: slice, work: Work, store: Store, tile_report: TileReport
) -> Summary:
    """Reconstruct a tile and store it."""
    part = reconstruct_tile(
        job, tile, work.known_of(tile), lambda share: tile_report(tile.start, share)
    )
    return store.put(tile, part)


def execute(work: Work, executor: Executor, sink: Sink, report: Report) -> Summary:
    """Reconstruct the tiles that a sink does not have yet, and complete the transport.

    Raises
    ------
    NearfarError
        As the executor and the sink.
    """
    summaries = dict(sink.stored())
    tiles = [tile for tile in work.tiling.tiles() if tile.start not in summaries]
    progress = _Progress(work.tiling, summaries, report)
    for tile, summary in executor.run(work, tiles, sink.store, report, progress.of_tile):
        sink.note(tile, summary)
        summaries[tile.start] = summary
        progress.of_tile(tile.start, 1.0)
    whole = Summary()
    for first in sorted(summaries):
        whole = whole.with_tile(summaries[first])
    sink.finish(whole)
    return whole


class _Progress:
    """Adds up the progress of tiles, which threads report, to that of all rows."""

    def __init__(self, tiling: Tiling, stored: Container[int], report: Report) -> None:
        self._rows = {tile.start: tile.stop - tile.start for tile in tiling.tiles()}
        self._shares = {first: float(first in stored) for first in self._rows}
        self._height, self._report, self._lock = tiling.height, report, Lock()

    def of_tile(self, first: int, share: float) -> None:
        """Report the share done of the tile whose first row is `first`."""
        with self._lock:
            self._shares[first] = share
            done = sum(self._shares[row] * count for row, count in self._rows.items())
            self._report("reconstructing", done / self._height)
