"""Posterior variances of the joint estimate: of d, of entries of N and F, and of pictures.

All of them are linear functionals h_o o + h_d d + h_n.n + h_f.f of a camera pixel's row, f's DC
being what d and n leave of white. Given the prior component, o, d and q, the posterior is a
Gaussian in the prior's eigenvectors; o, d and q add their own uncertainty.

Index convention: arrays are (n, channels, ...), n camera pixels; k runs over functionals of each of
them, h over lights, r over real responses, w over window entries, i over eigenvectors, g over o, d
and shifts of q.
"""

from collections.abc import Callable, Sequence
from functools import lru_cache, partial
from typing import Any, NamedTuple

import numpy as np

from nearfar.arrays import Booleans, Floats, Integers, Size
from nearfar.estimate.joint import nuisance
from nearfar.estimate.joint.batch import (
    DIFFERENCE_STEP,
    RELATIVE_NOISE_FLOOR,
    noise_floor,
    responses_of_direct,
)
from nearfar.estimate.joint.clipped_variance import clipped_variance
from nearfar.estimate.joint.clipped_windows import is_clipped
from nearfar.estimate.joint.footprint import footprint_weights
from nearfar.estimate.joint.posterior_variance import (
    Functionals,
    PixelState,
    posterior_variance,
)
from nearfar.estimate.joint.second_places import responses_of
from nearfar.estimate.joint.shares import share_on_projector
from nearfar.estimate.truncated import Rows, change_by_place, share_missed, truncated_variance
from nearfar.illumination.centred_basis import CentredBasis, centred_basis
from nearfar.illumination.frequencies import Frequency
from nearfar.illumination.near_basis import NearBasis
from nearfar.illumination.real_basis import real_basis
from nearfar.priors.component import PriorComponent
from nearfar.priors.responses import ResponsePrior, response_prior
from nearfar.transport import near
from nearfar.transport.blurred import BlurredLight, blurred_light
from nearfar.transport.boxes import box_axes
from nearfar.transport.direct import footprint, look_up
from nearfar.transport.gains import Gains
from nearfar.transport.model import Transport
from nearfar.transport.posterior import Posterior

# Standard deviation of a second place, in projector pixels.
SECOND_SHIFT = 0.15
# How much larger errors are at a camera pixel with a second place than its posterior says: the
# place is the likeliest of many, and there may be a third. On glass, and on a scene of posts, one
# standard deviation held 56 to 58 % of the errors without it.
SECOND_WIDENING = 1.25
# They are so much larger where the estimate misses at least this share of the variance of far-range
# light. The less it misses, the less room photos leave for a third place.
ROOM_FOR_A_THIRD = 0.01
# Half a step of a second place, in projector pixels, of numerical derivatives by it.
HALF_STEP = 0.25


class _Lights(NamedTuple):
    """Lights whose pictures have error bars.

    Attributes
    ----------
    mean : ndarray, shape (h,)
    seen : callable
        As `JointVariances._seen`, for a batch of camera pixels.
    overlap : ndarray, shape (h, R), float32
        With the responses that the transport holds, times the gain of far-range light.
    truncated : ndarray, shape (components, h)
        See `Functionals`.
    at_second : callable
        Responses of unit direct light from second places, and their derivatives, (n, h, 3).
    """

    mean: Floats
    seen: Callable[[slice], tuple[Floats, Floats]]
    overlap: Floats
    truncated: Floats
    at_second: Callable[[slice], Floats]


