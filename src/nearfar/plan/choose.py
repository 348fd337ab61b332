"""The plan that is expected to relight best with a given number of photos.

A camera pixel of a known kind has a Gaussian expectation, so what a plan leaves unknown of its
answer b_k to every frequency k can be told before any photo. Pictures have spectra of 1/f, so the
expected error of relighting is the sum over k of that variance times the picture's power; under
a random light all frequencies count alike. Starting from nothing, the pattern that lowers both
errors most is added, again and again: a new frequency, or a frequency once more.

Index convention: k and e run over candidate frequencies; cosines and sines are apart, since a
window's expectation is the same to both sides of q.
"""

from collections.abc import Callable
from fractions import Fraction
from typing import NamedTuple

import numpy as np

from nearfar.arrays import AnySize, Floats, Size, as_size
from nearfar.checks import as_count, as_number
from nearfar.errors import PlanError
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
from nearfar.plan.model import Plan, Purpose
from nearfar.plan.paper import LARGEST, sinusoids
from nearfar.plan.references import FEWEST, with_references
from nearfar.plan.typical import TYPICAL, Typical
from nearfar.transport import near
from nearfar.transport.kinds import far_power, near_covariance

# Standard deviation of an answer to a sinusoid, as a share of white: 30 000 electrons at full
# scale and a scene of middling brightness.
NOISE = 0.011
# Direct light before any photo, as a share of white.
DIRECT = 0.5
# All frequencies up to as many cycles per pattern grid are candidates; beyond, one in each of
# these shares of 1/W: a window's spectrum changes no faster.
LOW = 8
FINE = 0.5
# Fewer photos than this settle neither q nor light.
LEAST_PHOTOS = 24
# f is kept at the measured ones of as many DFT frequencies on each side.
BAND = 13
SMALLEST = 8
# Other photos from one white and black to the next. Fewer references leave more for frequencies
# but cost white light; at 117 photos of the box, 10 instead of 16 gain 0.6 dB under pictures and
# lose 0.7 dB under white.
INTERVAL = 10
# How much a decibel under pictures and one under a random light count. At 1.5 for the latter,
# cornell-aside gains 0.9 dB under a random light at 117 photos, corner loses 0.8 dB under pictures
# at 261.
COUNTS = np.array([1.0, 1.2])
# Power of a picture in its mean and in the rest, as shares of white squared.
MEAN, REST = 0.25, 0.06


class Expected(NamedTuple):
    """What a plan is expected to leave: SNR_b in dB under pictures and under a random light."""

    pictures: float
    random: float


class Choice(NamedTuple):
    """What to show of a plan's frequencies.

    Attributes
    ----------
    frequencies : dict
        Frequency and how often its photos are taken, in the order of choice.
    references : int
        How often white and black are each shown.
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
    typical: Typical | None = None,
    noise: float = NOISE,
    progress: Callable[[int], None] | None = None,
) -> tuple[Plan, Expected]:
    """Choose a plan of at most so many photos, correspondence by phase among them.

    Parameters
    ----------
    projector : Size
    photos : int
        All photos, whites and blacks included.
    window : int, optional
        W, an upper bound of how far near-range light reaches; `default_window` if left out.
    typical : Typical
        Kinds of camera pixel to plan for: of the simulated scenes, or of a quick look at this one.
    noise : float
        Standard deviation of an answer to a sinusoid, as a share of white.
    progress : callable, optional
        Called with the number of photos chosen so far.

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
    if photos < LEAST_PHOTOS:
        raise PlanError(
            f"{photos} photos are too few to settle correspondence and light: plan with --photos "
            f"{LEAST_PHOTOS} or more."
        )
    if min(projector) < SMALLEST or max(projector) > LARGEST:
        raise PlanError(
            f"a projector of {projector} is no pattern grid to choose frequencies on: its sides "
            f"must be from {SMALLEST} to {LARGEST} pixels."
        )
    window = default_window(projector) if window is None else window
    if not 1 <= window <= min(projector):
        raise PlanError(
            f"W = {window} does not fit a projector of {projector}: choose --near between 1 and "
            f"{min(projector)}."
        )
    choice = choose_frequencies(
        projector, photos, window, typical=typical or TYPICAL, noise=noise, progress=progress
    )
    band = Size(*(min(BAND, side - 1 + side % 2) for side in projector))
    low = set(far_frequencies(band, projector))

    def purpose(frequency: Frequency) -> Purpose:
        if frequency == CHECKERBOARD:
            return "direct"
        return "far" if frequency in low or -frequency in low else "near"

    # Repeats stand far apart, so that no short disturbance meets them all.
    most = max(choice.frequencies.values())
    patterns = [
        shown
        for turn in range(most)
        for frequency, count in choice.frequencies.items()
        if turn < count
        for shown in sinusoids([frequency], purpose(frequency))
    ]
    plan = Plan(
        projector=projector,
        window=window,
        far=band,
        dropped=Size(1, 1),
        offset="reference",
        correspondence="phase",
        patterns=with_references(patterns, choice.references, choice.references),
    )
    return plan, choice.expected


