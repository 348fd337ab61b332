"""The error that the place of direct light is expected to make of a random light, beyond pitch 1.

There a light is as fine as the projector's pixels, and direct light that is looked up beside its
place is wrong by as much as light differs there. The plan's frequencies determine how precisely
the place is known. The footprint of a camera pixel determines how much the light differs there.

Index convention: k runs over frequencies.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from nearfar.arrays import Floats, Size
from nearfar.illumination.frequencies import Frequency, as_array
from nearfar.plan.expect import RANDOM_VARIANCE, TYPICAL_DIRECT_DEVIATION, ExpectedErrors

# Side of the box that a camera pixel sees of the projector, in projector pixels. In the built-in
# scenes it is a third of one to twelve.
TYPICAL_BOX = 1.0
# Standard deviation of q on each axis that no photo lowers, in projector pixels: measured on curved
# surfaces (docs/decisions/0045), where noise alone would leave 0.006.
Q_DEVIATION_FLOOR = 0.01


class DirectDeviation(NamedTuple):
    """Standard deviations of direct light that the frequencies above the cells' leave.

    Attributes
    ----------
    q : ndarray, shape (2,)
        Of its place on each axis, in projector pixels.
    amount : float
        Of how much there is, as a share of white.
    """

    q: Floats
    amount: float


def direct_deviation(
    times: Mapping[Frequency, int], projector: Size, noise: float
) -> DirectDeviation:
    """Return how well frequencies that direct light alone answers tell it.

    Its response is d B(k) exp(-j 2 pi k.q), B that of a box of `TYPICAL_BOX`. The phase has the
    Fisher information (2 pi k)^2 d^2 B^2 / noise^2 of q on each axis, the modulus B^2 / noise^2 of
    d; the two are at right angles, so that neither takes from the other. Before, q is known to a
    pixel and d as in the typical scenes.

    Parameters
    ----------
    times : mapping
        How often each frequency is photographed.
    projector : Size
    noise : float
        Standard deviation of a response, as a share of white.
    """
    cycles = as_array(list(times)).reshape(-1, 2)
    seen = np.prod(np.sinc(TYPICAL_BOX * cycles), axis=1) ** 2 * np.array(list(times.values()))
    of_phase = (2 * np.pi * TYPICAL_DIRECT_DEVIATION / noise) ** 2 * (seen @ cycles**2)
    q = np.sqrt(1.0 / (1.0 + of_phase) + Q_DEVIATION_FLOOR**2)
    of_modulus = 1.0 / TYPICAL_DIRECT_DEVIATION**2 + seen.sum() / noise**2
    return DirectDeviation(q * (np.array(projector) > 1), float(of_modulus**-0.5))


def random_errors_of_direct(deviation: DirectDeviation) -> float:
    """Return the squared error under a random light that direct light makes by its deviations.

    A box of side w sees the mean of the light that it covers. Of w projector pixels in a row, not
    rounded to whole ones, that has the variance (w - 1/3) / w^2 of a single pixel's (1 - w / 3 for
    w up to 1). It changes with q by the difference of what enters and what leaves, over w.
    """
    w = TYPICAL_BOX
    of_row = (w - 1.0 / 3.0) / w**2 if w > 1 else 1.0 - w / 3.0
    axes = int(np.count_nonzero(deviation.q))
    across = of_row ** (axes - 1)
    slope = 2.0 * RANDOM_VARIANCE * across / max(w, w**2)
    of_place = TYPICAL_DIRECT_DEVIATION**2 * slope * float(np.sum(deviation.q**2))
    return of_place + deviation.amount**2 * RANDOM_VARIANCE * of_row**axes


def errors_under_lights(
    errors: ExpectedErrors,
    times: Mapping[Frequency, int],
    projector: Size,
    pitch: int,
    noise: float,
) -> Floats:
    """Return the expected squared errors of pictures and of a random light, (scenes, 2).

    Parameters
    ----------
    errors : ExpectedErrors
    times : mapping
        How often each frequency is photographed.
    projector : Size
    pitch : int
        At 1, the errors are as they are: those that q makes are in what relighting reached. Beyond
        it light is as fine as the projector's pixels. A random light differs from each pixel to
        the next: near- and far-range light answer the part of its variance that lies below the
        cells' half cycle, and direct light all. Pictures differ at few edges: q hardly counts.
    noise : float
        Standard deviation of a response, as a share of white.
    """
    found = errors.errors()
    if pitch > 1:
        high = {k: count for k, count in times.items() if max(map(abs, k)) * pitch > 0.5}
        found[:, 1] /= pitch ** np.count_nonzero(np.array(projector) > 1)
        found[:, 1] += random_errors_of_direct(direct_deviation(high, projector, noise))
    return found
