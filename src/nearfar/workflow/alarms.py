"""What the photos of a capture tell of a fault while they are taken, and it can still be mended.

Index convention: photos are (Cy, Cx, channels), raw levels.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Floats
from nearfar.capture.store import white_and_black
from nearfar.illumination.frequencies import DC, Frequency
from nearfar.photometry.modulation import TOO_MANY, TOO_MUCH, of_pair, share_above_one
from nearfar.plan import Plan
from nearfar.plan.model import Sinusoid

# More than this share of a photo's values at full scale is told.
SATURATED = 1e-3
# White and black that differ by this share of white are of another light.
CHANGE = 0.02
# Camera pixels say something of modulation where white adds this share of what it adds to others.
LIT = 0.2
# Neighbours whose modulations are averaged.
TOGETHER = 16
# With less than so many values for each of them, fewer are.
FEW = 200
# Pairs that are kept until white and black have been shown.
MOST_WAITING = 8
# Rows are looked at in steps, so that a large camera costs no time.
ROWS = 256


class CaptureAlarms:
    """Follows a capture photo by photo; each kind of alarm is given once.

    Parameters
    ----------
    plan : Plan
    full_scale : float
        Raw level at which a value is saturated.
    """

    def __init__(self, plan: Plan, full_scale: float) -> None:
        self._plan, self._full_scale = plan, full_scale
        self._ends = white_and_black(plan)
        self._known: dict[int, Floats] = {}
        self._halves: dict[Frequency, tuple[str, Floats]] = {}
        self._waiting: list[tuple[int, Frequency, Floats, Floats]] = []
        self._given: set[str] = set()
        self._recalled = False

    def recall(self, read: Callable[[int], NDArray[Any]], taken: int) -> None:
        """Take up white and black of a capture that is gone on with."""
        for number in self._ends or ():
            if number < taken:
                self._known[number] = self._rows(read(number))
                self._recalled = True

    def __call__(self, number: int, photo: NDArray[Any]) -> list[str]:
        """Look at a photo; return alarms, a sentence each."""
        alarms = [self._saturation(number, photo), self._since_before(number, photo)]
        if self._ends is not None and number in self._ends:
            self._known.setdefault(number, self._rows(photo))
        pattern = self._plan.patterns[number]
        if isinstance(pattern, Sinusoid) and not pattern.inverse and pattern.frequency != DC:
            alarms.append(self._modulation(number, pattern, self._rows(photo)))
        return [alarm for alarm in alarms if alarm]

    def _saturation(self, number: int, photo: NDArray[Any]) -> str:
        share = float(np.mean(photo >= self._full_scale))
        if share <= SATURATED or not self._first("saturation"):
            return ""
        return (
            f"{share:.1%} of photo {number} is saturated: expose less, or those camera pixels will "
            f"be wrong."
        )

    def _since_before(self, number: int, photo: NDArray[Any]) -> str:
        """Compare white and black with those of before a capture was gone on with."""
        pattern = self._plan.patterns[number]
        uniform = isinstance(pattern, Sinusoid) and pattern.frequency == DC
        if not uniform or not self._recalled or self._ends is None or len(self._known) < 2:
            return ""
        white, black = (float(self._known[end].mean()) for end in self._ends)
        inverse = isinstance(pattern, Sinusoid) and pattern.inverse
        change = float(self._rows(photo).mean()) - (black if inverse else white)
        share = change / (white - black)
        if abs(share) <= CHANGE or not self._first("since before"):
            return ""
        return (
            f"photo {number}, of {'black' if inverse else 'white'}, is {share:+.1%} of white off "
            f"that of before the capture was gone on with: lamp, exposure or ambient light are "
            f"others; see that they are as they were, or begin anew with --force."
        )

    def _modulation(self, number: int, pattern: Sinusoid, photo: Floats) -> str:
        kind, other = self._halves.pop(pattern.frequency, ("", photo))
        if kind in {"", pattern.kind}:
            self._halves[pattern.frequency] = (pattern.kind, photo)
            return ""
        self._waiting.append((number, pattern.frequency, photo, other))
        if self._ends is None or len(self._known) < 2:
            # Plans of inverse pairs may show white late.
            del self._waiting[MOST_WAITING:]
            return ""
        alarms = [self._too_much(*pair) for pair in self._waiting]
        self._waiting.clear()
        return next((alarm for alarm in alarms if alarm), "")

    def _too_much(self, number: int, frequency: Frequency, photo: Floats, other: Floats) -> str:
        assert self._ends is not None
        white, black = (self._known[end] for end in self._ends)
        contrast = white - black
        lit = (contrast > LIT * np.quantile(contrast, 0.99)) & (white < self._full_scale)
        # Neighbours in a row one after another, channel by channel.
        seen = np.moveaxis(lit, -1, 0)
        one, half, dark, light = (
            np.asarray(np.moveaxis(p, -1, 0)[seen]) for p in (photo, other, black, white)
        )
        modulation = of_pair(one, half, dark, light)
        # The mean of a few: modulation knows no phase, and noise must not look like it.
        together = int(np.clip(len(modulation) // FEW, 1, TOGETHER))
        groups = len(modulation) // together
        if not groups:
            return ""
        means = modulation[: groups * together].reshape(groups, together).mean(axis=-1)
        share = share_above_one(means, np.ones(means.shape, dtype=bool))
        if share <= TOO_MANY or not self._first("modulation"):
            return ""
        fy, fx = frequency
        return (
            f"{share:.0%} of the camera answer frequency ({fy}, {fx}) with over {TOO_MUCH:g} times "
            f"what white adds, which no linear response does (photo {number}): run nearfar "
            f"calibrate, and see that black is not clipped."
        )

    def _first(self, kind: str) -> bool:
        new = kind not in self._given
        self._given.add(kind)
        return new

    def _rows(self, photo: NDArray[Any]) -> Floats:
        return photo[:: max(1, len(photo) // ROWS)].astype(np.float32)
