"""The paper's estimation: direct, then near-range, then far-range (sections 4.1 to 4.3).

All camera pixels go through the same few matrix products: responses re-centred on q meet one
matrix for every pixel. What the far estimate contributes to near responses off the DFT grid is
taken out of them, and near and far are estimated again.

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
    blocks,
    fetch,
    namespace,
    product,
)
from nearfar.devices import Device, mover
from nearfar.estimate.matrices import Matrices, build_matrices
from nearfar.estimate.sparse import least_risk, solve
from nearfar.illumination.centred_basis import FOOTPRINT_OFFSETS, CentredBasis
from nearfar.parallel import side_by_side
from nearfar.photometry.measurements import Measurements
from nearfar.transport import near
from nearfar.transport.direct import Footprint, footprint, look_up_each
from nearfar.transport.model import Transport

# Rounds of near and far at most, and when they agree: as a share of the noise, and of the light.
ROUNDS = 60
AGREED_NOISE = 0.02
AGREED = 2e-7
# Each round must move a camera pixel's leaks by at most this share of what the last one did.
SETTLING = 0.8
# lambda of equation (10) before each window has its own, as a share of an entry's noise.
FIRST = np.float32(0.75)
# Where no measured pattern tells direct light from none, d fades out instead of growing noise.
FAINT = 0.1
# What strays beyond the border by less than this share of a window's peak is rounding.
DEPARTS = 1e-3
# Windows at once, one for each channel of a camera pixel: few enough to lie near the processor.
BLOCK = 2048
# Near frequencies that help with direct light between pixels lie above this, in cycles/pixel.
HIGH = 0.3


def estimate(
    measurements: Measurements,
    correspondence: Floats,
    window: int,
    far: Size,
    dropped: Size,
    *,
    rounds: int = ROUNDS,
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
        Where the work is done: by NumPy, by PyTorch on an accelerator, or by PyTorch on the
        processor.
    progress : callable, optional
        Called with the number of camera pixels done after each block.

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
            np.ascontiguousarray(measurements.quantisation_error[band.places].T)
            for band in (matrices.near, matrices.far)
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

    def work(block: slice) -> None:
        pixels = _pixels(measurements, where, lit, centres, block, matrices, errors)
        pixels = _Pixels._make(map(move, pixels))
        found = _estimate_block(pixels, there, rounds)
        for values, own in ((direct, found.direct), (windows, found.near), (low, found.far)):
            values[block] = fetch(own)
        done[0] += block.stop - block.start
        if progress is not None:
            progress(done[0])

    side_by_side(work, blocks(number, max(1, BLOCK // channels)))
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
    """What 8 bits got wrong of the near and far patterns, a row for each projector pixel."""

    near: Floats
    far: Floats


class _Pixels(NamedTuple):
    """A block of camera pixels; each field's first axis runs over them."""

    centres: NDArray[np.int64]
    lit: Booleans
    inside: Booleans
    corners: Floats  # weights of the direct light over FOOTPRINT_OFFSETS, (n, 9)
    noise: Floats
    light: Floats  # largest answer, (n,)
    checkerboard: Floats  # responses, re-centred
    near: Floats  # responses, re-centred
    far: Floats  # responses, as measured
    near_of_direct: Floats  # responses of unit direct light, 8 bits included
    far_of_direct: Floats

    def only(self, pixels: Booleans) -> "_Pixels":
        return _Pixels._make(values[pixels] for values in self)


class _Estimate(NamedTuple):
    """What a round finds; each field's first axis runs over camera pixels."""

    direct: Floats
    near: Floats
    far: Floats
    unseen: Floats  # z of equation (10)

    def copy(self) -> "_Estimate":
        return _Estimate(*(namespace(values).asarray(values, copy=True) for values in self))

    def only(self, pixels: Booleans) -> "_Estimate":
        return _Estimate(*(values[pixels] for values in self))

    def put(self, pixels: NDArray[np.int64], others: "_Estimate") -> None:
        """Take over the estimates of others at some pixels."""
        for values, new in zip(self, others, strict=True):
            values[pixels] = new


