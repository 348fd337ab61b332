"""The error that a plan is expected to leave, before any photo.

A camera pixel of a known prior component is Gaussian, so the posterior variance that a plan leaves
of its response b_k to every frequency k follows from the plan alone. The amplitude spectra of
pictures fall as 1/f, so the expected error of relighting is the sum over k of that variance times
the picture's spectral density; under a random light all frequencies count alike.

Scenes differ, and an expectation for a scene that nobody has seen is a range.

A window's functions are hats, as wide as the pitch on each side. In cycles per screen, and for the
light of a function, they are the single pixels of a grid of cells, each of pitch x pitch projector
pixels; what is said of typical scenes in pixels holds for cells.

Index convention: k runs over candidate frequencies, j over prior components with cosines and sines
apart, which are independent because a window's prior is the same to both sides of q.
"""

from collections.abc import Iterator
from typing import NamedTuple, Protocol

import numpy as np

from nearfar.arrays import Floats, Size
from nearfar.illumination.frequencies import Frequency, as_array
from nearfar.illumination.near_basis import window_offsets
from nearfar.illumination.real_basis import real_basis
from nearfar.plan.expected_range import ExpectedRange
from nearfar.priors.component import PriorComponent
from nearfar.priors.covariance import far_variance, near_covariance
from nearfar.priors.typical import TypicalScenes

# Standard deviation of direct light in the typical scenes, as a share of white.
TYPICAL_DIRECT_DEVIATION = 0.5
# All frequencies up to as many cycles per pattern grid are candidates of a plan, each for itself.
LOWEST_CYCLES = 8
# Up to this many frequencies, what those of a complete plan tell of one another is counted.
MOST_TOGETHER = 1024
# Squared mean of a picture, and the variance about it, as shares of white squared.
PICTURE_SQUARED_MEAN, PICTURE_VARIANCE = 0.25, 0.06
# Variance of a uniform random light.
RANDOM_VARIANCE = 1.0 / 12.0
# What relighting reached less what was expected of the typical scenes, dB, from the lowest to the
# highest: all six built-in scenes at two sizes and four or five budgets each, with a margin of half
# a decibel (docs/decisions/0041). Where a first estimate of the scene was planned for, the same.
OFF_PICTURES, OFF_RANDOM = (-6.0, 2.0), (-4.0, 6.5)
OFF_PICTURES_LOOKED_AT, OFF_RANDOM_LOOKED_AT = (-4.0, 3.0), (-4.0, 6.0)
# At a pitch over 1: camera pixels that see several projector pixels average a random light, and
# those that see two surfaces place it wrongly (docs/decisions/0044).
OFF_RANDOM_AT_PITCH = (-8.5, 13.0)


class Expected(NamedTuple):
    """Expected SNR_b of relighting in dB, under pictures and under a random light.

    That of the typical scenes; `expected_range` says how far others differ.
    """

    pictures: float
    random: float


def expected_range(
    expected: Expected, pitch: int = 1, *, is_looked_at: bool = False
) -> ExpectedRange:
    """Return the range in which the SNR_b of scenes of direct, near- and far-range light lies.

    Its limits are rounded to hundredths, so that plans do not depend on rounding errors.

    Parameters
    ----------
    expected : Expected
    pitch : int
        Of the plan.
    is_looked_at : bool
        Whether the plan is for a first estimate of this very scene.
    """
    pictures = OFF_PICTURES_LOOKED_AT if is_looked_at else OFF_PICTURES
    random = OFF_RANDOM_LOOKED_AT if is_looked_at else OFF_RANDOM
    if pitch > 1:
        random = OFF_RANDOM_AT_PITCH
    return ExpectedRange(
        pictures=_around(expected.pictures, pictures), random=_around(expected.random, random)
    )


def _around(expected: float, off: tuple[float, float]) -> tuple[float, float]:
    return round(expected + off[0], 2), round(expected + off[1], 2)


class ExpectedErrors(Protocol):
    """The expected errors of typical camera pixels while a plan grows.

    Attributes
    ----------
    weights : ndarray, shape (2, K)
        See `light_weights`.
    rounding : float
        Share by which gains may differ and count as equal; the first of the equal ones is chosen.
    """

    weights: Floats
    rounding: float

    def errors(self) -> Floats:
        """Return the expected squared errors of pictures and of the random light, (scenes, 2)."""
        ...

    def gains(self, noise: float) -> Floats:
        """Return by how much measuring each candidate would lower the errors, (scenes, 2, K)."""
        ...

    def condition_on(self, candidate: int, noise: float) -> None:
        """Condition on one measurement of a candidate."""
        ...


