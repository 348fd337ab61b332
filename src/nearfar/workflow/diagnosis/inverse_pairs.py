"""Motion during a capture of inverse pairs, by the sums of the pairs.

Every pair sums to white and black. So the sums are photos of white throughout the capture, though
white itself was photographed once. They are compared with their own mean: a response that is not
linear changes all of them alike, and is not taken for motion.
"""

from dataclasses import replace

import numpy as np

from nearfar.faults.of_photos import Moved
from nearfar.illumination.frequencies import DC
from nearfar.photometry.by_inverse import find_pairs
from nearfar.photometry.in_memory import PhotosInMemory
from nearfar.photometry.pair_sums import sum_pairs
from nearfar.plan import Sinusoid
from nearfar.workflow.diagnosis.misfit import Fits, model_variance, normal_equations
from nearfar.workflow.diagnosis.sample import CameraSample
from nearfar.workflow.diagnosis.whole_capture import FROM_THE_ENDS, find_changes

WHITE = Sinusoid(kind="cosine", frequency=DC, purpose="reference")


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
