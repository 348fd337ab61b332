"""Colour: the sRGB curve (IEC 61966-2-1) and the luminance of linear Rec. 709 light."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

_LUMINANCE = np.array([0.2126, 0.7152, 0.0722], dtype=np.float32)


def to_srgb(linear: NDArray[np.floating[Any]]) -> NDArray[np.float32]:
    """Encode linear light by the sRGB curve, clipped to [0, 1], any shape."""
    light = np.clip(np.asarray(linear, dtype=np.float32), 0.0, 1.0)
    curve = 1.055 * np.power(light, np.float32(1 / 2.4)) - 0.055
    return np.asarray(np.where(light <= 0.0031308, 12.92 * light, curve), dtype=np.float32)


def from_srgb(encoded: NDArray[np.floating[Any]]) -> NDArray[np.float32]:
    """Decode sRGB values in [0, 1] into linear light, any shape."""
    value = np.asarray(encoded, dtype=np.float32)
    curve = np.power((np.maximum(value, 0) + 0.055) / 1.055, np.float32(2.4))
    return np.asarray(np.where(value <= 0.04045, value / 12.92, curve), dtype=np.float32)


def luminance(rgb: NDArray[np.floating[Any]]) -> NDArray[np.float32]:
    """Luminance of linear RGB light, shape (..., 3) to (...)."""
    return np.asarray(np.asarray(rgb, dtype=np.float32) @ _LUMINANCE, dtype=np.float32)
