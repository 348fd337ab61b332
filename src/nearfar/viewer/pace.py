"""How finely pictures are relit while the light moves: as finely as time allows."""

from dataclasses import dataclass

# Slower pictures are relit more coarsely from then on, quicker ones more finely. A level has four
# times the camera pixels of the next, so that a change does not ask for the next one at once.
SLOW_SECONDS = 1 / 15
QUICK_SECONDS = SLOW_SECONDS / 5


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

    def took(self, seconds: float) -> None:
        """Choose the next level, from how long a picture of this one took."""
        if seconds > SLOW_SECONDS:
            self.level = min(self.level + 1, self.levels - 1)
        elif seconds < QUICK_SECONDS:
            self.level = max(self.level - 1, 0)
