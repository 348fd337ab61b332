"""n and f in half precision, which takes half the bytes, and the rounding error beside the noise.

float16 has 11 significant bits: the root mean square of its rounding error is at most
2^-12 / sqrt(3) of a value, and 0.8 times that on average over a power of 2.
"""

from dataclasses import replace

import numpy as np

from nearfar.arrays import Floats, blocks
from nearfar.transport.model import Transport

# Camera pixels of a batch.
BATCH_PIXELS = 8192


def in_half(transport: Transport) -> Transport:
    """Return a transport whose n and f are float16; what is computed from them is float32.

    Values above 65504 would become infinite, but photo units never reach them.
    """
    return replace(
        transport,
        near=transport.near.astype(np.float16),
        far=transport.far.astype(np.float16),
    )


def rounding_over_noise(transport: Transport) -> float:
    """Return the rounding error of n and f in float16 as a share of their noise.

    Returns
    -------
    float
        The larger of two ratios of root mean squares over the camera. For n it is the rounding
        error of a window entry over its noise, which is sqrt(2) / W times that of a measurement;
        for f the rounding error of a response over the noise of a measurement. 0 where no value
        is rounded, infinite where values are rounded and have no noise.
    """
    noise = float(np.sqrt(np.mean(transport.noise.astype(np.float64) ** 2)))
    entry_noise = noise * np.sqrt(2.0) / max(1, transport.window)
    ratios = []
    for values, level in ((transport.near, entry_noise), (transport.far, noise)):
        rounding = _rounding(values)
        if rounding > 0:
            ratios.append(rounding / level if level > 0 else np.inf)
    return float(max(ratios, default=0.0))


def _rounding(values: Floats) -> float:
    """Return the root mean square of the rounding error in float16."""
    if not values.size:
        return 0.0
    flat = values.reshape(-1, values.shape[-1])
    total = 0.0
    for batch in blocks(len(flat), BATCH_PIXELS):
        off = flat[batch].astype(np.float16).astype(np.float32) - flat[batch]
        total += float(np.sum(off.astype(np.float64) ** 2))
    return float(np.sqrt(total / max(1, flat.size)))
