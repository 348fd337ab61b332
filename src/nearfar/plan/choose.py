"""The plan that is expected to relight best with a given number of photos.

A camera pixel of a known prior component is Gaussian, so the posterior variance that a plan leaves
of its response b_k to every frequency k follows before any photo. The amplitude spectra of
pictures fall as 1/f, so the expected error of relighting is the sum over k of that variance times
the picture's spectral density; under a random light all frequencies count alike. Starting from
nothing, the pattern that lowers both errors most is added, again and again: a new frequency, or a
frequency once more. With as many photos as unknowns, every frequency is measured before any is
repeated, whatever scenes are expected to be.

Index convention: k runs over candidate frequencies, j over prior components with cosines and sines
apart, which are independent because a window's prior is the same to both sides of q.
"""

from collections.abc import Callable, Iterator
from fractions import Fraction
from typing import NamedTuple

import numpy as np

from nearfar.arrays import AnySize, Floats, Size, as_size
from nearfar.callbacks import OldReport, Report, as_report, counting
from nearfar.checks import as_count, as_number
from nearfar.errors import PlanError
from nearfar.illumination.centred_basis import window_offsets
from nearfar.illumination.frequencies import (
    CHECKERBOARD,
    DC,
    Frequency,
    as_array,
    far_frequencies,
    grid,
    representatives,
    wrap,
)
from nearfar.illumination.real_basis import real_basis
from nearfar.plan.checks import check_pairs, check_patterns, spread_checks
from nearfar.plan.model import LARGEST_SIDE, Plan, largest_window
from nearfar.plan.paper import sinusoids
from nearfar.plan.patterns import Purpose
from nearfar.plan.references import FEWEST, with_references
from nearfar.priors.covariance import far_variance, near_covariance
from nearfar.priors.fitted import TYPICAL_SCENES
from nearfar.priors.typical import TypicalScenes

# Standard deviation of the response to a sinusoid, as a share of white: 30 000 electrons at full
# scale and a scene of middling brightness.
NOISE = 0.011
# Standard deviation of direct light in the typical scenes, as a share of white.
TYPICAL_DIRECT_DEVIATION = 0.5
# All frequencies up to as many cycles per pattern grid are candidates; beyond, one in each of
# these shares of 1/W: a window's spectrum changes no faster.
LOWEST_CYCLES = 8
STEP_SHARE = 0.5
# Fewer photos than this settle neither q nor light.
FEWEST_PHOTOS = 24
# f is kept at the measured ones of as many DFT frequencies on each side.
FAR_BAND_SIDE = 13
SMALLEST_SIDE = 8
# Other photos from one white and black to the next. Fewer references leave more for frequencies
# but cost white light; at 117 photos of the box, 10 instead of 16 gain 0.6 dB under pictures and
# lose 0.7 dB under white.
REFERENCE_INTERVAL = 10
# How much a decibel under pictures and one under a random light count. At 1.5 for the latter,
# cornell-aside gains 0.9 dB under a random light at 117 photos, corner loses 0.8 dB under pictures
# at 261.
LIGHT_WEIGHTS = np.array([1.0, 1.2])
# Up to this many frequencies, what those of a complete plan tell of one another is counted.
MOST_TOGETHER = 1024
# Squared mean of a picture, and the variance about it, as shares of white squared.
PICTURE_SQUARED_MEAN, PICTURE_VARIANCE = 0.25, 0.06


class Expected(NamedTuple):
    """Expected SNR_b of relighting in dB, under pictures and under a random light."""

    pictures: float
    random: float


class FrequencyChoice(NamedTuple):
    """Frequencies and references to photograph.

    Attributes
    ----------
    frequencies : dict
        How often the photos of each frequency are taken, in the order of choice.
    references : int
        How often white and black are each photographed.
    expected : Expected
    """

    frequencies: dict[Frequency, int]
    references: int
    expected: Expected


