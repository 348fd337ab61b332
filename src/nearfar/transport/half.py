"""Windows and bands in half precision: half the bytes, where the noise is above the rounding.

float16 keeps 11 binary digits, so rounding strays by 2^-12 / sqrt(3) of a value at the most and
0.8 times that on average over a power of 2.
"""

from dataclasses import replace

import numpy as np

from nearfar.arrays import Floats, blocks
from nearfar.transport.model import Transport

# Camera pixels at once.
BLOCK = 8192


def in_half(transport: Transport) -> Transport:
    """Return a transport whose n and f are float16; all that is computed of it is float32.

    What lies beyond float16's range of 65504 becomes infinite, which photo units never reach.
    """
    return replace(
        transport,
        near=transport.near.astype(np.float16),
        far=transport.far.astype(np.float16),
    )


def rounding_over_noise(transport: Transport) -> float:
    """Tell how far float16 strays from n and f, beside the noise that they have anyway.

    Returns
    -------
    float
        The larger of two ratios of root mean squares over the camera: of a window entry's rounding
        to its noise, sqrt(2) / W of a measurement's, and of an answer of f's to a measurement's.
        0 where nothing is rounded, infinite where there is rounding and no noise.
    """
    noise = float(np.sqrt(np.mean(transport.noise.astype(np.float64) ** 2)))
    entry_noise = noise * np.sqrt(2.0) / transport.window
    ratios = []
    for values, level in ((transport.near, entry_noise), (transport.far, noise)):
        rounding = _rounding(values)
        if rounding > 0:
            ratios.append(rounding / level if level > 0 else np.inf)
    return float(max(ratios, default=0.0))


def _rounding(values: Floats) -> float:
    """Root mean square of what rounding to float16 changes."""
    flat = values.reshape(-1, values.shape[-1])
    total = 0.0
    for block in blocks(len(flat), BLOCK):
        off = flat[block].astype(np.float16).astype(np.float32) - flat[block]
        total += float(np.sum(off.astype(np.float64) ** 2))
    return float(np.sqrt(total / max(1, flat.size)))