def _estimate_block(pixels: _Pixels, matrices: Matrices, rounds: int) -> _Estimate:
    """Alternate near and far; each camera pixel stops when its own leaks have settled.

    Where a scene does not obey the model, or the near set reaches into the far band, the rounds
    may not settle: a camera pixel whose leaks move no less than before keeps its best round.
    """
    xp, here = namespace(pixels.near), device_of(pixels.near)
    found = _round(pixels, None, _no_leaks(pixels), matrices)
    moving = xp.arange(len(pixels.lit), device=here)
    latest, leaks = found.copy(), _no_leaks(pixels)
    before = xp.full(len(moving), xp.inf, dtype=xp.float64, device=here)
    for _ in range(rounds - 1):
        previous, leaks = leaks, _leaks(latest.far, pixels, matrices)
        moved = _moved(previous, leaks)
        limit = AGREED_NOISE * xp.mean(pixels.noise, axis=1) + AGREED * pixels.light
        settling = moved <= SETTLING * before
        # The latest round of a pixel that still settles is its best so far.
        found.put(moving[settling], latest.only(settling))
        going = settling & (moved > limit)
        if not bool(xp.any(going)):
            break
        moving, pixels, before = moving[going], pixels.only(going), moved[going]
        leaks = _Leaks(*(leak[going] for leak in leaks))
        latest = _round(pixels, latest.unseen[going], leaks, matrices)
    else:
        found.put(moving, latest)
    return found


def _moved(previous: "_Leaks", leaks: "_Leaks") -> NDArray[np.float64]:
    """Root mean square by which each camera pixel's leaks changed, (n,)."""
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
    """What f adds to responses where the model has it silent: off the DFT grid."""

    checkerboard: Floats
    near: Floats


def _no_leaks(pixels: _Pixels) -> _Leaks:
    xp = namespace(pixels.near)
    return _Leaks(xp.zeros_like(pixels.checkerboard), xp.zeros_like(pixels.near))


def _leaks(far: Floats, pixels: _Pixels, matrices: Matrices) -> _Leaks:
    return _Leaks(
        matrices.checkerboard.recentre(product(far, matrices.checkerboard_leak), pixels.centres),
        matrices.near.recentre(product(far, matrices.near_leak), pixels.centres),
    )


def _round(pixels: _Pixels, start: Floats | None, leaks: _Leaks, matrices: Matrices) -> _Estimate:
    """Sections 4.1, 4.2 and 4.3 once."""
    near_responses = pixels.near - leaks.near
    direct = _direct(pixels.checkerboard - leaks.checkerboard, near_responses, pixels, matrices)
    near_responses -= direct[..., None] * pixels.near_of_direct
    windows, unseen = _near(near_responses, pixels, matrices, start)
    far = pixels.far - direct[..., None] * pixels.far_of_direct
    far -= matrices.far.uncentre(product(windows, matrices.far.on_window.T), pixels.centres)
    return _Estimate(direct, windows, far, unseen)


def _corner_weights(where: Footprint, centres: NDArray[np.int64], width: int) -> Floats:
    """Weights of the footprint over `FOOTPRINT_OFFSETS`, shape (n, 9)."""
    y, x = np.divmod(where.pixels, width)
    place = (y - centres[:, 0, None] + 1) * 3 + (x - centres[:, 1, None] + 1)
    weights = np.zeros((len(centres), len(FOOTPRINT_OFFSETS)), dtype=np.float32)
    # Weightless corners of unlit or whole pixels may lie anywhere: clip, they add nothing.
    np.add.at(
        weights,
        (np.arange(len(weights))[:, None], np.clip(place, 0, len(FOOTPRINT_OFFSETS) - 1)),
        where.weights,
    )
    return weights


