"""One photo of one frame: displayed, settled, exposed, and taken again if it is lost.

Index convention: frames are (height, width) or (height, width, 3), 8 bits; photos (Cy, Cx,
channels), raw levels.
"""

import math

import numpy as np
from numpy.typing import NDArray

from nearfar.errors import DeviceError, LostPhotoError
from nearfar.faults.records import PhotoTakenAgain
from nearfar.rigs.base import MAXIMUM_TRIES, Photo
from nearfar.rigs.cameras.base import Camera
from nearfar.rigs.real.alarms import AlarmLog
from nearfar.rigs.screens import Screen

# Refreshes after which no older frame or photo is still on its way.
FLUSH_REFRESHES = 12


class Shutter:
    """Displays frames and photographs each once it has settled.

    Parameters
    ----------
    screen : Screen
    camera : Camera
    settle : int
        Refreshes from the display of a frame to the exposure; may be set anew.
    alarms : AlarmLog
        Where photos that were taken again are noted.
    """

    def __init__(self, screen: Screen, camera: Camera, settle: int, alarms: AlarmLog) -> None:
        self.settle = settle
        self._screen, self._camera, self._alarms = screen, camera, alarms
        self._form: str | None = None

    @property
    def flush(self) -> int:
        """Refreshes after which nothing older is on its way, and a frame has settled."""
        return max(FLUSH_REFRESHES, self.settle)

    def photograph(
        self, frame: NDArray[np.uint8], settle: int | None = None, *, number: int | None = None
    ) -> Photo:
        """Photograph a frame; again if the photo is lost.

        Parameters
        ----------
        frame : array, shape (height, width) or (height, width, 3)
        settle : int, optional
            Refreshes to wait, where not the usual ones.
        number : int, optional
            The photo's in its plan, for the alarm if it had to be taken again.

        Raises
        ------
        DeviceError
            If it is lost time and again.
        """
        for tries_left in reversed(range(MAXIMUM_TRIES)):
            try:
                return self._expose(frame, settle)
            except LostPhotoError as error:
                if not tries_left:
                    raise DeviceError(f"{error} It was tried {MAXIMUM_TRIES} times.") from None
                if number is not None:
                    self._alarms.add(PhotoTakenAgain(number, str(error)))
                self._screen.wait(FLUSH_REFRESHES * self._screen.period)
        raise AssertionError

    def _expose(self, frame: NDArray[np.uint8], settle: int | None) -> Photo:
        self._screen.show(frame)
        self._screen.wait((self.settle if settle is None else settle) * self._screen.period)
        wanted = self._camera.exposure
        photo = self._camera.photograph()
        form = f"{photo.shape} of {photo.dtype}"
        if self._form is None:
            self._form = form
        elif form != self._form:
            raise LostPhotoError(
                f"a photo of {self._camera.name} is {form}, and those before {self._form}: leave "
                f"the camera's settings as they are."
            )
        real = self._camera.conditions().get("exposure")
        if wanted is not None and real is not None and not math.isclose(real, wanted, rel_tol=1e-3):
            self._camera.set_exposure(wanted)
            raise LostPhotoError(
                f"{self._camera.name} exposed {real:g} s instead of {wanted:g} s: let no other "
                f"program set it, and turn its automatic exposure off."
            )
        return photo
