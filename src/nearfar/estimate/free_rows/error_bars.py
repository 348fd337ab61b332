"""Standard deviations of pictures of free rows; see `nearfar.transport.free_posterior`."""

import numpy as np

from nearfar.arrays import Floats, Integers, blocks
from nearfar.errors import InputError
from nearfar.transport import near
from nearfar.transport.free_posterior import FreePosterior
from nearfar.transport.gains import gains_on
from nearfar.transport.model import Transport

# Camera pixels of a batch.
BATCH_PIXELS = 8192
# A share of a light that no photo tells anything of is none below this: it is rounding.
LEAST_UNSEEN = 1e-9


class FreeErrorBars:
    """Posterior standard deviations of a transport of free rows.

    They cover the photos' noise, what was never measured and, of light stages, the errors of the
    lamps' gains. Where held-out photos showed larger errors, they are multiplied by the
    ``widening`` of the transport's verdict. At saturated camera pixels they are infinite.

    Parameters
    ----------
    transport : Transport
        Of free rows.

    Raises
    ------
    InputError
        If it has no error bars.
    """

    def __init__(self, transport: Transport) -> None:
        if transport.free_posterior is None:
            raise InputError(
                "this transport holds no error bars: its photos do not tell their own noise. Take "
                "some patterns twice, such as black and white, and reconstruct again."
            )
        self._transport = transport
        self._posterior = transport.free_posterior
        self._widening = transport.verdict.widening if transport.verdict is not None else 1.0
        centres = near.centre(transport.correspondence, transport.projector)
        lamps = centres[:, 0] * transport.projector.width + centres[:, 1]
        self._lamps = np.where(transport.lit.ravel(), lamps, -1)

    def picture(self, light: Floats, *, direct: float = 1.0, free: float = 1.0) -> Floats:
        """Return the standard deviation of a relit picture.

        Parameters
        ----------
        light : ndarray, shape (Py, Px) or (Py, Px, channels)
        direct, free : float
            Gains, as `Transport.relight` takes them.

        Returns
        -------
        ndarray, shape (Cy, Cx) or (Cy, Cx, channels), float32
            Photo units; infinite at saturated camera pixels.
        """
        transport = self._transport
        gains = gains_on(transport.parts, direct, 1.0, 1.0, free)
        lights = transport.lights(light).astype(np.float64)
        count, channels = transport.camera.pixels, transport.channels
        found = np.empty((count, channels), dtype=np.float32)
        noise = transport.noise.reshape(count, channels)
        for channel in range(channels):
            flat = lights[min(channel, len(lights) - 1)]
            variance = variance_in_noise(
                self._posterior, self._lamps, flat, gains.direct, gains.far
            )
            found[:, channel] = noise[:, channel] ** 2 * variance
        if len(self._posterior.gain_errors):
            for batch in blocks(count, BATCH_PIXELS):
                found[batch] += self._of_gains(batch, lights) * gains.far**2
        found = np.sqrt(found) * np.float32(self._widening)
        if transport.quality is not None:
            found[transport.quality.saturated.ravel()] = np.inf
        return transport.picture(found)

    def _of_gains(self, batch: slice, lights: Floats) -> Floats:
        """Return the variance that errors of the gains leave, (n, channels)."""
        rows = self._transport.rows(batch)
        errors = (rows * lights) @ self._posterior.gain_errors.T
        return np.asarray((errors**2).sum(axis=2))


def variance_in_noise(
    posterior: FreePosterior, lamps: Integers, light: Floats, direct: float, free: float
) -> Floats:
    """Return the variance of pictures under a light, over that of a photo's noise.

    Parameters
    ----------
    posterior : FreePosterior
        Of n camera pixels.
    lamps : ndarray of int, shape (n,)
        The lamp of direct light, -1 for none.
    light : ndarray, shape (P,), float64
    direct, free : float
        Gains.

    Returns
    -------
    ndarray, shape (n,), float64
    """
    ratio = posterior.ratio.ravel()
    modes, strengths = (part.astype(np.float64) for part in (posterior.modes, posterior.strengths))
    total = free * float(light.sum())
    left = free * light - total * posterior.mean
    overlaps = modes @ left
    whole = float(((left - left.mean()) ** 2).sum())
    unseen = whole - float((overlaps**2).sum())
    # Less is nothing but rounding.
    unseen = unseen if unseen > LEAST_UNSEEN * whole else 0.0
    of_lamps = strengths[:, None] * modes
    found = np.empty(len(ratio))
    for one in np.unique(ratio):
        mine = np.flatnonzero(ratio == one)
        lit = lamps[mine] >= 0
        if np.isfinite(one):
            inverse = 1.0 / (one * strengths**2 + 1.0)
            base = one * (float((overlaps**2 * inverse).sum()) + unseen)
            follows = one * strengths * inverse
        else:
            inverse = strengths**-2.0
            base = float((overlaps**2 * inverse).sum())
            follows = 1.0 / strengths
        base += total**2 * posterior.mean_variance
        own = inverse @ of_lamps**2
        # What light from each lamp alone would add to the picture if it were no direct light.
        taken = (overlaps * follows) @ of_lamps + total * posterior.mean
        off = (direct * light - taken) ** 2 / np.where(own > 0, own, np.inf)
        found[mine] = base + lit * off[lamps[mine]]
    return found