def _pixels(
    measurements: Measurements,
    where: Footprint,
    lit: Booleans,
    centres: NDArray[np.int64],
    block: slice,
    matrices: Matrices,
    errors: _QuantisationErrors,
) -> _Pixels:
    """Gather what a block's rounds need."""
    projector = measurements.projector
    where = Footprint(where.pixels[block], where.weights[block])
    centres = centres[block]
    corners = _corner_weights(where, centres, projector.width)
    responses = measurements.responses[block]

    def quantisation_error(error: Floats) -> Floats:
        """Responses (n, 1, R) of unit direct light to what 8 bits got wrong."""
        return look_up_each(error, where.pixels, where.weights)[:, None]

    def of_direct(band: CentredBasis) -> Floats:
        return np.asarray((corners @ band.on_footprint.T)[:, None])

    checkerboard, near_band, far_band = matrices.checkerboard, matrices.near, matrices.far
    near_error = near_band.recentre(quantisation_error(errors.near), centres)
    return _Pixels(
        centres=centres,
        lit=lit[block],
        inside=near.inside(centres, matrices.window, projector),
        corners=corners,
        noise=measurements.noise[block],
        light=np.abs(responses).max(axis=(1, 2)),
        checkerboard=checkerboard.recentre(responses[..., checkerboard.places], centres),
        near=near_band.recentre(responses[..., near_band.places], centres),
        far=responses[..., far_band.places],
        near_of_direct=of_direct(near_band) + near_error,
        far_of_direct=far_band.uncentre(of_direct(far_band), centres)
        + quantisation_error(errors.far),
    )


def _direct(
    checkerboard: Floats, near_responses: Floats, pixels: _Pixels, matrices: Matrices
) -> Floats:
    """Return d, shape (n, channels): section 4.1, and more where q falls between pixels.

    There the checkerboard's answer fades, d (1 - 2a)(1 - 2b) for an offset (a, b), so the
    highest near frequencies are weighed in as far as it does.
    """
    xp = namespace(near_responses)
    answer = pixels.corners @ matrices.checkerboard.on_footprint.T
    frequencies = np.abs(matrices.near.basis.cycles).max(axis=1, initial=0.0)
    high = beside(np.flatnonzero(frequencies[matrices.near.basis.index] > HIGH), near_responses)
    high_answer = pixels.corners @ matrices.near.on_footprint[high].T
    faded = 1.0 - answer[:, 0] ** 2
    energy = answer[:, 0] ** 2 + faded * xp.sum(high_answer**2, axis=1)
    of_high = (near_responses[..., high] @ high_answer[..., None])[..., 0]
    total = checkerboard[..., 0] * answer + faded[:, None] * of_high
    d = total / xp.clip(energy, min=FAINT)[:, None] * pixels.lit[:, None]
    found: Floats = xp.astype(d, xp.float32)
    return found


def _near(
    responses: Floats, pixels: _Pixels, matrices: Matrices, start: Floats | None
) -> tuple[Floats, Floats]:
    """Equation (10): windows n, shape (n, channels, W^2), and the unseen part z."""
    number, channels = responses.shape[:2]
    xp, rows = namespace(responses), number * channels
    n0 = product(responses, matrices.near_inverse).reshape((rows, matrices.window**2))
    # A window entry is a mean of W^2 responses, cosine and sine of each pair.
    entry_noise = pixels.noise.reshape((rows,)) * (math.sqrt(2.0) / matrices.window)
    inside = xp.repeat(pixels.inside, channels, axis=0)
    if start is None:
        _, z = solve(n0, matrices.unseen, inside, FIRST * entry_noise)
    else:
        z = start.reshape((rows, matrices.unseen.shape[1]))
    v = n0 + z @ matrices.unseen.T
    entry_noise = xp.maximum(entry_noise, _strays_beyond_the_border(v, inside, z.shape[1]))
    windows, unseen = solve(n0, matrices.unseen, inside, least_risk(v, inside, entry_noise), z)
    windows = windows.reshape((number, channels, matrices.window**2)) * pixels.lit[:, None, None]
    return windows, unseen.reshape((number, channels, z.shape[1]))


def _strays_beyond_the_border(v: Floats, inside: Booleans, unknowns: int) -> Floats:
    """Root mean square of window entries beyond the projector's border, (I,); 0 where none are.

    They are known to be zero: what a scene that departs from the model leaves there tells how far
    the entries inside can be trusted, as noise would. Where the model holds it is 0.
    """
    xp = namespace(v)
    beyond = xp.count_nonzero(~inside, axis=1)
    energy = xp.sum(xp.where(inside, 0.0, v) ** 2, axis=1)
    strays = xp.sqrt(energy / xp.astype(xp.clip(beyond - unknowns, min=1), v.dtype))
    told = (beyond > unknowns) & (strays > DEPARTS * xp.max(xp.abs(v), axis=1))
    known: Floats = strays * told
    return known
