"""Colour lights, converted into one light for each channel of the camera."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from nearfar.arrays import Floats
from nearfar.errors import InputError
from nearfar.files import luminance

# Entry of a rig's description with the colour mixing that its calibration found.
MIXING = "colour_mixing"


def as_channels_see(light: Floats, channels: int, provenance: Mapping[str, Any]) -> Floats:
    """Convert a colour light into one light for each channel of the camera.

    Patterns are white, so a channel's transport is that of white light. A calibration finds which
    share of a channel's response to white is due to red, green and blue; the shares are assumed to
    be the same all over the scene. Without a calibration, a camera of three channels sees red,
    green and blue, and a camera of one channel sees luminance.

    Parameters
    ----------
    light : array, shape (Py, Px) or (Py, Px, 3)
    channels : int
        Of the transport.
    provenance : mapping
        The transport's.

    Returns
    -------
    array, shape (Py, Px) or (Py, Px, channels)

    Raises
    ------
    InputError
        If the calibration has another number of channels than the transport, or there is none and
        the camera has neither one channel nor three.
    """
    if light.ndim == 2:
        return light
    shares = mixing_of(channels, provenance)
    if shares is None and channels not in (1, 3):
        raise InputError(
            f"what {channels} channels see of red, green and blue is not known: calibrate the "
            f"rig, or give a grey light."
        )
    if shares is None:
        return luminance(light.astype(np.float32)) if channels == 1 else light
    seen = (light @ shares.T).astype(light.dtype)
    return np.asarray(seen[..., 0] if channels == 1 else seen)


def mixing_of(channels: int, provenance: Mapping[str, Any]) -> Floats | None:
    """Return the shares of red, green and blue in each channel's response to white.

    Parameters
    ----------
    channels : int
        Of the transport.
    provenance : mapping
        The transport's.

    Returns
    -------
    ndarray, shape (channels, 3), float64, or None
        Rows sum to 1. None without a calibration.

    Raises
    ------
    InputError
        If the calibration has another number of channels than the transport.
    """
    rig = provenance.get("rig")
    mixing = rig.get(MIXING) if isinstance(rig, Mapping) else None
    if mixing is None:
        return None
    shares = np.asarray(mixing, dtype=np.float64)
    if shares.shape != (channels, 3) or not (shares.sum(axis=1) > 0).all():
        raise InputError(
            f"the transport has {channels} channels, and the colour mixing of its rig is of shape "
            f"{shares.shape}: calibrate the rig again."
        )
    return np.asarray(shares / shares.sum(axis=1, keepdims=True))
