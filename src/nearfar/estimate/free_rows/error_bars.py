"""Posterior variances of free rows; see `nearfar.transport.posterior.FreePosterior`.

Index convention: n runs over camera pixels, h over lights, p over lamps.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from nearfar.arrays import Floats, Integers, blocks
from nearfar.transport import near
from nearfar.transport.gains import Gains
from nearfar.transport.model import Transport
from nearfar.transport.posterior import FreePosterior

# A share of a light that no photo tells anything of is none below this: it is rounding.
LEAST_UNSEEN = 1e-9
# Values of the lights whose variances are computed at once.
VALUES_AT_ONCE = 2**22


class FreeVariances:
    """Posterior variances of free rows; see `nearfar.estimate.error_bars`.

    They cover the photos' noise, what was never measured and, of light stages, the errors of the
    lamps' gains. Free rows take the place of far-range light.

    Parameters
    ----------
    transport : Transport
    posterior : FreePosterior
        Of the transport.
    """

    def __init__(self, transport: Transport, posterior: FreePosterior) -> None:
        self._transport = transport
        self._posterior = replace(posterior, variance_ratio=posterior.variance_ratio.ravel())
        centres = near.centre(transport.correspondence, transport.projector)
        lamps = centres[:, 0] * transport.projector.width + centres[:, 1]
        self._lamps = np.where(transport.lit.ravel(), lamps, -1)
        self._noise = transport.noise.reshape(-1, transport.channels).astype(np.float64)

    def of_pictures(self, lights: Floats, gains: Gains) -> Callable[[slice], Floats]:
        """Return a function of camera pixels: variances (n, h, channels) under lights (h, P)."""
        # Of all camera pixels at once: they share the matrices of a variance ratio.
        of_photos = self._in_noise(slice(None), lights, gains.direct, gains.far)

        def of_pixels(batch: slice) -> Floats:
            found = np.moveaxis(of_photos[:, batch], 0, 1).copy()
            if len(self._posterior.gain_errors):
                rows = self._transport.component_rows(batch).far
                for h, light in enumerate(lights):
                    errors = (gains.far * rows * light) @ self._posterior.gain_errors.T
                    found[:, h] += (errors**2).sum(axis=2)
            return found

        return of_pixels

    def change_by_place(self, light: Floats, gains: Gains) -> Callable[[slice], Floats]:
        """Return corrections of 0: free rows expect the same of all lamps."""
        return lambda batch: np.zeros((1, 1))

    def of_direct(self, batch: slice) -> Floats:
        """Return the variances of d at camera pixels, (n, channels)."""
        white = np.ones((1, self._transport.projector.pixels))
        return np.asarray(self._in_noise(batch, white, 1.0, 0.0)[0])

    def of_window(self, pixel: int, values: Floats) -> Floats:
        """Return those of near-range light, (m, channels): there is none."""
        return np.zeros((len(values), self._transport.channels))

    def of_far(self, pixel: int, lines: slice) -> Floats:
        """Return those of one camera pixel's free row on projector rows, (lines * Px, channels)."""
        one, projector = slice(pixel, pixel + 1), self._transport.projector
        lamps = np.arange(lines.start * projector.width, lines.stop * projector.width)
        found = np.empty((len(lamps), self._transport.channels))
        for some in blocks(len(lamps), max(1, VALUES_AT_ONCE // projector.pixels)):
            alone = np.zeros((len(lamps[some]), projector.pixels))
            alone[np.arange(len(alone)), lamps[some]] = 1.0
            found[some] = self._in_noise(one, alone, 0.0, 1.0)[:, 0]
        if len(self._posterior.gain_errors):
            row = self._transport.component_rows(one).far[0].T[lamps].astype(np.float64)
            found += row**2 * (self._posterior.gain_errors[:, lamps] ** 2).sum(axis=0)[:, None]
        return found

    def _in_noise(self, batch: slice, lights: Floats, direct: float, free: float) -> Floats:
        """Return the variances that noise and what was never measured leave, (h, n, channels)."""
        posterior = replace(self._posterior, variance_ratio=self._posterior.variance_ratio[batch])
        relative = variance_in_noise(posterior, self._lamps[batch], lights, direct, free)
        return np.asarray(relative[..., None] * self._noise[batch] ** 2)


def variance_in_noise(
    posterior: FreePosterior, lamps: Integers, lights: Floats, direct: float, free: float
) -> Floats:
    """Return the variances of pictures under lights, over that of a photo's noise.

    Parameters
    ----------
    posterior : FreePosterior
        Of n camera pixels.
    lamps : ndarray of int, shape (n,)
        The lamp of direct light, -1 for none.
    lights : ndarray, shape (h, P)
    direct, free : float
        Gains.

    Returns
    -------
    ndarray, shape (h, n), float64
    """
    ratio = posterior.variance_ratio.ravel()
    modes, strengths = (part.astype(np.float64) for part in (posterior.modes, posterior.strengths))
    lights = lights.astype(np.float64)
    total = free * lights.sum(axis=1)
    left = free * lights - total[:, None] * posterior.mean
    overlaps = left @ modes.T
    whole = ((left - left.mean(axis=1, keepdims=True)) ** 2).sum(axis=1)
    unseen = whole - (overlaps**2).sum(axis=1)
    # Less is nothing but rounding.
    unseen[unseen <= LEAST_UNSEEN * whole] = 0.0
    of_lamps = strengths[:, None] * modes
    found = np.empty((len(lights), len(ratio)))
    for one in np.unique(ratio):
        mine = np.flatnonzero(ratio == one)
        if np.isfinite(one):
            inverse = 1.0 / (one * strengths**2 + 1.0)
            base = one * (overlaps**2 @ inverse + unseen)
            follows = one * strengths * inverse
        else:
            inverse = strengths**-2.0
            base = overlaps**2 @ inverse
            follows = 1.0 / strengths
        base += total**2 * posterior.mean_variance
        own = inverse @ of_lamps**2
        # What light from each lamp alone would add to the picture if it were no direct light.
        taken = (overlaps * follows) @ of_lamps + total[:, None] * posterior.mean
        off = (direct * lights - taken) ** 2 / np.where(own > 0, own, np.inf)
        lit = lamps[mine] >= 0
        found[:, mine] = base[:, None] + lit * off[:, lamps[mine]]
    return found
