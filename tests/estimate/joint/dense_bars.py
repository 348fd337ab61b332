"""Error bars of small transports by dense Gaussian algebra."""

from dataclasses import replace

import numpy as np

from nearfar.arrays import Size
from nearfar.estimate.joint.nuisance import (
    SHIFT_DEVIATION,
    common_precision,
)
from nearfar.illumination.frequencies import DC, far_frequencies
from nearfar.illumination.near_basis import window_offsets
from nearfar.illumination.real_basis import real_basis
from nearfar.plan.choose_frequencies import choose_frequencies
from nearfar.priors.component import PriorComponent
from nearfar.priors.covariance import far_variance, near_covariance
from nearfar.transport import near
from nearfar.transport.model import Transport
from nearfar.transport.posterior import Posterior

PROJECTOR = Size(12, 16)
WINDOW = 5
COMPONENT = PriorComponent(1.5, 8.0, 2.0)
NOISE, OFFSET, LIGHT, SHARE = 2e-3, 1e-3, 1.5e-3, 0.4
SCALE, WHITE = 0.05, 0.8


def transport_at(centres, lit=True, noise=NOISE, noise_share=1.0):
    """Build a transport of one prior component, all factors 0: error bars do not depend on them."""
    low = [k for k in far_frequencies(Size(3, 3), PROJECTOR) if k != DC]
    frequencies = [DC, *(k for i, k in enumerate(low) if -k not in low[:i])]
    basis = real_basis(frequencies, PROJECTOR)
    measured = tuple(choose_frequencies(PROJECTOR, 60, WINDOW).frequencies)
    count = real_basis(measured, PROJECTOR).count
    shape = (1, len(centres), 1)
    q = centres[None].astype(np.float32)
    return Transport(
        projector=PROJECTOR,
        correspondence=q if lit else np.full_like(q, np.nan),
        direct=np.zeros(shape, np.float32),
        near=np.zeros((*shape, WINDOW, WINDOW), np.float32),
        far=np.zeros((*shape, basis.count), np.float32),
        far_basis=basis,
        black=np.zeros(shape, np.float32),
        noise=np.full(shape, noise, np.float32),
        posterior=Posterior(
            prior_components=(PriorComponent(0.0, 1.0, 1.0), COMPONENT),
            frequencies=measured,
            multiplicity=np.random.default_rng(0).integers(1, 4, count).astype(np.float32),
            prior_component=np.ones(shape[:2], np.uint8),
            prior_scale=np.full(shape[:2], SCALE, np.float32),
            white=np.full(shape, WHITE, np.float32),
            offset_noise=np.full(shape, OFFSET, np.float32),
            light_noise=np.full(shape, LIGHT, np.float32),
            share_of_white=np.full(shape, SHARE, np.float32),
            noise_share=np.full(shape, noise_share, np.float32),
        ),
    )


def in_channels(transport, factors):
    """Repeat the only channel of a transport, times factors."""
    posterior, factors = transport.posterior, np.asarray(factors, np.float32)

    def times_factors(values, names):
        return {n: getattr(values, n) * factors for n in names}

    shares = {
        n: getattr(posterior, n) * np.ones_like(factors) for n in ("share_of_white", "noise_share")
    }
    of_light = times_factors(posterior, ("white", "offset_noise", "light_noise"))
    wide = {n: np.repeat(getattr(transport, n), len(factors), axis=2) for n in ("near", "far")}
    return replace(
        transport,
        **times_factors(transport, ("direct", "black", "noise")),
        **wide,
        posterior=replace(posterior, **of_light, **shares),
    )


def prior_variance():
    """Prior variance of o, d and the shifts of q."""
    return 1.0 / common_precision(np.array([[WHITE]]), np.array([[OFFSET]]), SHIFT_DEVIATION)[0, 0]


def dense_deviation(transport, c, ask, scale=SCALE):
    """Posterior deviation of ask(o, white's own, d, n, f) by plain linear algebra.

    `ask` holds weights of each; f is its responses to the measured patterns. Entries of n beyond
    the border are 0.
    """
    posterior = transport.posterior
    basis = real_basis(posterior.frequencies, PROJECTOR)
    centre = transport.correspondence[0, c].astype(int)
    on_window = basis.patterns_at(window_offsets(WINDOW) + centre)
    s = scale * WHITE
    ones = np.ones((basis.count, 1))
    direct = basis.patterns[:, [centre[0] * PROJECTOR.width + centre[1]]]
    responses = np.concatenate(
        [ones, 0 * ones, direct, on_window, np.eye(basis.count)], axis=1
    ).astype(np.float64)
    prior = np.zeros((responses.shape[1], responses.shape[1]))
    prior[0, 0] = OFFSET**2
    prior[1, 1] = LIGHT**2 - (SHARE * OFFSET) ** 2
    prior[2, 2] = prior_variance()[1]
    end = 3 + WINDOW**2
    inside = near.inside(centre[None], WINDOW, PROJECTOR)[0]
    both = np.outer(inside, inside)
    prior[3:end, 3:end] = s**2 * near_covariance(COMPONENT, WINDOW, PROJECTOR) * both
    prior[end:, end:] = s**2 * np.diag(far_variance(basis, COMPONENT))
    noise = np.diag(NOISE**2 / posterior.multiplicity.astype(np.float64))
    gain = prior @ responses.T @ np.linalg.inv(responses @ prior @ responses.T + noise)
    posterior = prior - gain @ responses @ prior
    return np.sqrt(ask @ posterior @ ask)


def weights_of_picture(transport, c, light, *, far_only_held=True):
    """Weights of o, white's own error, d, n and f's responses in the picture under a light."""
    basis = real_basis(transport.posterior.frequencies, PROJECTOR)
    held = np.array([basis.frequencies[i] in transport.far_basis.frequencies for i in basis.index])
    mean = light.mean()
    centre = transport.correspondence[:, c].astype(int)
    seen = near.look_up(light, centre, WINDOW, PROJECTOR)[0]
    inside = near.inside(centre, WINDOW, PROJECTOR)[0]
    return np.concatenate(
        [
            [-SHARE * mean, mean, light[tuple(centre[0])] - mean],
            seen - mean * inside,
            basis.analyse(light.ravel()) * held,
        ]
    )
