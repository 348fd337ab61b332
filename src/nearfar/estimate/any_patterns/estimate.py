"""Estimate D, N and F from photos of any patterns.

Every camera pixel chooses among a few prior components and variance ratios by the evidence of its
own photos; a sample of camera pixels settles which few. Where the photos are more probable without
direct light, there is none.

Index convention: arrays are (C, ...); n runs over the photos of one camera pixel and channel.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Floats, Integers, Size, blocks
from nearfar.estimate.any_patterns.covariance import (
    NearRoot,
    PatternModel,
    far_covariance,
    near_root,
    pattern_model,
    patterns_over_window,
)
from nearfar.estimate.any_patterns.solve import Rotated, Solved, log_evidence, rotated, solve
from nearfar.parallel import side_by_side
from nearfar.priors.covariance import far_variance
from nearfar.priors.fitted import LIT_AT_PITCH, LIT_COMPONENTS, UNLIT_COMPONENTS
from nearfar.transport import near
from nearfar.transport.direct import Footprint, footprint

# Prior components, those of camera pixels with direct light first.
COMPONENTS = (*LIT_COMPONENTS, *UNLIT_COMPONENTS)
# Variance ratios (s / sigma)^2 that are tried.
RATIOS = tuple(4.0**power for power in range(-6, 9))
# Pairs of component and ratio that camera pixels choose from, and camera pixels that settle them.
MOST_CHOICES = 8
SAMPLE_PIXELS = 128
# Camera pixels that are solved for together.
PIXELS_TOGETHER = 256


class Choice(NamedTuple):
    """A prior component, by its number, and a variance ratio."""

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
    """

    black: Floats
    direct: Floats
    near: Floats
    far: Floats
    noise: Floats
    lit: NDArray[np.bool_]
    component: NDArray[np.uint8]
    ratio: Floats


class _Photos(NamedTuple):
    """Photos of camera pixels, and where their direct light would come from."""

    values: Floats  # (C, channels, N)
    centres: NDArray[np.int64]  # q rounded
    where: Footprint


class _Prepared(NamedTuple):
    """What camera pixels share."""

    model: PatternModel
    roots: Mapping[int, NearRoot]
    far: Mapping[int, Floats]
    unlit: Sequence[Floats]
    unlit_rotated: Sequence[Rotated]


class _Found(NamedTuple):
    """Camera pixels and channels that made one choice, and what it comes to for them."""

    component: int
    ratio: float
    solved: Solved
    mine: Integers  # among those that were solved for


def estimate_from_patterns(
    photos: Floats,
    patterns: Floats,
    correspondence: Floats,
    projector: Size,
    window: int,
    progress: Callable[[float], None] = lambda _share: None,
) -> tuple[PatternModel, PatternRows]:
    """Estimate the rows of all camera pixels.

    Parameters
    ----------
    photos : ndarray, shape (C, channels, N)
    patterns : ndarray, shape (N, P)
        Levels from 0 to 1.
    correspondence : ndarray, shape (C, 2)
        The most probable q, whether or not there is direct light; NaN where there is surely none.
    projector : Size
    window : int
        W.
    progress : callable
        Called with the share done.
    """
    model = pattern_model(patterns, projector, window)
    prepared = _prepare(model)
    count, channels, _ = photos.shape
    rows = PatternRows(
        black=np.zeros((count, channels), np.float32),
        direct=np.zeros((count, channels), np.float32),
        near=np.zeros((count, channels, window**2), np.float32),
        far=np.zeros((count, channels, model.far_basis.count), np.float32),
        noise=np.zeros((count, channels), np.float32),
        lit=np.zeros(count, bool),
        component=np.zeros(count, np.uint8),
        ratio=np.zeros(count, np.float32),
    )
    seen = _Photos(
        photos, near.centre(correspondence, projector), footprint(correspondence, projector)
    )
    evidence = np.empty(count)

    def estimate_dark(part: slice) -> None:
        evidence[part] = _estimate_unlit(rows, seen, np.arange(count)[part], prepared)

    side_by_side(estimate_dark, blocks(count, PIXELS_TOGETHER))
    (candidates,) = np.nonzero(np.isfinite(correspondence).all(axis=1))
    if not len(candidates):
        return model, rows
    choices = _choose(seen, candidates, prepared)
    done = [0]

    def estimate(group: NDArray[np.int64]) -> None:
        for part in blocks(len(group), PIXELS_TOGETHER):
            _estimate_lit(rows, seen, group[part], choices, prepared, evidence)
        done[0] += len(group)
        progress(done[0] / len(candidates))

    side_by_side(estimate, _of_one_centre(seen.centres, candidates))
    return model, rows


