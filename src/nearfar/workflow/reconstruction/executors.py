"""Who works at the tiles of a reconstruction: this process, one or several tiles at a time."""

from collections.abc import Callable, Container, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass
from threading import Lock
from typing import Protocol

from threadpoolctl import threadpool_limits

from nearfar.capture import Capture
from nearfar.correspondence import Correspondence
from nearfar.progress import Report
from nearfar.workflow.reconstruction.job import Job, reconstruct_tile
from nearfar.workflow.reconstruction.options import ReconstructionOptions
from nearfar.workflow.reconstruction.sinks import Sink, Store
from nearfar.workflow.reconstruction.sources import without_light
from nearfar.workflow.reconstruction.summary import Summary
from nearfar.workflow.reconstruction.tiles import Tiling

# Called with the first row of a tile, and the share of it that is done.
TileReport = Callable[[int, float], None]


@dataclass(frozen=True, eq=False)
class Work:
    """A reconstruction to be executed.

    Attributes
    ----------
    capture : Capture
    options : ReconstructionOptions
    correspondence : Correspondence, optional
        Of the whole camera, if it is given.
    tiling : Tiling
    prepare : callable
        Returns the job, in this process; called with a report.
    """

    capture: Capture
    options: ReconstructionOptions
    correspondence: Correspondence | None
    tiling: Tiling
    prepare: Callable[[Report], Job]

    def known_of(self, tile: slice) -> Correspondence | None:
        """Return the correspondence of a tile and its halo, if tiles are given any."""
        if self.correspondence is None or self.options.square:
            return None
        return self.correspondence.of_rows(self.tiling.with_halo(tile))


class Executor(Protocol):
    """Who works at the tiles."""

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
            Those that are not stored yet.
        store : Store
        report : callable
            Called while the job is prepared.
        tile_report : callable
            Called while a tile is worked at, where that is known.
        """
        ...


class SerialExecutor:
    """One tile after another, the camera pixels of each on all processors."""

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
        with one_processor_a_product():
            for tile in tiles:
                yield tile, _reconstructed(job, tile, work, store, tile_report)


@dataclass(frozen=True)
class ThreadExecutor:
    """Several tiles at a time in this process, which share its memory.

    Reading and measuring use one processor for a tile, so several tiles keep more of them busy.
    The tiles are smaller in return, and more of their rows are halo.

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
        """Reconstruct the tiles as threads come free."""
        job = work.prepare(report)
        waiting = iter(tiles)
        with (
            one_processor_a_product(),
            ThreadPoolExecutor(max_workers=self.tiles_at_once) as pool,
        ):
            under_way: dict[Future[Summary], slice] = {}
            try:
                while True:
                    for tile in waiting:
                        future = pool.submit(_reconstructed, job, tile, work, store, tile_report)
                        under_way[future] = tile
                        if len(under_way) == self.tiles_at_once:
                            break
                    if not under_way:
                        return
                    done, _ = wait(under_way, return_when=FIRST_COMPLETED)
                    for future in done:
                        yield under_way.pop(future), future.result()
            finally:
                for future in under_way:
                    future.cancel()


def _reconstructed(
    job: Job, tile: slice, work: Work, store: Store, tile_report: TileReport
) -> Summary:
    """Reconstruct a tile and store it."""
    part = reconstruct_tile(
        job, tile, work.known_of(tile), lambda share: tile_report(tile.start, share)
    )
    return store.put(tile, part)


def one_processor_a_product() -> threadpool_limits:
    """Keep every matrix product on one processor, within the context that is returned.

    Several products run side by side instead, so that what comes out does not depend on how many
    processors there are.
    """
    return threadpool_limits(1, "blas")


def execute(work: Work, executor: Executor, sink: Sink, report: Report) -> Summary:
    """Reconstruct the tiles that a sink lacks, and conclude.

    Raises
    ------
    InputError
        If no camera pixel is directly lit.
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
    if not whole.lit:
        raise without_light(work.capture)
    sink.finish(whole)
    return whole


class _Progress:
    """The share of all rows that is done, from the shares of tiles in any thread."""

    def __init__(self, tiling: Tiling, stored: Container[int], report: Report) -> None:
        self._rows = {tile.start: tile.stop - tile.start for tile in tiling.tiles()}
        self._shares = {first: float(first in stored) for first in self._rows}
        self._height, self._report, self._lock = tiling.height, report, Lock()

    def of_tile(self, first: int, share: float) -> None:
        """Report that a share of the tile that begins with a row is done."""
        with self._lock:
            self._shares[first] = share
            done = sum(self._shares[row] * count for row, count in self._rows.items())
            self._report("reconstructing", done / self._height)
