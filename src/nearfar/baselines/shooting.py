"""Photos that an adaptive method asks for one batch after the other, up to a number of them."""

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Floats, Size
from nearfar.errors import InputError
from nearfar.rigs.base import Rig


class Shooting:
    """A rig with a number of photos that may be taken.

    Each photo counts, that of black too, and each has noise of its own, however the photos are
    asked for.

    Parameters
    ----------
    rig : Rig
    photos : int
        How many may be taken.

    Attributes
    ----------
    taken : int
        Photos so far.
    """

    def __init__(self, rig: Rig, photos: int) -> None:
        self._rig = rig
        self._photos = photos
        self._camera: Size | None = None
        self.taken = 0

    @property
    def projector(self) -> Size:
        """Pattern grid."""
        return self._rig.projector

    @property
    def camera(self) -> Size:
        """Height and width of the photos, known once there is one.

        Raises
        ------
        InputError
            If no photo was taken yet.
        """
        if self._camera is None:
            raise InputError("no photo was taken yet, so its size is not known: shoot one first.")
        return self._camera

    @property
    def left(self) -> int:
        """How many photos may still be taken."""
        return self._photos - self.taken

    def shoot(self, patterns: NDArray[np.uint8]) -> Floats:
        """Take a photo of each pattern.

        Parameters
        ----------
        patterns : ndarray, shape (n, Py, Px), uint8

        Returns
        -------
        ndarray, shape (n, C, channels), float32
            In photo units, ambient light and black level included.

        Raises
        ------
        InputError
            If that is more photos than are left.
        """
        if len(patterns) > self.left:
            raise InputError(
                f"{len(patterns)} more photos were asked for, and {self.left} of {self._photos} "
                f"are left: ask for no more, or allow more."
            )
        shot = []
        for photo in self._rig.shoot(iter(patterns), self.taken):
            self._camera = Size(*photo.shape[:2])
            shot.append(photo.reshape(-1, photo.shape[2]).astype(np.float32))
        self.taken += len(shot)
        return np.stack(shot) / np.float32(self._rig.full_scale)
