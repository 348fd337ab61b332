"""Camera raw files: the sensor's own numbers, which are linear, through LibRaw."""

import io
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from nearfar.errors import UnreadableFileError
from nearfar.files.mosaic import CELLS, bin_mosaic
from nearfar.packages import needed


class RawPhoto(NamedTuple):
    """The content of a raw file.

    Attributes
    ----------
    levels : array, shape (Cy, Cx, 3)
        uint16; each 2x2 cell of the sensor's mosaic is one pixel, black level included.
    white : float
        Level at which the sensor is saturated.
    """

    levels: NDArray[np.uint16]
    white: float


def decode_raw(data: bytes, name: str | Path) -> RawPhoto:
    """Decode a camera raw file.

    Parameters
    ----------
    data : bytes
    name : str or Path
        What a message calls it.

    Raises
    ------
    MissingPackageError
        If rawpy is not installed.
    UnreadableFileError
        If it is damaged, not a raw file, or its sensor has no mosaic of red, green and blue.
    """
    with needed(extra="raw", what="a camera raw file"):
        import rawpy
    try:
        with rawpy.imread(io.BytesIO(data)) as raw:
            pattern: Any = raw.raw_pattern
            colours = raw.color_desc.decode()
            white = max(int(raw.white_level), 1)
            # Some sensors give levels above this, where they are no longer linear.
            mosaic = np.minimum(raw.raw_image_visible, white).astype(np.uint16)
    except (rawpy.LibRawError, ValueError) as error:
        detail = error.args[0] if error.args else error
        reason = detail.decode(errors="replace") if isinstance(detail, bytes) else str(detail)
        raise UnreadableFileError(
            f"{name} is no camera raw file that can be read ({reason}): copy it again, or develop "
            f"it to a linear 16-bit TIFF."
        ) from None
    cell = "".join(colours[i] for i in pattern.reshape(-1)) if pattern is not None else ""
    if cell not in CELLS:
        raise UnreadableFileError(
            f"{name} is of a sensor without 2x2 cells of red, green and blue: develop it to a "
            f"linear 16-bit TIFF."
        )
    return RawPhoto(bin_mosaic(mosaic, cell, white), float(white))
