"""Non-negative transport, by the smallest change of window entries.

Where n + f is negative at a window entry, n is raised until n + f is 0. The other entries are
lowered by as much in total, so that the response to white does not change: the Euclidean projection
onto a simplex (Michelot, JOTA 50, 1986). Entries next to q share their light with d and do not
change.

Other responses change with the window, and photos no longer fit. What f is, given the window,
follows from them as before: it changes by G B (n before - n), G = s^2 S / (s^2 S + sigma^2 / m).
Then n + f may be negative again, by less, and so on. Where all frequencies of the projector are
measured, f would undo what the window gained, and is left alone.

Index convention: arrays are (n, channels, ...); r runs over real responses, w over window entries.
"""

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Booleans, Floats, Integers, beside, fetch, namespace, product
from nearfar.estimate.joint.problem import ComponentChoice, Problem
from nearfar.estimate.joint.spikes import away_from_q
from nearfar.illumination.centred_basis import CentredBasis
from nearfar.parallel import in_batches
from nearfar.transport import near

# Camera pixels of a batch.
BATCH_PIXELS = 2048
# How often f follows before windows are raised for the last time. Of the misfit at measured
# frequencies each leaves less than half; 4 and 8 relight no better than 2.
ROUNDS = 2
# The active set shrinks at every iteration; measured windows have settled well before this many.
MAXIMUM_ITERATIONS = 60


def make_positive(
    problem: Problem,
    windows: Floats,
    far_range: Floats,
    centred: CentredBasis,
    kept: Integers,
    choice: ComponentChoice,
) -> tuple[Floats, Floats]:
    """Return windows with n + f not negative, and f given these.

    Parameters
    ----------
    problem : Problem
    windows : ndarray, shape (C, channels, W^2)
    far_range : ndarray, shape (C, channels, 1 + K), float32
        f's response to white, which stays, and those that the transport keeps.
    centred : CentredBasis
        Of the same responses.
    kept : ndarray of int, shape (K,)
        Their indices among those of `problem.model`.
    choice : ComponentChoice
        Prior components and scales that f follows by.

    Returns
    -------
    windows : ndarray, shape (C, channels, W^2), float32
    far_range : ndarray, shape (C, channels, 1 + K), float32
    """
    xp, pixels = namespace(windows), problem.pixels
    projector = problem.measurements.projector
    away = away_from_q(problem.near_basis.count)
    inside = near.inside(pixels.centres, problem.near_basis.window, projector)
    free = inside & beside(away, windows) & pixels.lit[:, None]
    weights = beside(centred.basis.weights.astype(np.float32), windows)
    rounds = ROUNDS if centred.basis.count < projector.pixels else 0
    raised, far = xp.empty_like(windows), xp.asarray(far_range, copy=True)

    def least(far: Floats, centres: NDArray[np.int64]) -> Floats:
        recentred = centred.recentre(far * weights, centres)
        below_zero: Floats = -product(recentred, centred.on_window)
        return below_zero

    def work(batch: slice) -> None:
        centres = pixels.centres[batch]
        mine = xp.broadcast_to(free[batch, None], windows[batch].shape)
        share = _share_of_far(problem, choice, batch, kept)
        values = windows[batch]
        for _ in range(rounds):
            before, values = values, raise_to(values, least(far[batch], centres), mine)
            change = product(values - before, centred.on_window.T)
            change[..., :1] = 0.0
            change[..., 1:] *= share
            far[batch] -= centred.uncentre(change, centres)
        raised[batch] = raise_to(values, least(far[batch], centres), mine)

    in_batches(work, len(windows), BATCH_PIXELS, windows)
    return raised, far


def _share_of_far(
    problem: Problem, choice: ComponentChoice, batch: slice, kept: Integers
) -> Floats:
    """Return G at kept responses of camera pixels, (n, channels, K), float32."""
    pixels, model = problem.pixels, problem.model
    xp = namespace(pixels.white)
    multiplicity = model.multiplicity[beside(kept, pixels.white)]
    noise_variance = pixels.noise[batch, :, None] ** 2 / multiplicity
    squared = (choice.prior_scale[batch, None] * pixels.white[batch])[..., None] ** 2
    found: Floats = xp.empty_like(noise_variance)
    component = choice.prior_component[batch]
    for place in np.unique(fetch(component)).tolist():
        (alike,) = xp.nonzero(component == place)
        shape = model.priors[place].far_variance[kept].astype(np.float32)
        variance = squared[alike] * beside(shape, pixels.white)
        found[alike] = variance / (variance + noise_variance[alike])
    return found


def raise_to(values: Floats, least: Floats, free: Booleans) -> Floats:
    """Return the nearest values that are at least `least` and have the same sum.

    Parameters
    ----------
    values, least : ndarray, shape (..., E)
    free : ndarray of bool, shape (..., E)
        Entries that may change; the sum is over them.

    Returns
    -------
    ndarray, shape (..., E), float32
        The values themselves where their sum is too small.
    """
    xp = namespace(values)
    above = xp.astype(xp.where(free, values - least, 0.0), xp.float64)
    total = xp.sum(above, axis=-1, keepdims=True)
    active = free & (above > 0)
    taken = xp.zeros_like(total)
    for _ in range(MAXIMUM_ITERATIONS):
        count = xp.clip(xp.sum(xp.astype(active, xp.float64), axis=-1, keepdims=True), min=1.0)
        taken = (xp.sum(above * active, axis=-1, keepdims=True) - total) / count
        smaller = active & (above > taken)
        if bool(xp.all(smaller == active)):
            break
        active = smaller
    raised = least + xp.clip(above - taken, min=0.0)
    moved = xp.where(free & (total > 0), raised, xp.astype(values, raised.dtype))
    found: Floats = xp.astype(moved, xp.float32)
    return found
