"""A GigE Vision camera on the loopback, before a simulated scene that a screen lights.

A process of its own: python -m tests.rigs.fake_camera SETTINGS.json. Each frame that it is asked
for is computed from what its screen shows at that moment: grabbed, through the projector's gamma,
averaged over each pattern pixel's block, through the transport, noise and sensor, and sent as
packets of the real protocol. The file that ``control`` names tells it what to do wrong.
"""

import ctypes
import json
import os
import sys
import time
from pathlib import Path
from typing import Any

import mss
import numpy as np

from nearfar.arrays import Size
from nearfar.rigs.simulated.camera import SimulatedCamera

GAMMA = 2.2


class Scene:
    """What the camera sees."""

    def __init__(self, settings: dict[str, Any]) -> None:
        self.transport = np.load(settings["transport"]).astype(np.float64)
        self.projector = Size(*settings["projector"])
        self.camera = Size(*settings["camera"])
        self.light_of_level = (np.arange(256) / 255.0) ** settings.get("gamma", GAMMA)
        self.sensor = SimulatedCamera(**settings.get("sensor", {}))
        # Exposure in seconds at which the transport is in photo units.
        self.unit = settings.get("unit", 0.02)
        self.control = Path(settings["control"])
        self.screen = mss.MSS()
        self.generator = np.random.default_rng(settings.get("seed", 0))
        self.frames = 0
        self.before = np.zeros(self.camera.pixels)

    def light(self) -> np.ndarray[Any, Any]:
        """Read the screen back, as light on the pattern grid."""
        shot = np.asarray(self.screen.grab(self.screen.monitors[0]))[..., :3]
        block = min(side // n for side, n in zip(shot.shape[:2], self.projector, strict=True))
        height, width = (block * n for n in self.projector)
        top, left = (shot.shape[0] - height) // 2, (shot.shape[1] - width) // 2
        linear = self.light_of_level[shot[top : top + height, left : left + width]].mean(axis=-1)
        cells = linear.reshape(self.projector.height, block, self.projector.width, block)
        return cells.mean(axis=(1, 3)).reshape(-1)

    def frame(self, exposure: float) -> np.ndarray[Any, Any]:
        """Take a frame at an exposure in seconds; faults as the control file says."""
        fault = json.loads(self.control.read_text()) if self.control.exists() else {}
        self.frames += 1
        picture = self.transport @ self.light()
        asked = fault.get("fault")
        if fault and fault.get("once", True):
            self.control.unlink()
        if asked == "repeat":
            picture = self.before
        elif asked == "tear":
            cut = self.camera.width * (self.camera.height // 2)
            picture = np.concatenate([self.before[:cut], picture[cut:]])
        elif asked == "exposure":
            exposure *= fault["factor"]
        elif asked == "ambient":
            picture = picture + fault["light"]
        elif asked == "silence":
            time.sleep(fault["seconds"])
        self.before = picture
        share = exposure / self.unit
        ambient = self.sensor.ambient * (share - 1)
        return self.sensor.photograph(picture * share + ambient, self.generator)


def serve(settings: dict[str, Any]) -> None:
    """Serve frames until the process is ended, or its parent has ended."""
    parent = os.getppid()
    library = ctypes.CDLL("libaravis-0.8.so.0")
    objects = ctypes.CDLL("libgobject-2.0.so.0")
    scene = Scene(settings)
    fill = ctypes.CFUNCTYPE(
        None, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_uint32, ctypes.c_uint32, ctypes.c_uint32
    )
    library.arv_buffer_get_data.restype = ctypes.c_void_p
    library.arv_buffer_get_data.argtypes = (ctypes.c_void_p, ctypes.c_void_p)
    for side in ("width", "height"):
        getattr(library, f"arv_buffer_get_image_{side}").argtypes = (ctypes.c_void_p,)

    def on_frame(buffer: int, _data: int, exposure: int, _gain: int, _kind: int) -> None:
        try:
            width = library.arv_buffer_get_image_width(buffer)
            height = library.arv_buffer_get_image_height(buffer)
            if (height, width) != scene.camera:
                print(f"asked for {height}x{width}", file=sys.stderr, flush=True)
                return
            levels = scene.frame(exposure / 1e6).astype("<u2")
            place = library.arv_buffer_get_data(buffer, None)
            ctypes.memmove(place, levels.tobytes(), levels.nbytes)
        except (ValueError, OSError) as error:
            print(repr(error), file=sys.stderr, flush=True)

    callback = fill(on_frame)
    library.arv_gv_fake_camera_new.restype = ctypes.c_void_p
    library.arv_gv_fake_camera_new.argtypes = (ctypes.c_char_p, ctypes.c_char_p)
    served = library.arv_gv_fake_camera_new(b"127.0.0.1", settings["serial"].encode())
    objects.g_object_set.argtypes = (
        ctypes.c_void_p,
        ctypes.c_char_p,
        ctypes.c_double,
        ctypes.c_void_p,
    )
    if settings.get("lost_ratio"):
        objects.g_object_set(served, b"gvsp-lost-ratio", settings["lost_ratio"], None)
    library.arv_gv_fake_camera_get_fake_camera.restype = ctypes.c_void_p
    library.arv_gv_fake_camera_get_fake_camera.argtypes = (ctypes.c_void_p,)
    camera = library.arv_gv_fake_camera_get_fake_camera(served)
    library.arv_fake_camera_set_fill_pattern.argtypes = (ctypes.c_void_p, fill, ctypes.c_void_p)
    library.arv_fake_camera_set_fill_pattern(camera, callback, None)
    print("ready", flush=True)
    # Left behind by a test run that was killed, it would answer the cameras' next tests.
    while os.getppid() == parent:
        time.sleep(0.5)


if __name__ == "__main__":
    serve(json.loads(Path(sys.argv[1]).read_text()))
