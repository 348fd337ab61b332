r"""Photos of all codes of an order become measurements.

Code n lights about half of the projector's pixels, and shows the row l_n of a cyclic S-matrix of
order q. All q of them see a row t of T as y_n = b + l_n t, b the black, and

    sum_n l_n l_n^T = (q + 1) / 4 (I + 1 1^T).

A wave w other than DC sums to 0 over the projector, so that neither b nor the sum of t has a part
in

    4 / (q + 1) sum_n (w l_n) y_n = w t,

the response to w without offset: the least squares solution. Its errors are independent of those of
all other waves, with half the variance of a response to a photo of the wave itself, as codes show
twice the power. White, black and the mean of the codes tell the response to DC.

Where a wave is photographed as well, its response is the mean of both, weighted by their variances.

Index convention: photos are (n, C, channels) with C camera pixels row by row; r runs over real
responses.
"""

from collections import Counter
from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from nearfar.arrays import Floats, blocks
from nearfar.compiled import compiled
from nearfar.errors import InputError
from nearfar.illumination.frequencies import DC
from nearfar.illumination.patterns import s_matrix_row
from nearfar.illumination.real_basis import RealBasis, basis_of_every_frequency
from nearfar.parallel import side_by_side, single_threaded_products
from nearfar.photometry.by_reference import levels_by_references
from nearfar.photometry.drift import find_references
from nearfar.photometry.drift_removal import PhotosWithoutDrift
from nearfar.photometry.measurements import Measurements
from nearfar.photometry.photos import (
    Reference,
    find_waves,
    in_batches,
    size_of_rows,
)
from nearfar.photometry.quantisation import without_quantisation
from nearfar.plan import Plan
from nearfar.plan.patterns import LampCode

# Camera pixels to which a thread adds photos.
PIXELS_AT_ONCE = 2**8


class Codes(NamedTuple):
    """The codes that a plan shows, each as often as all others.

    Attributes
    ----------
    order : int
    rows : dict
        The row of each photo of a code.
    repeats : int
        How often each code is shown.
    """

    order: int
    rows: dict[int, int]
    repeats: int


class Weighing(NamedTuple):
    """Responses as weighted sums of the photos of a plan, that to DC left out.

    Attributes
    ----------
    basis : RealBasis
        Of all frequencies of the projector's DFT.
    place : dict
        Of each photo of a code or a wave, its row of `weights`.
    weights : ndarray, shape (n, R), float32
    of_offset : ndarray, shape (R,), float32
        Weights of black + white / 2, which is taken off waves.
    multiplicity : ndarray, shape (R,), float32
        By how many photos of a wave a response would be as well known.
    of_waves : ndarray, shape (R,), float32
        The share that photos of waves have in each response.
    """

    basis: RealBasis
    place: dict[int, int]
    weights: Floats
    of_offset: Floats
    multiplicity: Floats
    of_waves: Floats


def find_codes(plan: Plan) -> Codes:
    """Find the photos of codes of a plan, those of check photos left out.

    Raises
    ------
    InputError
        If codes are missing, or shown more often than others.
    """
    shown = {
        number: pattern
        for number, pattern in enumerate(plan.patterns)
        if isinstance(pattern, LampCode) and pattern.purpose != "check"
    }
    order = max((pattern.order for pattern in shown.values()), default=0)
    times = Counter(pattern.row for pattern in shown.values() if pattern.order == order)
    repeats = max(times.values(), default=0)
    if not shown or len(shown) != order * repeats or times.total() != len(shown):
        missing = order * repeats - times.total()
        raise InputError(
            f"{missing} of the photos of {order} codes are missing, and the joint estimate needs "
            f"all of them: take the remaining photos, or estimate free rows by "
            f"`reconstruct(no_near=True, no_far=True)`."
        )
    rows = {number: pattern.row for number, pattern in shown.items()}
    return Codes(order, rows, repeats)


# Tiles of camera rows share it.
@lru_cache(maxsize=1)
def weighing_of(plan: Plan) -> Weighing:
    """Return the weights of photos in the responses that a plan of codes measures.

    Raises
    ------
    InputError
        If codes are missing, or shown more often than others, or if a wave is none of the
        projector's DFT.
    """
    codes, basis = find_codes(plan), basis_of_every_frequency(plan.projector)
    # A photo of a wave that is its own negative has twice the power.
    own = np.array([k.is_own_negative for k in basis.frequencies])[basis.index]
    by_codes = np.where(own, 1.0, 2.0) * (codes.order + 1) / basis.projector.pixels * codes.repeats
    signs = _signs_of_waves(plan, basis)
    by_waves = np.bincount([r for r, _ in signs.values()], minlength=basis.count)
    multiplicity = by_codes + by_waves
    dc = basis.response_indices([DC])
    numbers = [*codes.rows, *signs]
    weights = np.zeros((len(numbers), basis.count), dtype=np.float32)
    np.multiply(
        _code_weights(basis, codes.order)[list(codes.rows.values())],
        by_codes / codes.repeats / multiplicity,
        out=weights[: len(codes.rows)],
        casting="same_kind",
    )
    of_offset = np.zeros(basis.count)
    for place, (r, sign) in enumerate(signs.values(), len(codes.rows)):
        weights[place, r] = 2 * sign / multiplicity[r]
        of_offset[r] += 2 * sign / multiplicity[r]
    multiplicity[dc] = len(find_references(plan).whites)
    return Weighing(
        basis=basis,
        place={number: place for place, number in enumerate(numbers)},
        weights=weights,
        of_offset=of_offset.astype(np.float32),
        multiplicity=multiplicity.astype(np.float32),
        of_waves=(by_waves / multiplicity).astype(np.float32),
    )


