"""A shoot of patterns: stale photos are taken again, and changes of light are followed.

Index convention: patterns are (Py, Px) or (Py, Px, 3), photos (Cy, Cx, channels) in raw levels.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Size
from nearfar.errors import DeviceError
from nearfar.faults.records import (
    InverseDoesNotAdd,
    LightChange,
    LightChanged,
    LightChangedBefore,
    PatternsIndistinguishable,
    PhotoTakenAgain,
)
from nearfar.rigs.base import MAXIMUM_TRIES, Photo
from nearfar.rigs.real.alarms import AlarmLog
from nearfar.rigs.real.black_and_white import (
    BlackAndWhite,
    Levels,
    agree_in_mean,
    measure_black_and_white,
)
from nearfar.rigs.real.light import ExpectedLight
from nearfar.rigs.real.shutter import Shutter
from nearfar.rigs.real.stale import StalePhotos
from nearfar.rigs.real.superposition import halves


class CheckedShoot:
    """Photographs patterns one by one, and checks each photo.

    Parameters
    ----------
    shutter : Shutter
    draw : callable
        Draws the frame of an 8-bit pattern.
    projector : Size
        Pattern grid.
    levels : BlackAndWhite
        What black and white look like now.
    alarms : AlarmLog
    first : int
        Number of the first photo in its plan.
    """

    def __init__(
        self,
        shutter: Shutter,
        draw: Callable[[NDArray[np.uint8]], NDArray[np.uint8]],
        projector: Size,
        levels: BlackAndWhite,
        alarms: AlarmLog,
        first: int = 0,
    ) -> None:
        self._shutter, self._draw, self._alarms = shutter, draw, alarms
        self._levels = levels
        self._stale, self._light = StalePhotos(levels), ExpectedLight(levels, first)
        self._projector = projector
        self._black, self._white = (np.full(projector, v, dtype=np.uint8) for v in (0, 255))

    def begin_after_halves(self, left: Levels, right: Levels) -> None:
        """Begin after photos of the left half of white and then of the right."""
        self._stale.learn_direct_bands(left, right)
        self._stale.begin_after(halves(self._projector)[1], right)

    def photograph(self, number: int, pattern: NDArray[np.uint8]) -> Photo:
        """Photograph a pattern; again, by way of black or white, while the photo looks stale.

        Raises
        ------
        DeviceError
            If it looks stale time and again, or is lost.
        """
        frame = self._draw(pattern)
        photo = self._shutter.photograph(frame, number=number)
        reason = self._stale.suspect(_grey(pattern), photo)
        if reason is not None:
            photo = self._photograph_again(number, pattern, photo, reason)
        return photo

    def follow_light(self, number: int, pattern: NDArray[np.uint8], photo: Photo) -> None:
        """Take in a photo of its pattern, and find by black and white what light has changed."""
        grey = _grey(pattern)
        self._stale.accept(grey, photo)
        deviation = self._light.compare(number, grey, photo)
        if deviation is None:
            return
        now = self._measure_levels()
        change = self._levels.change_to(now)
        if change is None and deviation.is_by_inverse:
            self._alarms.add(InverseDoesNotAdd(number, deviation.share))
            self._light.ignore_inverses()
        else:
            change = change or LightChange("any", deviation.share)
            self._alarms.add(LightChanged(change, deviation.last_good, number))
        self._go_on_from(now)

    def _photograph_again(
        self, number: int, pattern: NDArray[np.uint8], suspect: Photo, reason: str
    ) -> Photo:
        shutter = self._shutter
        # After black or white, whichever is unlike the pattern, a photo of it differs everywhere.
        is_bright = pattern.mean() > 127
        away, other = (self._draw(p) for p in (self._black, self._white)[:: 1 if is_bright else -1])
        for _ in range(MAXIMUM_TRIES):
            between = shutter.photograph(away, shutter.flush, number=number)
            photo = shutter.photograph(self._draw(pattern), shutter.flush, number=number)
            known = self._levels.black if is_bright else self._levels.white
            if not self._levels.has_mean_of(known, between):
                # The light may have changed since black and white were measured.
                self._measure_levels_again(number)
                continue
            if self._stale.repeated(photo, between) is not None:
                # The pattern may be as black, or as white, where the camera looks: bits of Gray
                # code are. Then its photo is the same by way of the other; an old part is not.
                shutter.photograph(other, shutter.flush, number=number)
                again = shutter.photograph(self._draw(pattern), shutter.flush, number=number)
                if not self._levels.is_same_light(photo, again):
                    continue
            if self._levels.is_same_light(suspect, photo):
                self._stale.accept_suspect()
                if self._stale.is_too_coarse:
                    self._alarms.add(PatternsIndistinguishable(number))
            else:
                self._alarms.add(PhotoTakenAgain(number, reason))
            return photo
        raise DeviceError(
            f"photo {number} could not be taken: {reason}, {MAXIMUM_TRIES + 1} times: look at the "
            f"projector's picture and at the camera's."
        )

    def _measure_levels_again(self, number: int) -> None:
        """Measure black and white again, and go on from them where they have changed."""
        try:
            now = self._measure_levels()
        except DeviceError:
            # A camera that repeats one photo for ever shows neither black nor white.
            return
        change = self._levels.change_to(now)
        if change is not None:
            self._alarms.add(LightChangedBefore(change, number))
            self._go_on_from(now)

    def _measure_levels(self) -> BlackAndWhite:
        shutter = self._shutter
        frames = [self._draw(self._black), self._draw(self._white)]
        for _ in range(MAXIMUM_TRIES):
            darks, lights = (
                [shutter.photograph(frame, shutter.flush) for _ in range(2)] for frame in frames
            )
            if agree_in_mean(darks, lights):
                break
        return measure_black_and_white(darks, lights)

    def _go_on_from(self, levels: BlackAndWhite) -> None:
        self._levels = self._stale.levels = levels
        self._light.start_again(levels)
        # White was displayed last.
        self._stale.begin_after(self._white, levels.white)


def _grey(pattern: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return the mean of a pattern's colours, (Py, Px)."""
    if pattern.ndim == 2:
        return pattern
    return np.asarray(np.rint(pattern.mean(axis=2)), dtype=np.uint8)
