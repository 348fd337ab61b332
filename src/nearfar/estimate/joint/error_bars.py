"""Error bars: the posterior standard deviation of D, of entries of N and F, and of pictures.

All of them are linear functionals h_o o + h_d d + h_n.n + h_f.f of a camera pixel's row, f's DC
being what d and n leave of white. Given the prior component, o, d and q, the posterior is a
Gaussian in the prior's eigenvectors; o, d and q add their own uncertainty.

Index convention: arrays are (n, channels, ...), n camera pixels or functionals of one of them; r
runs over real responses, w over window entries, i over eigenvectors, g over o, d and shifts of q.
"""

from functools import lru_cache

import numpy as np

from nearfar.arrays import Floats, Integers, Size, blocks
from nearfar.errors import InputError
from nearfar.estimate.joint import nuisance
from nearfar.estimate.joint.batch import (
    DIFFERENCE_STEP,
    RELATIVE_NOISE_FLOOR,
    responses_of_direct,
)
from nearfar.estimate.joint.footprint import footprint_weights
from nearfar.estimate.joint.posterior_variance import (
    Functionals,
    PixelState,
    posterior_variance,
)
from nearfar.estimate.joint.shares import share_on_projector
from nearfar.illumination.centred_basis import CentredBasis, centred_basis
from nearfar.illumination.frequencies import DC, Frequency
from nearfar.illumination.near_basis import NearBasis
from nearfar.illumination.real_basis import real_basis
from nearfar.priors.component import PriorComponent
from nearfar.priors.covariance import spectral_density
from nearfar.priors.responses import ResponsePrior, response_prior
from nearfar.transport import near
from nearfar.transport.boxes import box_axes, summed_area
from nearfar.transport.direct import footprint
from nearfar.transport.model import Components, Transport
from nearfar.transport.posterior import Posterior

# Camera pixels of a batch.
BATCH_PIXELS = 2048
# Smaller shares of a footprint are rounding.
SHARE_FLOOR = 1e-9
# Entries of a row whose variance is computed at once.
ENTRIES_AT_ONCE = 2**14


