"""A camera that computes its photos from what the screen shows, as if pointed at a grey card."""

import mss
import numpy as np

from nearfar.arrays import parse_size
from nearfar.rigs.cameras.base import Camera
from nearfar.rigs.cameras.driver import CameraDriver, CameraTable, FoundCamera

GAMMA = 2.2
DIRECT, FAR = 0.5, 0.1
# Exposure in seconds at which the brightest camera pixel under white is at DIRECT + FAR.
UNIT = 1 / 60


class MirrorCamera(Camera):
    """One camera pixel for each pixel of the pattern grid, 16 bits, one channel."""

    full_scale = 65535.0
    exposure_limits = (1e-4, 1.0)

    def __init__(self, grid, **options):
        super().__init__("the mirror", **options)
        self._grid, self._screen = grid, mss.MSS()

    def take(self):
        """Take a frame, (Cy, Cx, 1)."""
        shot = np.asarray(self._screen.grab(self._screen.monitors[0]))[..., 0] / 255
        block = min(side // cells for side, cells in zip(shot.shape, self._grid, strict=True))
        size = [block * cells for cells in self._grid]
        top, left = ((a - b) // 2 for a, b in zip(shot.shape, size, strict=True))
        light = shot[top : top + size[0], left : left + size[1]] ** GAMMA
        light = light.reshape(self._grid[0], block, self._grid[1], block).mean(axis=(1, 3))
        photo = (DIRECT * light + FAR * light.mean()) * self.exposure / UNIT
        return np.rint(np.clip(photo, 0, 1) * 65535).astype(np.uint16)[..., None]

    def _set_exposure(self, seconds):
        return seconds

    def close(self):
        """Let go of the screen."""
        self._screen.close()


class MirrorTable(CameraTable):
    """Its [camera] table: the pattern grid, HxW."""

    grid: str

    def open(self, folder):
        """Open the camera."""
        options = {"frames": self.average, "bracket": self.bracket}
        return MirrorCamera(parse_size(self.grid), **options)


DRIVER = CameraDriver(
    MirrorTable,
    find=lambda: [FoundCamera("mirror", "screen", "A mirror of the screen")],
    settings='# Pattern grid.\n# grid = "16x16"\n',
)