class ErrorsTogether:
    """Posterior covariances of the responses of typical camera pixels while a plan grows.

    At a pitch of 1. Frequencies that mirror one another are worth the same, and rounding decides
    between them: `nearfar.plan.low_rank`, several times as fast, chooses others as good.
    """

    rounding: float = 0.0

    def __init__(
        self, frequencies: list[Frequency], projector: Size, window: int, typical: TypicalScenes
    ) -> None:
        count = len(frequencies)
        self.covariance = np.empty((2 * len(typical.prior_components), count, count))
        for place, covariance in _covariances(frequencies, projector, window, 1, typical):
            self.covariance[place] = covariance
        self.shares = np.repeat(typical.shares, 2, axis=1)
        self.weights = light_weights(frequencies, projector, 1)

    def errors(self) -> Floats:
        """Return the expected squared errors of pictures and of the random light, (scenes, 2)."""
        variance = np.einsum("jkk->jk", self.covariance)
        return np.asarray(self.shares @ variance @ self.weights.T)

    def gains(self, noise: float) -> Floats:
        """Return by how much measuring each candidate would lower the errors, (scenes, 2, K)."""
        measured = np.einsum("jkk->jk", self.covariance) + noise**2
        each = np.stack([self.weights @ covariance**2 for covariance in self.covariance])
        return np.asarray(np.tensordot(self.shares, each / measured[:, None], axes=1))

    def condition_on(self, candidate: int, noise: float) -> None:
        """Condition the covariances on one measurement of a candidate."""
        column = self.covariance[:, :, candidate].copy()
        measured = column[:, candidate] + noise**2
        # One at a time, which stays in the processor's cache.
        for covariance, mine, of_one in zip(self.covariance, column, measured, strict=True):
            np.subtract(covariance, mine[:, None] * (mine / of_one), out=covariance)


class ErrorsApart:
    """`ErrorsTogether` where what one frequency tells of others hardly counts.

    Parameters
    ----------
    variance : ndarray, shape (J, K)
        Of each response, so far.
    """

    rounding: float = 0.0

    def __init__(
        self,
        variance: Floats,
        frequencies: list[Frequency],
        projector: Size,
        pitch: int,
        typical: TypicalScenes,
    ) -> None:
        self.variance = variance
        self.shares = np.repeat(typical.shares, 2, axis=1)
        self.weights = light_weights(frequencies, projector, pitch)

    def errors(self) -> Floats:
        """Return the expected squared errors, as `ErrorsTogether.errors`."""
        return np.asarray(self.shares @ self.variance @ self.weights.T)

    def gains(self, noise: float) -> Floats:
        """Return by how much measuring each candidate would lower them, (scenes, 2, K)."""
        lowered = self.shares @ (self.variance**2 / (self.variance + noise**2))
        return np.asarray(lowered[:, None] * self.weights)

    def condition_on(self, candidate: int, noise: float) -> None:
        """Condition on one measurement of a candidate."""
        column = self.variance[:, candidate]
        self.variance[:, candidate] = column * noise**2 / (column + noise**2)


def errors_of_all_measured(
    frequencies: list[Frequency],
    projector: Size,
    window: int,
    pitch: int,
    typical: TypicalScenes,
    noise: float,
) -> ErrorsApart:
    """Return the errors of a plan that has measured every frequency once."""
    squared = noise**2
    if len(frequencies) > MOST_TOGETHER:
        variance = np.full((2 * len(typical.prior_components), len(frequencies)), squared)
    else:
        unit = squared * np.eye(len(frequencies))
        variance = np.empty((2 * len(typical.prior_components), len(frequencies)))
        for place, covariance in _covariances(frequencies, projector, window, pitch, typical):
            left = np.diagonal(np.linalg.inv(covariance + unit))
            variance[place] = squared * (1.0 - squared * left)
    return ErrorsApart(variance, frequencies, projector, pitch, typical)