class ErrorBars:
    """Posterior standard deviations of a transport.

    They cover the photos' noise and what was never measured, for rows as the prior components of
    `nearfar.priors` expect them and q as it was found. Where held-out photos showed larger errors,
    they are multiplied by the ``widening`` of the transport's verdict. Those of components are of
    the model's split (d at q, n in the window, f in the band), not of the physical one.

    Where a camera pixel is saturated under white, nothing is known of its light: its standard
    deviations are infinite. Means over a picture leave such pixels out,
    ``sigma[numpy.isfinite(sigma)]``, and weights of 1 / sigma^2 are 0 there.

    Parameters
    ----------
    transport : Transport
        From a joint estimate.

    Raises
    ------
    InputError
        If the transport was not estimated jointly.

    Examples
    --------
    >>> bars = nearfar.ErrorBars(transport)
    >>> bars.picture(light).shape  # the standard deviation of `transport @ light`
    (8, 8)
    """

    def __init__(self, transport: Transport) -> None:
        if transport.posterior is None:
            raise InputError(
                "this transport holds no error bars: reconstruct a capture of a plan of "
                "nearfar's own with `method='joint'`."
            )
        self._transport = transport
        self._posterior: Posterior = transport.posterior
        self._levels: tuple[Floats, Floats, Floats] | None = None
        self._widening = transport.verdict.widening if transport.verdict is not None else 1.0
        self._centred: CentredBasis = _centred_on(
            self._posterior.frequencies, transport.projector, transport.near_basis
        )
        basis = self._centred.basis
        self._priors: dict[int, ResponsePrior] = {}
        self._where = footprint(transport.correspondence, transport.projector)
        self._centres = near.centre(transport.correspondence, transport.projector)
        kept = set(transport.far_basis.frequencies)
        self._is_held = np.array([basis.frequencies[i] in kept for i in basis.index])
        quality = transport.quality
        self._unknown = (
            np.zeros(transport.camera.pixels, dtype=bool)
            if quality is None
            else quality.saturated.ravel()
        )

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
            Photo units; infinite at saturated camera pixels.
        """
        transport = self._transport
        lights = transport.lights(light)
        number, channels = transport.camera.pixels, transport.channels
        found = np.empty((number, channels), dtype=np.float32)
        for place, flat in enumerate(lights):
            truncated = self._truncated(flat) * far**2
            for batch in blocks(number, BATCH_PIXELS):
                functionals = self._of_light(batch, flat, truncated, (direct, near, far))
                deviation = np.sqrt(self._variance(batch, functionals))
                if len(lights) == 1:
                    found[batch] = deviation
                else:
                    found[batch, place] = deviation[:, place]
        found[self._unknown] = np.inf
        return transport.picture(found)

    def direct(self) -> Floats:
        """Return the standard deviation of d, (Cy, Cx, channels); 0 without direct light.

        Infinite at saturated camera pixels.
        """
        transport = self._transport
        found = np.empty((transport.camera.pixels, transport.channels), dtype=np.float32)
        for batch in blocks(len(found), BATCH_PIXELS):
            found[batch] = np.sqrt(self._variance(batch, self._of_direct(len(found[batch]))))
        found *= transport.lit.reshape(-1, 1)
        found[self._unknown] = np.inf
        return found.reshape(*transport.camera, transport.channels)

    def component_rows(self, pixels: slice) -> Components:
        """Return standard deviations of dense rows of D, N and F; see `Transport.component_rows`.

        N and F are the model's: n in the window, f at the frequencies of the far band that the
        transport holds. Infinite at saturated camera pixels. Some milliseconds for each thousand
        projector pixels and camera pixel.
        """
        selected = range(*pixels.indices(self._transport.camera.pixels))
        shape = (0, self._transport.channels, self._transport.projector.pixels)
        rows = [self._on(c, slice(0, self._transport.projector.height)) for c in selected]
        if not rows:
            return Components(*(np.zeros(shape, dtype=np.float32) for _ in Components._fields))
        return Components(*(np.stack(part) for part in zip(*rows, strict=True)))

    def along(self, pixel: int, line: int) -> Components:
        """Return standard deviations of one camera pixel along one row of the projector.

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
        """Return those of one camera pixel on some projector rows, each (channels, lines * Px)."""
        transport, one = self._transport, slice(c, c + 1)
        width = transport.projector.width
        first, last = lines.start * width, lines.stop * width
        d = np.zeros((transport.channels, last - first), dtype=np.float32)
        if self._unknown[c]:
            return Components(*(np.full_like(d, np.inf) for _ in Components._fields))
        n, f = np.zeros_like(d), np.empty_like(d)
        if transport.lit.ravel()[c]:
            deviation = np.sqrt(self._variance(one, self._of_direct(1)))[0]
            corners, weights = self._direct_pixels(c)
            here = (corners >= first) & (corners < last)
            np.add.at(d.T, corners[here] - first, weights[here, None] * deviation)
            pixels, values = self._window_pixels(c, first, last)
            variance = self._variance(one, self._of_entries(values))
            n[:, pixels - first] = np.sqrt(variance).T
        inside = self._inside(one)
        for some in blocks(lines.stop - lines.start, max(1, ENTRIES_AT_ONCE // width)):
            on_grid = slice(lines.start + some.start, lines.start + some.stop)
            variance = self._variance(one, self._of_far(one, inside[0], on_grid))
            f[:, some.start * width : some.stop * width] = np.sqrt(variance).T
        return Components(d, n, f)

    def _direct_pixels(self, c: int) -> tuple[Integers, Floats]:
        """Return the projector pixels of one camera pixel's footprint, and their shares."""
        transport, one = self._transport, slice(c, c + 1)
        if transport.pitch == 1:
            return self._where.pixels[c], self._where.weights[c]
        q = transport.correspondence.reshape(-1, 2)[one]
        (rows, columns), shares = box_axes(q, transport.boxes[one], transport.projector).shares(0)
        y, x = np.nonzero(shares > SHARE_FLOOR)
        pixels = (rows.start + y) * transport.projector.width + columns.start + x
        return pixels, shares[y, x].astype(np.float32)

    def _window_pixels(self, c: int, first: int, last: int) -> tuple[Integers, Floats]:
        """Return the projector pixels of a camera pixel's window from `first` to before `last`.

        And the value of each function on each of them, (n, J).
        """
        transport, projector = self._transport, self._transport.projector
        centre = self._centres[c : c + 1]
        if transport.pitch == 1:
            inside = near.inside(centre, transport.window, projector)[0]
            pixels = near.window_pixels(centre, transport.window, projector)[0]
            entries = np.flatnonzero(inside & (pixels >= first) & (pixels < last))
            return pixels[entries], np.eye(transport.window**2, dtype=np.float32)[entries]
        reach = transport.near_basis.reach
        sides = [
            np.arange(max(at - reach, 0), min(at + reach + 1, side))
            for at, side in zip(centre[0].tolist(), projector, strict=True)
        ]
        rows = sides[0]
        rows = rows[(rows >= first // projector.width) & (rows < -(-last // projector.width))]
        y, x = (axis.ravel() for axis in np.meshgrid(rows, sides[1], indexing="ij"))
        values = transport.near_basis.values_at(np.stack([y, x], axis=1) - centre)
        return y * projector.width + x, values.astype(np.float32)

    def _of_direct(self, number: int) -> Functionals:
        """Return the functional d of so many camera pixels."""
        return Functionals(
            np.zeros(number),
            np.broadcast_to([1.0, 0.0, 0.0], (number, 3)),
            np.zeros((number, self._transport.near_basis.count), dtype=np.float32),
            np.zeros((number, self._centred.basis.count), dtype=np.float32),
            np.zeros(len(self._posterior.prior_components)),
        )

    def _of_entries(self, values: Floats) -> Functionals:
        """Return the functionals that are sums of one camera pixel's near-range functions."""
        return Functionals(
            np.zeros(len(values)),
            np.zeros((len(values), 3)),
            values,
            np.zeros((len(values), self._centred.basis.count), dtype=np.float32),
            np.zeros(len(self._posterior.prior_components)),
        )

    def _of_far(self, one: slice, inside: Floats, lines: slice) -> Functionals:
        """Return the entries of one camera pixel's row of F on some rows of the projector."""
        centred, total = self._centred, self._transport.projector.pixels
        lit = float(self._transport.lit.ravel()[one][0])
        drawn = centred.basis.patterns_on(lines).T
        patterns = (drawn * centred.basis.weights * self._is_held).astype(np.float32)
        number = len(patterns)
        centre = np.broadcast_to(self._centres[one], (number, 2))
        return Functionals(
            np.full(number, 1.0 / total),
            np.broadcast_to([-lit / total, 0.0, 0.0], (number, 3)),
            (-lit / total * inside[None]).astype(np.float32),
            centred.recentre(patterns[:, None], centre)[:, 0],
            np.zeros(len(self._posterior.prior_components)),
        )

    def _of_light(
        self, batch: slice, light: Floats, truncated: Floats, gains: tuple[float, float, float]
    ) -> Functionals:
        """Return the functional that is the picture under a light (P,)."""
        transport, centred = self._transport, self._centred
        gain_direct, gain_near, gain_far = gains
        centres = self._centres[batch]
        mean = gain_far * float(light.mean())
        in_window, direct = self._seen(batch, light)
        inside = self._inside(batch)
        overlap = (gain_far * centred.basis.analyse(light) * self._is_held).astype(np.float32)
        overlaps = np.broadcast_to(overlap, (len(centres), 1, len(overlap)))
        lit = transport.lit.ravel()[batch]
        direct = gain_direct * direct
        direct[:, 0] -= mean * lit
        return Functionals(
            np.full(len(centres), mean),
            direct,
            (lit[:, None] * (gain_near * in_window - mean * inside)).astype(np.float32),
            centred.recentre(overlaps, centres)[:, 0],
            truncated,
        )

    def _seen(self, batch: slice, light: Floats) -> tuple[Floats, Floats]:
        """Return the responses of unit near-range and unit direct light to a light (P,).

        Returns
        -------
        in_window : ndarray, shape (n, J)
        direct : ndarray, shape (n, 3)
            Direct light, and its derivatives by q.
        """
        transport, projector = self._transport, self._transport.projector
        centres, q = self._centres[batch], transport.correspondence.reshape(-1, 2)[batch]
        if transport.pitch == 1:
            return (
                near.look_up(light.reshape(projector), centres, transport.window, projector),
                responses_of_direct(q, light[None], projector)[..., 0],
            )
        pyramid = transport.pyramid
        if self._levels is None or self._levels[0] is not light:
            square = light.reshape(projector).astype(np.float32)
            self._levels = (light, pyramid.levels(square), summed_area(square))
        _, levels, summed = self._levels
        boxes = transport.boxes[batch]

        def at(places: Floats) -> Floats:
            return box_axes(places, boxes, projector).means(summed, projector)

        steps = DIFFERENCE_STEP * np.eye(2)
        derivatives = [(at(q + step) - at(q - step)) / (2 * DIFFERENCE_STEP) for step in steps]
        return (
            levels[pyramid.places(centres)[:, None] + pyramid.steps],
            np.stack([at(q), *derivatives], axis=-1),
        )

    def _inside(self, batch: slice) -> Floats:
        """Return the share of each near-range function that lies on the projector, (n, J)."""
        transport, centres = self._transport, self._centres[batch]
        if transport.pitch == 1:
            within = near.inside(centres, transport.window, transport.projector)
            return np.asarray(within, dtype=np.float32)
        basis = transport.near_basis
        return share_on_projector(centres, basis.offsets, basis.pitches, transport.projector)

    def _truncated(self, light: Floats) -> Floats:
        """Return the variance of what the transport does not hold of f, under a light (P,).

        At unit prior scale, for each prior component: shape (components,).
        """
        transport = self._transport
        projector = transport.projector
        spectrum = np.abs(np.fft.fft2(light.reshape(projector).astype(np.float64))) ** 2
        held = (DC, *(k for k in transport.far_basis.frequencies if k != DC))
        for k in held:
            y, x = (round(part * side) for part, side in zip(k, projector, strict=True))
            spectrum[y % projector.height, x % projector.width] = 0.0
            spectrum[-y % projector.height, -x % projector.width] = 0.0
        # Far-range light has no detail that is finer than the coarsest functions.
        cycles = [np.fft.fftfreq(side) for side in projector]
        sampled = [np.flatnonzero(np.abs(one) <= 0.5 / transport.pitch) for one in cycles]
        spectrum = spectrum[np.ix_(*sampled)]
        down, across = (
            side * one[kept] for side, one, kept in zip(projector, cycles, sampled, strict=True)
        )
        radius = np.hypot(down[:, None], across)
        total = [
            np.sum(spectral_density(radius, one) * spectrum)
            for one in self._posterior.prior_components
        ]
        return np.array(total) / projector.pixels**2

    def _state(self, batch: slice) -> PixelState:
        """Gather the posterior's state at camera pixels."""
        transport, posterior, centred = self._transport, self._posterior, self._centred
        channels = transport.channels
        white = posterior.white.reshape(-1, channels)[batch]
        centres = self._centres[batch]
        q = transport.correspondence.reshape(-1, 2)[batch]
        boxes = transport.boxes[batch]
        direct = footprint_weights(q, centres, boxes, centred) @ centred.on_footprint.T
        ones = centred.recentre(np.ones_like(direct[:, :1]), centres)
        offset_noise = posterior.offset_noise.reshape(-1, channels)[batch]
        share_of_white = posterior.share_of_white.reshape(-1, channels)[batch]
        light_noise = posterior.light_noise.reshape(-1, channels)[batch]
        noise = transport.noise.reshape(-1, channels)[batch]
        return PixelState(
            np.concatenate([ones, direct], axis=1).transpose(0, 2, 1),
            nuisance.common_precision(
                white, offset_noise, nuisance.shift_deviation(transport.near_basis)
            ),
            np.maximum(noise, RELATIVE_NOISE_FLOOR * white),
            posterior.prior_scale.ravel()[batch, None] * white,
            np.maximum(light_noise**2 - (share_of_white * offset_noise) ** 2, 0.0),
            share_of_white,
            posterior.prior_component.ravel()[batch].astype(np.int64),
        )

    def _variance(self, batch: slice, functionals: Functionals) -> Floats:
        """Return posterior variances, (n, channels), of each pixel's or of one pixel's many."""
        state, widening = self._state(batch), self._widening**2
        if len(state.prior_component) == 1:
            (place,) = state.prior_component
            its = functionals._replace(truncated=functionals.truncated[place])
            return widening * posterior_variance(self._prior(int(place)), state, its)
        found = np.empty((len(functionals.white), self._transport.channels))
        for place in np.unique(state.prior_component):
            rows = np.flatnonzero(state.prior_component == place)
            theirs = Functionals._make(
                (*(part[rows] for part in functionals[:-1]), functionals.truncated[place])
            )
            found[rows] = posterior_variance(self._prior(int(place)), state.only(rows), theirs)
        return widening * found

    def _prior(self, place: int) -> ResponsePrior:
        if place not in self._priors:
            posterior = self._posterior
            self._priors[place] = _prior_of(
                posterior.prior_components[place],
                posterior.frequencies,
                self._transport.projector,
                self._transport.near_basis,
                tuple(posterior.multiplicity.tolist()),
            )
        return self._priors[place]


# Those of the blocks of camera rows of one transport are the same.
@lru_cache(maxsize=4)
def _centred_on(
    frequencies: tuple[Frequency, ...], projector: Size, near_basis: NearBasis
) -> CentredBasis:
    return centred_basis(real_basis(frequencies, projector), near_basis)


@lru_cache(maxsize=64)
def _prior_of(
    prior_component: PriorComponent,
    frequencies: tuple[Frequency, ...],
    projector: Size,
    near_basis: NearBasis,
    multiplicity: tuple[float, ...],
) -> ResponsePrior:
    centred = _centred_on(frequencies, projector, near_basis)
    return response_prior(prior_component, centred, np.array(multiplicity, dtype=np.float32))
