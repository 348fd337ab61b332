"""Flat fields: how bright the pixels of a camera or a projector are where all should be alike."""

from dataclasses import dataclass

import numpy as np

from nearfar.arrays import Floats, Size
from nearfar.checks import as_light
from nearfar.errors import InputError


@dataclass(frozen=True, eq=False)
class FlatFields:
    """Flat fields of a camera and a projector, each over its mean.

    Attributes
    ----------
    camera, projector : ndarray, shape (y, x, 1 or channels), float32
        (1, 1, 1) where there is none.
    """

    camera: Floats
    projector: Floats


def flat_fields(
    camera_flat: Floats | None,
    projector_flat: Floats | None,
    camera: Size,
    projector: Size,
    channels: int,
) -> FlatFields:
    """Return flat fields over their means.

    Parameters
    ----------
    camera_flat, projector_flat : ndarray, shape (y, x) or (y, x, channels), or None
        In any unit.
    camera, projector : Size
    channels : int

    Raises
    ------
    InputError
        If one has another size or other channels, or values that are not finite and above 0.
    """
    return FlatFields(
        _over_mean(camera_flat, camera, channels, "camera"),
        _over_mean(projector_flat, projector, channels, "projector"),
    )


def _over_mean(flat: Floats | None, size: Size, channels: int, side: str) -> Floats:
    if flat is None:
        return np.ones((1, 1, 1), dtype=np.float32)
    name = f"flat field of the {side}"
    field = as_light(flat, size, channels, name=name, side=side).reshape(*size, -1)
    if field.min() <= 0:
        raise InputError(
            f"the {name} has values of 0 or below, by which nothing can be divided: give one that "
            f"is bright everywhere."
        )
    return np.asarray(field / field.mean(axis=(0, 1)), dtype=np.float32)