def default_window(projector: Size) -> int:
    """W where nothing is known: a sixth of the shorter side, odd, between 5 and 25."""
    side = min(projector)
    return int(min(2 * (min(25, max(5, round(side / 6))) // 2) + 1, side))


def candidates(projector: Size, window: int) -> list[Frequency]:
    """Frequencies of the projector's DFT to choose from, one of each +-k, without DC."""
    low = Size(*(min(2 * LOW + 1, side) for side in projector))
    steps = round(window / FINE)
    rounded = [
        wrap(*(_on_grid(part, side) for part, side in zip(k, projector, strict=True)))
        for k in grid(Size(steps, steps), Size(steps, steps))
    ]
    halves = [CHECKERBOARD, wrap(CHECKERBOARD.fy, DC.fx), wrap(DC.fy, CHECKERBOARD.fx)]
    even = all(side % 2 == 0 for side in projector)
    listed = far_frequencies(low, projector) + rounded + (halves if even else [CHECKERBOARD])
    return [k for k in representatives(listed) if k != DC]


def _on_grid(part: Fraction, side: int) -> Fraction:
    return Fraction(round(part * side), side)


class _Beliefs:
    """What is known of the responses of each typical camera pixel while a plan grows."""

    def __init__(
        self, frequencies: list[Frequency], projector: Size, window: int, typical: Typical
    ) -> None:
        basis = real_basis(frequencies, projector)
        angle = 2 * np.pi * (as_array(frequencies) @ near.offsets(window).T)
        cosines, sines = np.cos(angle), np.sin(angle)
        paired = np.array([not k.is_own_negative for k in frequencies])
        parts = []
        for kind, strength in typical.kinds:
            covariance = near_covariance(kind, window)
            far = np.diag(far_power(basis, kind)[~basis.is_sine])
            direct = np.full_like(far, DIRECT**2)
            level = strength**2
            parts.append(direct + level * (cosines @ covariance @ cosines.T + far))
            parts.append(level * (sines @ covariance @ sines.T + far) * np.outer(paired, paired))
        self.covariance = np.stack(parts)
        self.shares = np.repeat(typical.shares, 2, axis=1)
        self.weights = _weights(frequencies, projector)

    def errors(self) -> Floats:
        """Return the expected squared errors of pictures and of the random light, (scenes, 2)."""
        variance = np.einsum("jkk->jk", self.covariance)
        return np.asarray(self.shares @ variance @ self.weights.T)

    def gains(self, noise: float) -> Floats:
        """Return what each candidate takes off all errors, (scenes, 2, K)."""
        spent = np.einsum("jkk->jk", self.covariance) + noise**2
        each = np.stack([self.weights @ covariance**2 for covariance in self.covariance])
        return np.asarray(np.tensordot(self.shares, each / spent[:, None], axes=1))

    def learn(self, chosen: int, noise: float) -> None:
        """Take in one measurement of a candidate's photos."""
        column = self.covariance[:, :, chosen]
        spent = column[:, chosen] + noise**2
        self.covariance = self.covariance - (
            column[:, :, None] * (column / spent[:, None])[:, None, :]
        )


def _weights(frequencies: list[Frequency], projector: Size) -> Floats:
    """Power of pictures and of the random light that each candidate stands for, (2, K)."""
    points = as_array(frequencies)
    power = 1.0 / np.sum((points * np.array(projector)) ** 2, axis=1)
    # Low frequencies stand for themselves; those of the coarse grid for all around them.
    low = np.all(np.abs(points) * np.array(projector) <= LOW, axis=1)
    below = int(np.count_nonzero(low))
    beyond = max(projector.pixels / 2 - below, 0.0)
    area = np.where(low, 1.0, beyond / max(len(low) - below, 1))
    pictures, even = power * area, area
    return np.stack([REST * pictures / pictures.sum(), even / even.sum() / 12.0])


def choose_frequencies(
    projector: Size,
    photos: int,
    window: int,
    *,
    typical: Typical = TYPICAL,
    noise: float = NOISE,
    progress: Callable[[int], None] | None = None,
) -> Choice:
    """Choose what to show with a given number of photos.

    Parameters
    ----------
    projector : Size
    photos : int
        Photos of transport and references together.
    window : int
        W.
    typical : Typical
        Kinds of camera pixel to plan for.
    noise : float
        Standard deviation of an answer, as a share of white.
    progress : callable, optional
        Called with the number of photos chosen so far.

    Returns
    -------
    Choice
    """
    listed = candidates(projector, window)
    cost = np.array([1 if k.is_own_negative else 2 for k in listed])
    beliefs = _Beliefs(listed, projector, window, typical)
    references = max(FEWEST, photos // (INTERVAL + 2))
    left = photos - 2 * references
    chosen: dict[Frequency, int] = {}

    def take(place: int) -> None:
        nonlocal left
        beliefs.learn(place, noise)
        chosen[listed[place]] = chosen.get(listed[place], 0) + 1
        left -= int(cost[place])

    take(listed.index(CHECKERBOARD))
    while left > 0:
        relative = beliefs.gains(noise) / beliefs.errors()[..., None]
        worth = typical.weights @ np.einsum("l,slk->sk", COUNTS, relative) / cost
        worth[cost > left] = -np.inf
        if not np.isfinite(worth.max()):
            break
        take(int(np.argmax(worth)))
        if progress is not None:
            progress(photos - left)
    # White has twice the light of a sinusoid, and is one answer and not half of one; its error
    # is in every other answer too.
    shared = 0.5 * noise**2 / references * (MEAN + beliefs.weights.sum(axis=1))
    light = MEAN + np.array([REST, 1.0 / 12.0])
    decibels = 10 * np.log10(light / (beliefs.errors() + shared))
    expected = np.average(decibels, axis=0, weights=typical.weights)
    return Choice(chosen, references, Expected(*(float(value) for value in expected)))
