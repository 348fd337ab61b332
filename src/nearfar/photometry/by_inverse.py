"""Photos of inverse pairs become measurements.

A pair's difference is the answer to a sinusoid without offset; ambient light, black level and
the projector's black fall out. Every pair sums to white + black: the mean of the sums is a
white reference with almost no noise, and their scatter is the noise.

What a pair's sum strays from that mean is noise that can be seen. Shot noise is larger in the
brighter photo of a pair, so it shows in the difference too, by rho = (v+ - v-) / (v+ + v-) for
variances v+ and v-; taking it out leaves 1 - rho^2 of the variance (half of it, on average, at a
camera pixel with direct light alone), and a lamp that flickers falls out with it.
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
from nearfar.photometry.noise import NoiseModel, fit_noise
from nearfar.photometry.photos import (
    BATCH,
    Photos,
    Reference,
    basis_of,
    quantisation_error,
    size_of_rows,
    stripe_references,
    two_levels,
)
from nearfar.plan import Plan, Sinusoid

# Pairs that sum to more or less than white + black by this share of white are not linear.
NOT_LINEAR = 0.005
# Camera pixels whose responses are laid side by side at once: few enough to lie near the processor.
TURNED = 256


class Pair(NamedTuple):
    """Photo numbers of a pattern and its inverse, and what they answer."""

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
                f"made of inverse pairs: plan with `offset='inverse'`."
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
            "the plan shows no white with its inverse, black, of which all light is a share: plan "
            "with a far band, which white belongs to."
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
    strays = np.empty((len(pairs), *shape), dtype=np.float32)

    def read(batch: slice) -> Floats:
        numbers = [n for pair in pairs[batch] for n in (pair.photo, pair.inverse)]
        return photos.read(numbers, rows).reshape(-1, 2, *shape)

    for batch, both in ahead(read, blocks(len(pairs), BATCH // 2)):
        np.subtract(both[:, 0], both[:, 1], out=differences[batch])
        np.add(both[:, 0], both[:, 1], out=strays[batch])
        if progress is not None:
            progress(2 * batch.stop)
    pair_mean = strays.mean(axis=0, dtype=np.float64)
    strays -= pair_mean.astype(np.float32)
    pair_variance = np.einsum("kci,kci->ci", strays, strays, dtype=np.float64)
    pair_variance /= max(len(pairs) - 1, 1)
    white, black = _reference_photos(pairs, differences, strays, pair_mean)
    models = [
        fit_noise(pair_mean[:, i], pair_variance[:, i], float(np.median(black[:, i])))
        for i in range(photos.channels)
    ]

    def variance(photo: Floats) -> Floats:
        return np.stack([m.variance(photo[:, i]) for i, m in enumerate(models)], axis=1)

    excess = _excess_of_sums(pair_mean, white, black)
    # Sums that do not add up tell of a projector or camera that is not linear, not of white.
    sums = [Reference(pair_mean, 2.0, 1.0, pair_variance / len(pairs))]
    if abs(excess) > NOT_LINEAR:
        sums = []
    levels = two_levels(
        [
            Reference(white, 1.0, 1.0, variance(white)),
            Reference(black, 1.0, 0.0, variance(black)),
            *sums,
            *stripe_references(photos, rows, variance),
        ]
    )
    left = _take_out_strays(differences, strays, models, variance(pair_mean / 2) * 2)
    responses = _means(differences, places, multiplicity)
    responses[..., basis.places([DC])[0]] = levels.light
    return Measurements(
        camera=camera,
        basis=basis,
        responses=responses,
        noise=np.sqrt(pair_variance * left).astype(np.float32),
        black=levels.black.astype(np.float32),
        quantisation_error=quantisation_error(basis),
        excess_of_sums=excess,
        multiplicity=multiplicity,
        light_noise=np.sqrt(levels.light_variance).astype(np.float32),
    )


def _means(differences: Floats, places: Integers, multiplicity: Floats) -> Floats:
    """Mean of the differences (pairs, C, channels) of each answer, (C, channels, R)."""
    order = np.argsort(places, kind="stable")
    first = np.flatnonzero(np.diff(places[order], prepend=-1))
    shape = differences.shape[1:]
    responses = np.empty((*shape, len(multiplicity)), dtype=np.float32)
    for block in blocks(shape[0], TURNED):
        sums = np.add.reduceat(differences[:, block][order], first, axis=0)
        responses[block] = np.moveaxis(sums, 0, -1) / multiplicity
    return responses


def _excess_of_sums(pair_mean: Floats, white: Floats, black: Floats) -> float:
    """Tell by what share of white the pairs sum to more than white + black: 0 if all is linear."""
    light = (white - black).sum()
    return float((pair_mean - white - black).sum() / light) if light > 0 else 0.0


def _reference_photos(
    pairs: Sequence[Pair], differences: Floats, strays: Floats, pair_mean: Floats
) -> tuple[Floats, Floats]:
    """Photos of white and of black, which are the DC pair's."""
    chosen = [i for i, pair in enumerate(pairs) if pair.frequency == DC]
    total = strays[chosen].mean(axis=0) + pair_mean
    difference = differences[chosen].mean(axis=0)
    return (total + difference) / 2, (total - difference) / 2


def _take_out_strays(
    differences: Floats, strays: Floats, models: Sequence[NoiseModel], total: Floats
) -> Floats:
    """Take the noise that the sums show out of the differences, in place.

    Parameters
    ----------
    differences, strays : ndarray, shape (pairs, C, channels)
    models : sequence of NoiseModel, one per channel
    total : ndarray, shape (C, channels)
        v+ + v-, the same for all pairs.

    Returns
    -------
    ndarray, shape (C, channels)
        Share of the variance that is left, the mean over pairs.
    """
    gain = np.array([model.gain for model in models], dtype=np.float32)
    scale = (gain / total).astype(np.float32)
    shrinkage = np.clip(gain * scale, 0.0, 0.5)
    left = np.zeros(total.shape)
    for difference, stray in zip(differences, strays, strict=True):
        rho = np.clip(scale * difference, -1.0, 1.0)
        # rho is taken from the noisy difference, which shrinks it by gain * scale on average.
        np.subtract(difference, rho * stray, out=difference)
        np.divide(difference, 1.0 - shrinkage, out=difference)
        left += 1.0 - rho.astype(np.float64) ** 2
    return left / len(differences)
