"""The exposure that suits a picture, by the rule that the page has too (``picture.js``)."""

import numpy as np

from nearfar.arrays import Floats

# All but one value in so many come out below white, and the brightest of these at this level.
VALUES_TO_ONE_BRIGHTER = 200
LEVEL = 0.95
# A picture is sampled down to about so many values.
SAMPLES = 20_000
LOWEST, HIGHEST = -6.0, 12.0
STEPS_IN_A_STOP = 10


def exposure_for(picture: Floats) -> float:
    """Return the exposure, in stops, at which all but one value in two hundred are below white.

    Parameters
    ----------
    picture : ndarray, shape (y, x, colours)
        Linear light, 1 at white.

    Returns
    -------
    float
        From -6 to 12 in tenths of a stop; 0 for a picture without light.
    """
    values = picture.ravel()
    sample = np.sort(values[:: max(1, values.size // SAMPLES)])
    bright = float(sample[int((1 - 1 / VALUES_TO_ONE_BRIGHTER) * (len(sample) - 1))])
    if bright <= 0:
        return 0.0
    stops = round(STEPS_IN_A_STOP * float(np.log2(LEVEL / bright))) / STEPS_IN_A_STOP
    return min(HIGHEST, max(LOWEST, stops))
