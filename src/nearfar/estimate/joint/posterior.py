"""Error bars: the posterior standard deviation of D, of entries of N and F, and of pictures.

All of them are numbers h_o o + h_d d + h_n.n + h_f.f of a camera pixel, f's DC being what d and n
leave of white. Given the kind, o, d and q, the posterior is a Gaussian in the kind's eigenvectors;
o, d and q add what is not known of them.

Index convention: arrays are (n, channels, ...), n camera pixels or numbers asked of one of them; r
runs over real responses, w over window entries, i over eigenvectors, g over o and d.
"""

from typing import NamedTuple

import numpy as np

from nearfar.arrays import Booleans, Floats, Integers, blocks
from nearfar.errors import InputError
from nearfar.estimate.joint import nuisance
from nearfar.estimate.joint.pixels import EXACT, responses_of_direct
from nearfar.estimate.joint.prior import Prior, build_prior
from nearfar.estimate.matrices import Band, band_of, corner_weights
from nearfar.illumination.frequencies import DC
from nearfar.illumination.real_basis import real_basis
from nearfar.transport import near
from nearfar.transport.direct import footprint
from nearfar.transport.kinds import Kind, power_at
from nearfar.transport.model import Components, Transport
from nearfar.transport.posterior import Posterior

BLOCK = 2048
# Entries of a row that are worked at at once.
ENTRIES = 2**14


class _Asked(NamedTuple):
    """Numbers asked for; of camera pixels one each, or all of one camera pixel.

    Attributes
    ----------
    mean : ndarray, shape (n,)
        h of white.
    direct : ndarray, shape (n, 3)
        h of d, and of d times what q is off down and across.
    near : ndarray, shape (n, W^2) or (1, W^2)
        One for all of them where they are of one camera pixel.
    far : ndarray, shape (n, R)
        Re-centred.
    unseen : ndarray, shape (kinds,) or (kinds, n)
        Variance of the part of f that the transport does not hold, at unit strength.
    """

    mean: Floats
    direct: Floats
    near: Floats
    far: Floats
    unseen: Floats


class _Of(NamedTuple):
    """What is known of camera pixels: see `nearfar.estimate.joint.pixels.Pixels`."""

    columns: Floats  # (n, R, 4)
    precision: Floats  # (n, channels, 4)
    noise: Floats  # (n, channels)
    scale: Floats  # s in photo units, (n, channels)
    white_left: Floats  # variance of white that o does not tell, (n, channels)
    share: Floats  # (n, channels)
    kind: Integers  # (n,)

    def only(self, chosen: Integers) -> "_Of":
        return _Of._make(values[chosen] for values in self)