def errors_of_none_measured(
    frequencies: list[Frequency],
    projector: Size,
    window: int,
    pitch: int,
    typical: TypicalScenes,
) -> ErrorsApart:
    """Return the errors of a plan that has measured nothing, of direct light known all the same.

    For rows that no model describes: any few frequencies tell how much direct light there is, and
    none what the other frequencies answer.
    """
    basis = real_basis(frequencies, projector)
    cosines, sines = waves_on_window(frequencies, window, pitch)
    paired = np.array([not k.is_own_negative for k in frequencies])
    variance = []
    for prior_component, scale in typical.prior_components:
        covariance = near_covariance(prior_component, window, projector)
        far = far_variance(basis, prior_component)[~basis.is_sine]
        for waves, has in ((cosines, np.ones_like(paired)), (sines, paired)):
            near = np.einsum("kw,kw->k", waves @ covariance, waves)
            variance.append(scale**2 * (near + far) * has)
    return ErrorsApart(np.stack(variance), frequencies, projector, pitch, typical)


def waves_on_window(frequencies: list[Frequency], window: int, pitch: int) -> tuple[Floats, Floats]:
    """Return the responses of a window's functions to cosines and to sines, (K, W^2) each.

    A hat of 2 * pitch - 1 projector pixels, of light 1, answers exp(-j 2 pi k.p) as the square of
    a box of pitch pixels does on each axis; at a pitch of 1 it is a single pixel, and answers 1.
    """
    cycles = as_array(frequencies)
    hat = np.prod((np.sinc(pitch * cycles) / np.sinc(cycles)) ** 2, axis=1)[:, None]
    angle = 2 * np.pi * (cycles @ (pitch * window_offsets(window)).T)
    return np.asarray(hat * np.cos(angle)), np.asarray(hat * np.sin(angle))


def _covariances(
    frequencies: list[Frequency],
    projector: Size,
    window: int,
    pitch: int,
    typical: TypicalScenes,
) -> Iterator[tuple[int, Floats]]:
    """Yield j and the covariance, (K, K), of each prior component's cosines and of its sines."""
    basis = real_basis(frequencies, projector)
    cosines, sines = waves_on_window(frequencies, window, pitch)
    paired = np.array([not k.is_own_negative for k in frequencies])
    # Components that differ in scale alone share what takes longest.
    scales: dict[PriorComponent, list[tuple[int, float]]] = {}
    for place, (prior_component, scale) in enumerate(typical.prior_components):
        scales.setdefault(prior_component, []).append((place, scale))
    for prior_component, places in scales.items():
        covariance = near_covariance(prior_component, window, projector)
        far = np.diag(far_variance(basis, prior_component)[~basis.is_sine])
        direct = np.full_like(far, TYPICAL_DIRECT_DEVIATION**2)
        of_cosines = cosines @ covariance @ cosines.T + far
        of_sines = sines @ covariance @ sines.T + far
        for place, scale in places:
            yield 2 * place, direct + scale**2 * of_cosines
            yield 2 * place + 1, scale**2 * of_sines * np.outer(paired, paired)


def light_weights(frequencies: list[Frequency], projector: Size, pitch: int) -> Floats:
    """Return the variance of pictures and of a random light at each candidate frequency, (2, K).

    A low frequency stands for itself, one of the coarse grid for all frequencies around it. Light
    is that of the grid of cells: frequencies of more than half a cycle a cell on an axis hold none.
    """
    points = as_array(frequencies)
    density = 1.0 / np.sum((points * np.array(projector)) ** 2, axis=1)
    low = np.all(np.abs(points) * np.array(projector) <= LOWEST_CYCLES, axis=1)
    half = 0.5 / pitch + 0.5 / np.array(projector)
    within = np.all(np.abs(points) <= half, axis=1)
    below = int(np.count_nonzero(low))
    beyond = max(projector.pixels / pitch**2 / 2 - below, 0.0)
    coarse = max(int(np.count_nonzero(within)) - below, 1)
    area = np.where(low, 1.0, beyond / coarse) * within
    pictures, even = density * area, area
    return np.stack([PICTURE_VARIANCE * pictures / pictures.sum(), even / even.sum() / 12.0])


def expected_of(
    found: Floats, weights: Floats, references: int, typical: TypicalScenes, noise: float
) -> Expected:
    """Return the SNR_b that errors (scenes, 2) come to, beside those of so many whites and blacks.

    `weights` are those of `light_weights`.
    """
    # White has twice the light of a sinusoid, and is one response and not half of one; its error
    # is in every other response too.
    of_white = PICTURE_SQUARED_MEAN + weights.sum(axis=1)
    common = 0.5 * noise**2 / references * of_white
    light = PICTURE_SQUARED_MEAN + np.array([PICTURE_VARIANCE, RANDOM_VARIANCE])
    decibels = 10 * np.log10(light / (found + common))
    expected = np.average(decibels, axis=0, weights=typical.weights)
    return Expected(*(float(value) for value in expected))
