"""Rows drawn from a prior component, measured, and solved by dense algebra."""

from dataclasses import replace

import numpy as np

from nearfar.arrays import Size
from nearfar.estimate.joint.batch import AllPixels, gather, offset_noise, white_scale
from nearfar.estimate.joint.clipped import solve_clipped
from nearfar.estimate.joint.nuisance import amplitude_responses, prior_precision
from nearfar.estimate.joint.solve import PosteriorMean, solve_whole, variance_ratio
from nearfar.illumination.centred_basis import centred_basis
from nearfar.illumination.frequencies import DC
from nearfar.illumination.near_basis import NearBasis
from nearfar.illumination.real_basis import real_basis
from nearfar.photometry.measurements import Measurements
from nearfar.plan.choose_frequencies import choose_frequencies
from nearfar.priors.component import PriorComponent
from nearfar.priors.covariance import far_variance, near_covariance
from nearfar.transport import near

PROJECTOR = Size(16, 20)
WINDOW = 5
FAR = Size(5, 5)
COMPONENT = PriorComponent(1.5, 8.0, 2.0)


def chosen_frequencies(photos=70):
    return list(choose_frequencies(PROJECTOR, photos, WINDOW).frequencies)


def centred_on_all(frequencies):
    basis = real_basis(frequencies, PROJECTOR)
    plain = centred_basis(basis, NearBasis(WINDOW))
    return replace(plain, response_indices=np.arange(1, basis.count + 1))


def measured(
    rows, frequencies, *, noise=1e-4, seed=0, camera=None, offset=0.0, projector=PROJECTOR
):
    """Measure dense rows (C, channels, P) with DC first; `offset` is the references' deviation."""
    generator = np.random.default_rng(seed)
    basis = real_basis([DC, *frequencies], projector)
    count, channels = rows.shape[:2]
    responses = rows @ basis.patterns.T.astype(np.float64)
    responses = responses + noise * generator.normal(size=responses.shape)
    responses[..., 1:] += offset * generator.normal(size=(count, channels, 1))
    level = np.full((count, channels), noise, dtype=np.float32)
    return Measurements(
        camera=camera or Size(1, count),
        basis=basis,
        responses=responses.astype(np.float32),
        noise=level,
        black=np.zeros_like(level),
        quantisation_error=np.zeros((basis.count, projector.pixels), dtype=np.float32),
        white_noise=np.full_like(level, offset),
    )


def drawn_rows(count, centres, scale, seed=0):
    """Draw rows of COMPONENT about chosen q, (C, 1, P), with direct light of 0.5; and windows."""
    generator = np.random.default_rng(seed)
    covariance = near_covariance(COMPONENT, WINDOW, PROJECTOR)
    windows = scale * generator.multivariate_normal(
        np.zeros(WINDOW**2), covariance, count, method="eigh"
    )
    rows = np.zeros((count, PROJECTOR.pixels))
    inside = near.inside(centres, WINDOW, PROJECTOR)
    places = near.window_pixels(centres, WINDOW, PROJECTOR)
    for c in range(count):
        np.add.at(rows[c], places[c], windows[c] * inside[c])
        rows[c, centres[c] @ [PROJECTOR.width, 1]] += 0.5
    return rows[:, None], windows * inside


def batch_of(measurements, centres, centred):
    count = len(centres)
    pixels = AllPixels(
        responses=measurements.responses[..., centred.response_indices],
        correspondence=centres.astype(float),
        centres=centres,
        lit=np.ones(count, dtype=bool),
        noise=measurements.noise,
        offset_noise=offset_noise(measurements),
        white=white_scale(measurements),
        spike_expected=np.zeros((count, WINDOW**2), dtype=bool),
        footprint=np.zeros(count, dtype=np.float32),
        is_even=np.ones(count, dtype=bool),
    )
    return gather(pixels, slice(None), centred, PROJECTOR)


def solved(batch, prior, scale, centred, *, by=None):
    """Solve each camera pixel as its window asks, or all by one solver."""
    ratio = variance_ratio(batch, scale)
    if by is not None:
        return by(batch, prior, ratio, centred)
    inner = batch.inside.all(axis=1)
    parts = [
        (
            np.flatnonzero(mine),
            solver(batch.only(np.flatnonzero(mine)), prior, ratio[mine], centred),
        )
        for mine, solver in ((inner, solve_whole), (~inner, solve_clipped))
        if mine.any()
    ]
    order = np.argsort(np.concatenate([number for number, _ in parts]))
    return PosteriorMean(
        *(np.concatenate(values)[order] for values in zip(*(f for _, f in parts), strict=True))
    )


def dense(measurements, batch, centred, scale, component=COMPONENT):
    """Posterior mean of (o, d, n, f) and the log evidence by plain linear algebra."""
    results = []
    window = near_covariance(component, WINDOW, PROJECTOR)
    variance = far_variance(centred.basis, component)
    for c in range(len(batch.white)):
        white, noise = float(batch.white[c, 0]), float(batch.noise[c, 0])
        patterns = centred.on_window * batch.inside[c]
        s = (scale * white) ** 2
        design = amplitude_responses(batch, centred)[c].T.astype(np.float64)
        precision = prior_precision(batch, NearBasis(WINDOW))[c, 0]
        covariance = (
            s * (patterns @ window @ patterns.T + np.diag(variance))
            + design @ np.diag(1 / precision) @ design.T
            + noise**2 * np.eye(len(variance))
        )
        y = batch.responses[c, 0].astype(np.float64)
        x = np.linalg.solve(covariance, y)
        _, logarithm = np.linalg.slogdet(covariance)
        near_mean = s * (window @ patterns.T @ x) * batch.inside[c]
        results.append(
            (design.T @ x / precision, near_mean, s * variance * x, -0.5 * (y @ x + logarithm))
        )
    return [np.stack(part) for part in zip(*results, strict=True)]