def _signs_of_waves(plan: Plan, basis: RealBasis) -> dict[int, tuple[int, int]]:
    """Return the response that each photo of a wave but white and black measures, and its sign."""
    place = {
        (basis.frequencies[i], bool(sine)): r
        for r, (i, sine) in enumerate(zip(basis.index, basis.is_sine, strict=True))
    }
    found = {}
    for wave, numbers in find_waves(plan).items():
        if wave == (DC, False):
            continue
        if wave not in place:
            raise InputError(
                f"the plan shows frequency ({wave[0].fy}, {wave[0].fx}) beside codes, and it is "
                f"none of the projector's DFT: make the plan again with `photos`."
            )
        found.update({number: (place[wave], sign) for number, sign in numbers})
    return found


def measure_by_codes(
    photos: PhotosWithoutDrift, rows: slice, progress: Callable[[int], None] | None = None
) -> Measurements:
    """Turn photos of codes into measurements of all frequencies of the projector.

    Parameters
    ----------
    photos : PhotosWithoutDrift
    rows : slice
        Rows of the camera to measure.
    progress : callable, optional
        Called with the number of photos read so far.

    Returns
    -------
    Measurements
        In photo units.

    Raises
    ------
    InputError
        As `weighing_of`.
    """
    weighing, codes = weighing_of(photos.plan), find_codes(photos.plan)
    basis, camera = weighing.basis, size_of_rows(photos, rows)
    responses = np.zeros((camera.pixels, photos.channels, basis.count), dtype=np.float32)
    total = np.zeros((camera.pixels, photos.channels))
    for numbers, read in in_batches(photos, sorted(weighing.place), rows):
        shown = [place for place, number in enumerate(numbers) if number in codes.rows]
        total += read[shown].sum(axis=0, dtype=np.float64)
        _add_photos(responses, read, weighing.weights[[weighing.place[n] for n in numbers]])
        if progress is not None:
            progress(numbers[-1] + 1)
    mean = total / len(codes.rows)
    # Each pixel is lit by (q + 1) / 2 of the q codes.
    lit_share = (codes.order + 1) / (2 * codes.order)
    of_codes = Reference(mean, 1.0, lit_share, photos.variance(mean) / len(codes.rows))
    levels = levels_by_references(photos, rows, [of_codes])
    half = levels.black + levels.light / 2
    responses -= half[..., None].astype(np.float32) * weighing.of_offset
    responses[..., basis.response_indices([DC])[0]] = levels.light
    if weighing.of_waves.any():
        ideal, _ = without_quantisation(basis, responses)
        responses += weighing.of_waves * (ideal - responses)
    return Measurements(
        camera=camera,
        basis=basis,
        responses=responses,
        noise=2 * np.sqrt(photos.variance(half)).astype(np.float32),
        black=levels.black.astype(np.float32),
        quantisation_error=np.zeros((basis.count, 0), dtype=np.float32),
        multiplicity=weighing.multiplicity,
        light_noise=np.sqrt(levels.light_variance).astype(np.float32),
    )


def responses_of_photos(plan: Plan, numbers: Sequence[int], photos: Floats) -> Floats:
    """Return the contribution of some photos to all responses but that to DC.

    Parameters
    ----------
    plan : Plan
    numbers : sequence of int
    photos : ndarray, shape (n, C, channels)

    Returns
    -------
    ndarray, shape (C, channels, R), float32
    """
    weighing = weighing_of(plan)
    responses = np.zeros((*photos.shape[1:], weighing.basis.count), dtype=np.float32)
    _add_photos(responses, photos, weighing.weights[[weighing.place[n] for n in numbers]])
    return responses


@lru_cache(maxsize=1)
def _code_weights(basis: RealBasis, order: int) -> Floats:
    """Return the weight of each code's photo in the responses, (q, R); 0 for DC."""
    drawn = np.stack(
        [s_matrix_row(order, row, basis.projector).ravel() for row in range(order)]
    ).astype(np.float32)
    # The last bits of a product change with its threads, and those of responses must not.
    with single_threaded_products():
        found = basis.analyse(drawn) / basis.weights * (4 / (order + 1))
    found[:, basis.response_indices([DC])] = 0.0
    return found.astype(np.float32)


def _add_photos(responses: Floats, photos: Floats, weights: Floats) -> None:
    """Add photos (n, C, channels), times their weights (n, R), to the responses."""

    def work(block: slice) -> None:
        _add_products(responses, photos, weights, block.start, block.stop)

    side_by_side(work, blocks(len(responses), PIXELS_AT_ONCE))


@compiled
def _add_products(
    responses: Floats, photos: Floats, weights: Floats, first: int, last: int
) -> None:
    """Add products photo after photo, so that a row's rounding depends on no other row."""
    for pixel in range(first, last):
        for channel in range(responses.shape[1]):
            for number in range(len(photos)):
                value = photos[number, pixel, channel]
                for r in range(weights.shape[1]):
                    responses[pixel, channel, r] += value * weights[number, r]
