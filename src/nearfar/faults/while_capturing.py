"""Faults that photos show while a capture is taken, when they can still be mended.

Index convention: photos are (Cy, Cx, channels), raw levels.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Floats
from nearfar.capture import white_and_black
from nearfar.faults.records import (
    Fault,
    LightChangedWhileStopped,
    ModulationTooHigh,
    PhotoSaturated,
)
from nearfar.illumination.frequencies import DC, Frequency
from nearfar.photometry.modulation import (
    LARGEST_MODULATION,
    LARGEST_SHARE_ABOVE,
    of_pair,
    share_above_one,
)
from nearfar.plan import Plan, Sinusoid

# A photo is faulty with more than this share of its values at full scale.
SATURATED_SHARE_OF_VALUES = 1e-3
# White and black that differ by more than this share of white are of another light.
LIGHT_CHANGE_SHARE_OF_WHITE = 0.02
# Modulation is measured at camera pixels where white adds this share of what it adds to the
# brightest.
LIT_SHARE_OF_BRIGHTEST = 0.2
# Modulations are averaged over this many neighbours, or over fewer, so that at least this many
# groups are left.
MAXIMUM_NEIGHBOURS = 16
MINIMUM_GROUPS = 200
# Pairs of cosine and sine that are kept until white and black have been photographed.
MAXIMUM_WAITING_PAIRS = 8
# Of a camera with more rows, evenly spaced rows are examined, so that a photo costs little time.
MAXIMUM_ROWS = 256


class FaultsWhileCapturing:
    """Finds faults photo by photo; each sort of fault is reported once.

    Parameters
    ----------
    plan : Plan
    full_scale : float
        Raw level at which a value is saturated.
    """

    def __init__(self, plan: Plan, full_scale: float) -> None:
        self._plan, self._full_scale = plan, full_scale
        self._white_and_black = white_and_black(plan)
        self._known: dict[int, Floats] = {}
        self._halves: dict[Frequency, tuple[str, Floats]] = {}
        self._waiting: list[tuple[int, Frequency, Floats, Floats]] = []
        self._found: set[type[Fault]] = set()
        self._is_resumed = False

    def recall(self, read: Callable[[int], NDArray[Any]], taken: int) -> None:
        """Read white and black of a capture that is resumed.

        Parameters
        ----------
        read : callable
            Returns a photo by its number.
        taken : int
            Photos that are there.
        """
        for number in self._white_and_black or ():
            if number < taken:
                self._known[number] = self._some_rows(read(number))
                self._is_resumed = True

    def examine(self, number: int, photo: NDArray[Any]) -> list[Fault]:
        """Examine the next photo and return the faults that are new."""
        found = [self._saturation(number, photo), self._light_change(number, photo)]
        if self._white_and_black is not None and number in self._white_and_black:
            self._known.setdefault(number, self._some_rows(photo))
        pattern = self._plan.patterns[number]
        if isinstance(pattern, Sinusoid) and not pattern.inverse and pattern.frequency != DC:
            found += self._modulation(number, pattern, self._some_rows(photo))
        new: list[Fault] = []
        for fault in found:
            if fault is not None and type(fault) not in self._found:
                self._found.add(type(fault))
                new.append(fault)
        return new

    def _saturation(self, number: int, photo: NDArray[Any]) -> Fault | None:
        share = float(np.mean(photo >= self._full_scale))
        return PhotoSaturated(number, share) if share > SATURATED_SHARE_OF_VALUES else None

    def _light_change(self, number: int, photo: NDArray[Any]) -> Fault | None:
        """Compare white and black with those before the capture was stopped."""
        pattern = self._plan.patterns[number]
        if not isinstance(pattern, Sinusoid) or pattern.frequency != DC:
            return None
        if not self._is_resumed or self._white_and_black is None or len(self._known) < 2:
            return None
        white, black = (float(self._known[end].mean()) for end in self._white_and_black)
        before = black if pattern.inverse else white
        share = (float(self._some_rows(photo).mean()) - before) / (white - black)
        if abs(share) <= LIGHT_CHANGE_SHARE_OF_WHITE:
            return None
        return LightChangedWhileStopped(number, "black" if pattern.inverse else "white", share)

    def _modulation(self, number: int, pattern: Sinusoid, photo: Floats) -> list[Fault | None]:
        """Examine pairs of cosine and sine once both, white and black are there."""
        half = self._halves.pop(pattern.frequency, None)
        if half is None or half[0] == pattern.kind:
            self._halves[pattern.frequency] = (pattern.kind, photo)
            return []
        self._waiting.append((number, pattern.frequency, photo, half[1]))
        if self._white_and_black is None or len(self._known) < 2:
            # Plans of inverse pairs may photograph white late.
            del self._waiting[MAXIMUM_WAITING_PAIRS:]
            return []
        if ModulationTooHigh in self._found:
            self._waiting.clear()
            return []
        found = [self._excess_modulation(*pair) for pair in self._waiting]
        self._waiting.clear()
        return found

    def _excess_modulation(
        self, number: int, frequency: Frequency, photo: Floats, other: Floats
    ) -> Fault | None:
        assert self._white_and_black is not None
        white, black = (self._known[end] for end in self._white_and_black)
        contrast = white - black
        brightest = np.quantile(contrast, 0.99)
        lit = (contrast > LIT_SHARE_OF_BRIGHTEST * brightest) & (white < self._full_scale)
        # Neighbours in a row one after another, channel by channel.
        by_channel = np.moveaxis(lit, -1, 0)
        one, half, dark, light = (
            np.asarray(np.moveaxis(p, -1, 0)[by_channel]) for p in (photo, other, black, white)
        )
        modulation = of_pair(one, half, dark, light)
        # The mean of a few: modulation is free of phase, and noise must not look like it.
        together = int(np.clip(len(modulation) // MINIMUM_GROUPS, 1, MAXIMUM_NEIGHBOURS))
        groups = len(modulation) // together
        if not groups:
            return None
        means = modulation[: groups * together].reshape(groups, together).mean(axis=-1)
        share = share_above_one(means, np.ones(means.shape, dtype=bool))
        if share <= LARGEST_SHARE_ABOVE:
            return None
        return ModulationTooHigh(number, frequency, share, LARGEST_MODULATION)

    def _some_rows(self, photo: NDArray[Any]) -> Floats:
        return photo[:: max(1, len(photo) // MAXIMUM_ROWS)].astype(np.float32)
