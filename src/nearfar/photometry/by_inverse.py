"""Photos of inverse pairs become measurements.

A pair's difference is the response to a sinusoid without offset: ambient light, black level and
the projector's black cancel. Every pair sums to white + black: the mean of the sums is a white
reference with almost no noise, and their scatter measures the noise.

A pair's sum deviates from that mean by noise alone, so this part of the noise is known. Shot noise
is larger in the brighter photo of a pair, so the noise of the difference correlates with that of
the sum: its regression coefficient is rho = (v+ - v-) / (v+ + v-) for variances v+ and v-.
Subtracting rho times the sum's deviation leaves 1 - rho^2 of the variance (half of it, on average,
at a camera pixel with direct light alone), and removes the flicker of the lamp too.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from nearfar.arrays import Floats, Integers, blocks
from nearfar.errors import InputError
from nearfar.illumination.frequencies import DC, Frequency
from nearfar.illumination.real_basis import RealBasis
from nearfar.parallel import ahead
from nearfar.photometry.measurements import Measurements
from nearfar.photometry.noise import NoiseModel, fit_noise, variance_by_channel
from nearfar.photometry.photos import (
    PHOTOS_AT_ONCE,
    Photos,
    Reference,
    basis_of,
    size_of_rows,
    stripe_references,
    two_levels,
)
from nearfar.photometry.quantisation import without_quantisation
from nearfar.plan import Plan, Sinusoid

# Share of white by which pairs may sum to more or less than white + black; projector or camera is
# not linear beyond.
LARGEST_LINEAR_EXCESS = 0.005
# Camera pixels whose responses are transposed at once: few enough to stay in the cache.
TRANSPOSED_PIXELS = 256


class Pair(NamedTuple):
    """Photo numbers of a sinusoid and of its inverse."""

    frequency: Frequency
    sine: bool
    photo: int
    inverse: int


def find_pairs(plan: Plan) -> list[Pair]:
    """List a plan's inverse pairs in the order of their first photo.

    Raises
    ------
    InputError
        If a pattern has no inverse in the plan.
    """
    waiting: dict[tuple[Frequency, str, str, bool], list[int]] = {}
    for number, pattern in enumerate(plan.patterns):
        if isinstance(pattern, Sinusoid):
            key = (pattern.frequency, pattern.kind, pattern.purpose, pattern.inverse)
            waiting.setdefault(key, []).append(number)
    pairs = []
    for (frequency, kind, purpose, inverse), numbers in waiting.items():
        partners = waiting.get((frequency, kind, purpose, not inverse), [])
        if len(partners) != len(numbers):
            raise InputError(
                f"the plan shows pattern {numbers[0]} without its inverse, and measurements are "
                f"made from inverse pairs: plan with `offset='inverse'`."
            )
        if not inverse:
            pairs += [
                Pair(frequency, kind == "sine", a, b)
                for a, b in zip(numbers, partners, strict=True)
            ]
    return sorted(pairs, key=lambda pair: pair.photo)


def responses_of_pairs(plan: Plan) -> tuple[RealBasis, Integers, Floats]:
    """Return the basis that a plan's pairs measure, each pair's place in it, multiplicity (R,)."""
    pairs = find_pairs(plan)
    if all(pair.frequency != DC for pair in pairs):
        raise InputError(
            "the plan has no pair of white and black, against which all light is measured: plan "
            "with a far band, which contains white."
        )
    basis, place = basis_of([(pair.frequency, pair.sine) for pair in pairs], plan.projector)
    places = np.array([place[pair.frequency, pair.sine] for pair in pairs])
    return basis, places, np.bincount(places, minlength=basis.count).astype(np.float32)


def measure_pairs(
    photos: Photos, rows: slice, progress: Callable[[int], None] | None = None
) -> Measurements:
    """Turn photos of inverse pairs into measurements.

    Parameters
    ----------
    photos : Photos
        A capture of a plan with offset inverse.
    rows : slice
        Rows of the camera to measure.
    progress : callable, optional
        Called with the number of photos read so far.

    Returns
    -------
    Measurements
        In photo units. A frequency that was shot twice counts as the mean.

    Raises
    ------
    InputError
        If a pattern has no inverse, a cosine no sine, or there is no white.
    """
    plan = photos.plan
    camera = size_of_rows(photos, rows)
    pairs, (basis, places, multiplicity) = find_pairs(plan), responses_of_pairs(plan)
    shape = (camera.pixels, photos.channels)
    differences = np.empty((len(pairs), *shape), dtype=np.float32)
    deviations = np.empty((len(pairs), *shape), dtype=np.float32)

    def read(batch: slice) -> Floats:
        numbers = [n for pair in pairs[batch] for n in (pair.photo, pair.inverse)]
        return photos.read(numbers, rows).reshape(-1, 2, *shape)

    for batch, both in ahead(read, blocks(len(pairs), PHOTOS_AT_ONCE // 2)):
        np.subtract(both[:, 0], both[:, 1], out=differences[batch])
        np.add(both[:, 0], both[:, 1], out=deviations[batch])
        if progress is not None:
            progress(2 * batch.stop)
    pair_mean = deviations.mean(axis=0, dtype=np.float64)
    deviations -= pair_mean.astype(np.float32)
    pair_variance = np.einsum("kci,kci->ci", deviations, deviations, dtype=np.float64)
    pair_variance /= max(len(pairs) - 1, 1)
    white, black = _reference_photos(pairs, differences, deviations, pair_mean)
    models = [
        fit_noise(pair_mean[:, i], pair_variance[:, i], float(np.median(black[:, i])))
        for i in range(photos.channels)
    ]

    def variance(photo: Floats) -> Floats:
        return variance_by_channel(models, photo)

    excess = _excess_of_sums(pair_mean, white, black)
    # Where projector or camera is not linear, the sums are no reference for white.
    sums = [Reference(pair_mean, 2.0, 1.0, pair_variance / len(pairs))]
    if abs(excess) > LARGEST_LINEAR_EXCESS:
        sums = []
    levels = two_levels(
        [
            Reference(white, 1.0, 1.0, variance(white)),
            Reference(black, 1.0, 0.0, variance(black)),
            *sums,
            *stripe_references(photos, rows, variance),
        ]
    )
    left = _remove_visible_noise(differences, deviations, models, variance(pair_mean / 2) * 2)
    responses = _means(differences, places, multiplicity)
    responses[..., basis.response_indices([DC])[0]] = levels.light
    responses, error = without_quantisation(basis, responses)
    return Measurements(
        camera=camera,
        basis=basis,
        responses=responses,
        noise=np.sqrt(pair_variance * left).astype(np.float32),
        black=levels.black.astype(np.float32),
        quantisation_error=error,
        excess_of_sums=excess,
        multiplicity=multiplicity,
        light_noise=np.sqrt(levels.light_variance).astype(np.float32),
    )


def _means(differences: Floats, places: Integers, multiplicity: Floats) -> Floats:
    """Return the mean difference of each response's pairs, (C, channels, R)."""
    order = np.argsort(places, kind="stable")
    first = np.flatnonzero(np.diff(places[order], prepend=-1))
    shape = differences.shape[1:]
    responses = np.empty((*shape, len(multiplicity)), dtype=np.float32)
    for block in blocks(shape[0], TRANSPOSED_PIXELS):
        sums = np.add.reduceat(differences[:, block][order], first, axis=0)
        responses[block] = np.moveaxis(sums, 0, -1) / multiplicity
    return responses


