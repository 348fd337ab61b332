"""Seconds that the viewer's server takes for each tool, without a browser.

Run ``python benchmarks/viewer_tools.py TRANSPORT.zarr``. The light is white; a wanted picture is
half of the scene under it. Each figure is the best of three, but compensation's and the physical
split's, which are made once.
"""

import json
import struct
import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from nearfar.arrays import Floats
from nearfar.viewer.interactive import InteractiveTransport
from nearfar.viewer.messages import Light, unpack_levels
from nearfar.viewer.numbers import PixelHeader, numbers_at
from nearfar.viewer.physical import PhysicalRelighting
from nearfar.viewer.tools import TOOLS

EDGES = (1, 2, 4, 8, 16, 32)


def message(light: Floats, **header: Any) -> bytes:
    """Pack a light as the page does."""
    levels = np.rint(65535 * light.reshape(*light.shape[:2], -1)).astype(np.uint16)
    text = json.dumps({"shape": levels.shape, **header}).encode()
    text += b" " * (-(4 + len(text)) % 8)
    return struct.pack("<I", len(text)) + text + levels.tobytes()


def seconds(job: Callable[[], object], times: int = 3) -> float:
    """Return the seconds of the quickest of some runs."""
    found = []
    for _ in range(times):
        began = time.perf_counter()
        job()
        found.append(time.perf_counter() - began)
    return min(found)


def main(path: str) -> None:
    """Print a line for each tool."""
    transport = InteractiveTransport(path)
    white = np.ones(transport.projector, dtype=np.float32)
    camera = np.ones(transport.stored.camera, dtype=np.float32)
    physical, light = PhysicalRelighting(transport), Light(white, np.ones(3, np.float32))
    wanted = 0.5 * transport.to_colours(np.atleast_3d(transport.whole() @ white))

    def made(name: str, given: Floats, **header: Any) -> Callable[[], object]:
        return lambda: list(TOOLS[name](transport, message(given, **header)))

    def told() -> object:
        header, sent = unpack_levels(
            PixelHeader, message(white, y=0, x=0, split="physical"), transport.projector
        )
        return numbers_at(transport, physical, header, sent)

    print(f"projector {transport.projector}, camera {transport.stored.camera}")
    for title, job, times in (
        ("relit, model's split", lambda: transport.relight_coarsely(light), 3),
        ("the physical split, once", physical.prepare, 1),
        ("relit, physical split", lambda: physical.relight_coarsely(light), 3),
        ("sigma of one pixel, physical split", told, 3),
        ("by distance, while it moves", made("reach", white, inner=3, coarse=True), 3),
        ("by distance, at rest", made("reach", white, inner=3), 3),
        ("pictures by distance", made("distances", white, edges=EDGES), 3),
        ("dual view", made("dual", camera), 3),
        ("compensation", made("compensation", np.clip(wanted, 0, 1)), 1),
    ):
        print(f"{title:36} {seconds(job, times):8.3f} s", flush=True)


if __name__ == "__main__":
    main(sys.argv[1])