def choose_plan(
    projector: AnySize,
    photos: int,
    *,
    window: int | None = None,
    typical: TypicalScenes | None = None,
    noise: float = NOISE,
    checks: int | None = None,
    progress: Report | OldReport | None = None,
) -> tuple[Plan, Expected]:
    """Choose a plan of at most `photos` photos, whose own phase gives correspondence.

    Parameters
    ----------
    projector : Size
    photos : int
        All photos, whites, blacks and check photos included.
    window : int, optional
        W, an upper bound of how far near-range light reaches; `default_window` if left out.
    typical : TypicalScenes
        What to plan for: the simulated scenes, or a quick first estimate of this one.
    noise : float
        Standard deviation of the response to a sinusoid, as a share of white.
    checks : int, optional
        Check patterns, pictures and half-screens that no estimate sees; each is photographed with
        its inverse. By default about 4 % of the photos, and at least one pattern.
    progress : callable, optional
        Called with what is being done and the share of it that is done, 0 to 1.

    Returns
    -------
    plan : Plan
    expected : Expected
        What relighting is expected to reach on scenes like the simulated ones.

    Raises
    ------
    PlanError
        If the photos are too few or the projector too small.
    InputError
        If the size, the photos or W are not whole numbers, or the noise is not a number.

    Examples
    --------
    >>> chosen, expected = nearfar.choose_plan((8, 8), photos=24)
    >>> len(chosen.patterns)
    24
    """
    projector, photos = as_size(projector, "projector"), as_count(photos, "photos")
    window = None if window is None else as_count(window, "window")
    noise = as_number(noise, "noise")
    report = counting(as_report(progress, photos), "photos", photos)
    if photos < FEWEST_PHOTOS:
        raise PlanError(
            f"{photos} photos are too few to settle correspondence and light: plan with "
            f"`photos={FEWEST_PHOTOS}` or more."
        )
    sides = [side for side in projector if side > 1] or [1]
    if min(sides) < SMALLEST_SIDE or max(sides) > LARGEST_SIDE:
        raise PlanError(
            f"a projector of {projector} is no pattern grid to choose frequencies on: its sides "
            f"must be from {SMALLEST_SIDE} to {LARGEST_SIDE} pixels, or one of them 1."
        )
    window = default_window(projector) if window is None else window
    if not 1 <= window <= largest_window(projector):
        raise PlanError(
            f"W = {window} does not fit a projector of {projector}: choose `window` between 1 and "
            f"{largest_window(projector)}."
        )
    checks = check_pairs(photos) if checks is None else as_count(checks, "checks", 0)
    own = photos - 2 * checks
    if own < FEWEST_PHOTOS - 2:
        raise PlanError(
            f"{checks} check patterns and their inverses leave too few of {photos} photos: plan "
            f"with `photos={FEWEST_PHOTOS + 2 * checks}` or more."
        )
    choice = choose_frequencies(
        projector, own, window, typical=typical or TYPICAL_SCENES, noise=noise, progress=report
    )
    band = Size(*(min(FAR_BAND_SIDE, side - 1 + side % 2) for side in projector))
    low = set(far_frequencies(band, projector))

    finest = finest_pattern(projector)

    def purpose(frequency: Frequency) -> Purpose:
        if frequency == finest:
            return "direct"
        return "far" if frequency in low or -frequency in low else "near"

    # Repeats stand far apart, so that no short disturbance meets them all.
    rounds = max(choice.frequencies.values())
    patterns = [
        pattern
        for repeat in range(rounds)
        for frequency, count in choice.frequencies.items()
        if repeat < count
        for pattern in sinusoids([frequency], purpose(frequency))
    ]
    plan = Plan(
        projector=projector,
        window=window,
        far=band,
        dropped=Size(1, 1),
        offset="reference",
        correspondence="phase",
        patterns=with_references(
            spread_checks(patterns, check_patterns(checks, projector)),
            choice.references,
            choice.references,
        ),
    )
    return plan, choice.expected


