"""Lights resized to another projector's pixels."""

import numpy as np

from nearfar.arrays import Floats, Size


def resize_light(light: Floats, size: Size) -> Floats:
    """Return a light on another number of pixels, each the mean of what it covers.

    Parameters
    ----------
    light : ndarray, shape (height, width) or (height, width, channels)
    size : Size

    Returns
    -------
    ndarray, shape (*size,) or (*size, channels), float32
        Its mean is that of the light.
    """
    down, across = (_means(old, new) for old, new in zip(light.shape[:2], size, strict=True))
    planes = np.moveaxis(np.asarray(light, dtype=np.float32).reshape(*light.shape[:2], -1), 2, 0)
    resized = np.moveaxis(np.stack([down @ plane @ across.T for plane in planes]), 0, 2)
    return np.asarray(resized.reshape(*size, *light.shape[2:]))


def _means(old: int, new: int) -> Floats:
    """Return the matrix (new, old) of means along one axis, float32."""
    ends = np.arange(new + 1) * (old / new)
    pixels = np.arange(old)
    high = np.minimum(ends[1:, None], pixels + 1)
    low = np.maximum(ends[:-1, None], pixels)
    return np.asarray(np.maximum(high - low, 0.0) * (new / old), dtype=np.float32)
