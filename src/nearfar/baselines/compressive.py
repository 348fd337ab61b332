"""Compressive light transport: random patterns, and rows that are sparse in Haar wavelets.

After Peers et al. 2009, "Compressive Light Transport Sensing", as the paper compares with it
(section 5.2): patterns of independent 0 and 1, each row of T reconstructed on its own. A row is
t = sum_n x_n psi_n over the two-dimensional Haar wavelets psi_n, and x minimises

    1/2 |b - A x|^2 + lambda sum_{n > 0} |x_n|,    A_kn = <l_k, psi_n>.

The rival is given its best. The scaling function's coefficient x_0, the mean of t, is not
penalised. Patterns of 0 and 1 all share their mean, which would spoil the matrix: x_0 is therefore
solved for exactly, which projects the column of the means out of A and b and leaves wavelets that
meet patterns of -1/2 and 1/2. The refit takes back what the l1 norm takes from the coefficients it
keeps. lambda is given as a share of the least that leaves the row without wavelets, and
`nearfar.baselines.choosing` looks for it.

Index convention: k runs over K patterns, n over wavelets, i over rows: camera pixels and channels.
"""

import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np

from nearfar.arrays import Floats, Size, blocks
from nearfar.baselines.lasso import highest_penalty, refit, solve, start
from nearfar.baselines.random_patterns import (
    CompressiveMeasurements,
    bernoulli_patterns,
    measure_by_rig,
    measure_without_noise,
)
from nearfar.baselines.sensing import Sensing, sense
from nearfar.errors import InputError
from nearfar.parallel import single_threaded_products, threads
from nearfar.transport.exact import ExactTransport

# The whole method, with the steps that lie in other modules.
__all__ = [
    "DEFAULT_PENALTY_SHARE",
    "PENALTY_SHARES",
    "CompressiveMeasurements",
    "bernoulli_patterns",
    "estimate_seconds",
    "measure_by_rig",
    "measure_without_noise",
    "reconstruct_compressive",
    "refit_few",
]

# lambda as a share of the least that leaves a row without wavelets: those tried, and the default.
PENALTY_SHARES = tuple(10 ** (-0.5 - 0.25 * i) for i in range(13))
DEFAULT_PENALTY_SHARE = 1e-3
# A row is refitted by least squares if it keeps at most one coefficient for this many patterns.
PATTERNS_PER_COEFFICIENT = 2
# Rows that are solved together.
ROWS_AT_ONCE = 512
# Camera pixels by whose time that of all is estimated.
ROWS_TIMED = 64


Solver = Callable[[Sensing, Floats], Floats]


def reconstruct_compressive(
    measurements: CompressiveMeasurements,
    share: float = DEFAULT_PENALTY_SHARE,
    *,
    refitted: bool = True,
    progress: Callable[[float], None] | None = None,
) -> ExactTransport:
    """Reconstruct every row with one lambda relative to the row's own scale.

    Parameters
    ----------
    measurements : CompressiveMeasurements
    share : float
        lambda as a share of the least that leaves a row without wavelets, in (0, 1].
    refitted : bool
        Fit the coefficients that are kept by least squares, where a row keeps at most half
        as many as there are patterns.
    progress : callable, optional
        Called with the share of rows done.

    Returns
    -------
    ExactTransport
        Dense, all in `far`, in photo units.

    Raises
    ------
    InputError
        If the share is not in (0, 1].
    """
    if not 0.0 < share <= 1.0:
        raise InputError(f"a share of {share} gives no lambda: choose one above 0 and up to 1.")

    def solver(sensing: Sensing, responses: Floats) -> Floats:
        penalty = share * highest_penalty(start(sensing.columns, responses))
        found = solve(sensing.columns, responses, penalty)
        return refit_few(sensing, responses, found) if refitted else found

    return _reconstruct(measurements, solver, progress)


def estimate_seconds(
    measurements: CompressiveMeasurements,
    share: float = DEFAULT_PENALTY_SHARE,
    *,
    refitted: bool = True,
    rows: int = ROWS_TIMED,
) -> float:
    """Estimate how long `reconstruct_compressive` will take, by the time of a few rows.

    Parameters
    ----------
    measurements, share, refitted
        As `reconstruct_compressive`.
    rows : int
        Camera pixels to time, evenly spaced.

    Returns
    -------
    float
        In seconds, on all processors.
    """
    step = max(1, len(measurements.responses) // rows)
    some = measurements.responses[::step]
    part = replace(measurements, camera=Size(1, len(some)), responses=some)
    before = time.perf_counter()
    reconstruct_compressive(part, share, refitted=refitted)
    taken = time.perf_counter() - before
    # The few rows are one block, which one processor solves.
    blocks_at_once = min(threads(), -(-len(measurements.rows) // ROWS_AT_ONCE))
    return taken * len(measurements.responses) / len(some) / blocks_at_once


def refit_few(sensing: Sensing, responses: Floats, coefficients: Floats) -> Floats:
    """Refit the rows that keep few coefficients: see `PATTERNS_PER_COEFFICIENT`."""
    most = responses.shape[1] // PATTERNS_PER_COEFFICIENT
    return refit(sensing.columns, responses, coefficients, most)


def _reconstruct(
    measurements: CompressiveMeasurements, solver: Solver, progress: Callable[[float], None] | None
) -> ExactTransport:
    """Solve rows in blocks, on all cores."""
    sensing = sense(measurements.patterns)
    rows, channels = measurements.rows, measurements.responses.shape[1]
    projector, camera = measurements.projector, measurements.camera
    far = np.empty((channels, camera.pixels, projector.pixels), dtype=np.float32)

    def one(block: slice) -> int:
        responses, along = sensing.project(rows[block])
        pictures = sensing.pictures(solver(sensing, responses), along)
        pixel, channel = np.divmod(np.arange(block.start, block.stop), channels)
        far[channel, pixel] = pictures.reshape(len(pictures), -1)
        return len(pictures)

    done = 0
    # One BLAS thread in each of these threads: more would only wait for each other.
    with single_threaded_products(), ThreadPoolExecutor(threads()) as pool:
        for count in pool.map(one, blocks(len(rows), ROWS_AT_ONCE)):
            done += count
            if progress is not None:
                progress(done / len(rows))
    return ExactTransport(projector, camera, (), (), far, measurements.name)
