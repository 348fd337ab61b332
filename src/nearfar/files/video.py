"""Films: pictures one after the other in an MP4 file, compressed as VP9.

Chromium, Firefox and common players show VP9 in MP4. OpenCV's wheels have an encoder of it, and
none of H.264, for its licence.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from nearfar.errors import StorageError
from nearfar.packages import needed

CODEC = "vp09"
# Smaller pictures are enlarged by a whole number: players would blur them, and colour is stored at
# every second pixel.
SMALLEST_ROWS = 480


class AddPicture(Protocol):
    """What adds a picture to a film."""

    def __call__(self, picture: NDArray[np.uint8], /) -> None:
        """Add a picture, sRGB, shape (y, x) or (y, x, 3), of the size of those before."""
        ...


def enlarged(picture: NDArray[Any]) -> NDArray[Any]:
    """Return a picture as a film has it: (y, x, 3), large enough, with even sides.

    Pixels become squares of a whole number of pixels; a row and a column that are missing to even
    sides repeat those before.
    """
    colours = np.broadcast_to(np.atleast_3d(picture), (*picture.shape[:2], 3))
    factor = -(-SMALLEST_ROWS // picture.shape[0])
    large = colours.repeat(factor, axis=0).repeat(factor, axis=1)
    odd = [(0, side % 2) for side in large.shape[:2]]
    return np.pad(large, (*odd, (0, 0)), mode="edge")


@contextmanager
def new_film(path: Path, rate: float) -> Iterator[AddPicture]:
    """Write a film, whose size is that of its first picture.

    Parameters
    ----------
    path : Path
        Ends in .mp4.
    rate : float
        Pictures a second.

    Yields
    ------
    callable
        Adds a picture.

    Raises
    ------
    MissingPackageError
        Without OpenCV.
    StorageError
        If the film cannot be written.
    """
    with needed(extra="film", what="a film"):
        import cv2
    writer = cv2.VideoWriter()

    def add(picture: NDArray[np.uint8]) -> None:
        frame = enlarged(picture)
        if not writer.isOpened():
            height, width = frame.shape[:2]
            code = cv2.VideoWriter.fourcc(*CODEC)
            if not writer.open(str(path), cv2.CAP_FFMPEG, code, rate, (width, height)):
                raise StorageError(
                    f"OpenCV cannot write {path.name} as VP9: choose a folder that can be written "
                    f"to, or install opencv-python-headless."
                )
        writer.write(np.ascontiguousarray(frame[..., ::-1]))

    try:
        yield add
    finally:
        writer.release()
