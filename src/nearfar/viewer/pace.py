"""How finely pictures are relit while the light moves: as finely as time allows."""

from dataclasses import dataclass

# Pictures that take longer are relit more coarsely from then on, quicker ones more finely. A level
# has four times the camera pixels of the next, so that a change does not ask for the next one at
# once.
SLOW_SECONDS = 1 / 15
QUICK_SECONDS = SLOW_SECONDS / 5
# So slow that one picture is enough; of others two must follow each other.
VERY_SLOW_SECONDS = 2 * SLOW_SECONDS
# A page takes some time for its screen, however few camera pixels there are. So a finer level is
# tried after so many pictures that took half as long as they may; more if that was too fine.
PROMISING_SECONDS = SLOW_SECONDS / 2
FIRST_PATIENCE, LONGEST_PATIENCE = 60, 960


@dataclass
class Pace:
    """The level of detail of the next picture.

    Attributes
    ----------
    levels : int
        How many there are.
    level : int
        0 is the finest.
    """

    levels: int
    level: int = 0
    _slow: int = 0
    _promising: int = 0
    _patience: int = FIRST_PATIENCE
    _is_on_trial: bool = False

    def took(self, seconds: float) -> None:
        """Choose the next level, from how long a picture of this one took."""
        self._slow = self._slow + 1 if seconds > SLOW_SECONDS else 0
        self._promising = self._promising + 1 if seconds < PROMISING_SECONDS else 0
        if self._slow > 1 or seconds > VERY_SLOW_SECONDS:
            if self._is_on_trial:
                self._patience = min(2 * self._patience, LONGEST_PATIENCE)
            self._choose(self.level + 1)
        elif seconds < QUICK_SECONDS:
            self._choose(self.level - 1)
        elif self._promising >= self._patience:
            if self.level == 0:
                # Fine pictures have been quick for long.
                self._patience = FIRST_PATIENCE
            self._choose(self.level - 1, is_on_trial=self.level > 0)

    def _choose(self, level: int, *, is_on_trial: bool = False) -> None:
        self._slow = self._promising = 0
        self._is_on_trial = is_on_trial
        self.level = min(max(level, 0), self.levels - 1)
