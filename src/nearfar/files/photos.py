"""A camera's photos as files, of any kind that cameras give."""

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from nearfar.files.images import (
    JPEG_SIGNATURE,
    decode_jpeg,
    decode_picture,
    full_scale_of,
    is_raw,
)
from nearfar.files.raw import decode_raw


class CameraFile(NamedTuple):
    """A photo that a camera gave as a file.

    Attributes
    ----------
    levels : array, shape (Cy, Cx, channels)
    full_scale : float
        Level at which it is saturated.
    linear : bool
        False for a JPEG: its levels are those of a screen, not the light's.
    """

    levels: NDArray[Any]
    full_scale: float
    linear: bool


def decode_camera_file(data: bytes, name: Path) -> CameraFile:
    """Decode a raw file, a picture as `nearfar.files.read_picture` reads it, or a JPEG.

    Raises
    ------
    UnreadableFileError, InputError, MissingPackageError
        As `nearfar.files.read_picture`.
    """
    if data.startswith(JPEG_SIGNATURE):
        return CameraFile(np.atleast_3d(decode_jpeg(data, name)), 255.0, linear=False)
    if is_raw(name):
        levels, white = decode_raw(data, name)
        return CameraFile(levels, white, linear=True)
    levels = np.atleast_3d(decode_picture(data, name))
    return CameraFile(levels, full_scale_of(levels.dtype), linear=True)
