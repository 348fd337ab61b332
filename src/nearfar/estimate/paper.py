"""The paper's estimation: direct, then near-range, then far-range (sections 4.1 to 4.3).

All camera pixels go through the same few matrix products: responses re-centred on q are multiplied
by one matrix for every pixel. Off the DFT grid f leaks into near responses: what the far estimate
adds to them is subtracted, and near and far are estimated again, in rounds.

Index convention: arrays are (n, channels, ...) with n camera pixels; r runs over real responses,
w over window entries, m over far coefficients.
"""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from array_api_compat import device as device_of
from numpy.typing import NDArray

from nearfar.arrays import (
    Booleans,
    Floats,
    Size,
    beside,
    fetch,
    namespace,
    product,
)
from nearfar.devices import Device, mover
from nearfar.estimate.matrices import Matrices, build_matrices
from nearfar.estimate.sparse import least_risk, solve
from nearfar.illumination.centred_basis import FOOTPRINT_OFFSETS, CentredBasis
from nearfar.parallel import in_batches
from nearfar.photometry.measurements import Measurements
from nearfar.transport import near
from nearfar.transport.direct import Footprint, footprint, look_up_each
from nearfar.transport.model import Transport

# Most rounds of near and far.
MAXIMUM_ROUNDS = 60
# A camera pixel's rounds end when its leaks change by less than these shares of its noise and of
# its light together.
NOISE_TOLERANCE = 0.02
LIGHT_TOLERANCE = 2e-7
# Each round must change a camera pixel's leaks by at most this share of what the last one did.
LARGEST_CONTRACTION = 0.8
# lambda of equation (10) in the first round, as a share of an entry's noise: later each window has
# its own.
FIRST_LAMBDA = np.float32(0.75)
# Least energy of the responses that d is divided by: where no measured pattern responds to direct
# light, d fades out instead of growing noise.
ENERGY_FLOOR = 0.1
# Light beyond the border of less than this share of a window's peak is rounding.
ROUNDING_SHARE = 1e-3
# Windows of a batch, one for each channel of a camera pixel: few enough to stay in the
# processor's cache.
BATCH_WINDOWS = 2048
# Near frequencies that help with direct light between pixels lie above this, in cycles/pixel.
LEAST_HIGH_FREQUENCY = 0.3


