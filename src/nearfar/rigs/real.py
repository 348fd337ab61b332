"""A real rig: a screen and a camera in step, each photo checked before it counts.

Index convention: patterns are (Py, Px), photos (Cy, Cx, channels) in raw levels.
"""

import math
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Size
from nearfar.errors import DeviceError, LostPhotoError
from nearfar.illumination.frames import Shown, fit_frame
from nearfar.rigs.base import Photo
from nearfar.rigs.calibration import Calibration
from nearfar.rigs.cameras.base import Camera
from nearfar.rigs.linear import LinearProjector, identity
from nearfar.rigs.screens import Monitor, Screen
from nearfar.rigs.watch import Change, Ends, Watch, are_alike, difference, look_at_ends, shows

# A photo is tried so often before the capture is stopped.
TRIES = 6
# Refreshes after which any projector has settled.
LONGEST_SETTLE = 32
# Refreshes to let what was on its way pass by, before a photo is taken again.
PAUSE = 12
# Two halves of white that miss it by more than this share are told.
SUPERPOSITION = 0.02


class RealRig:
    """A projector's screen and a camera.

    It is a context: leaving it gives both back.

    Parameters
    ----------
    screen : Screen
    camera : Camera
    projector : Size
        Pattern grid.
    calibration : Calibration, optional
        Response of the projector and levels of the camera; without one both are taken as linear.
    scale : int, optional
        Side of a pattern pixel on the screen; the largest that fits if left out.
    brightness : float
        Light of a white pattern over the projector's full white.
    settle : int
        Refreshes from a pattern's appearance to the exposure; longer where photos show that it
        takes longer.
    exposure : float, optional
        In seconds, rounded to whole refreshes; chosen by white's photo if left out.
    on_alarm : callable, optional
        Called with each alarm, a sentence.
    on_start : callable, optional
        Called before the first photo with the seconds that each will take.

    Raises
    ------
    InputError
        If the pattern grid does not fit on the screen, or the camera cannot expose so long.
    DeviceError
        If white does not fit the camera at any exposure.
    """

    def __init__(
        self,
        screen: Screen,
        camera: Camera,
        projector: Size,
        *,
        calibration: Calibration | None = None,
        scale: int | None = None,
        brightness: float = 1.0,
        settle: int = 2,
        exposure: float | None = None,
        on_alarm: Callable[[str], None] | None = None,
        on_start: Callable[[float], None] | None = None,
    ) -> None:
        self._screen, self.camera, self._projector = screen, camera, projector
        self.shown: Shown = fit_frame(projector, scale, screen.monitor.size)
        response = calibration.response_table() if calibration else identity()
        self._linear = LinearProjector(response, self.shown, brightness)
        self._brightness, self._settle = brightness, settle
        self._calibrated = calibration.made if calibration else None
        self._mixing = [list(row) for row in calibration.mixing] if calibration else None
        if calibration is not None:
            camera.sensor = calibration.sensor
        self._on_alarm = on_alarm or (lambda _alarm: None)
        self._on_start = on_start or (lambda _seconds: None)
        self.alarms: list[str] = []
        self._like = ""
        self._conditions: dict[str, float] = {}
        self._set_exposure(exposure)
        self._devices = ExitStack()
        self._devices.callback(camera.close)
        self._devices.callback(screen.close)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_fault: object) -> None:
        self.close()

    def close(self) -> None:
        """Give the projector and the camera back."""
        self._devices.close()

    @property
    def notes(self) -> tuple[str, ...]:
        """What a user should know of the rig before photos are taken: nothing."""
        return ()

    @property
    def projector(self) -> Size:
        """Pattern grid."""
        return self._projector

    @property
    def monitor(self) -> Monitor:
        """What the projector is connected to."""
        return self._screen.monitor

    @property
    def full_scale(self) -> float:
        """Level of the camera that stands for 1."""
        return self.camera.full_scale

    @property
    def refresh(self) -> float:
        """Seconds from one refresh of the projector to the next."""
        return self._screen.period

    def describe(self) -> dict[str, Any]:
        """Tell what the capture remembers: what stays as it is from photo to photo."""
        monitor = self._screen.monitor
        return {
            "kind": "real",
            "projector": {
                "monitor": monitor.name,
                "size": list(monitor.size),
                "refresh": monitor.refresh,
                "scale": self.shown.scale,
                "brightness": self._brightness,
            },
            "camera": self.camera.describe(),
            "exposure": self.camera.exposure,
            "calibration": self._calibrated,
            # What relighting in colour goes by.
            "colour_mixing": self._mixing,
        }

    def conditions(self) -> dict[str, float]:
        """Tell of the last photo what may change, such as temperatures in degrees Celsius."""
        return self._conditions

    def shoot(self, patterns: Iterable[NDArray[np.uint8]], first: int = 0) -> Iterator[Photo]:
        """Show each 8-bit pattern and yield its photo, (Cy, Cx, channels), in order.

        First of all black, white and halves are shown: whether photos follow the projector, how
        long it takes to settle, and whether light adds up.

        Raises
        ------
        DeviceError
            If the projector or the camera does not do what it should.
        KeyboardInterrupt
            If Esc was pressed.
        """
        watch = Watch(self.in_step(), first)
        self._add_up(watch)
        for number, pattern in enumerate(patterns, first):
            photo = self._of_pattern(number, pattern, watch)
            self._conditions = self.camera.conditions()
            change = watch.accept(number, pattern, photo)
            if change is not None:
                self._tell_of_change(number, change, watch)
            yield photo

    def photograph(
        self, frame: NDArray[np.uint8], settle: int | None = None, *, number: int | None = None
    ) -> Photo:
        """Show a frame as it is, wait until it has settled, and take a photo; again if it is lost.

        Parameters
        ----------
        frame : array, shape (height, width) or (height, width, 3)
        settle : int, optional
            Refreshes to wait.
        number : int, optional
            The photo's, for the alarm if it had to be taken again.

        Raises
        ------
        DeviceError
            If it is lost time and again.
        """
        for left in reversed(range(TRIES)):
            try:
                return self._expose(frame, settle)
            except LostPhotoError as error:
                if not left:
                    raise DeviceError(f"{error} It was tried {TRIES} times.") from None
                if number is not None:
                    self._note(f"photo {number} was taken again: {error}")
                self._screen.wait(PAUSE * self.refresh)
        raise AssertionError

    def show_levels(self, levels: tuple[int, int, int]) -> Photo:
        """Fill the pattern grid with levels of red, green and blue, as they are; photograph it."""
        height, width = (self.shown.scale * side for side in self._projector)
        top, left = ((a - b) // 2 for a, b in zip(self.shown.frame, (height, width), strict=True))
        frame = np.zeros((*self.shown.frame, 3), dtype=np.uint8)
        frame[top : top + height, left : left + width] = levels
        return self.photograph(frame)

    def wait(self, seconds: float) -> None:
        """Let time pass; raises KeyboardInterrupt if Esc was pressed."""
        self._screen.wait(seconds)

    def whole_refreshes(self, seconds: float) -> float:
        """Round an exposure to whole refreshes of the projector, one at least."""
        if _is_whole(seconds, self.refresh):
            # As it was asked for, or as a capture was begun.
            return seconds
        return max(1, round(seconds / self.refresh)) * self.refresh

    def frame(self, level: int) -> NDArray[np.uint8]:
        """Draw a pattern of one level, linear."""
        return self._linear.draw(np.full(self._projector, level, dtype=np.uint8))

    def _set_exposure(self, wanted: float | None) -> None:
        camera, refresh = self.camera, self.refresh
        if wanted is not None:
            camera.set_exposure(self.whole_refreshes(wanted))
        elif camera.exposure_limits is not None:
            self._screen.show(self.frame(255))
            self._screen.wait(max(LONGEST_SETTLE, self._settle) * refresh)
            camera.expose_for_light(self.whole_refreshes)
        if camera.exposure is not None and not _is_whole(camera.exposure, refresh):
            self._alarm(
                f"{camera.name} exposes {camera.exposure:g} s, which is not a whole number of the "
                f"projector's refreshes of {refresh:.5g} s: brightness may beat from photo to "
                f"photo; choose another exposure, or close the aperture for a longer one."
            )

    def in_step(self) -> Ends:
        """Find after how long photos follow the projector, and what black and white are like.

        Raises
        ------
        DeviceError
            If they do not, or white is no brighter than black.
        """
        white, black = self.frame(255), self.frame(0)
        while True:
            long = max(LONGEST_SETTLE, self._settle)
            darks = [self.photograph(black, long)]
            soon = self.photograph(white)
            lights = [self.photograph(white, long), self.photograph(white)]
            darks.append(self.photograph(black, long))
            ends = look_at_ends(darks, lights)
            # A bad frame here would spoil all that follows.
            if are_alike(darks, lights) and Watch(ends).agrees(soon, lights[0]):
                return ends
            if self._settle >= LONGEST_SETTLE:
                raise DeviceError(
                    f"photos do not follow the patterns even {LONGEST_SETTLE} refreshes after "
                    f"they are shown, or the light is not steady: turn the camera's buffering, and "
                    f"what dims projector or room, off."
                )
            self._settle = max(1, 2 * self._settle)

    def _add_up(self, watch: Watch) -> None:
        """See whether the light of two patterns is that of their sum."""
        if not self.camera.linear:
            self._alarm(
                f"{self.camera.name} gives JPEGs, whose 8 bits are a screen's and not the light's: "
                f"set it to raw."
            )
        ends = watch.ends
        left = np.zeros(self._projector, dtype=np.uint8)
        left[:, : self._projector.width // 2] = 255
        sums = {
            "127 and 128 of 255": [self.frame(127), self.frame(128)],
            "the left half and the right": [self._linear.draw(left), self._linear.draw(255 - left)],
        }
        black = float(ends.black.mean())
        start = time.monotonic()
        for name, frames in sums.items():
            photos = [self.photograph(frame) for frame in frames]
            light = sum(float(photo.mean(dtype=np.float64)) - black for photo in photos)
            missed = light / ends.contrast - 1
            if abs(missed) > SUPERPOSITION:
                cure = (
                    "run nearfar calibrate again"
                    if self._calibrated
                    else "run nearfar calibrate first"
                )
                self._alarm(
                    f"light does not add up: {name} together give {1 + missed:.1%} of white; turn "
                    f"what makes the projector's picture livelier and the camera's automatics off, "
                    f"and {cure}."
                )
        watch.learn_bands(*photos)
        watch.begin(255 - left, photos[-1])
        self._on_start((time.monotonic() - start) / sum(map(len, sums.values())))

    def _of_pattern(self, number: int, pattern: NDArray[np.uint8], watch: Watch) -> Photo:
        """Take the photo of a pattern; again, by way of black, while it seems not to be of it."""
        frame = self._linear.draw(pattern)
        photo = self.photograph(frame, number=number)
        why = watch.suspect(pattern, photo)
        if not why:
            return photo
        # From the other end any pattern's photo differs all over.
        bright = pattern.mean() > 127
        away = self.frame(0 if bright else 255)
        settle = max(PAUSE, self._settle)
        for _ in range(TRIES):
            between = self.photograph(away, settle, number=number)
            again = self.photograph(frame, settle, number=number)
            known = watch.ends.black if bright else watch.ends.white
            if not shows(between, known, watch.ends):
                # The light may have changed since black and white were learnt.
                self._learn_ends_again(number, watch)
                continue
            if watch.alike(again, between):
                continue
            if watch.agrees(photo, again):
                watch.mistaken()
                if watch.coarse:
                    self._alarm(
                        f"up to photo {number} many photos are like the ones before, though their "
                        f"patterns differ: the camera hardly resolves them, and photos are not "
                        f"told apart from here on; focus it, or move closer."
                    )
            else:
                self._note(f"photo {number} was taken again: {why}")
            return again
        raise DeviceError(
            f"photo {number} cannot be had: {why}, {TRIES + 1} times: look at the projector's "
            f"picture and at the camera's."
        )

    def _expose(self, frame: NDArray[np.uint8], settle: int | None) -> Photo:
        """Show a frame and take one photo."""
        self._screen.show(frame)
        self._screen.wait((self._settle if settle is None else settle) * self.refresh)
        wanted = self.camera.exposure
        photo = self.camera.photograph()
        like = f"{photo.shape} of {photo.dtype}"
        if not self._like:
            self._like = like
        elif like != self._like:
            raise LostPhotoError(
                f"a photo of {self.camera.name} is {like}, and those before {self._like}: leave "
                f"the camera's settings as they are."
            )
        told = self.camera.conditions().get("exposure")
        if wanted is not None and told is not None and not math.isclose(told, wanted, rel_tol=1e-3):
            self.camera.set_exposure(wanted)
            raise LostPhotoError(
                f"{self.camera.name} exposed {told:g} s instead of {wanted:g} s: let no other "
                f"program set it, and turn its automatic exposure off."
            )
        return photo

    def _tell_of_change(self, number: int, change: Change, watch: Watch) -> None:
        """Find by black and white what has changed, name it, and go on from there."""
        old, now = watch.ends, self._ends()
        what = difference(old, now)
        after = (
            f"after photo {change.since}" if change.since >= 0 else "before the first comparison"
        )
        again = f"shoot them again by --reshoot {change.since + 1}-{number}"
        if not what and change.by_inverse:
            self._alarm(
                f"photo {number} and that of the inverse pattern give {change.share:+.1%} of white "
                f"too much or too little, while black and white are as they were: the response is "
                f"not linear, or something is saturated; run nearfar calibrate."
            )
            watch.forget_inverses()
        else:
            what = what or f"the light was off by {change.share:+.1%} of white for a while"
            self._alarm(f"{what}, {after} and up to photo {number}: {again}.")
        self._go_on_from(now, watch)

    def _learn_ends_again(self, number: int, watch: Watch) -> None:
        """Learn black and white anew where they are not what they were."""
        try:
            now = self._ends()
        except DeviceError:
            # A camera that shows one picture for ever has neither.
            return
        if what := difference(watch.ends, now):
            self._alarm(f"{what}, before photo {number}: see whether photos before it are good.")
            self._go_on_from(now, watch)

    def _ends(self) -> Ends:
        settle = max(PAUSE, self._settle)
        for _ in range(TRIES):
            darks = [self.photograph(self.frame(0), settle) for _ in range(2)]
            lights = [self.photograph(self.frame(255), settle) for _ in range(2)]
            if are_alike(darks, lights):
                break
        return look_at_ends(darks, lights)

    def _go_on_from(self, now: Ends, watch: Watch) -> None:
        watch.start_again(now)
        # White was shown last.
        watch.begin(np.full(self._projector, 255, dtype=np.uint8), now.white)

    def _alarm(self, sentence: str) -> None:
        self.alarms.append(sentence)
        self._on_alarm(sentence)

    def _note(self, sentence: str) -> None:
        self._alarm(sentence if sentence.endswith(".") else f"{sentence}.")


def _is_whole(seconds: float, refresh: float) -> bool:
    turns = seconds / refresh
    return round(turns) >= 1 and abs(turns - round(turns)) < min(0.1, 0.01 * turns)
