"""Posterior variances of rows that were estimated from any patterns; see `solve` for the model.

A linear functional h_d d + h_n.n + h_F.F of a row has, in units of sigma^2, the variance

    rho v - rho^2 c^T K^-1 c + w^T (G^T K^-1 G + Q)^-1 w,   w = (0, h_d) - rho G^T K^-1 c,

v its variance at unit prior scale, Q the prior precision of b and d, and c = L C h_n + Lf S h_F its
covariance with the photos.

Index convention: n runs over camera pixels of one rounded q, component and variance ratio, h over
functionals, k over photos, g over b and d.
"""

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Floats, Integers
from nearfar.estimate.any_patterns.covariance import (
    NearRoot,
    PatternModel,
    far_covariance,
    near_root,
    patterns_over_window,
)
from nearfar.estimate.any_patterns.solve import information, inverted
from nearfar.estimate.truncated import truncated_variance
from nearfar.parallel import side_by_side
from nearfar.priors.covariance import far_variance
from nearfar.transport import near
from nearfar.transport.direct import Footprint, footprint, look_up
from nearfar.transport.gains import Gains
from nearfar.transport.model import Transport
from nearfar.transport.posterior import PatternPosterior


class _Functionals(NamedTuple):
    """Functionals of camera pixels of one rounded q; those of n and F are the same for all."""

    direct: Floats  # (n, h)
    near: Floats  # (h, W^2)
    far: Floats  # (h, R)
    truncated: Floats  # variance of far-range light that the transport does not hold, (h,)


