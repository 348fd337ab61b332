"""Posterior variances where the projector's border clips the window: entries beyond it are zero.

Given the window n, a response of f has the mean G (y - B n), G = s^2 S D^-1 / sigma^2, and the
variance sigma^2 G / m. So h_n.n + h_f.f has, with u = h_n - B^T G h_f and Lambda of
`clipped_windows`, the variance sigma^2 (h_f.(G / m) h_f + u.Lambda^-1 u).

Index convention: arrays are (n, channels, ...); r runs over real responses, w over window entries,
g over o, d and shifts of q; m over pairs of a camera pixel and a channel, k over functionals of
one camera pixel.
"""

from typing import NamedTuple

import numpy as np

from nearfar.arrays import Booleans, Floats, blocks, product
from nearfar.estimate.joint.clipped_windows import (
    Ratios,
    clippings_of,
    rounded_ratio,
    solve_windows,
)
from nearfar.estimate.joint.posterior_variance import Functionals, PixelState, add_amplitudes
from nearfar.illumination.centred_basis import CentredBasis
from nearfar.priors.responses import ResponsePrior

# Functionals that are solved for at once, over all pairs of a camera pixel and a channel.
BLOCK_FUNCTIONALS = 2048


def clipped_variance(
    prior: ResponsePrior,
    state: PixelState,
    functionals: Functionals,
    inside: Booleans,
    centred: CentredBasis,
    multiplicity: Floats,
) -> Floats:
    """Return posterior variances for one prior component, (n, k, channels).

    Parameters
    ----------
    prior : ResponsePrior
    state : PixelState
    functionals : Functionals
        Their weights of window entries beyond the border are 0. `truncated` is that of the
        component, (k,) or (1,).
    inside : ndarray of bool, shape (n, W^2)
        Which entries of each camera pixel's window lie on the projector.
    centred : CentredBasis
    multiplicity : ndarray, shape (R,)
        How often each response was measured.
    """
    far = functionals.far.astype(np.float64)
    count, each = far.shape[:2]
    near = np.broadcast_to(functionals.near, (count, each, inside.shape[1])).astype(np.float64)
    truncated = np.broadcast_to(functionals.truncated, each)
    amplitudes = state.amplitude_responses.transpose(0, 2, 1).astype(np.float64)
    asked = near, far, truncated, amplitudes

    def solve(variance: Floats) -> _Solved:
        ratios = rounded_ratio(state.scale.astype(np.float64) ** 2 / variance)
        return _solved(prior, ratios, asked, inside, centred, multiplicity)

    variance, variance_left = (
        noise.astype(np.float64) ** 2 for noise in (state.noise, state.noise_left)
    )
    # Only the camera pixel's own photos tell o, d and q; neighbours' photos tell of n and f, too.
    by_own = by_all = solve(variance)
    if np.any(variance_left != variance):
        by_all = solve(variance_left)
    return add_amplitudes(
        by_all.given * variance_left[..., None],
        by_own.told / variance[..., None, None],
        by_all.through_rows.transpose(0, 1, 3, 2),
        state,
        functionals,
    )


class _Solved(NamedTuple):
    """Variances at unit noise, and what they depend on; see `add_amplitudes`."""

    given: Floats  # (n, channels, k)
    told: Floats  # (n, channels, G, G)
    through_rows: Floats  # (n, channels, k, G)


def _solved(
    prior: ResponsePrior,
    ratios: Floats,
    asked: tuple[Floats, Floats, Floats, Floats],
    inside: Booleans,
    centred: CentredBasis,
    multiplicity: Floats,
) -> _Solved:
    """Solve the windows of camera pixels at variance ratios (pixels, channels)."""
    near, far, truncated, amplitudes = asked
    deviation = prior.factors.deviation
    patterns = centred.on_window.astype(np.float64) * deviation
    clippings = clippings_of(inside)
    each, number = far.shape[1], amplitudes.shape[1]
    pixels, channels = ratios.shape
    given = np.empty((pixels * channels, each))
    all_told = np.empty((pixels * channels, number, number))
    through_rows = np.empty((pixels * channels, each, number))
    values, of_pair = np.unique(ratios, return_inverse=True)
    of_pair = of_pair.ravel()
    table = 1.0 / (values[:, None] * prior.far_variance + 1.0 / multiplicity)
    for pairs in blocks(len(of_pair), BLOCK_FUNCTIONALS // max(1, each)):
        mine = of_pair[pairs]
        of = np.arange(pairs.start, pairs.stop) // channels
        weight, ratio = table[mine, None], values[mine, None]
        gain = ratio[..., None] * prior.far_variance * weight
        response, own = far[of] * gain, amplitudes[of]
        weighted, transposed = own * weight, own.transpose(0, 2, 1)
        u = near[of] * deviation - product(response, patterns)
        right = np.concatenate([u, product(weighted, patterns)], axis=1)
        known = Ratios(values, mine, table)
        solved = solve_windows(right, clippings, of, prior, known, centred)
        of_u, of_amplitudes = solved[:, :each], solved[:, each:]
        before = np.sum(far[of] * response / multiplicity, axis=-1) + ratio * truncated
        given[pairs] = before + np.sum(u * of_u, axis=-1)
        right_of_amplitudes = right[:, each:].transpose(0, 2, 1)
        all_told[pairs] = weighted @ transposed - right[:, each:] @ of_amplitudes.transpose(0, 2, 1)
        through_rows[pairs] = response @ transposed + of_u @ right_of_amplitudes
    return _Solved(
        given.reshape(pixels, channels, each),
        all_told.reshape(pixels, channels, number, number),
        through_rows.reshape(pixels, channels, each, number),
    )