def default_window(projector: Size) -> int:
    """W where nothing is known: a sixth of the shorter side, odd, between 5 and 25.

    On a projector of one row or column it is a sixth of the longer side.
    """
    side = largest_window(projector)
    return int(min(2 * (min(25, max(5, round(side / 6))) // 2) + 1, side))


def finest_pattern(projector: Size) -> Frequency:
    """Return the highest frequency: the checkerboard, or alternate pixels of one row or column."""
    return wrap(
        *(k if side > 1 else DC.fy for k, side in zip(CHECKERBOARD, projector, strict=True))
    )


def candidates(projector: Size, window: int) -> list[Frequency]:
    """Frequencies of the projector's DFT to choose from, one of each +-k, without DC."""
    low = Size(*(min(2 * LOWEST_CYCLES + 1, side) for side in projector))
    steps = round(window / STEP_SHARE)
    rounded = [
        wrap(*(_on_grid(part, side) for part, side in zip(k, projector, strict=True)))
        for k in grid(Size(steps, steps), Size(steps, steps))
    ]
    finest = finest_pattern(projector)
    halves = [finest, wrap(finest.fy, DC.fx), wrap(DC.fy, finest.fx)]
    even = all(side % 2 == 0 for side in projector)
    listed = far_frequencies(low, projector) + rounded + (halves if even else [finest])
    return [k for k in representatives(listed) if k != DC]


def _lowest_first(projector: Size) -> list[Frequency]:
    """All frequencies of the projector's DFT, one of each +-k, without DC, the lowest first."""
    listed = [k for k in representatives(grid(projector, projector)) if k != DC]
    cycles = np.linalg.norm(as_array(listed) * np.array(projector), axis=1)
    return [listed[i] for i in np.argsort(cycles, kind="stable")]


def _on_grid(part: Fraction, side: int) -> Fraction:
    return Fraction(round(part * side), side)


class _ExpectedErrors:
    """Posterior covariances of the responses of typical camera pixels while a plan grows."""

    def __init__(
        self, frequencies: list[Frequency], projector: Size, window: int, typical: TypicalScenes
    ) -> None:
        parts = list(_covariances(frequencies, projector, window, typical))
        self.covariance = np.stack(parts)
        self.shares = np.repeat(typical.shares, 2, axis=1)
        self.weights = _weights(frequencies, projector)

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


class _ErrorsApart:
    """`_ExpectedErrors` of a plan that has measured every frequency once.

    What one frequency tells of others hardly counts from then on.
    """

    def __init__(
        self,
        frequencies: list[Frequency],
        projector: Size,
        window: int,
        typical: TypicalScenes,
        noise: float,
    ) -> None:
        squared = noise**2
        if len(frequencies) > MOST_TOGETHER:
            self.variance = np.full((2 * len(typical.prior_components), len(frequencies)), squared)
        else:
            unit = squared * np.eye(len(frequencies))
            left = [
                squared * (1.0 - squared * np.diagonal(np.linalg.inv(covariance + unit)))
                for covariance in _covariances(frequencies, projector, window, typical)
            ]
            self.variance = np.stack(left)
        self.shares = np.repeat(typical.shares, 2, axis=1)
        self.weights = _weights(frequencies, projector)

    def errors(self) -> Floats:
        """Return the expected squared errors, as `_ExpectedErrors.errors`."""
        return np.asarray(self.shares @ self.variance @ self.weights.T)

    def gains(self, noise: float) -> Floats:
        """Return by how much measuring each candidate would lower them, (scenes, 2, K)."""
        lowered = self.shares @ (self.variance**2 / (self.variance + noise**2))
        return np.asarray(lowered[:, None] * self.weights)

    def condition_on(self, candidate: int, noise: float) -> None:
        """Condition on one measurement of a candidate."""
        column = self.variance[:, candidate]
        self.variance[:, candidate] = column * noise**2 / (column + noise**2)


def _covariances(
    frequencies: list[Frequency], projector: Size, window: int, typical: TypicalScenes
) -> Iterator[Floats]:
    """Yield the covariances of cosines, and of sines, of each prior component, (K, K)."""
    basis = real_basis(frequencies, projector)
    angle = 2 * np.pi * (as_array(frequencies) @ window_offsets(window).T)
    cosines, sines = np.cos(angle), np.sin(angle)
    paired = np.array([not k.is_own_negative for k in frequencies])
    for prior_component, scale in typical.prior_components:
        covariance = near_covariance(prior_component, window, projector)
        far = np.diag(far_variance(basis, prior_component)[~basis.is_sine])
        direct = np.full_like(far, TYPICAL_DIRECT_DEVIATION**2)
        squared = scale**2
        yield direct + squared * (cosines @ covariance @ cosines.T + far)
        yield squared * (sines @ covariance @ sines.T + far) * np.outer(paired, paired)


def _weights(frequencies: list[Frequency], projector: Size) -> Floats:
    """Return how much of pictures' and of the random light's variance each candidate holds, (2, K).

    A low frequency stands for itself, one of the coarse grid for all around it.
    """
    points = as_array(frequencies)
    density = 1.0 / np.sum((points * np.array(projector)) ** 2, axis=1)
    low = np.all(np.abs(points) * np.array(projector) <= LOWEST_CYCLES, axis=1)
    below = int(np.count_nonzero(low))
    beyond = max(projector.pixels / 2 - below, 0.0)
    area = np.where(low, 1.0, beyond / max(len(low) - below, 1))
    # A uniform random light has the variance 1/12.
    pictures, even = density * area, area
    return np.stack([PICTURE_VARIANCE * pictures / pictures.sum(), even / even.sum() / 12.0])


def choose_frequencies(
    projector: Size,
    photos: int,
    window: int,
    *,
    typical: TypicalScenes = TYPICAL_SCENES,
    noise: float = NOISE,
    progress: Callable[[int], None] | None = None,
) -> FrequencyChoice:
    """Choose what to show with a given number of photos.

    Parameters
    ----------
    projector : Size
    photos : int
        Photos of transport and references together.
    window : int
        W.
    typical : TypicalScenes
        What to plan for.
    noise : float
        Standard deviation of a response, as a share of white.
    progress : callable, optional
        Called with the number of photos chosen so far.

    Returns
    -------
    FrequencyChoice
    """
    references = max(FEWEST, photos // (REFERENCE_INTERVAL + 2))
    # With as many photos as unknowns, nothing is left to what scenes are expected to be. For that,
    # half of the references are given up.
    unknowns = projector.pixels - 1
    is_complete = photos - 2 * max(FEWEST, references // 2) >= unknowns
    expected_errors: _ExpectedErrors | _ErrorsApart
    if is_complete:
        references = min(references, (photos - unknowns) // 2)
        listed = _lowest_first(projector)
        expected_errors = _ErrorsApart(listed, projector, window, typical, noise)
    else:
        listed = candidates(projector, window)
        expected_errors = _ExpectedErrors(listed, projector, window, typical)
    cost = np.array([1 if k.is_own_negative else 2 for k in listed])
    left = photos - 2 * references
    chosen: dict[Frequency, int] = {}

    def take(place: int) -> None:
        nonlocal left
        chosen[listed[place]] = chosen.get(listed[place], 0) + 1
        left -= int(cost[place])

    if is_complete:
        for place in range(len(listed)):
            take(place)
    else:
        finest = listed.index(finest_pattern(projector))
        take(finest)
        expected_errors.condition_on(finest, noise)
    while left > 0:
        relative = expected_errors.gains(noise) / expected_errors.errors()[..., None]
        per_photo = typical.weights @ np.einsum("l,slk->sk", LIGHT_WEIGHTS, relative) / cost
        per_photo[cost > left] = -np.inf
        if not np.isfinite(per_photo.max()):
            break
        best = int(np.argmax(per_photo))
        take(best)
        expected_errors.condition_on(best, noise)
        if progress is not None:
            progress(photos - left)
    # White has twice the light of a sinusoid, and is one response and not half of one; its error
    # is in every other response too.
    of_white = PICTURE_SQUARED_MEAN + expected_errors.weights.sum(axis=1)
    common = 0.5 * noise**2 / references * of_white
    light = PICTURE_SQUARED_MEAN + np.array([PICTURE_VARIANCE, 1.0 / 12.0])
    decibels = 10 * np.log10(light / (expected_errors.errors() + common))
    expected = np.average(decibels, axis=0, weights=typical.weights)
    return FrequencyChoice(chosen, references, Expected(*(float(value) for value in expected)))