def estimate(
    measurements: Measurements,
    correspondence: Floats,
    window: int,
    far: Size,
    dropped: Size,
    *,
    rounds: int = MAXIMUM_ROUNDS,
    device: Device = "cpu",
    progress: Callable[[int], None] | None = None,
) -> Transport:
    """Estimate D, N and F as in the paper.

    Parameters
    ----------
    measurements : Measurements
    correspondence : ndarray, shape (Cy, Cx, 2)
        q as (y, x), NaN where there is no direct light.
    window : int
        W.
    far, dropped : Size
        Far band and the block of near frequencies that were not shot.
    rounds : int
        Rounds of near and far.
    device : {"cpu", "cuda", "torch"}
        Device of the estimate: NumPy, PyTorch on an accelerator, or PyTorch on the processor.
    progress : callable, optional
        Called with the number of camera pixels done after each batch.

    Returns
    -------
    Transport

    Raises
    ------
    InputError, MissingPackageError
        As `nearfar.devices.mover`.
    """
    move = mover(device)
    matrices = build_matrices(measurements, window, far, dropped)
    there = matrices.put(move)
    errors = _QuantisationErrors(
        *(
            np.ascontiguousarray(measurements.quantisation_error[centred.response_indices].T)
            for centred in (matrices.near, matrices.far)
        )
    )
    where = footprint(correspondence, measurements.projector)
    centres = near.centre(correspondence, measurements.projector)
    lit = np.isfinite(correspondence).all(axis=-1).ravel()
    number, channels = measurements.responses.shape[:2]
    direct = np.empty((number, channels), dtype=np.float32)
    windows = np.empty((number, channels, window**2), dtype=np.float32)
    low = np.empty((number, channels, matrices.far.basis.count), dtype=np.float32)
    done = [0]

    def work(selected: slice) -> None:
        batch = _gather(measurements, where, lit, centres, selected, matrices, errors)
        batch = _PixelBatch._make(map(move, batch))
        found = _estimate_batch(batch, there, rounds)
        for values, own in ((direct, found.direct), (windows, found.near), (low, found.far)):
            values[selected] = fetch(own)
        done[0] += selected.stop - selected.start
        if progress is not None:
            progress(done[0])

    in_batches(work, number, max(1, BATCH_WINDOWS // channels), there.near_inverse)
    shape = (*measurements.camera, channels)
    return Transport(
        projector=measurements.projector,
        correspondence=correspondence.astype(np.float32),
        direct=direct.reshape(shape),
        near=windows.reshape(*shape, window, window),
        far=low.reshape(*shape, -1),
        far_basis=matrices.far.basis,
        black=measurements.black.reshape(shape),
        noise=measurements.noise.reshape(shape),
    )


class _QuantisationErrors(NamedTuple):
    """Quantisation errors of the near and far patterns, a row for each projector pixel."""

    near: Floats
    far: Floats


class _PixelBatch(NamedTuple):
    """A batch of camera pixels; each field's first axis runs over them."""

    centres: NDArray[np.int64]
    lit: Booleans
    inside: Booleans
    weights: Floats  # weights of the direct light over FOOTPRINT_OFFSETS, (n, 9)
    noise: Floats
    light: Floats  # largest response, (n,)
    checkerboard: Floats  # responses, re-centred
    near: Floats  # responses, re-centred
    far: Floats  # responses, as measured
    near_of_direct: Floats  # responses of unit direct light, quantisation error included
    far_of_direct: Floats

    def only(self, selected: Booleans) -> "_PixelBatch":
        return _PixelBatch._make(values[selected] for values in self)


class _Estimate(NamedTuple):
    """The estimate of a round; each field's first axis runs over camera pixels."""

    direct: Floats
    near: Floats
    far: Floats
    unseen: Floats  # z of equation (10)

    def copy(self) -> "_Estimate":
        return _Estimate(*(namespace(values).asarray(values, copy=True) for values in self))

    def only(self, selected: Booleans) -> "_Estimate":
        return _Estimate(*(values[selected] for values in self))

    def put(self, selected: NDArray[np.int64], others: "_Estimate") -> None:
        """Replace the estimates of some pixels, in place."""
        for values, new in zip(self, others, strict=True):
            values[selected] = new


def _estimate_batch(batch: _PixelBatch, matrices: Matrices, rounds: int) -> _Estimate:
    """Alternate near and far; each camera pixel stops when its own leaks have settled.

    Where a scene does not obey the model, or the near set reaches into the far band, the rounds
    may not settle: a camera pixel whose leaks move no less than before keeps its best round.
    """
    xp, here = namespace(batch.near), device_of(batch.near)
    found = _round(batch, None, _no_leaks(batch), matrices)
    moving = xp.arange(len(batch.lit), device=here)
    latest, leaks = found.copy(), _no_leaks(batch)
    before = xp.full(len(moving), xp.inf, dtype=xp.float64, device=here)
    for _ in range(rounds - 1):
        previous, leaks = leaks, _leaks(latest.far, batch, matrices)
        moved = _moved(previous, leaks)
        limit = NOISE_TOLERANCE * xp.mean(batch.noise, axis=1) + LIGHT_TOLERANCE * batch.light
        settling = moved <= LARGEST_CONTRACTION * before
        # The latest round of a pixel that still settles is its best so far.
        found.put(moving[settling], latest.only(settling))
        going = settling & (moved > limit)
        if not bool(xp.any(going)):
            break
        moving, batch, before = moving[going], batch.only(going), moved[going]
        leaks = _Leaks(*(leak[going] for leak in leaks))
        latest = _round(batch, latest.unseen[going], leaks, matrices)
    else:
        found.put(moving, latest)
    return found


def _moved(previous: "_Leaks", leaks: "_Leaks") -> NDArray[np.float64]:
    """Return the root mean square by which each camera pixel's leaks changed, (n,)."""
    xp = namespace(leaks.near)
    moved: NDArray[np.float64] = xp.zeros(
        len(leaks.near), dtype=xp.float64, device=device_of(leaks.near)
    )
    for old, new in zip(previous, leaks, strict=True):
        if new.shape[2]:
            off = xp.sqrt(xp.mean((new - old) ** 2, axis=(1, 2)))
            moved = xp.maximum(moved, xp.astype(off, xp.float64))
    return moved


class _Leaks(NamedTuple):
    """Contribution of f, off the DFT grid, to the responses to near patterns and checkerboard."""

    checkerboard: Floats
    near: Floats


def _no_leaks(batch: _PixelBatch) -> _Leaks:
    xp = namespace(batch.near)
    return _Leaks(xp.zeros_like(batch.checkerboard), xp.zeros_like(batch.near))


def _leaks(far: Floats, batch: _PixelBatch, matrices: Matrices) -> _Leaks:
    return _Leaks(
        matrices.checkerboard.recentre(product(far, matrices.checkerboard_leak), batch.centres),
        matrices.near.recentre(product(far, matrices.near_leak), batch.centres),
    )


def _round(
    batch: _PixelBatch, start: Floats | None, leaks: _Leaks, matrices: Matrices
) -> _Estimate:
    """Estimate d, n and f once, by sections 4.1, 4.2 and 4.3."""
    near_responses = batch.near - leaks.near
    direct = _direct(batch.checkerboard - leaks.checkerboard, near_responses, batch, matrices)
    near_responses -= direct[..., None] * batch.near_of_direct
    windows, unseen = _near(near_responses, batch, matrices, start)
    far = batch.far - direct[..., None] * batch.far_of_direct
    far -= matrices.far.uncentre(product(windows, matrices.far.on_window.T), batch.centres)
    return _Estimate(direct, windows, far, unseen)


def _footprint_weights(where: Footprint, centres: NDArray[np.int64], width: int) -> Floats:
    """Return weights of the footprint over `FOOTPRINT_OFFSETS`, shape (n, 9)."""
    y, x = np.divmod(where.pixels, width)
    place = (y - centres[:, 0, None] + 1) * 3 + (x - centres[:, 1, None] + 1)
    weights = np.zeros((len(centres), len(FOOTPRINT_OFFSETS)), dtype=np.float32)
    # Corners without weight, of unlit or whole pixels, may lie anywhere: clip, they add nothing.
    np.add.at(
        weights,
        (np.arange(len(weights))[:, None], np.clip(place, 0, len(FOOTPRINT_OFFSETS) - 1)),
        where.weights,
    )
    return weights


def _gather(
    measurements: Measurements,
    where: Footprint,
    lit: Booleans,
    centres: NDArray[np.int64],
    selected: slice,
    matrices: Matrices,
    errors: _QuantisationErrors,
) -> _PixelBatch:
    """Gather the data of a batch of camera pixels."""
    projector = measurements.projector
    where = Footprint(where.pixels[selected], where.weights[selected])
    centres = centres[selected]
    weights = _footprint_weights(where, centres, projector.width)
    responses = measurements.responses[selected]

    def of_error(error: Floats) -> Floats:
        """Return responses (n, 1, R) of unit direct light to quantisation errors.

        0 where there are so many projector pixels that footprints average them.
        """
        if len(error) == 0:
            return np.zeros((len(centres), 1, error.shape[1]), dtype=np.float32)
        return look_up_each(error, where.pixels, where.weights)[:, None]

    def of_direct(centred: CentredBasis) -> Floats:
        return np.asarray((weights @ centred.on_footprint.T)[:, None])

    checkerboard, near_basis, far_basis = matrices.checkerboard, matrices.near, matrices.far
    near_error = near_basis.recentre(of_error(errors.near), centres)
    return _PixelBatch(
        centres=centres,
        lit=lit[selected],
        inside=near.inside(centres, matrices.window, projector),
        weights=weights,
        noise=measurements.noise[selected],
        light=np.abs(responses).max(axis=(1, 2)),
        checkerboard=checkerboard.recentre(responses[..., checkerboard.response_indices], centres),
        near=near_basis.recentre(responses[..., near_basis.response_indices], centres),
        far=responses[..., far_basis.response_indices],
        near_of_direct=of_direct(near_basis) + near_error,
        far_of_direct=far_basis.uncentre(of_direct(far_basis), centres) + of_error(errors.far),
    )


def _direct(
    checkerboard: Floats, near_responses: Floats, batch: _PixelBatch, matrices: Matrices
) -> Floats:
    """Return d, shape (n, channels), by section 4.1, extended to q between pixels.

    The response to the checkerboard is d (1 - 2a)(1 - 2b) for an offset (a, b) of q from a pixel.
    As it fades, the highest near frequencies get more weight.
    """
    xp = namespace(near_responses)
    response = batch.weights @ matrices.checkerboard.on_footprint.T
    frequencies = np.abs(matrices.near.basis.cycles).max(axis=1, initial=0.0)
    of_response = frequencies[matrices.near.basis.index]
    high = beside(np.flatnonzero(of_response > LEAST_HIGH_FREQUENCY), near_responses)
    high_response = batch.weights @ matrices.near.on_footprint[high].T
    faded = 1.0 - response[:, 0] ** 2
    energy = response[:, 0] ** 2 + faded * xp.sum(high_response**2, axis=1)
    of_high = (near_responses[..., high] @ high_response[..., None])[..., 0]
    total = checkerboard[..., 0] * response + faded[:, None] * of_high
    d = total / xp.clip(energy, min=ENERGY_FLOOR)[:, None] * batch.lit[:, None]
    found: Floats = xp.astype(d, xp.float32)
    return found


def _near(
    responses: Floats, batch: _PixelBatch, matrices: Matrices, start: Floats | None
) -> tuple[Floats, Floats]:
    """Solve equation (10): windows n, shape (n, channels, W^2), and the unseen part z."""
    number, channels = responses.shape[:2]
    xp, rows = namespace(responses), number * channels
    n0 = product(responses, matrices.near_inverse).reshape((rows, matrices.window**2))
    # A window entry is a mean of W^2 responses, cosine and sine of each pair.
    entry_noise = batch.noise.reshape((rows,)) * (math.sqrt(2.0) / matrices.window)
    inside = xp.repeat(batch.inside, channels, axis=0)
    if start is None:
        _, z = solve(n0, matrices.unseen, inside, FIRST_LAMBDA * entry_noise)
    else:
        z = start.reshape((rows, matrices.unseen.shape[1]))
    v = n0 + z @ matrices.unseen.T
    entry_noise = xp.maximum(entry_noise, _rms_beyond_border(v, inside, z.shape[1]))
    windows, unseen = solve(n0, matrices.unseen, inside, least_risk(v, inside, entry_noise), z)
    windows = windows.reshape((number, channels, matrices.window**2)) * batch.lit[:, None, None]
    return windows, unseen.reshape((number, channels, z.shape[1]))


def _rms_beyond_border(v: Floats, inside: Booleans, unknowns: int) -> Floats:
    """Return the root mean square of window entries beyond the projector's border, (I,).

    They are zero if the model holds. If the scene departs from it, they count as noise of the
    entries inside. 0 where there are too few such entries to tell.
    """
    xp = namespace(v)
    beyond = xp.count_nonzero(~inside, axis=1)
    energy = xp.sum(xp.where(inside, 0.0, v) ** 2, axis=1)
    rms = xp.sqrt(energy / xp.astype(xp.clip(beyond - unknowns, min=1), v.dtype))
    departs = (beyond > unknowns) & (rms > ROUNDING_SHARE * xp.max(xp.abs(v), axis=1))
    noise: Floats = rms * departs
    return noise
