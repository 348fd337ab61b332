"""Correspondence by Gray code with its inverse: 2 log2 photos of each axis.

Each bit is the sign of a photo less that of the inverse pattern, so that neither albedo nor ambient
light matter. Neighbouring rows differ in one bit (Gray 1953), so a camera pixel that sees two of
them is unsure of that bit alone, and the contrast of that bit measures its share of each.

Far-range light hardly responds to fine bits: this is how camera pixels without direct light are
recognised. Where it outshines direct light it flips coarse bits; stripes and phase do better there.

Index convention: arrays are (C,) or (B, C); c runs over camera pixels, b over the bits of one axis,
0 the finest.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from nearfar.arrays import Booleans, Floats, Integers, Size
from nearfar.correspondence.methods import CorrespondenceMethod
from nearfar.correspondence.normal import normal_cdf
from nearfar.correspondence.result import Correspondence
from nearfar.errors import InputError
from nearfar.illumination.patterns import gray_bits
from nearfar.photometry.measurements import Measurements
from nearfar.photometry.noise import fit_noise
from nearfar.photometry.photos import Photos, size_of_rows
from nearfar.plan import GrayCode, Plan

# Confidence above which there is direct light: noise is mistaken for it once in a million.
LEAST_CONFIDENCE = 1 - 1e-6
# Share of a camera pixel's white below which what responds may be near-range light alone.
LEAST_DIRECT_SHARE = 0.04
# Contrast of the bit between two neighbours, over that of the other bits, below which both share a
# camera pixel: near-range light alone weakens the finest bits, too. Of the Cornell box from aside
# and the shelf 97 to 98 % of camera pixels are within half a pixel for any value from 1/3 to 0.8,
# and 81 % without sharing.
LARGEST_SHARED_RATIO = 0.5


class GrayAxis(NamedTuple):
    """One axis of every camera pixel, each of shape (C,)."""

    place: Floats
    # Probability that noise flipped a bit that matters.
    false_alarm: Floats
    # Smallest difference of a bit that matters.
    contrast: Floats
    inside: Booleans


def gray_code(projector: Size) -> tuple[GrayCode, ...]:
    """Return the Gray code of the rows, then of the columns, each bit beside its inverse."""
    return tuple(
        GrayCode(kind=kind, bit=bit, inverse=inverse)
        for kind, side in (("gray rows", projector.height), ("gray columns", projector.width))
        for bit in range(gray_bits(side))
        for inverse in (False, True)
    )


def has_gray_code(plan: Plan) -> bool:
    """Return whether a plan holds Gray code with its inverse on both axes."""
    return plan.projector.pixels > 1 and all(
        set(_numbers(plan, kind)) == {(bit, inverse) for bit in bits for inverse in (False, True)}
        for kind, bits in _bits(plan.projector).items()
    )


def correspond_by_gray_code(
    photos: Photos, rows: slice | None = None, progress: Callable[[int], None] | None = None
) -> Correspondence:
    """Find q(c) from photos of Gray code.

    Parameters
    ----------
    photos : Photos
        A capture whose plan holds Gray code with its inverse.
    rows : slice, optional
        Rows of the camera; all by default.
    progress : callable, optional
        Called with the number of photos read so far.

    Returns
    -------
    Correspondence

    Raises
    ------
    InputError
        If the plan holds no Gray code.
    """
    plan = photos.plan
    if not has_gray_code(plan):
        raise InputError(
            "the plan of this capture has no Gray code: give the correspondence with "
            "`correspondence`, or plan with `correspondence='gray'`."
        )
    rows = slice(0, photos.camera.height) if rows is None else rows
    camera = size_of_rows(photos, rows)
    read: dict[str, tuple[Floats, Floats]] = {}
    for kind, bits in _bits(plan.projector).items():
        read[kind] = _differences(photos, _numbers(plan, kind), len(bits), rows)
        if progress is not None:
            progress(2 * sum(len(differences) for differences, _ in read.values()))
    white, noise = _white_and_noise(np.concatenate([sums for _, sums in read.values()]))
    down, across = (
        decode_axis(differences, noise, side)
        for (differences, _), side in zip(read.values(), plan.projector, strict=True)
    )
    confidence = 1.0 - np.minimum(1.0, down.false_alarm + across.false_alarm)
    contrast = np.minimum(down.contrast, across.contrast)
    lit = (
        (confidence >= LEAST_CONFIDENCE)
        & (contrast >= LEAST_DIRECT_SHARE * white)
        & down.inside
        & across.inside
    )
    q = np.stack([down.place, across.place], axis=-1)
    q[~lit] = np.nan
    return Correspondence(
        q.reshape(*camera, 2).astype(np.float32),
        confidence.reshape(camera).astype(np.float32),
    )


def _bits(projector: Size) -> dict[str, range]:
    return {
        "gray rows": range(gray_bits(projector.height)),
        "gray columns": range(gray_bits(projector.width)),
    }


def _numbers(plan: Plan, kind: str) -> dict[tuple[int, bool], int]:
    """Return photo numbers by bit and by whether they show the inverse."""
    return {
        (pattern.bit, pattern.inverse): i
        for i, pattern in enumerate(plan.patterns)
        if isinstance(pattern, GrayCode) and pattern.kind == kind
    }


def _differences(
    photos: Photos, numbers: dict[tuple[int, bool], int], bits: int, rows: slice
) -> tuple[Floats, Floats]:
    """Return photo less inverse and their sum, (B, C) each, summed over channels."""
    pixels = size_of_rows(photos, rows).pixels
    differences, sums = np.empty((bits, pixels)), np.empty((bits, pixels))
    for bit in range(bits):
        pair = photos.read([numbers[bit, False], numbers[bit, True]], rows)
        one, other = pair.sum(axis=-1, dtype=np.float64).reshape(2, pixels)
        differences[bit], sums[bit] = one - other, one + other
    return differences, sums


def _white_and_noise(sums: Floats) -> tuple[Floats, Floats]:
    """Return the mean sum of a pair, and the deviation of its difference, (C,) each."""
    white = sums.mean(axis=0)
    if len(sums) < 2:
        return white, np.full_like(white, np.finfo(np.float64).tiny)
    model = fit_noise(white, sums.var(axis=0, ddof=1), 0.0)
    return white, np.sqrt(2 * np.maximum(model.variance(white / 2), 1e-18))


def decode_axis(differences: Floats, noise: Floats, side: int) -> GrayAxis:
    """Decode the Gray code of one axis.

    Parameters
    ----------
    differences : array, shape (B, C)
        Photo of each bit less that of its inverse, the finest bit first.
    noise : array, shape (C,)
        Standard deviation of a difference.
    side : int
        Number of rows or columns, or of cells of them, that the code distinguishes.
    """
    bits, pixels = differences.shape
    if not bits:
        none = np.zeros(pixels)
        return GrayAxis(none, none, np.full(pixels, np.inf), np.ones(pixels, dtype=bool))
    number, size = np.arange(pixels), np.abs(differences)
    place = _place_of(differences > 0)
    weakest = np.argmin(size, axis=0)
    flipped = differences > 0
    flipped[weakest, number] ^= True
    neighbour = _place_of(flipped)
    beside = (np.abs(neighbour - place) == 1) & (neighbour < side)
    # The weakest bit does not matter if it only distinguishes two neighbours.
    matters = np.ones_like(flipped)
    matters[weakest, number] = ~beside
    false_alarm = np.sum(normal_cdf(-size / noise) * matters, axis=0)
    contrast = np.min(np.where(matters, size, np.inf), axis=0)
    others = np.where(np.arange(bits)[:, None] == weakest, np.nan, size)
    usual = np.nanmedian(others, axis=0) if bits > 1 else size[0]
    ratio = size[weakest, number] / np.maximum(usual, np.finfo(np.float64).tiny)
    share = np.where(beside & (ratio < LARGEST_SHARED_RATIO), 0.5 * (1.0 - ratio), 0.0)
    if bits == 1:
        contrast, false_alarm = size[0], normal_cdf(-size[0] / noise)
    return GrayAxis(place + share * (neighbour - place), false_alarm, contrast, place < side)


def _place_of(gray: Booleans) -> Integers:
    """Decode bits (B, C), the finest first: (C,)."""
    binary = np.logical_xor.accumulate(gray[::-1], axis=0)[::-1]
    place: Integers = np.sum(binary * (1 << np.arange(len(gray)))[:, None], axis=0)
    return place


def _find(
    photos: Photos,
    rows: slice,
    measure: Callable[[], Measurements],
    progress: Callable[[int], None] | None = None,
) -> Correspondence:
    return correspond_by_gray_code(photos, rows, progress)


GRAY_CODE = CorrespondenceMethod(patterns=gray_code, serves=has_gray_code, find=_find)
