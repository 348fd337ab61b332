"""Rows drawn from a kind, what is measured of them, and what dense algebra makes of that."""

import numpy as np

from nearfar.arrays import Size
from nearfar.estimate.joint.cut import solve_cut
from nearfar.estimate.joint.nuisance import columns, precision
from nearfar.estimate.joint.pixels import Whole, gather, offset_noise, scale_of
from nearfar.estimate.joint.solve import Found, ratio_of, solve_whole
from nearfar.estimate.matrices import Band, band_of
from nearfar.illumination.frequencies import DC
from nearfar.illumination.real_basis import real_basis
from nearfar.photometry.measurements import Measurements
from nearfar.plan.choose import choose_frequencies
from nearfar.transport import near
from nearfar.transport.kinds import Kind, far_power, near_covariance

PROJECTOR = Size(16, 20)
WINDOW = 5
FAR = Size(5, 5)
KIND = Kind(1.5, 8.0, 2.0)


def chosen_frequencies(photos=70):
    return list(choose_frequencies(PROJECTOR, photos, WINDOW).frequencies)


def band_of_all(frequencies):
    basis = real_basis(frequencies, PROJECTOR)
    plain = band_of(basis, near.offsets(WINDOW))
    return Band(basis, np.arange(1, basis.count + 1), plain.on_window, plain.on_corners)


def measured(rows, frequencies, *, noise=1e-4, seed=0, camera=None, channels=None, offset=0.0):
    """Measure dense rows (C, channels, P) with DC first; `offset` is the references' deviation."""
    generator = np.random.default_rng(seed)
    basis = real_basis([DC, *frequencies], PROJECTOR)
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
        quantisation_error=np.zeros((basis.count, PROJECTOR.pixels), dtype=np.float32),
        white_noise=np.full_like(level, offset),
    )


def drawn_rows(count, centres, strength, seed=0):
    """Draw rows of KIND about chosen q, (C, 1, P), with direct light of 0.5, and their parts."""
    generator = np.random.default_rng(seed)
    covariance = near_covariance(KIND, WINDOW)
    windows = strength * generator.multivariate_normal(
        np.zeros(WINDOW**2), covariance, count, method="eigh"
    )
    rows = np.zeros((count, PROJECTOR.pixels))
    inside = near.inside(centres, WINDOW, PROJECTOR)
    places = near.places_on(centres, WINDOW, PROJECTOR)
    for c in range(count):
        np.add.at(rows[c], places[c], windows[c] * inside[c])
        rows[c, centres[c] @ [PROJECTOR.width, 1]] += 0.5
    return rows[:, None], windows * inside


def pixels_of(measurements, centres, band):
    count = len(centres)
    whole = Whole(
        responses=measurements.responses[..., band.places],
        correspondence=centres.astype(float),
        centres=centres,
        lit=np.ones(count, dtype=bool),
        noise=measurements.noise,
        offset_noise=offset_noise(measurements),
        white=scale_of(measurements),
        likely=np.zeros((count, WINDOW**2), dtype=bool),
    )
    return gather(whole, slice(None), band, PROJECTOR)


def solved(pixels, prior, strength, band, *, by=None):
    """Solve each camera pixel as its window asks, or all as told."""
    ratio = ratio_of(pixels, strength)
    if by is not None:
        return by(pixels, prior, ratio, band)
    inner = pixels.inside.all(axis=1)
    parts = [
        (np.flatnonzero(mine), solver(pixels.only(np.flatnonzero(mine)), prior, ratio[mine], band))
        for mine, solver in ((inner, solve_whole), (~inner, solve_cut))
        if mine.any()
    ]
    order = np.argsort(np.concatenate([number for number, _ in parts]))
    return Found(
        *(np.concatenate(values)[order] for values in zip(*(f for _, f in parts), strict=True))
    )


def dense(measurements, pixels, band, strength, kind=KIND):
    """Posterior mean of (o, d, n, f) and the log evidence by plain linear algebra."""
    results = []
    window = near_covariance(kind, WINDOW)
    power = far_power(band.basis, kind)
    for c in range(len(pixels.white)):
        white, noise = float(pixels.white[c, 0]), float(pixels.noise[c, 0])
        cut = band.on_window * pixels.inside[c]
        s = (strength * white) ** 2
        shared = columns(pixels, band)[c].T.astype(np.float64)
        known = precision(pixels)[c, 0]
        covariance = (
            s * (cut @ window @ cut.T + np.diag(power))
            + shared @ np.diag(1 / known) @ shared.T
            + noise**2 * np.eye(len(power))
        )
        y = pixels.responses[c, 0].astype(np.float64)
        x = np.linalg.solve(covariance, y)
        _, logarithm = np.linalg.slogdet(covariance)
        near_mean = s * (window @ cut.T @ x) * pixels.inside[c]
        results.append((shared.T @ x / known, near_mean, s * power * x, -0.5 * (y @ x + logarithm)))
    return [np.stack(part) for part in zip(*results, strict=True)]
