"""The places that sequences of levels tell: camera pixels compared with the codes of all places.

Index convention: arrays are (C, N) and (places, N); c runs over camera pixels, n over photos.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from nearfar.arrays import Booleans, Floats, Integers, blocks
from nearfar.correspondence.candidates import best_places
from nearfar.correspondence.codes import SAME_CODE, Codes
from nearfar.parallel import side_by_side

# Places that are compared after they are refined: where two pixels share direct light, neither's
# code may be the best by itself.
CANDIDATES = 3
# Scores held at once: few enough for a processor's cache.
SCORES_AT_ONCE = 2**18
# Probability above which there is direct light, from that place.
LEAST_CONFIDENCE = 0.999
# Direct light over the mean of the photos, below which what responds may be near-range light alone.
LEAST_LIGHT = 0.1
# Share of a sequence that direct light explains at least, beyond offset and far-range light.
LEAST_EXPLAINED = 0.5
# A camera pixel's own misfit counts as that of its photos, that of all camera pixels together as so
# many more: few photos tell little of their own noise.
PHOTOS_OF_TYPICAL = 20


class Places(NamedTuple):
    """The places that camera pixels' sequences tell.

    Attributes
    ----------
    place : ndarray, shape (C, 2)
        (y, x) in projector pixels.
    confidence : ndarray, shape (C,)
        Probability that the place is right and there is direct light from it.
    explained : ndarray, shape (C,)
        Share of a sequence's power, beyond offset and far-range light, that direct light explains.
    light : ndarray, shape (C,)
        Direct light, in the units of the sequences under a white pattern.
    """

    place: Floats
    confidence: Floats
    explained: Floats
    light: Floats


def is_lit(places: Places, sequences: Floats) -> Booleans:
    """Return which camera pixels have direct light from the places that were found, (C,)."""
    found: Booleans = (
        (places.confidence >= LEAST_CONFIDENCE)
        & (places.explained >= LEAST_EXPLAINED)
        & (places.light >= LEAST_LIGHT * sequences.mean(axis=1))
    )
    return found


def typical_misfit(sequences: Floats, codes: Sequence[Codes]) -> float:
    """Return the typical variance of what direct light leaves of a photo, over its own power.

    Parameters
    ----------
    sequences : ndarray, shape (C, N)
        Of camera pixels all over the camera; some thousand tell enough.
    codes : sequence of Codes
        As `find_places` takes them.

    Returns
    -------
    float
        The median over the camera pixels.
    """
    places = find_places(sequences, codes, 0.0)
    misfits = (1.0 - places.explained) / np.maximum(places.explained, SAME_CODE)
    return float(np.median(misfits) / max(1, codes[0].degrees))


def find_places(sequences: Floats, codes: Sequence[Codes], misfit: float) -> Places:
    """Find the place whose code explains each camera pixel's sequence best.

    Parameters
    ----------
    sequences : ndarray, shape (C, N)
        Photos' values; the last axis in the order of the patterns.
    codes : sequence of Codes
        The same patterns, as camera pixels with footprints of different widths see them. Each
        camera pixel has the width that explains its sequence best.
    misfit : float
        That of `typical_misfit`.

    Returns
    -------
    Places
    """
    count, largest = len(sequences), max(each.grid.pixels for each in codes)
    found = Places(np.zeros((count, 2)), *(np.zeros(count) for _ in range(3)))

    def work(block: slice) -> None:
        compared = [_compare(sequences[block], each) for each in codes]
        mine = _surest(compared, codes, misfit)
        for all_of, part in zip(found, mine, strict=True):
            all_of[block] = part

    side_by_side(work, blocks(count, max(64, SCORES_AT_ONCE // largest)))
    return found


class _Compared(NamedTuple):
    """Camera pixels, compared with the codes of one width of their footprints.

    Attributes
    ----------
    place : ndarray, shape (C, 2)
        The best place, in projector pixels.
    explained : ndarray, shape (C,)
        Share of the power of a sequence that it explains.
    runner_up : ndarray, shape (C,)
        Share that the best place with another code explains.
    light : ndarray, shape (C,)
    """

    place: Floats
    explained: Floats
    runner_up: Floats
    light: Floats


def _surest(compared: Sequence[_Compared], codes: Sequence[Codes], misfit: float) -> Places:
    """Choose the width of each camera pixel, and say how sure its place is."""
    number = np.arange(len(compared[0].explained))
    shares = np.stack([each.explained for each in compared])
    chosen = shares.argmax(axis=0)
    best = shares[chosen, number]
    place = np.stack([each.place for each in compared])[chosen, number]
    second = np.zeros(len(number))
    for each, its in zip(compared, codes, strict=True):
        reach = [side * step for side, step in zip(its.reach, its.steps, strict=True)]
        is_elsewhere = (np.abs(each.place - place) > reach).any(axis=1)
        second = np.maximum(second, np.where(is_elsewhere, each.explained, each.runner_up))
    # The noise being unknown, the likelihood of a place is a power of what it leaves.
    degrees = codes[0].degrees + PHOTOS_OF_TYPICAL
    expected = PHOTOS_OF_TYPICAL * misfit * best + SAME_CODE
    odds = (1.0 - second + expected) / (np.maximum(1.0 - best, 0.0) + expected)
    log_odds = 0.5 * degrees * np.log(np.maximum(odds, SAME_CODE)) - np.log(codes[0].grid.pixels)
    return Places(
        place=place,
        confidence=1.0 / (1.0 + np.exp(-np.clip(log_odds, -50, 50))) * (best > 0),
        explained=best,
        light=np.stack([each.light for each in compared])[chosen, number],
    )


def _compare(sequences: Floats, codes: Codes) -> _Compared:
    """Compare camera pixels with all places, and refine the best ones."""
    whitened = [sequences @ matrix.T for matrix in codes.whitening]
    number = np.arange(len(sequences))
    products = np.stack(
        [
            np.asarray(mine, dtype=np.float32) @ unit.T
            for mine, unit in zip(whitened, codes.unit, strict=True)
        ]
    )
    candidates = [
        _refined(whitened, codes, *np.divmod(places, codes.grid.width))
        for places in best_places(products, *codes.grid, *codes.reach, CANDIDATES)
    ]
    explained = np.stack([each.explained for each in candidates])
    order = np.argsort(-explained, axis=0, kind="stable")
    power = sum(np.einsum("cn,cn->c", each, each).astype(np.float64) for each in whitened)
    explained /= np.maximum(power, np.finfo(np.float32).tiny)
    place = np.stack([each.place for each in candidates])[order[0], number]
    in_pixels = [
        np.interp(place[:, axis], np.arange(codes.grid[axis]), codes.places[axis])
        for axis in (0, 1)
    ]
    return _Compared(
        np.stack(in_pixels, axis=1),
        explained[order[0], number],
        explained[order[1], number],
        np.stack([each.light for each in candidates])[order[0], number],
    )


class _Candidate(NamedTuple):
    """A place, refined, and the power and the direct light that it explains."""

    place: Floats
    explained: Floats
    light: Floats


def _refined(whitened: Sequence[Floats], codes: Codes, y: Integers, x: Integers) -> _Candidate:
    """Refine places below a pixel, axis by axis."""
    index = y * codes.grid.width + x
    place = np.stack([y, x], axis=1).astype(np.float64)
    light, explained = np.zeros(len(y)), np.zeros(len(y))
    for mine, unit, norm in zip(whitened, codes.unit, codes.norms, strict=True):
        direct = np.maximum(np.einsum("cn,cn->c", mine, unit[index]), 0.0)
        light = np.maximum(light, direct / norm[index])
        explained = explained + direct.astype(np.float64) ** 2
    for axis in (0, 1):
        if codes.grid[axis] > 1:
            place[:, axis], together = _between(whitened, codes, y, x, axis)
            explained = np.maximum(explained, together)
    return _Candidate(place, explained, light)


def _between(
    whitened: Sequence[Floats], codes: Codes, y: Integers, x: Integers, axis: int
) -> tuple[Floats, Floats]:
    """Share direct light between the best place and a neighbour along one axis.

    Returns
    -------
    place : ndarray, shape (C,)
        The centroid on this axis, of the groups' by what they explain.
    explained : ndarray, shape (C,)
        The power that both explain together.
    """
    width, centre = codes.grid[1], (y, x)[axis]
    here = y * width + x
    found, explained = centre.astype(np.float64), np.zeros(len(centre))
    for step in (-1, 1):
        beside = np.clip(centre + step, 0, codes.grid[axis] - 1)
        there = beside * width + x if axis == 0 else y * width + beside
        shares = [
            _shared(mine, unit, norm, here, there)
            for mine, unit, norm in zip(whitened, codes.unit, codes.norms, strict=True)
        ]
        total = sum(share.power for share in shares)
        weight = sum(share.information for share in shares)
        moved = sum(share.information * share.fraction for share in shares)
        better = (beside != centre) & (total > explained)
        centroid = centre + step * moved / np.maximum(weight, np.finfo(np.float32).tiny)
        found = np.where(better, centroid, found)
        explained = np.where(better, total, explained)
    return found, explained


class _Shared(NamedTuple):
    """Direct light of one group between two places, each of shape (C,)."""

    fraction: Floats  # of light at the second place
    power: Floats  # that both explain
    information: Floats  # of the fraction


def _shared(
    whitened: Floats, unit: Floats, norm: Floats, here: Integers, there: Integers
) -> _Shared:
    a, b = unit[here], unit[there]
    of_a, of_b, both = (
        np.einsum("cn,cn->c", one, other).astype(np.float64)
        for one, other in ((whitened, a), (whitened, b), (a, b))
    )
    determinant = np.maximum(1.0 - both**2, 0.0)
    can_share: Booleans = determinant > SAME_CODE
    share_a = (of_a - both * of_b) / np.where(can_share, determinant, 1.0)
    share_b = (of_b - both * of_a) / np.where(can_share, determinant, 1.0)
    is_shared = can_share & (share_a > 0) & (share_b > 0)
    # Of codes of norm 1; their light is this over the norm.
    light_a, light_b = share_a / norm[here], share_b / norm[there]
    alone_a, alone_b = np.maximum(of_a, 0.0) ** 2, np.maximum(of_b, 0.0) ** 2
    fraction = np.where(
        is_shared,
        light_b / np.where(is_shared, light_a + light_b, 1.0),
        (alone_b > alone_a) & can_share,
    )
    power = np.where(is_shared, share_a * of_a + share_b * of_b, np.maximum(alone_a, alone_b))
    return _Shared(fraction, power, determinant * alone_a)