def _of_one_centre(
    centres: NDArray[np.int64], candidates: NDArray[np.int64]
) -> list[NDArray[np.int64]]:
    """Return the camera pixels of each rounded q."""
    order = candidates[np.lexsort(centres[candidates].T[::-1])]
    starts = np.flatnonzero((np.diff(centres[order], axis=0) != 0).any(axis=1)) + 1
    return np.split(order, starts)


def _prepare(model: PatternModel) -> _Prepared:
    unlit = [far_covariance(model, component) for component in UNLIT_COMPONENTS]
    return _Prepared(
        model,
        {n: near_root(model, LIT_COMPONENTS[n]) for n in LIT_AT_PITCH},
        {n: far_covariance(model, LIT_COMPONENTS[n]) for n in LIT_AT_PITCH},
        unlit,
        [rotated(covariance) for covariance in unlit],
    )


def _covariances(
    prepared: _Prepared, over_window: Floats, components: Sequence[int]
) -> dict[int, Floats]:
    """Return the covariance of photos under each component, about one q."""
    found: dict[int, Floats] = {}
    for number in dict.fromkeys(components):
        root = prepared.roots[number]
        in_window = over_window[:, root.entries] @ root.root
        found[number] = np.asarray(in_window @ in_window.T + prepared.far[number])
    return found


def _of_direct(model: PatternModel, seen: _Photos, group: Integers) -> Floats:
    """Return sequences of unit black and unit direct light, (n * channels, N, 2)."""
    levels = np.einsum(
        "knc,nc->nk", model.patterns[:, seen.where.pixels[group]], seen.where.weights[group]
    )
    known = np.stack([np.ones_like(levels), levels], axis=2).astype(np.float64)
    return np.repeat(known, seen.values.shape[1], axis=0)


def _sequences(seen: _Photos, group: Integers) -> Floats:
    """Return the photos of camera pixels, a row for each channel, (n * channels, N), float64."""
    return seen.values[group].reshape(-1, seen.values.shape[2]).astype(np.float64)


def _choose(
    seen: _Photos, candidates: NDArray[np.int64], prepared: _Prepared
) -> tuple[Choice, ...]:
    """Return the pairs of component and ratio that make a sample of camera pixels most probable.

    One by one: each raises the evidence of those that choose it over the ones before.
    """
    sample = np.random.default_rng(0).permutation(candidates)[:SAMPLE_PIXELS]
    pairs = [Choice(number, ratio) for number in LIT_AT_PITCH for ratio in RATIOS]
    evidence = np.empty((len(pairs), len(sample)))

    def work(place: int) -> None:
        pixel = sample[place : place + 1]
        known, photos = _of_direct(prepared.model, seen, pixel), _sequences(seen, pixel)
        over_window = patterns_over_window(prepared.model, seen.centres[pixel[0]])
        covariances = _covariances(prepared, over_window, LIT_AT_PITCH)
        found = [
            log_evidence(photos, known, rotated(covariances[component]), RATIOS).sum(axis=1)
            for component in LIT_AT_PITCH
        ]
        evidence[:, place] = np.concatenate(found)

    side_by_side(work, range(len(sample)))
    chosen: list[int] = []
    best = np.full(len(sample), -np.inf)
    for _ in range(MOST_CHOICES):
        chosen.append(int(np.maximum(evidence, best).sum(axis=1).argmax()))
        best = np.maximum(best, evidence[chosen[-1]])
    return tuple(pairs[number] for number in dict.fromkeys(chosen))


