"""Photos of inverse pairs without the drift of the lamp, and motion, by the sums of the pairs.

Every pair sums to white and black. So the sums are photos of white throughout the capture, though
white itself was photographed once. They are compared with their own mean: a response that is not
linear changes all of them alike, and is not taken for motion.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy import ndimage

from nearfar.arrays import Booleans, Floats, Integers
from nearfar.faults.of_photos import Moved
from nearfar.illumination.frequencies import DC
from nearfar.photometry.by_inverse import LARGEST_LINEAR_EXCESS, find_pairs
from nearfar.photometry.in_memory import PhotosInMemory
from nearfar.photometry.pair_sums import sum_pairs
from nearfar.photometry.photos import PhotosWithNoise
from nearfar.plan import Sinusoid
from nearfar.workflow.diagnosis.explanations import SUSPECT_MISFIT
from nearfar.workflow.diagnosis.misfit import Fits, model_variance, normal_equations
from nearfar.workflow.diagnosis.sample import CameraSample
from nearfar.workflow.diagnosis.whole_capture import FROM_THE_ENDS, find_changes

WHITE = Sinusoid(kind="cosine", frequency=DC, purpose="reference")


# Pairs over which the light of the lamp is the median, so that no single photo has a say in it.
PAIRS_OF_MEDIAN = 5


@dataclass(frozen=True, eq=False)
class SteadyPairs(PhotosWithNoise):
    """Photos of a sample, of a plan of inverse pairs, without the drift of the lamp.

    Attributes
    ----------
    photos : PhotosInMemory
        In photo units.
    unsaturated : ndarray of bool, shape (Cy, Cx, channels)
        Where no photo is saturated.
    """

    photos: PhotosInMemory
    unsaturated: Booleans

    def only(self, numbers: Integers) -> "SteadyPairs":
        """Return some of the photos, in order; the noise is that of all."""
        patterns = tuple(self.plan.patterns[number] for number in numbers)
        plan = self.plan.model_copy(update={"patterns": patterns})
        return replace(self, photos=PhotosInMemory(plan, self.photos.photos[numbers], 1.0))


def steady_pairs(sample: CameraSample) -> SteadyPairs:
    """Return the photos of a sample without what the lamp drifts from pair to pair.

    A single photo under another light stays as it is.

    Parameters
    ----------
    sample : CameraSample
        Of a plan of inverse pairs.

    Raises
    ------
    InputError
        If a pattern has no inverse.
    """
    pairs = find_pairs(sample.plan)
    photos = PhotosInMemory(sample.plan, sample.photos, 1.0)
    measured = sum_pairs(photos, [slice(0, photos.camera.height)])
    lamp = np.ones(len(sample.photos), dtype=np.float32)
    smooth = ndimage.median_filter(measured.light, PAIRS_OF_MEDIAN, mode="nearest")
    for pair, light in zip(pairs, smooth, strict=True):
        lamp[[pair.photo, pair.inverse]] = light
    steady = PhotosInMemory(sample.plan, sample.photos / lamp[:, None, None, None], 1.0)
    return SteadyPairs(steady, measured.noise, np.asarray((sample.photos < 1).all(axis=0)))


def are_linear(photos: SteadyPairs) -> bool:
    """Return whether most pairs sum to white and black, as where the response is linear."""
    levels = [n for pair in find_pairs(photos.plan) if pair.frequency == DC for n in pair[2:]]
    white_and_black = 2 * photos.photos.photos[levels].mean(axis=0)
    excess = (np.median(_sums(photos), axis=0) - white_and_black)[photos.unsaturated].sum()
    most = LARGEST_LINEAR_EXCESS * white_and_black[photos.unsaturated].sum()
    return bool(abs(excess) <= most)


def has_odd_pairs(photos: SteadyPairs) -> bool:
    """Return whether a pair sums to something else than the others do."""
    sums = _sums(photos)
    usual = np.median(sums, axis=0)
    variance = 2 * photos.variance(usual.reshape(-1, photos.channels) / 2).reshape(usual.shape)
    squares = (sums - usual) ** 2 / (variance + model_variance(usual))
    misfit = squares[:, photos.unsaturated].mean(axis=1)
    return bool(misfit.max() > SUSPECT_MISFIT * max(1.0, float(np.median(misfit))))


def _sums(photos: SteadyPairs) -> Floats:
    """Return the sum of each pair, (pairs, Cy, Cx, channels)."""
    pairs = find_pairs(photos.plan)
    taken = photos.photos.photos
    return np.asarray(
        taken[[pair.photo for pair in pairs]] + taken[[pair.inverse for pair in pairs]]
    )


def find_motion_by_pairs(sample: CameraSample) -> list[Moved]:
    """Find whether camera or scene moved, and before which photo.

    Parameters
    ----------
    sample : CameraSample
        Of a plan of inverse pairs.

    Returns
    -------
    list of Moved
        Empty if all was at rest, or the pairs are too few to tell.

    Raises
    ------
    InputError
        If a pattern has no inverse.
    """
    pairs = find_pairs(sample.plan)
    if len(pairs) <= 2 * FROM_THE_ENDS:
        return []
    photos = PhotosInMemory(sample.plan, sample.photos, 1.0)
    measured = sum_pairs(photos, [slice(0, photos.camera.height)])
    first, second = (
        sample.photos[numbers]
        for numbers in ([pair.photo for pair in pairs], [pair.inverse for pair in pairs])
    )
    # A lamp that changes is no motion.
    sums = ((first + second) / measured.light[:, None, None, None]).astype(np.float32)
    mean = sums.mean(axis=0)
    black = 2 * sample.photos[[pair.inverse for pair in pairs if pair.frequency == DC]].mean(axis=0)
    noise = 2 * measured.variance(mean.reshape(-1, photos.channels) / 2).reshape(mean.shape)
    variance = (noise + model_variance(mean - black)).astype(np.float32)
    variance[(sample.photos >= 1).any(axis=0)] = np.inf
    fits = Fits(
        photos=sums,
        relit=np.broadcast_to(mean, sums.shape),
        variance=np.broadcast_to(variance, sums.shape),
        black=black,
        white=mean - black,
    )
    plan = sample.plan.model_copy(update={"patterns": (WHITE,) * len(pairs)})
    equations = normal_equations(replace(sample, plan=plan, photos=sums), fits)
    return [
        replace(found, photo=pairs[found.photo].photo)
        for found in find_changes(equations, fits.misfit, np.arange(len(pairs)))
        if isinstance(found, Moved)
    ]