class PatternVariances:
    """Posterior variances of rows; see `nearfar.estimate.error_bars`.

    Parameters
    ----------
    transport : Transport
    posterior : PatternPosterior
        Of the transport.
    """

    def __init__(self, transport: Transport, posterior: PatternPosterior) -> None:
        self._transport, self._posterior = transport, posterior
        basis = transport.far_basis
        of_far = basis.analyse(posterior.patterns)
        self._model = PatternModel(
            posterior.patterns, transport.projector, transport.window, basis, of_far
        )
        self._where = footprint(transport.correspondence, transport.projector)
        self._centres = near.centre(transport.correspondence, transport.projector)
        self._lit = transport.lit.ravel()
        self._component = posterior.prior_component.ravel().astype(np.int64)
        self._ratio = posterior.variance_ratio.ravel().astype(np.float64)
        self._noise = transport.noise.reshape(-1, transport.channels).astype(np.float64)
        self._black_deviation = posterior.black_deviation.reshape(self._noise.shape)
        used = np.unique(self._component).tolist()
        components = posterior.prior_components
        self._roots: dict[int, NearRoot] = {n: near_root(self._model, components[n]) for n in used}
        self._far = {n: far_covariance(self._model, components[n]) for n in used}
        self._far_variance = {n: far_variance(basis, components[n]) for n in used}

    def of_pictures(self, lights: Floats, gains: Gains) -> Callable[[slice], Floats]:
        """Return a function of camera pixels: variances (n, h, channels) under lights (h, P)."""
        transport, model = self._transport, self._model
        components = self._posterior.prior_components
        far = gains.far * model.far_basis.analyse(lights)
        truncated = gains.far**2 * np.stack(
            [truncated_variance(transport, light, components) for light in lights], axis=1
        )
        direct = gains.direct * look_up(lights, self._where).T

        def of_pixels(batch: slice) -> Floats:
            pixels = np.arange(len(self._lit))[batch]
            found = np.empty((len(pixels), len(lights), transport.channels))

            def work(members: Integers) -> None:
                mine = pixels[members]
                one = mine[:1]
                windows = [
                    near.look_up(light, self._centres[one], model.window, model.projector)[0]
                    for light in lights
                ]
                functionals = _Functionals(
                    direct[mine],
                    gains.near * np.stack(windows) * self._lit[one],
                    far,
                    truncated[self._component[one[0]]],
                )
                found[members] = self._variances(mine, functionals).transpose(0, 2, 1)

            side_by_side(work, self._alike(pixels))
            return found

        return of_pixels

    def change_by_place(self, light: Floats, gains: Gains) -> Callable[[slice], Floats]:
        """Return corrections of 0: nearly all frequencies of far-range light are held."""
        return lambda batch: np.zeros((1, 1))

    def of_direct(self, batch: slice) -> Floats:
        """Return the variances of d at camera pixels, (n, channels)."""
        pixels = np.arange(len(self._lit))[batch]
        found = np.empty((len(pixels), self._transport.channels))
        nothing = _Functionals(
            np.ones((1, 1)),
            np.zeros((1, self._model.window**2)),
            np.zeros((1, self._model.far_basis.count)),
            np.zeros(1),
        )

        def work(members: Integers) -> None:
            mine = pixels[members]
            functionals = nothing._replace(direct=np.ones((len(mine), 1)))
            found[members] = self._variances(mine, functionals)[:, :, 0]

        side_by_side(work, self._alike(pixels))
        return found

    def of_window(self, pixel: int, values: Floats) -> Floats:
        """Return those of sums of one camera pixel's window entries, (m, channels)."""
        far = np.zeros((len(values), self._model.far_basis.count))
        return self._of_one(pixel, np.asarray(values, dtype=np.float64), far)

    def of_far(self, pixel: int, lines: slice) -> Floats:
        """Return those of one camera pixel's row of F on projector rows, (lines * Px, channels)."""
        basis = self._model.far_basis
        entries = basis.patterns_on(lines).T * basis.weights
        return self._of_one(pixel, np.zeros((len(entries), self._model.window**2)), entries)

    def _of_one(self, pixel: int, near_range: Floats, far: Floats) -> Floats:
        """Return the variances of functionals of one camera pixel's n and F, (h, channels)."""
        count = len(far)
        functionals = _Functionals(np.zeros((1, count)), near_range, far, np.zeros(count))
        return np.asarray(self._variances(np.array([pixel]), functionals)[0].T)

    def _alike(self, pixels: NDArray[np.int64]) -> Iterator[Integers]:
        """Yield the camera pixels, by their places, that share their matrices."""
        keys = (self._ratio[pixels], self._component[pixels], *self._centres[pixels].T)
        order = np.lexsort(keys)
        changes = [np.diff(key[order]) != 0 for key in keys]
        yield from np.split(order, np.flatnonzero(np.any(changes, axis=0)) + 1)

    def _variances(self, pixels: NDArray[np.int64], functionals: _Functionals) -> Floats:
        """Return variances, (n, channels, h), of camera pixels that are alike."""
        model, first = self._model, pixels[0]
        component, ratio = int(self._component[first]), float(self._ratio[first])
        variance = self._far_variance[component]
        root = self._roots[component]
        in_window = root.seen(patterns_over_window(model, self._centres[first]))
        inverse = inverted(in_window @ in_window.T + self._far[component], ratio)
        of_near = functionals.near[:, root.entries] @ root.root
        covariance = of_near @ in_window.T + (functionals.far * variance) @ model.of_far.T
        before = (of_near**2).sum(axis=1) + functionals.far**2 @ variance + functionals.truncated
        solved = inverse.of(covariance.T)
        given = ratio * before - ratio**2 * np.einsum("hk,kh->h", covariance, solved)
        # b has no say in a functional, d its own.
        known, own = np.ones((len(pixels), covariance.shape[1], 1)), functionals.direct[:, :, None]
        own = np.concatenate([np.zeros_like(own), own], axis=2)[..., : 1 + self._lit[first]]
        if self._lit[first]:
            of_direct = look_up(
                model.patterns, Footprint(self._where.pixels[pixels], self._where.weights[pixels])
            ).T
            known = np.concatenate([known, of_direct[:, :, None]], axis=2)
        noise = self._noise[pixels] ** 2
        precision = np.zeros((*noise.shape, known.shape[2]))
        precision[..., 0] = noise / self._black_deviation[pixels] ** 2
        of_known = inverse.of_sequences(known)
        normal = np.stack(
            [information(known, of_known, each) for each in np.moveaxis(precision, 1, 0)], axis=1
        )
        gradient = own - ratio * np.einsum("nkg,kh->nhg", known, solved)
        through = np.linalg.solve(normal, np.swapaxes(gradient, 1, 2)[:, None])
        variances = given + np.einsum("nhg,ncgh->nch", gradient, through)
        return np.asarray(np.maximum(variances, 0.0) * noise[..., None])
