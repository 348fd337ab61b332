"""A projector and a camera on a table that is not there: no window, no wires, no waiting."""

import numpy as np

from nearfar.arrays import Size
from nearfar.errors import LostPhotoError
from nearfar.rigs.cameras.base import Camera
from nearfar.rigs.monitors import Monitor
from nearfar.rigs.simulated.camera import SimulatedCamera

REFRESH = 60.0


class TableScreen:
    """Shows frames to a `TableCamera`."""

    def __init__(self, size=Size(72, 96)):
        self.monitor = Monitor(0, "table", size, (0, 0), REFRESH)
        self.period = 1 / REFRESH
        self.clock = 0.0
        self.closed = False
        # What was shown, and since when.
        self.shown = [(0.0, np.zeros((*size, 3), dtype=np.uint8))]

    def show(self, frame):
        colour = np.broadcast_to(np.atleast_3d(frame), (*self.monitor.size, 3))
        self.shown.append((self.clock, colour.copy()))

    def close(self):
        self.closed = True

    def wait(self, seconds):
        self.clock += seconds

    def frame(self, late=0.0):
        """What the projector shows, so late."""
        black = self.shown[0][1]
        return next((f for since, f in reversed(self.shown) if since + late <= self.clock), black)


class TableCamera(Camera):
    """Photographs a transport, (Cy Cx, Py Px), that the screen lights; does wrong as told.

    `wrong` maps the number of a frame to what is done with it.
    """

    def __init__(
        self,
        screen,
        transport,
        camera,
        projector,
        *,
        gamma=1.0,
        late=0.0,
        unit=0.1,
        seed=0,
        limits=(1e-4, 10.0),
        channels=None,
        sensor=None,
        **kwargs,
    ):
        super().__init__("table camera", **kwargs)
        self._screen, self._transport = screen, transport
        self._size, self._projector = camera, projector
        self._gamma, self._late, self._unit, self._limits = gamma, late, unit, limits
        # What each primary adds in each channel.
        self._channels = np.full((1, 3), 1 / 3) if channels is None else np.asarray(channels)
        self.simulated = sensor or SimulatedCamera(bits=16)
        self._generator = np.random.default_rng(seed)
        self.taken = 0
        self.device_exposure = unit
        self.wrong = {}
        self.from_now_on = None
        self.before = None

    @property
    def full_scale(self):
        return float(self.simulated.full_scale)

    @property
    def exposure_limits(self):
        return self._limits

    def _set_exposure(self, seconds):
        self.device_exposure = seconds
        return seconds

    def conditions(self):
        told = {"temperature": 30.0 + self.taken / 100}
        return told | {"exposure": self.device_exposure}

    def light(self):
        """Light on the pattern grid, (Py Px, 3)."""
        frame = (self._screen.frame(self._late) / 255.0) ** self._gamma
        block = min(a // b for a, b in zip(frame.shape, self._projector, strict=False))
        height, width = (block * n for n in self._projector)
        top, left = (frame.shape[0] - height) // 2, (frame.shape[1] - width) // 2
        inside = frame[top : top + height, left : left + width]
        cells = inside.reshape(self._projector[0], block, self._projector[1], block, 3)
        return cells.mean(axis=(1, 3)).reshape(-1, 3)

    def take(self):
        # A refresh goes by with every frame.
        self._screen.wait(self.device_exposure)
        picture = (self._transport @ self.light() @ self._channels.T).reshape(*self._size, -1)
        what = self.wrong.pop(self.taken, self.from_now_on)
        self.taken += 1
        self.before, before = picture, self.before
        if what == "lost":
            raise LostPhotoError("the photo was lost.")
        if what == "repeated":
            picture = before
        elif what == "torn":
            half = self._size.height // 2
            picture = np.concatenate([before[:half], picture[half:]])
        elif what is not None:
            picture = what(picture)
        share = self.device_exposure / self._unit
        ambient = self.simulated.ambient * (share - 1)
        return self.simulated.photograph(picture * share + ambient, self._generator)
