"""Estimate D, N and F from photos of any patterns.

Every camera pixel chooses among a few prior components and variance ratios by the evidence of its
own photos; a sample of camera pixels settles which few. Where the photos are more probable without
direct light, there is none. A second sweep starts from what neighbours have.

Index convention: arrays are (C, ...), camera pixels row by row.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Floats, Size, blocks
from nearfar.estimate.any_patterns.covariance import PatternModel, pattern_model
from nearfar.estimate.any_patterns.neighbours import adjacent, expect_black
from nearfar.estimate.any_patterns.sweep import (
    Before,
    PatternRows,
    Photos,
    Prepared,
    choose,
    estimate_lit,
    estimate_unlit,
    prepare,
    refine_lit,
)
from nearfar.parallel import side_by_side
from nearfar.transport import near
from nearfar.transport.direct import footprint

# Camera pixels that are solved for together.
PIXELS_TOGETHER = 256
# Mean of photos above black below which a camera pixel is as dark as this, as a share of the mean.
DARKEST = 1e-3


def estimate_from_patterns(
    photos: Floats,
    patterns: Floats,
    correspondence: Floats,
    camera: Size,
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
    camera, projector : Size
    window : int
        W.
    progress : callable
        Called with the share done.
    """
    prepared = prepare(pattern_model(patterns, projector, window))
    seen = Photos(
        photos, near.centre(correspondence, projector), footprint(correspondence, projector)
    )
    (candidates,) = np.nonzero(np.isfinite(correspondence).all(axis=1))
    first = _first_sweep(prepared, seen, candidates, lambda share: progress(share / 2))
    rows = _second_sweep(prepared, seen, first, camera, lambda share: progress((1 + share) / 2))
    return prepared.model, rows


def _first_sweep(
    prepared: Prepared,
    photos: Photos,
    candidates: NDArray[np.int64],
    progress: Callable[[float], None],
) -> PatternRows:
    """Estimate every camera pixel by its own photos."""
    rows = _no_rows(prepared.model, *photos.values.shape[:2])
    evidence = np.empty(len(photos.values))

    def estimate_dark(part: slice) -> None:
        group = np.arange(len(evidence))[part]
        evidence[part] = estimate_unlit(rows, prepared, photos, group)

    side_by_side(estimate_dark, blocks(len(evidence), PIXELS_TOGETHER))
    if not len(candidates):
        return rows
    choices = choose(prepared, photos, candidates, None)

    def estimate(group: NDArray[np.int64]) -> None:
        estimate_lit(rows, prepared, photos, group, choices, evidence)

    _by_centre(estimate, photos, candidates, progress)
    return rows


def _second_sweep(
    prepared: Prepared,
    photos: Photos,
    first: PatternRows,
    camera: Size,
    progress: Callable[[float], None],
) -> PatternRows:
    """Estimate every camera pixel from what its neighbours have."""
    black = expect_black(first.black, first.noise, camera)
    level = photos.values.mean(axis=2) - black.mean
    level = np.maximum(level, DARKEST * max(float(level.mean()), 1e-30))
    before = Before(first, black, level, adjacent(camera))
    rows = replace(
        _no_rows(prepared.model, *photos.values.shape[:2]),
        lit=first.lit,
        black_deviation=np.sqrt(black.variance).astype(np.float32),
    )
    unlit, lit = np.flatnonzero(~first.lit), np.flatnonzero(first.lit)

    def refine_dark(part: slice) -> None:
        estimate_unlit(rows, prepared, photos, unlit[part], before)

    side_by_side(refine_dark, blocks(len(unlit), PIXELS_TOGETHER))
    if len(lit):
        choices = choose(prepared, photos, lit, before)

        def refine(group: NDArray[np.int64]) -> None:
            refine_lit(rows, prepared, photos, group, choices, before)

        _by_centre(refine, photos, lit, progress)
    # What neighbours have is uncertain itself: the first sweep's prior fits the error.
    return replace(rows, component=first.component, ratio=first.ratio)


def _no_rows(model: PatternModel, count: int, channels: int) -> PatternRows:
    return PatternRows(
        black=np.zeros((count, channels), np.float32),
        direct=np.zeros((count, channels), np.float32),
        near=np.zeros((count, channels, model.window**2), np.float32),
        far=np.zeros((count, channels, model.far_basis.count), np.float32),
        noise=np.zeros((count, channels), np.float32),
        lit=np.zeros(count, bool),
        component=np.zeros(count, np.uint8),
        ratio=np.zeros(count, np.float32),
        black_deviation=np.full((count, channels), np.inf, np.float32),
    )


def _by_centre(
    work: Callable[[NDArray[np.int64]], None],
    photos: Photos,
    pixels: NDArray[np.int64],
    progress: Callable[[float], None],
) -> None:
    """Call `work` with camera pixels of one rounded q, not too many at once."""
    order = pixels[np.lexsort(photos.centres[pixels].T[::-1])]
    starts = np.flatnonzero((np.diff(photos.centres[order], axis=0) != 0).any(axis=1)) + 1
    done = [0]

    def of_one_centre(group: NDArray[np.int64]) -> None:
        for part in blocks(len(group), PIXELS_TOGETHER):
            work(group[part])
        done[0] += len(group)
        progress(done[0] / len(pixels))

    side_by_side(of_one_centre, np.split(order, starts))