class JointVariances:
    """Posterior variances of a joint estimate's rows; see `nearfar.estimate.error_bars`.

    Parameters
    ----------
    transport : Transport
    posterior : Posterior
        Of the transport.
    """

    def __init__(self, transport: Transport, posterior: Posterior) -> None:
        self._transport, self._posterior = transport, posterior
        self._centred: CentredBasis = _centred_on(
            posterior.frequencies, transport.projector, transport.near_basis
        )
        basis = self._centred.basis
        self._priors: dict[int, ResponsePrior] = {}
        self._centres = near.centre(transport.correspondence, transport.projector)
        places = transport.second_place
        has_second = transport.factors.second is not None and places is not None
        self._second = places.reshape(-1, 2) if has_second and places is not None else None
        kept = set(transport.far_basis.frequencies)
        self._is_held = np.array([basis.frequencies[i] in kept for i in basis.index])
        if self._second is not None:
            missed = share_missed(transport, posterior.prior_components, self._rows())
            self._room = np.minimum(missed / ROOM_FOR_A_THIRD, 1.0)

    def of_pictures(self, lights: Floats, gains: Gains) -> Callable[[slice], Floats]:
        """Return a function of camera pixels: variances (n, h, channels) under lights (h, P)."""
        transport, components = self._transport, self._posterior.prior_components
        truncated = np.stack(
            [truncated_variance(transport, light, components) for light in lights], axis=1
        )
        blurred = None
        if transport.pitch > 1:
            pyramid = transport.pyramid
            blurred = [blurred_light(light.astype(np.float32), pyramid) for light in lights]
        seen = partial(self._seen, lights=lights, blurred=blurred)
        overlap = gains.far * self._centred.basis.analyse(lights) * self._is_held
        shown = _Lights(
            lights.mean(axis=1).astype(np.float64),
            seen,
            overlap.astype(np.float32),
            gains.far**2 * truncated,
            partial(self._at_second, lights),
        )
        return lambda batch: self._variance(batch, self._of_lights(batch, shown, gains))

    def change_by_place(self, light: Floats, gains: Gains) -> Callable[[slice], Floats]:
        """Return a function of camera pixels: corrections of variances, (n, channels).

        Squared error bars under a light (P,) are variances plus these.
        """
        change = change_by_place(
            self._transport, light, self._posterior.prior_components, self._rows()
        )
        return lambda batch: np.asarray(gains.far**2 * self._more(batch) * change(batch))

    def _rows(self) -> Rows:
        """Return prior component, prior scale, noise and measured frequencies of all rows."""
        posterior, transport = self._posterior, self._transport
        shape = (transport.camera.pixels, transport.channels)
        noise = transport.noise.reshape(shape).astype(np.float64) ** 2
        scale = posterior.prior_scale.reshape(-1, 1) * posterior.white.reshape(shape)
        basis, projector = self._centred.basis, transport.projector
        multiplicity = np.zeros(projector)
        # Cosine and sine of a pair are measured alike.
        places = np.rint(basis.cycles[basis.index] * projector).astype(np.int64)
        for sign in (1, -1):
            y, x = (sign * places % projector).T
            multiplicity[y, x] = self._is_held * posterior.multiplicity
        return Rows(
            posterior.prior_component.ravel().astype(np.int64),
            scale.astype(np.float64) ** 2,
            noise * posterior.noise_share.reshape(shape),
            multiplicity,
        )

    def of_direct(self, batch: slice) -> Floats:
        """Return the variances of d at camera pixels, (n, channels)."""
        second = np.zeros((len(self._centres[batch]), 1, 3))
        return self._of_light_from(batch, self._of_amplitudes([1.0, 0.0, 0.0], second))

    def of_second(self, batch: slice) -> Floats:
        """Return the variances of light from second places, (n, channels); 0 where none is."""
        second = (self._has_second(batch) * [1.0, 0.0, 0.0])[:, None]
        return self._has_second(batch) * self._of_light_from(
            batch, self._of_amplitudes([0.0, 0.0, 0.0], second)
        )

    def _of_light_from(self, batch: slice, amplitudes: Floats) -> Floats:
        """Return the variances of sums of the amplitudes of direct light, (n, channels)."""
        number = len(amplitudes)
        functionals = Functionals(
            np.zeros((number, 1)),
            amplitudes,
            np.zeros((number, 1, self._transport.near_basis.count), dtype=np.float32),
            np.zeros((number, 1, self._centred.basis.count), dtype=np.float32),
            np.zeros((len(self._posterior.prior_components), 1)),
        )
        return np.asarray(self._variance(batch, functionals)[:, 0])

    def of_window(self, pixel: int, values: Floats) -> Floats:
        """Return those of sums of one camera pixel's near-range functions, (m, channels)."""
        number = len(values)
        functionals = Functionals(
            np.zeros((1, number)),
            self._of_amplitudes([0.0, 0.0, 0.0], np.zeros((1, number, 3))),
            values[None],
            np.zeros((1, number, self._centred.basis.count), dtype=np.float32),
            np.zeros((len(self._posterior.prior_components), 1)),
        )
        return np.asarray(self._variance(slice(pixel, pixel + 1), functionals)[0])

    def of_far(self, pixel: int, lines: slice) -> Floats:
        """Return those of one camera pixel's row of F on projector rows, (lines * Px, channels)."""
        one = slice(pixel, pixel + 1)
        return np.asarray(self._variance(one, self._of_far(one, self._inside(one)[0], lines))[0])

    def _of_far(self, one: slice, inside: Floats, lines: slice) -> Functionals:
        """Return the entries of one camera pixel's row of F on some rows of the projector."""
        centred, total = self._centred, self._transport.projector.pixels
        lit = float(self._transport.lit.ravel()[one][0])
        drawn = centred.basis.patterns_on(lines).T
        patterns = (drawn * centred.basis.weights * self._is_held).astype(np.float32)
        number = len(patterns)
        second = self._has_second(one) * [-1.0 / total, 0.0, 0.0]
        return Functionals(
            np.full((1, number), 1.0 / total),
            self._of_amplitudes([-lit / total, 0.0, 0.0], np.broadcast_to(second, (1, number, 3))),
            (-lit / total * inside[None, None]).astype(np.float32),
            centred.recentre(patterns[None], self._centres[one]),
            np.zeros((len(self._posterior.prior_components), 1)),
        )

    def _of_lights(self, batch: slice, lights: "_Lights", gains: Gains) -> Functionals:
        """Return the functionals that are the pictures under lights."""
        transport, centred = self._transport, self._centred
        centres = self._centres[batch]
        mean = gains.far * lights.mean
        in_window, direct = lights.seen(batch)
        inside = self._inside(batch)[:, None]
        overlaps = np.broadcast_to(lights.overlap, (len(centres), *lights.overlap.shape))
        lit = transport.lit.ravel()[batch]
        direct = gains.direct * direct
        direct[..., 0] -= mean * lit[:, None]
        second = gains.direct * lights.at_second(batch)
        second[..., 0] -= mean * self._has_second(batch)
        near_range = gains.near * in_window - mean[:, None] * inside
        return Functionals(
            np.broadcast_to(mean, (len(centres), len(mean))),
            self._of_amplitudes(direct, second),
            (lit[:, None, None] * near_range).astype(np.float32),
            centred.recentre(overlaps, centres),
            lights.truncated,
        )

    def _seen(
        self, batch: slice, lights: Floats, blurred: Sequence[BlurredLight] | None
    ) -> tuple[Floats, Floats]:
        """Return the responses of unit near-range and unit direct light to lights (h, P).

        Returns
        -------
        in_window : ndarray, shape (n, h, J)
        direct : ndarray, shape (n, h, 3)
            Direct light, and its derivatives by q.
        """
        transport, projector = self._transport, self._transport.projector
        centres, q = self._centres[batch], transport.correspondence.reshape(-1, 2)[batch]
        if blurred is None:
            in_window = [
                near.look_up(light, centres, transport.window, projector) for light in lights
            ]
            direct = responses_of_direct(q, lights, projector)
            return np.stack(in_window, axis=1), direct.transpose(0, 2, 1)
        pyramid, boxes = transport.pyramid, transport.boxes[batch]

        def at(places: Floats) -> Floats:
            where = box_axes(places, boxes, projector)
            return np.stack([where.means(each.table, projector) for each in blurred], axis=1)

        steps = DIFFERENCE_STEP * np.eye(2)
        derivatives = [(at(q + step) - at(q - step)) / (2 * DIFFERENCE_STEP) for step in steps]
        places = pyramid.places(centres)[:, None] + pyramid.steps
        return (
            np.stack([each.levels[places] for each in blurred], axis=1),
            np.stack([at(q), *derivatives], axis=-1),
        )

    def _of_amplitudes(self, direct: Any, second: Floats) -> Floats:
        """Return functionals of direct light, (n, k, 3), with those of second places, if any."""
        own = np.broadcast_to(np.asarray(direct, dtype=np.float64), second.shape)
        return own if self._second is None else np.concatenate([own, second], axis=2)

    def _has_second(self, batch: slice) -> Floats:
        """Return 1 for each camera pixel that sees a second place, else 0, (n, 1)."""
        if self._second is None:
            return np.zeros((len(self._centres[batch]), 1))
        return np.isfinite(self._second[batch, :1]).astype(np.float64)

    def _at_second(self, lights: Floats, batch: slice) -> Floats:
        """Return responses of unit direct light from second places, and derivatives, (n, h, 3)."""
        projector = self._transport.projector
        if self._second is None:
            return np.zeros((len(self._centres[batch]), len(lights), 3))

        def seen(places: Floats) -> Floats:
            return look_up(lights, footprint(places, projector)).T

        return _with_derivatives(self._second[batch], seen, len(lights)).transpose(0, 2, 1)

    def _inside(self, batch: slice) -> Floats:
        """Return the share of each near-range function that lies on the projector, (n, J)."""
        transport, centres = self._transport, self._centres[batch]
        if transport.pitch == 1:
            within = near.inside(centres, transport.window, transport.projector)
            return np.asarray(within, dtype=np.float32)
        basis = transport.near_basis
        return share_on_projector(centres, basis.offsets, basis.pitches, transport.projector)

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
        noise_share = posterior.noise_share.reshape(-1, channels)[batch]
        noise = transport.noise.reshape(-1, channels)[batch]
        floor = noise_floor(transport.near_basis) * white
        precision = nuisance.common_precision(
            white, offset_noise, nuisance.shift_deviation(transport.near_basis)
        )
        if self._second is not None:
            direct = np.concatenate([direct, self._second_responses(batch)], axis=1)
            precision = np.concatenate([precision, self._second_precision(batch, white)], axis=2)
        return PixelState(
            np.concatenate([ones, direct], axis=1).transpose(0, 2, 1),
            precision,
            np.maximum(noise, floor),
            np.maximum(noise * np.sqrt(noise_share), floor),
            posterior.prior_scale.ravel()[batch, None] * white,
            np.maximum(light_noise**2 - (share_of_white * offset_noise) ** 2, 0.0),
            share_of_white,
            posterior.prior_component.ravel()[batch].astype(np.int64),
        )

    def _second_responses(self, batch: slice) -> Floats:
        """Return the same to the measured patterns, re-centred, (n, 3, R)."""
        assert self._second is not None
        basis = self._centred.basis
        of_place = partial(responses_of, basis=basis)
        found = _with_derivatives(self._second[batch], of_place, basis.count)
        return self._centred.recentre(found, self._centres[batch])

    def _second_precision(self, batch: slice, white: Floats) -> Floats:
        """Return the prior precision of light from second places and its shifts."""
        second = self._transport.second_direct
        assert second is not None
        direct = second.reshape(-1, white.shape[1])[batch]
        floor = RELATIVE_NOISE_FLOOR * white.astype(np.float64)
        shift = 1.0 / np.maximum(SECOND_SHIFT * direct, floor) ** 2
        light = 1.0 / (nuisance.DIRECT_PRIOR_DEVIATION * white.astype(np.float64)) ** 2
        return np.stack([light, shift, shift], axis=-1)

    def _variance(self, batch: slice, functionals: Functionals) -> Floats:
        """Return variances of functionals, (n, k, channels)."""
        more = self._more(batch)[:, None]
        return np.asarray(more * self._posterior_variance(batch, functionals))

    def _more(self, batch: slice) -> Floats:
        """Return how much larger variances are where there is a second place, (n, 1)."""
        if self._second is None:
            return np.ones((len(self._centres[batch]), 1))
        return np.asarray(
            1.0 + (SECOND_WIDENING**2 - 1.0) * self._has_second(batch) * self._room[batch, None]
        )

    def _posterior_variance(self, batch: slice, functionals: Functionals) -> Floats:
        """Return posterior variances, (n, k, channels)."""
        state = self._state(batch)
        clips = self._clips(batch)
        pixels = np.arange(*batch.indices(len(self._centres)))
        if len(pixels) == 1:
            (place,) = state.prior_component
            its = functionals._replace(truncated=functionals.truncated[place])
            return self._of_component(pixels, int(place), bool(clips[0]), state, its)
        found = np.empty((*functionals.white.shape, self._transport.channels))
        for place, clipped in np.unique(np.stack([state.prior_component, clips]), axis=1).T:
            rows = np.flatnonzero((state.prior_component == place) & (clips == clipped))
            theirs = functionals.only(rows)
            its = theirs._replace(truncated=functionals.truncated[place])
            found[rows] = self._of_component(
                pixels[rows], int(place), bool(clipped), state.only(rows), its
            )
        return found

    def _of_component(
        self,
        pixels: Integers,
        place: int,
        clipped: bool,
        state: PixelState,
        functionals: Functionals,
    ) -> Floats:
        """Return posterior variances of camera pixels of one prior component, (n, k, channels)."""
        prior = self._prior(place)
        if not clipped:
            return posterior_variance(prior, state, functionals)
        transport = self._transport
        inside = near.inside(self._centres[pixels], transport.window, transport.projector)
        multiplicity = self._posterior.multiplicity.astype(np.float64)
        return clipped_variance(prior, state, functionals, inside, self._centred, multiplicity)

    def _clips(self, batch: slice) -> Booleans:
        """Return whether the border clips the window of camera pixels with direct light, (n,)."""
        transport, centres = self._transport, self._centres[batch]
        lit = transport.lit.ravel()[batch]
        if transport.pitch > 1:
            return np.zeros_like(lit)
        return np.asarray(lit & is_clipped(centres, transport.near_basis, transport.projector))

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


def _with_derivatives(places: Floats, at: Callable[[Floats], Floats], count: int) -> Floats:
    """Return values (n, `count`) at places, and their derivatives by these: (n, 3, `count`).

    0 where a place is NaN.
    """
    found = np.zeros((len(places), 3, count), dtype=np.float32)
    has = np.flatnonzero(np.isfinite(places[:, 0]))
    found[has, 0] = at(places[has])
    for axis, step in enumerate(HALF_STEP * np.eye(2)):
        difference = at(places[has] + step) - at(places[has] - step)
        found[has, 1 + axis] = difference / (2 * HALF_STEP)
    return found