class ErrorBars:
    """Posterior standard deviations of a transport.

    They hold what the photos' noise and what was never measured leave open, for light as the
    kinds of `nearfar.transport.kinds` expect it and q as it was found. Those of components are of
    the model's split (d at q, n in the window, f in the band), not of the physical one.

    Parameters
    ----------
    transport : Transport
        From a joint estimate.

    Raises
    ------
    InputError
        If the transport does not tell its errors.

    Examples
    --------
    >>> bars = nearfar.ErrorBars(transport)
    >>> bars.picture(light).shape  # the standard deviation of `transport @ light`
    (8, 8)
    """

    def __init__(self, transport: Transport) -> None:
        if transport.posterior is None:
            raise InputError(
                "this transport holds no error bars: reconstruct the capture with --method joint."
            )
        self._transport = transport
        self._posterior: Posterior = transport.posterior
        basis = real_basis(self._posterior.frequencies, transport.projector)
        self._band: Band = band_of(basis, near.offsets(transport.window))
        self._priors: dict[int, Prior] = {}
        self._where = footprint(transport.correspondence, transport.projector)
        self._centres = near.centre(transport.correspondence, transport.projector)
        kept = set(transport.far_basis.frequencies)
        self._held = np.array([basis.frequencies[i] in kept for i in basis.index])

    def picture(
        self, light: Floats, *, direct: float = 1.0, near: float = 1.0, far: float = 1.0
    ) -> Floats:
        """Return the standard deviation of a relit picture.

        Parameters
        ----------
        light : ndarray, shape (Py, Px) or (Py, Px, channels)
        direct, near, far : float
            Gains, as `Transport.relight` takes them.

        Returns
        -------
        ndarray, shape (Cy, Cx) or (Cy, Cx, channels), float32
            Photo units.
        """
        transport = self._transport
        lights = transport.lights(light)
        number, channels = transport.camera.pixels, transport.channels
        found = np.empty((number, channels), dtype=np.float32)
        for place, flat in enumerate(lights):
            unseen = self._unseen(flat) * far**2
            for block in blocks(number, BLOCK):
                asked = self._of_light(block, flat, unseen, (direct, near, far))
                deviation = np.sqrt(self._variance(block, asked))
                if len(lights) == 1:
                    found[block] = deviation
                else:
                    found[block, place] = deviation[:, place]
        return transport.picture(found)

    def direct(self) -> Floats:
        """Return the standard deviation of d, (Cy, Cx, channels); 0 without direct light."""
        transport = self._transport
        found = np.empty((transport.camera.pixels, transport.channels), dtype=np.float32)
        for block in blocks(len(found), BLOCK):
            found[block] = np.sqrt(self._variance(block, self._of_direct(len(found[block]))))
        found *= transport.lit.reshape(-1, 1)
        return found.reshape(*transport.camera, transport.channels)

    def component_rows(self, pixels: slice) -> Components:
        """Return standard deviations of dense rows of D, N and F; see `Transport.component_rows`.

        N and F are the model's: n in the window, f at the frequencies of the far band that the
        transport holds. Some milliseconds for each thousand projector pixels and camera pixel.
        """
        chosen = range(*pixels.indices(self._transport.camera.pixels))
        shape = (0, self._transport.channels, self._transport.projector.pixels)
        rows = [self._on(c, slice(0, self._transport.projector.height)) for c in chosen]
        if not rows:
            return Components(*(np.zeros(shape, dtype=np.float32) for _ in Components._fields))
        return Components(*(np.stack(part) for part in zip(*rows, strict=True)))

    def along(self, pixel: int, line: int) -> Components:
        """Return those of one camera pixel along one row of the projector.

        Parameters
        ----------
        pixel : int
            Of the camera, row by row.
        line : int
            Row of the projector.

        Returns
        -------
        Components
            Each (channels, Px); as `component_rows`.

        Raises
        ------
        InputError
            If there is no such pixel, or no such row.
        """
        camera, projector = self._transport.camera, self._transport.projector
        if not 0 <= pixel < camera.pixels:
            raise InputError(
                f"the camera of {camera} has no pixel {pixel}: choose one that it has."
            )
        if not 0 <= line < projector.height:
            raise InputError(
                f"the projector of {projector} has no row {line}: choose one that it has."
            )
        return self._on(pixel, slice(line, line + 1))

    def _on(self, c: int, lines: slice) -> Components:
        """Of one camera pixel on some rows of the projector, each (channels, lines * Px)."""
        transport, one = self._transport, slice(c, c + 1)
        width = transport.projector.width
        first, last = lines.start * width, lines.stop * width
        inside = near.inside(self._centres[one], transport.window, transport.projector)[0]
        d = np.zeros((transport.channels, last - first), dtype=np.float32)
        n, f = np.zeros_like(d), np.empty_like(d)
        if transport.lit.ravel()[c]:
            deviation = np.sqrt(self._variance(one, self._of_direct(1)))[0]
            corners, weights = self._where.pixels[c], self._where.weights[c]
            here = (corners >= first) & (corners < last)
            np.add.at(d.T, corners[here] - first, weights[here, None] * deviation)
            places = near.places_on(self._centres[one], transport.window, transport.projector)[0]
            entries = np.flatnonzero(inside & (places >= first) & (places < last))
            variance = self._variance(one, self._of_entries(entries))
            n[:, places[entries] - first] = np.sqrt(variance).T
        for some in blocks(lines.stop - lines.start, max(1, ENTRIES // width)):
            shown = slice(lines.start + some.start, lines.start + some.stop)
            variance = self._variance(one, self._of_far(one, inside, shown))
            f[:, some.start * width : some.stop * width] = np.sqrt(variance).T
        return Components(d, n, f)

    def _of_direct(self, number: int) -> _Asked:
        """Ask for d."""
        return _Asked(
            np.zeros(number),
            np.broadcast_to([1.0, 0.0, 0.0], (number, 3)),
            np.zeros((number, self._transport.window**2), dtype=np.float32),
            np.zeros((number, self._band.basis.count), dtype=np.float32),
            np.zeros(len(self._posterior.kinds)),
        )

    def _of_entries(self, entries: Integers) -> _Asked:
        """Ask for window entries of one camera pixel."""
        return _Asked(
            np.zeros(len(entries)),
            np.zeros((len(entries), 3)),
            np.eye(self._transport.window**2, dtype=np.float32)[entries],
            np.zeros((len(entries), self._band.basis.count), dtype=np.float32),
            np.zeros(len(self._posterior.kinds)),
        )

    def _of_far(self, one: slice, inside: Booleans, lines: slice) -> _Asked:
        """Ask for what a row of F of one camera pixel holds on some rows of the projector."""
        band, total = self._band, self._transport.projector.pixels
        lit = float(self._transport.lit.ravel()[one][0])
        drawn = band.basis.patterns_on(lines).T
        patterns = (drawn * band.basis.weights * self._held).astype(np.float32)
        number = len(patterns)
        centre = np.broadcast_to(self._centres[one], (number, 2))
        return _Asked(
            np.full(number, 1.0 / total),
            np.broadcast_to([-lit / total, 0.0, 0.0], (number, 3)),
            -lit / total * inside[None].astype(np.float32),
            band.recentre(patterns[:, None], centre)[:, 0],
            np.zeros(len(self._posterior.kinds)),
        )

    def _of_light(
        self, block: slice, light: Floats, unseen: Floats, gains: tuple[float, float, float]
    ) -> _Asked:
        """Ask for the picture under a light (P,)."""
        transport, band = self._transport, self._band
        gain_direct, gain_near, gain_far = gains
        projector, centres = transport.projector, self._centres[block]
        q = transport.correspondence.reshape(-1, 2)[block]
        mean = gain_far * float(light.mean())
        seen = near.look_up(light.reshape(projector), centres, transport.window, projector)
        whole = near.inside(centres, transport.window, projector)
        overlap = (gain_far * band.basis.analyse(light) * self._held).astype(np.float32)
        turned = np.broadcast_to(overlap, (len(centres), 1, len(overlap)))
        lit = transport.lit.ravel()[block]
        direct = gain_direct * responses_of_direct(q, light[None], projector)[..., 0]
        direct[:, 0] -= mean * lit
        return _Asked(
            np.full(len(centres), mean),
            direct,
            (lit[:, None] * (gain_near * seen - mean * whole)).astype(np.float32),
            band.recentre(turned, centres)[:, 0],
            unseen,
        )

    def _unseen(self, light: Floats) -> Floats:
        """Variance, under a light (P,), of what the transport does not hold of f: (kinds,).

        At unit strength.
        """
        transport = self._transport
        projector = transport.projector
        power = np.abs(np.fft.fft2(light.reshape(projector).astype(np.float64))) ** 2
        held = (DC, *(k for k in transport.far_basis.frequencies if k != DC))
        for k in held:
            y, x = (round(part * side) for part, side in zip(k, projector, strict=True))
            power[y % projector.height, x % projector.width] = 0.0
            power[-y % projector.height, -x % projector.width] = 0.0
        cycles = [np.fft.fftfreq(side) * side for side in projector]
        radius = np.hypot(cycles[0][:, None], cycles[1])
        total = [np.sum(power_at(radius, kind) * power) for kind in self._posterior.kinds]
        return np.array(total) / projector.pixels**2

    def _known(self, block: slice) -> _Of:
        """Gather camera pixels."""
        transport, posterior, band = self._transport, self._posterior, self._band
        channels = transport.channels
        white = posterior.white.reshape(-1, channels)[block]
        centres = self._centres[block]
        q = transport.correspondence.reshape(-1, 2)[block]
        direct = corner_weights(q, centres) @ band.on_corners.T
        ones = band.recentre(np.ones_like(direct[:, :1]), centres)
        offset_noise = posterior.offset_noise.reshape(-1, channels)[block]
        share = posterior.share_of_white.reshape(-1, channels)[block]
        light_noise = posterior.light_noise.reshape(-1, channels)[block]
        return _Of(
            np.concatenate([ones, direct], axis=1).transpose(0, 2, 1),
            nuisance.precision_of(white, offset_noise),
            np.maximum(transport.noise.reshape(-1, channels)[block], EXACT * white),
            posterior.strength.ravel()[block, None] * white,
            np.maximum(light_noise**2 - (share * offset_noise) ** 2, 0.0),
            share,
            posterior.kind.ravel()[block].astype(np.int64),
        )

    def _variance(self, block: slice, asked: _Asked) -> Floats:
        """Posterior variance of numbers asked of a block, or many of one camera pixel."""
        known = self._known(block)
        if len(known.kind) == 1:
            (place,) = known.kind
            of_kind = asked._replace(unseen=asked.unseen[place])
            return _of_kind(self._prior(int(place)), known, of_kind)
        found = np.empty((len(asked.mean), self._transport.channels))
        for place in np.unique(known.kind):
            rows = np.flatnonzero(known.kind == place)
            of_kind = _Asked._make((*(part[rows] for part in asked[:-1]), asked.unseen[place]))
            found[rows] = _of_kind(self._prior(int(place)), known.only(rows), of_kind)
        return found

    def _prior(self, place: int) -> Prior:
        if place not in self._priors:
            kind: Kind = self._posterior.kinds[place]
            self._priors[place] = build_prior(kind, self._band, self._posterior.multiplicity)
        return self._priors[place]


def _of_kind(prior: Prior, known: _Of, asked: _Asked) -> Floats:
    """Posterior variance, (n, channels); `known` has one camera pixel for each number, or one."""
    squared = (known.scale.astype(np.float64) ** 2)[..., None]
    weight = 1.0 / (squared * prior.levels + known.noise.astype(np.float64)[..., None] ** 2)
    told = (asked.near @ prior.to_near.T + asked.far @ prior.to_far.T)[:, None]
    before = (
        np.einsum("nw,nw->n", asked.near @ prior.covariance, asked.near)
        + asked.far.astype(np.float64) ** 2 @ prior.power
        + asked.unseen
    )
    within = squared[..., 0] * (before[:, None] - np.sum(squared * weight * told**2, axis=-1))
    turned = np.matmul(known.columns.transpose(0, 2, 1), prior.directions)[:, None]
    weighed = turned * weight[:, :, None]
    normal = np.matmul(weighed, turned.transpose(0, 1, 3, 2))
    # o tells of white, d and q of direct light; all of what the responses say of n and f.
    shape = within.shape
    own = np.stack(
        [
            -known.share * asked.mean[:, None],
            *(np.broadcast_to(asked.direct[:, None, part], shape) for part in range(3)),
        ],
        axis=-1,
    )
    left = own - np.matmul(weighed, (squared * told)[..., None])[..., 0]
    spread = nuisance.solve(
        np.broadcast_to(normal, (*left.shape, nuisance.KEPT)),
        left,
        np.broadcast_to(known.precision, left.shape),
    )
    variance = within + np.sum(left * spread, axis=-1)
    variance += asked.mean[:, None] ** 2 * known.white_left
    return np.asarray(np.maximum(variance, 0.0))