def _excess_of_sums(pair_mean: Floats, white: Floats, black: Floats) -> float:
    """Return the share of white by which pairs exceed white + black: 0 if all is linear."""
    light = (white - black).sum()
    return float((pair_mean - white - black).sum() / light) if light > 0 else 0.0


def _reference_photos(
    pairs: Sequence[Pair], differences: Floats, deviations: Floats, pair_mean: Floats
) -> tuple[Floats, Floats]:
    """Photos of white and of black, which are the DC pair's."""
    chosen = [i for i, pair in enumerate(pairs) if pair.frequency == DC]
    total = deviations[chosen].mean(axis=0) + pair_mean
    difference = differences[chosen].mean(axis=0)
    return (total + difference) / 2, (total - difference) / 2


def _remove_visible_noise(
    differences: Floats, deviations: Floats, models: Sequence[NoiseModel], total: Floats
) -> Floats:
    """Subtract from the differences, in place, the noise that the sums reveal.

    Parameters
    ----------
    differences, deviations : ndarray, shape (pairs, C, channels)
    models : sequence of NoiseModel, one per channel
    total : ndarray, shape (C, channels)
        v+ + v-, the same for all pairs.

    Returns
    -------
    ndarray, shape (C, channels)
        Share of the variance that remains, the mean over pairs.
    """
    gain = np.array([model.gain for model in models], dtype=np.float32)
    scale = (gain / total).astype(np.float32)
    shrinkage = np.clip(gain * scale, 0.0, 0.5)
    left = np.zeros(total.shape)
    for difference, deviation in zip(differences, deviations, strict=True):
        rho = np.clip(scale * difference, -1.0, 1.0)
        # rho is computed from the noisy difference, which shrinks that by gain * scale on average.
        np.subtract(difference, rho * deviation, out=difference)
        np.divide(difference, 1.0 - shrinkage, out=difference)
        left += 1.0 - rho.astype(np.float64) ** 2
    return left / len(differences)
