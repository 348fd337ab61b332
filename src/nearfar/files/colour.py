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


def developed(
    picture: NDArray[np.floating[Any]],
    *,
    exposure: float = 0.0,
    gamma: float = 1.0,
    channel: int | None = None,
) -> NDArray[np.float32]:
    """Return a picture as the viewer shows it, in linear light, to be written as PNG.

    Parameters
    ----------
    picture : ndarray, shape (y, x) or (y, x, channels)
        Linear light.
    exposure : float
        In stops: each doubles the light.
    gamma : float
        On top of the sRGB curve; above 1, dark parts are lifted, and light is clipped to [0, 1].
    channel : int, optional
        The only channel to be left, as grey; of a grey picture there is only one.

    Returns
    -------
    ndarray, shape (y, x) or (y, x, channels), float32
    """
    light = np.asarray(picture, dtype=np.float32) * np.float32(2.0**exposure)
    if channel is not None and light.ndim == 3:
        light = light[..., min(channel, light.shape[2] - 1)]
    return light if gamma == 1.0 else from_srgb(to_srgb(light) ** np.float32(1 / gamma))


def luminance(rgb: NDArray[np.floating[Any]]) -> NDArray[np.float32]:
    """Luminance of linear RGB light, shape (..., 3) to (...)."""
    return np.asarray(np.asarray(rgb, dtype=np.float32) @ _LUMINANCE, dtype=np.float32)
