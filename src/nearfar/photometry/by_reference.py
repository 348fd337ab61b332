"""Photos against white and black become measurements.

b(0.5 + 0.5 s) = 0.5 b(1) + 0.5 b(s), so the response to a sinusoid without offset is
twice its photo less white and black: b = 2 photo - (white + black). One photo serves instead of
two, but the errors of white and black go into every response of a camera pixel. So these are
projected often, and their standard deviations are kept apart from the noise. The drift of lamp and
ambient light is estimated from the same photos.

Index convention: arrays are (photos, C, channels) with C camera pixels row by row; r runs over
real responses.
"""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Floats, blocks
from nearfar.illumination.frequencies import DC
from nearfar.illumination.real_basis import RealBasis
from nearfar.parallel import side_by_side
from nearfar.photometry.drift import find_references
from nearfar.photometry.drift_removal import PhotosWithoutDrift
from nearfar.photometry.measurements import Measurements
from nearfar.photometry.photos import (
    Levels,
    PhotosWithNoise,
    Reference,
    basis_of,
    find_waves,
    in_batches,
    mean_photo,
    size_of_rows,
    stripe_references,
    two_levels,
)
from nearfar.photometry.quantisation import without_quantisation
from nearfar.plan import Plan

# Camera pixels to which photos are added at once.
PIXELS_AT_ONCE = 2**12


def responses_by_reference(plan: Plan) -> tuple[RealBasis, dict[int, tuple[int, int]], Floats]:
    """Return the responses that the photos of a plan by reference measure.

    Returns
    -------
    basis : RealBasis
    terms : dict
        Place and sign of each photo's response, those of white and black left out.
    multiplicity : ndarray, shape (R,)
        How often each was measured, DC by white.
    """
    waves = find_waves(plan)
    basis, place = basis_of(list(waves), plan.projector)
    terms = {
        number: (place[wave], sign)
        for wave, numbers in waves.items()
        if wave != (DC, False)
        for number, sign in numbers
    }
    places = np.array([at for at, _ in terms.values()], dtype=np.int64)
    multiplicity = np.bincount(places, minlength=basis.count).astype(np.float32)
    multiplicity[place[DC, False]] = len(find_references(plan)[0])
    return basis, terms, multiplicity


def levels_by_references(
    photos: PhotosWithNoise, rows: slice, others: Sequence[Reference]
) -> Levels:
    """Return black and light by the photos of white and black, and by other references."""
    whites, blacks = find_references(photos.plan)
    white = mean_photo(photos, whites.tolist(), rows)
    black = mean_photo(photos, blacks.tolist(), rows)
    return two_levels(
        [
            Reference(white, 1.0, 1.0, photos.variance(white) / len(whites)),
            Reference(black, 1.0, 0.0, photos.variance(black) / len(blacks)),
            *others,
        ]
    )


def _add_photos(
    responses: Floats, photos: Floats, both: Floats, terms: Sequence[tuple[int, int]]
) -> None:
    """Add photos (n, C, channels), less white and black, to the responses that they measure."""

    def work(block: slice) -> None:
        for (r, sign), photo in zip(terms, photos, strict=True):
            responses[block, :, r] += sign * (2 * photo[block] - both[block])

    # Responses of one photo lie far apart in memory: photo after photo takes from a block's what
    # the processor has at hand.
    side_by_side(work, blocks(len(both), PIXELS_AT_ONCE))


def measure_by_reference(
    photos: PhotosWithoutDrift, rows: slice, progress: Callable[[int], None] | None = None
) -> Measurements:
    """Turn photos by reference into measurements.

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
        In photo units. A pattern that was shot several times counts as the mean of its photos.

    Raises
    ------
    InputError
        If a cosine was projected without its sine.
    """
    camera = size_of_rows(photos, rows)
    basis, terms, multiplicity = responses_by_reference(photos.plan)
    levels = levels_by_references(photos, rows, stripe_references(photos, rows, photos.variance))
    both = (2 * levels.black + levels.light).astype(np.float32)
    responses = np.zeros((camera.pixels, photos.channels, basis.count), dtype=np.float32)
    for numbers, read in in_batches(photos, sorted(terms), rows):
        _add_photos(responses, read, both, [terms[number] for number in numbers])
        if progress is not None:
            progress(numbers[-1] + 1)
    responses /= multiplicity
    responses[..., basis.response_indices([DC])[0]] = levels.light
    responses, error = without_quantisation(basis, responses)

    def deviation(variance: Floats) -> NDArray[np.float32]:
        return np.sqrt(variance).astype(np.float32)

    return Measurements(
        camera=camera,
        basis=basis,
        responses=responses,
        noise=2 * deviation(photos.variance(levels.black + levels.light / 2)),
        black=levels.black.astype(np.float32),
        quantisation_error=error,
        multiplicity=multiplicity,
        white_noise=deviation(levels.white_variance),
        black_noise=deviation(levels.black_variance),
        light_noise=deviation(levels.light_variance),
    )