def _estimate_lit(
    rows: PatternRows,
    seen: _Photos,
    group: NDArray[np.int64],
    choices: Sequence[Choice],
    prepared: _Prepared,
    without: Floats,
) -> None:
    """Estimate camera pixels of one rounded q, where that is more probable than no direct light."""
    model, channels = prepared.model, seen.values.shape[1]
    known, photos = _of_direct(model, seen, group), _sequences(seen, group)
    over_window = patterns_over_window(model, seen.centres[group[0]])
    covariances = _covariances(prepared, over_window, [each.component for each in choices])
    solved = [solve(photos, known, covariances[n], ratio) for n, ratio in choices]
    evidence = np.stack([each.evidence for each in solved])
    together = evidence.reshape(len(choices), len(group), channels).sum(axis=2)
    # q was chosen among all projector pixels.
    is_lit = together.max(axis=0) - np.log(model.projector.pixels) > without[group]
    rows.lit[group] = is_lit
    best = np.repeat(np.where(is_lit, together.argmax(axis=0), -1), channels)
    for number, (component, ratio) in enumerate(choices):
        found = _Found(component, ratio, solved[number], np.flatnonzero(best == number))
        pixel, channel = np.divmod(found.mine, channels)
        at = group[pixel], channel
        weights = ratio * found.solved.weights[found.mine]
        root = prepared.roots[component]
        windows = np.zeros((len(found.mine), model.window**2), np.float32)
        windows[:, root.entries] = weights @ over_window[:, root.entries] @ root.root @ root.root.T
        rows.near[at] = windows
        rows.direct[at] = found.solved.amplitudes[found.mine, 1]
        rows.component[at[0]], rows.ratio[at[0]] = component, ratio
        _put_far(rows, at, found, weights @ model.of_far * _far(model, component, is_lit=True))


def _estimate_unlit(
    rows: PatternRows, seen: _Photos, group: NDArray[np.int64], prepared: _Prepared
) -> Floats:
    """Estimate camera pixels without direct light, and return their log evidence."""
    model, channels = prepared.model, seen.values.shape[1]
    photos = _sequences(seen, group)
    known = np.ones((*photos.shape, 1))
    pairs = [(n, ratio) for n in range(len(prepared.unlit)) for ratio in RATIOS]
    evidence = np.concatenate(
        [log_evidence(photos, known, of, RATIOS) for of in prepared.unlit_rotated]
    )
    together = evidence.reshape(len(pairs), len(group), channels).sum(axis=2)
    best = np.repeat(together.argmax(axis=0), channels)
    for number in np.unique(best):
        component, ratio = pairs[number]
        mine = np.flatnonzero(best == number)
        solved = solve(photos[mine], known[mine], prepared.unlit[component], ratio)
        found = _Found(component, ratio, solved, np.arange(len(mine)))
        pixel, channel = np.divmod(mine, channels)
        weights = ratio * solved.weights
        far = weights @ model.of_far * _far(model, component, is_lit=False)
        rows.component[group[pixel]] = len(LIT_COMPONENTS) + component
        rows.ratio[group[pixel]] = ratio
        _put_far(rows, (group[pixel], channel), found, far)
    return np.asarray(together.max(axis=0))


def _put_far(rows: PatternRows, at: tuple[Integers, Integers], found: _Found, far: Floats) -> None:
    """Keep far-range light, black and noise."""
    rows.far[at] = far
    rows.black[at] = found.solved.amplitudes[found.mine, 0]
    rows.noise[at] = np.sqrt(found.solved.variance[found.mine])


def _far(model: PatternModel, component: int, *, is_lit: bool) -> Floats:
    """Return the variances of far-range light's responses at unit prior scale."""
    components = LIT_COMPONENTS if is_lit else UNLIT_COMPONENTS
    return far_variance(model.far_basis, components[component])
