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

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from threadpoolctl import threadpool_limits

from nearfar.arrays import Floats, Integers, blocks, processors
from nearfar.baselines.lasso import highest_strength, refit, settle, solve, start
from nearfar.baselines.random_patterns import (
    CompressiveMeasurements,
    answer_in_theory,
    bernoulli_patterns,
    measure_by_rig,
)
from nearfar.baselines.sensing import Sensing, sense
from nearfar.errors import InputError
from nearfar.transport.exact import ExactTransport

# What the method needs from first to last.
__all__ = [
    "SHARE",
    "SHARES",
    "CompressiveMeasurements",
    "answer_in_theory",
    "bernoulli_patterns",
    "measure_by_rig",
    "reconstruct_compressive",
    "reconstruct_to_noise",
    "refit_few",
]

# lambda as a share of the least that leaves nothing: what is tried, and what is taken unasked.
SHARES = tuple(10 ** (-0.5 - 0.25 * i) for i in range(13))
SHARE = 1e-3
# Least squares on the support is trusted with at most one coefficient for this many patterns.
PATTERNS_PER_COEFFICIENT = 2
# Rows solved together.
BLOCK = 512

Progress = Callable[[float], None]

Solver = Callable[[Sensing, Floats, slice], Floats]


def reconstruct_compressive(
    measurements: CompressiveMeasurements,
    share: float = SHARE,
    *,
    refitted: bool = True,
    progress: Progress | None = None,
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
        Told the share of rows done.

    Returns
    -------
    ExactTransport
        Dense, all in `far`, in photo units.

    Raises
    ------
    InputError
        If the share is no share.
    """
    if not 0.0 < share <= 1.0:
        raise InputError(f"a share of {share} gives no lambda: choose one above 0 and up to 1.")

    def solver(sensing: Sensing, responses: Floats, _: slice) -> Floats:
        strength = share * highest_strength(start(sensing.columns, responses))
        found = solve(sensing.columns, responses, strength)
        return refit_few(sensing, responses, found) if refitted else found

    return _reconstruct(measurements, solver, progress)


def reconstruct_to_noise(
    measurements: CompressiveMeasurements,
    noise: float | Floats,
    *,
    refitted: bool = True,
    progress: Progress | None = None,
) -> ExactTransport:
    """Reconstruct every row with the first lambda of `SHARES` whose residual is as small as noise.

    Parameters
    ----------
    measurements : CompressiveMeasurements
    noise : float, or ndarray of shape (C, channels)
        Standard deviation of one answer, photo units.
    refitted, progress
        As `reconstruct_compressive`.

    Returns
    -------
    ExactTransport
        A row that no share brings down to its noise has the least.

    Raises
    ------
    InputError
        If the noise is negative or of another shape.
    """
    shape = measurements.responses.shape[:2]
    if np.shape(noise) not in ((), shape) or not np.min(noise) >= 0:
        raise InputError(
            f"the noise is no number or array of shape {shape} of at least 0: give the standard "
            f"deviation of one answer."
        )
    deviation = np.broadcast_to(np.asarray(noise, dtype=np.float64), shape).ravel()
    freedom = len(measurements.patterns) - 1

    def solver(sensing: Sensing, responses: Floats, block: slice) -> Floats:
        allowed = freedom * (deviation[block] / sensing.scale) ** 2
        rows = start(sensing.columns, responses)
        highest = highest_strength(rows)
        waiting: Integers = np.arange(len(responses))
        for share in SHARES:
            settle(sensing.columns, responses, rows, share * highest, waiting)
            energy = np.einsum("ik,ik->i", rows.residual[waiting], rows.residual[waiting])
            waiting = waiting[energy > allowed[waiting]]
        return refit_few(sensing, responses, rows.coefficients) if refitted else rows.coefficients

    return _reconstruct(measurements, solver, progress)


def refit_few(sensing: Sensing, responses: Floats, coefficients: Floats) -> Floats:
    """Refit the rows that keep few coefficients: see `PATTERNS_PER_COEFFICIENT`."""
    most = responses.shape[1] // PATTERNS_PER_COEFFICIENT
    return refit(sensing.columns, responses, coefficients, most)


def _reconstruct(
    measurements: CompressiveMeasurements, solver: Solver, progress: Progress | None
) -> ExactTransport:
    """Solve rows in blocks, on all cores."""
    sensing = sense(measurements.patterns)
    rows, channels = measurements.rows, measurements.responses.shape[1]
    projector, camera = measurements.projector, measurements.camera
    far = np.empty((channels, camera.pixels, projector.pixels), dtype=np.float32)

    def one(block: slice) -> int:
        responses, along = sensing.project(rows[block])
        pictures = sensing.pictures(solver(sensing, responses, block), along)
        pixel, channel = np.divmod(np.arange(block.start, block.stop), channels)
        far[channel, pixel] = pictures.reshape(len(pictures), -1)
        return len(pictures)

    done = 0
    # One thread of linear algebra in each of ours: more would only wait for each other.
    with threadpool_limits(1, "blas"), ThreadPoolExecutor(processors()) as pool:
        for count in pool.map(one, blocks(len(rows), BLOCK)):
            done += count
            if progress is not None:
                progress(done / len(rows))
    return ExactTransport(projector, camera, (), (), far, measurements.name)
