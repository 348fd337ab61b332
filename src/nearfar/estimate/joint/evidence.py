"""Which kind a camera pixel is, and how strong its light: what its photos make most probable.

The log of the evidence of a kind at strength s, noise sigma and eigenvalues l_i is, but for a
constant, -1/2 sum_i (y_i^2 / v_i + log v_i), v_i = s^2 l_i + sigma^2, with o and d integrated out.
v_i depends on s and sigma through their ratio alone, so every camera pixel shares one table over
ratios, and the sums over i are matrix products.

A few responses narrow the kinds down, and all responses choose among those that are left: to
choose by a few alone cost 1.7 dB on the wedge, and by all throughout takes three times as long.

Channels are not put together first: of their mean, the shelf's coloured books lose 1.2 dB under a
random light.

Index convention: arrays are (n, channels, ...); i runs over eigenvectors.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from array_api_compat import device

from nearfar.arrays import Floats, Integers, beside, fetch, namespace
from nearfar.estimate.joint.nuisance import UNKNOWN
from nearfar.estimate.joint.pixels import Pixels
from nearfar.estimate.joint.prior import Prior, Spectrum
from nearfar.estimate.matrices import Band
from nearfar.transport.kinds import STRENGTHS

# Steps of the table in (s / sigma)^2, between two strengths: they are 2 apart.
STEPS = 4
# Responses by which kinds are told apart first, and kinds that are then told by all responses.
RESPONSES = 100
KINDS = 3


class Kinds(NamedTuple):
    """Kinds to choose from.

    Attributes
    ----------
    priors : tuple of Prior
    screens : tuple of Spectrum
        The same kinds as a few responses see them; the priors, where there are but a few.
    chosen : ndarray of int
        Those responses.
    """

    priors: tuple[Prior, ...]
    screens: tuple[Spectrum, ...]
    chosen: Integers

    def put(self, move: Callable[[Any], Any]) -> "Kinds":
        """Put what each camera pixel meets onto a device."""
        priors = tuple(prior.put(move) for prior in self.priors)
        if self.screens is self.priors:
            return self._replace(priors=priors, screens=priors)
        return self._replace(
            priors=priors, screens=tuple(screen.put(move) for screen in self.screens)
        )


def screened(priors: tuple[Prior, ...], band: Band, multiplicity: Floats) -> Kinds:
    """Choose responses that tell kinds apart: evenly among the frequencies, in their order."""
    frequencies = len(band.basis.frequencies)
    if band.basis.count <= 2 * RESPONSES:
        return Kinds(priors, priors, np.arange(band.basis.count))
    kept = np.linspace(0, frequencies - 1, RESPONSES // 2).round().astype(np.int64)
    chosen = np.flatnonzero(np.isin(band.basis.index, kept))
    screens = tuple(prior.told_by(chosen, band, multiplicity) for prior in priors)
    return Kinds(priors, screens, chosen)


def best_kind(pixels: Pixels, kinds: Kinds) -> tuple[Integers, Floats, Floats]:
    """Choose a kind and a strength for each camera pixel, the same for all channels.

    Parameters
    ----------
    pixels : Pixels
    kinds : Kinds

    Returns
    -------
    kind : ndarray of int, shape (n,)
        Place among the kinds.
    strength : ndarray, shape (n,)
        s as a share of white.
    evidence : ndarray, shape (n,)
        Its logarithm, but for a constant of the camera pixel.
    """
    xp = namespace(pixels.white)
    told = tell(pixels)
    chosen = beside(kinds.chosen, told.responses)
    some = told._replace(responses=told.responses[:, chosen], of_offset=told.of_offset[:, chosen])
    found = [evidence(some, screen) for screen in kinds.screens]
    values = xp.stack([xp.max(each, axis=1) for each in found])
    steps = xp.stack([xp.argmax(each, axis=1) for each in found])
    if kinds.screens is not kinds.priors:
        likely = values >= xp.sort(values, axis=0)[-min(KINDS, len(kinds.priors))]
        values[...] = -xp.inf
        for place, prior in enumerate(kinds.priors):
            (mine,) = xp.nonzero(likely[place, :])
            if len(mine):
                of_kind = evidence(told.only(mine), prior)
                steps[place, mine] = xp.argmax(of_kind, axis=1)
                values[place, mine] = xp.max(of_kind, axis=1)
    kind = xp.argmax(values, axis=0)
    step = xp.take_along_axis(steps, kind[None, :], axis=0)[0, :]
    return kind, beside(np.array(STRENGTHS), values)[step], xp.max(values, axis=0)


class Told(NamedTuple):
    """What the responses of camera pixels tell, a row for each channel of each.

    Rows with the same table stand side by side.

    Attributes
    ----------
    responses : ndarray, shape (m, R)
        In units of their noise.
    ratio, offset_ratio : ndarray, shape (m, 1)
        White, and the deviation of the references' error, over that noise.
    level : ndarray of int, shape (m,)
        White's ratio in steps of the table, rising.
    pixel : ndarray of int, shape (m,)
        Which camera pixel it is.
    corners : ndarray, shape (n, 9)
        Unit direct light around q.
    of_offset : ndarray, shape (n or 0, R)
        Responses of a unit error of the references; none where they cannot err.
    """

    responses: Floats
    ratio: Floats
    offset_ratio: Floats
    level: Integers
    pixel: Integers
    corners: Floats
    of_offset: Floats

    def only(self, chosen: Integers) -> "Told":
        """Return what those of some camera pixels tell."""
        xp, here = namespace(chosen), device(chosen)
        place = xp.full(len(self.corners), -1, dtype=xp.int64, device=here)
        place[chosen] = xp.arange(len(chosen), dtype=xp.int64, device=here)
        pixel = place[self.pixel]
        (rows,) = xp.nonzero(pixel >= 0)
        return Told(
            self.responses[rows],
            self.ratio[rows],
            self.offset_ratio[rows],
            self.level[rows],
            pixel[rows],
            self.corners[chosen],
            self.of_offset[chosen] if len(self.of_offset) else self.of_offset,
        )


def tell(pixels: Pixels) -> Told:
    """Lay out what the responses of camera pixels tell."""
    xp = namespace(pixels.white)
    noise = pixels.noise.reshape((-1, 1))
    ratio = pixels.white.reshape((-1, 1)) / noise
    level = xp.round(STEPS * xp.log2(xp.astype(ratio[:, 0], xp.float64) * STRENGTHS[0]))
    order = xp.argsort(level, stable=True)
    flat = pixels.responses.reshape((len(order), -1))
    return Told(
        responses=flat[order] / noise[order],
        ratio=ratio[order],
        offset_ratio=(pixels.offset_noise.reshape((-1, 1)) / noise)[order],
        level=xp.astype(level[order], xp.int64),
        pixel=order // pixels.white.shape[1],
        corners=pixels.corners[:, 0],
        of_offset=pixels.of_offset.reshape((-1, flat.shape[1])),
    )


def evidence(told: Told, spectrum: Spectrum) -> Floats:
    """Return the log evidence of one kind at every strength, of all channels, (n, strengths)."""
    y = told.responses @ spectrum.directions
    u = told.corners @ spectrum.of_corners
    v = told.of_offset @ spectrum.directions
    xp, level = namespace(y), fetch(told.level)
    found = xp.empty((len(y), len(STRENGTHS)), dtype=xp.float32, device=device(y))
    levels = xp.astype(spectrum.levels, xp.float64)[:, None]
    first = np.flatnonzero(np.diff(level, prepend=level[:1] - 1)).tolist()
    for start, stop in zip(first, [*first[1:], len(y)], strict=True):
        table = 4.0 ** ((level[start] + STEPS * np.arange(len(STRENGTHS))) / STEPS)
        variance = 1.0 + beside(table, y) * levels
        weight = xp.astype(1.0 / variance, xp.float32)
        spread = xp.astype(xp.sum(xp.log(variance), axis=0), xp.float32)
        of_y, pixel = y[start:stop], told.pixel[start:stop]
        of_u = u[pixel]
        yy, uy, uu = ((a * b) @ weight for a, b in ((of_y, of_y), (of_u, of_y), (of_u, of_u)))
        if len(v):
            # o first, so that what is left of y and u knows nothing of it.
            of_v = v[pixel]
            vy, vu, vv = ((a * b) @ weight for a, b in ((of_v, of_y), (of_v, of_u), (of_v, of_v)))
            known = told.offset_ratio[start:stop] ** 2
            free = 1.0 + known * vv
            yy, uy, uu = (
                whole - known * of * by / free
                for whole, of, by in ((yy, vy, vy), (uy, vu, vy), (uu, vu, vu))
            )
            spread = spread + xp.log(free)
        # d in units of the noise: UNKNOWN times white, beforehand.
        before = (UNKNOWN * told.ratio[start:stop]) ** 2
        free = 1.0 + before * uu
        found[start:stop] = -0.5 * (yy - before * uy**2 / free + spread + xp.log(free))
    # Rows of one camera pixel, one for each channel, side by side again.
    together = found[xp.argsort(told.pixel, stable=True)]
    total: Floats = xp.sum(together.reshape((len(u), -1, len(STRENGTHS))), axis=1)
    return total
