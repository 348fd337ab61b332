"""One sweep of the estimate from any patterns over camera pixels.

The first takes each camera pixel alone. The second expects what the neighbours have of black, n and
F, and estimates the difference; where a camera pixel's photos are more probable without that, its
own photos alone count.

Index convention: arrays are (C, ...); sequences are (n * channels, N), N photos.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
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
from nearfar.estimate.any_patterns.neighbours import Black, ExpectedRows, expect_rows
from nearfar.estimate.any_patterns.solve import (
    Rotated,
    Sequences,
    Solved,
    log_evidence,
    rotated,
    solve,
)
from nearfar.parallel import side_by_side
from nearfar.priors.covariance import far_variance
from nearfar.priors.fitted import LIT_COMPONENTS, LIT_OF_PATTERNS, UNLIT_COMPONENTS
from nearfar.transport.direct import Footprint

# Prior components, those of camera pixels with direct light first.
COMPONENTS = (*LIT_COMPONENTS, *UNLIT_COMPONENTS)
# Variance ratios (s / sigma)^2 that are tried.
RATIOS = tuple(4.0**power for power in range(-6, 9))
# Pairs of component and ratio that camera pixels choose from, and camera pixels that settle them.
MOST_CHOICES = 8
SAMPLE_PIXELS = 64
# Standard deviation of the factor between the light of a camera pixel and what its neighbours have,
# about their brightness.
FACTOR_DEVIATION = 0.3


class Choice(NamedTuple):
    """A prior component, by its number in `COMPONENTS`, and a variance ratio."""

    component: int
    ratio: float


@dataclass(frozen=True, eq=False)
class PatternRows:
    """Rows of camera pixels, in the units of the photos.

    Attributes
    ----------
    black, direct : ndarray, shape (C, channels), float32
    near : ndarray, shape (C, channels, W^2), float32
    far : ndarray, shape (C, channels, R), float32
        Responses of far-range light to the model's `far_basis`.
    noise : ndarray, shape (C, channels), float32
        Standard deviation of a photo.
    lit : ndarray of bool, shape (C,)
    component : ndarray of uint8, shape (C,)
        Index into `COMPONENTS`.
    ratio : ndarray, shape (C,), float32
        Variance ratio (s / sigma)^2.
    black_deviation : ndarray, shape (C, channels), float32
        Standard deviation of black before the camera pixel's own photos; infinite where nothing is
        known of it.
    """

    black: Floats
    direct: Floats
    near: Floats
    far: Floats
    noise: Floats
    lit: NDArray[np.bool_]
    component: NDArray[np.uint8]
    ratio: Floats
    black_deviation: Floats


class Photos(NamedTuple):
    """Photos of camera pixels, and where their direct light would come from."""

    values: Floats  # (C, channels, N)
    centres: NDArray[np.int64]  # q rounded
    where: Footprint


class Before(NamedTuple):
    """The first sweep, and what it leads to expect."""

    rows: PatternRows
    black: Black
    level: Floats  # mean of the photos above black, (C, channels)
    neighbours: Integers  # (C, steps)

    def expected(self, pixels: NDArray[np.int64]) -> ExpectedRows:
        """Return the near- and far-range light that neighbours lead to expect."""
        rows = self.rows
        return expect_rows(rows.near, rows.far, self.level, rows.lit, self.neighbours, pixels)


class Prepared(NamedTuple):
    """What camera pixels share."""

    model: PatternModel
    roots: Mapping[int, NearRoot]
    far: Mapping[int, Floats]
    far_variance: Mapping[int, Floats]  # of far-range light's responses at unit prior scale
    unlit: Mapping[int, Rotated]


def prepare(model: PatternModel) -> Prepared:
    """Compute the prior covariances of all components, which all camera pixels share."""
    unlit = range(len(LIT_COMPONENTS), len(COMPONENTS))
    far = {n: far_covariance(model, COMPONENTS[n]) for n in (*LIT_OF_PATTERNS, *unlit)}
    return Prepared(
        model,
        {n: near_root(model, COMPONENTS[n]) for n in LIT_OF_PATTERNS},
        far,
        {n: far_variance(model.far_basis, COMPONENTS[n]) for n in far},
        {n: rotated(far[n]) for n in unlit},
    )


class _Given(NamedTuple):
    """Sequences of camera pixels, less what is expected, and what that is."""

    seen: Sequences
    expected: ExpectedRows | None
    black: Floats  # (n * channels,)

    def alone(self) -> "_Given":
        """Return the same without what neighbours have of n and F."""
        if self.expected is None:
            return self
        photos, known, precision = self.seen
        return _Given(
            Sequences(photos + known[..., -1], known[..., :-1], precision[..., :-1]),
            None,
            self.black,
        )


def _given(
    prepared: Prepared,
    photos: Photos,
    group: NDArray[np.int64],
    before: Before | None,
    over_window: Floats | None,
) -> _Given:
    """Return the sequences of camera pixels; those without direct light have no window."""
    model, (channels, number) = prepared.model, photos.values.shape[1:]
    values = photos.values[group].reshape(-1, number).astype(np.float64)
    known = [np.ones_like(values)]
    if over_window is not None:
        levels = np.einsum(
            "knc,nc->nk", model.patterns[:, photos.where.pixels[group]], photos.where.weights[group]
        )
        known.append(np.repeat(levels.astype(np.float64), channels, axis=0))
    precision = np.zeros((len(values), len(known)))
    if before is None:
        return _Given(
            Sequences(values, np.stack(known, axis=2), precision), None, np.zeros(len(values))
        )
    noise = before.rows.noise[group].reshape(-1).astype(np.float64) ** 2
    black, variance = (part[group].reshape(-1) for part in before.black)
    precision[:, 0] = noise / variance
    expected = before.expected(group)
    of_expected = expected.far @ model.of_far.T
    if over_window is not None:
        of_expected = of_expected + expected.near @ over_window.T
    known.append(of_expected.reshape(-1, number).astype(np.float64))
    values = values - black[:, None] - known[-1]
    precision = np.concatenate([precision, noise[:, None] / FACTOR_DEVIATION**2], axis=1)
    return _Given(Sequences(values, np.stack(known, axis=2), precision), expected, black)


def _covariances(
    prepared: Prepared, over_window: Floats, components: Sequence[int]
) -> dict[int, Floats]:
    """Return the covariance of photos under each component, about one q."""
    found: dict[int, Floats] = {}
    for number in dict.fromkeys(components):
        root = prepared.roots[number]
        in_window = root.seen(over_window)
        found[number] = np.asarray(in_window @ in_window.T + prepared.far[number])
    return found


def choose(
    prepared: Prepared,
    photos: Photos,
    candidates: NDArray[np.int64],
    before: Before | None,
) -> tuple[Choice, ...]:
    """Return the pairs of component and ratio that make a sample of camera pixels most probable.

    One by one: each raises the evidence of those that choose it over the ones before.
    """
    sample = np.random.default_rng(0).permutation(candidates)[:SAMPLE_PIXELS]
    pairs = [Choice(number, ratio) for number in LIT_OF_PATTERNS for ratio in RATIOS]
    evidence = np.empty((len(pairs), len(sample)))

    def work(place: int) -> None:
        pixel = sample[place : place + 1]
        over_window = patterns_over_window(prepared.model, photos.centres[pixel[0]])
        seen = _given(prepared, photos, pixel, before, over_window).seen
        covariances = _covariances(prepared, over_window, LIT_OF_PATTERNS)
        found = [
            log_evidence(seen, rotated(covariances[component]), RATIOS).sum(axis=1)
            for component in LIT_OF_PATTERNS
        ]
        evidence[:, place] = np.concatenate(found)

    side_by_side(work, range(len(sample)))
    chosen: list[int] = []
    best = np.full(len(sample), -np.inf)
    for _ in range(MOST_CHOICES):
        chosen.append(int(np.maximum(evidence, best).sum(axis=1).argmax()))
        best = np.maximum(best, evidence[chosen[-1]])
    return tuple(pairs[number] for number in dict.fromkeys(chosen))


class _Trial(NamedTuple):
    """Camera pixels and channels under one choice, with what neighbours have or without."""

    choice: Choice
    given: _Given
    solved: Solved


def estimate_lit(
    rows: PatternRows,
    prepared: Prepared,
    photos: Photos,
    group: NDArray[np.int64],
    choices: Sequence[Choice],
    without: Floats,
) -> None:
    """Estimate camera pixels of one rounded q, where that is more probable than no direct light.

    Parameters
    ----------
    rows : PatternRows
        To fill.
    prepared : Prepared
    photos : Photos
    group : ndarray of int
    choices : sequence of Choice
    without : ndarray, shape (C,)
        Log evidence of camera pixels without direct light.
    """
    trials, over_window = _trials(prepared, photos, group, choices, None)
    together = _evidence(trials, len(group))
    # q was chosen among all projector pixels.
    is_lit = together.max(axis=0) - np.log(prepared.model.projector.pixels) > without[group]
    rows.lit[group] = is_lit
    best = np.where(is_lit, together.argmax(axis=0), -1)
    _put_best(rows, prepared, group, trials, best, over_window)


def refine_lit(
    rows: PatternRows,
    prepared: Prepared,
    photos: Photos,
    group: NDArray[np.int64],
    choices: Sequence[Choice],
    before: Before,
) -> None:
    """Estimate camera pixels of one rounded q anew, from what their neighbours have."""
    trials, over_window = _trials(prepared, photos, group, choices, before)
    best = _evidence(trials, len(group)).argmax(axis=0)
    _put_best(rows, prepared, group, trials, best, over_window)


def _trials(
    prepared: Prepared,
    photos: Photos,
    group: NDArray[np.int64],
    choices: Sequence[Choice],
    before: Before | None,
) -> tuple[list[_Trial], Floats]:
    """Return all trials of camera pixels of one rounded q, and the patterns over its window."""
    over_window = patterns_over_window(prepared.model, photos.centres[group[0]])
    given = _given(prepared, photos, group, before, over_window)
    tried = [(choice, given) for choice in choices]
    if before is not None:
        alone = given.alone()
        first = zip(before.rows.component[group], before.rows.ratio[group], strict=True)
        own = dict.fromkeys(Choice(int(component), float(ratio)) for component, ratio in first)
        tried += [(choice, alone) for choice in own]
    covariances = _covariances(prepared, over_window, [choice.component for choice, _ in tried])
    trials = [
        _Trial(choice, one, solve(one.seen, covariances[choice.component], choice.ratio))
        for choice, one in tried
    ]
    return trials, over_window


def _evidence(trials: Sequence[_Trial], count: int) -> Floats:
    """Return log evidence over all channels, (trials, n)."""
    evidence = np.stack([trial.solved.evidence for trial in trials])
    return np.asarray(evidence.reshape(len(trials), count, -1).sum(axis=2))


def _put_best(
    rows: PatternRows,
    prepared: Prepared,
    group: NDArray[np.int64],
    trials: Sequence[_Trial],
    best: Integers,
    over_window: Floats,
) -> None:
    """Keep the best trial of each camera pixel, by its number."""
    channels = rows.direct.shape[1]
    for number in np.unique(best[best >= 0]):
        choice, given, solved = trials[number]
        (pixels,) = np.nonzero(best == number)
        mine = (pixels[:, None] * channels + np.arange(channels)).ravel()
        root = prepared.roots[choice.component]
        weights = choice.ratio * solved.weights[mine]
        windows = np.zeros((len(mine), prepared.model.window**2))
        windows[:, root.entries] = weights @ root.seen(over_window) @ root.root.T
        if given.expected is not None:
            factor = 1.0 + solved.amplitudes[mine, -1, None]
            windows += factor * given.expected.near[pixels].reshape(len(mine), -1)
        rows.near[group[pixels]] = windows.reshape(len(pixels), channels, -1)
        rows.direct[group[pixels]] = solved.amplitudes[mine, 1].reshape(-1, channels)
        _put_far(
            rows, prepared, group, choice, given, Solved._make(p[mine] for p in solved), pixels
        )


def estimate_unlit(
    rows: PatternRows,
    prepared: Prepared,
    photos: Photos,
    group: NDArray[np.int64],
    before: Before | None = None,
) -> Floats:
    """Estimate camera pixels without direct light, and return their log evidence, (n,)."""
    channels = photos.values.shape[1]
    given = _given(prepared, photos, group, before, None)
    starts = [given] if before is None else [given, given.alone()]
    tried = [
        (start, Choice(n, ratio)) for start in starts for n in prepared.unlit for ratio in RATIOS
    ]
    evidence = np.concatenate(
        [log_evidence(start.seen, of, RATIOS) for start in starts for of in prepared.unlit.values()]
    )
    together = evidence.reshape(len(tried), len(group), channels).sum(axis=2)
    best = together.argmax(axis=0)
    for number in np.unique(best):
        start, choice = tried[number]
        (pixels,) = np.nonzero(best == number)
        mine = (pixels[:, None] * channels + np.arange(channels)).ravel()
        solved = solve(start.seen.of(mine), prepared.far[choice.component], choice.ratio)
        _put_far(rows, prepared, group, choice, start, solved, pixels)
    return np.asarray(together.max(axis=0))


def _put_far(
    rows: PatternRows,
    prepared: Prepared,
    group: NDArray[np.int64],
    choice: Choice,
    given: _Given,
    solved: Solved,
    pixels: NDArray[np.int64],
) -> None:
    """Keep far-range light, black, noise and choice of some camera pixels of a group."""
    shape = (len(pixels), rows.direct.shape[1])
    mine = (pixels[:, None] * shape[1] + np.arange(shape[1])).ravel()
    far = choice.ratio * solved.weights @ prepared.model.of_far
    far *= prepared.far_variance[choice.component]
    if given.expected is not None:
        factor = 1.0 + solved.amplitudes[:, -1, None]
        far += factor * given.expected.far[pixels].reshape(far.shape)
    at = group[pixels]
    rows.far[at] = far.reshape(*shape, -1)
    rows.black[at] = (solved.amplitudes[:, 0] + given.black[mine]).reshape(shape)
    rows.noise[at] = np.sqrt(solved.variance).reshape(shape)
    rows.component[at], rows.ratio[at] = choice
