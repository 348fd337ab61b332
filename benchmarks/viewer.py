"""Pictures a second in the viewer's page while its light is dragged, 128 x 128 x 3, W = 19.

Run ``python benchmarks/viewer.py``; it needs Chromium. The browser and the server share the
machine, as they do for a user. Lights that move are of one colour, of several, and all over the
grid. The rate of the server alone, without a browser, is measured in the same run. ``python
benchmarks/viewer.py TRANSPORT.zarr`` drags a white light before a transport of your own, and tells
how long the exact picture takes once the light is let go.
"""

import json
import struct
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np
from playwright.sync_api import sync_playwright
from websockets.sync.client import connect

from nearfar import Size, save_transport
from nearfar.viewer.interactive import InteractiveTransport
from nearfar.viewer.server import ListeningAddress
from nearfar.viewer.view import run_view
from reconstruction import FAR, PROJECTOR, WINDOW, random_transport

SECONDS = 5
STROKES = [
    {"colour": colour, "radius": 6, "points": [20 * i, 30, 20 * i, 90]}
    for i, colour in enumerate(("#ff4000", "#00ff80", "#4060ff"))
]
LIGHTS = {
    "a white spot": {"kind": "spot"},
    "a coloured spot": {"kind": "spot", "colour": "#ff8040"},
    "a sinusoid": {"kind": "sinusoid"},
    "a brush of one colour": {"kind": "paint"},
    "a brush over three colours": {"kind": "paint", "strokes": STROKES},
}
# The page has the exact picture of the newest light.
EXACT = """body[data-frame*='"exact":true,"newest":true']"""
# Moves the mouse round in the light, once for each frame of the screen.
DRAG = """seconds => new Promise(done => {
  const light = document.getElementById('light'), box = light.getBoundingClientRect();
  const count = () => JSON.parse(document.body.dataset.frame).count;
  light.setPointerCapture = () => {};
  const dispatch = (type, angle) => light.dispatchEvent(new PointerEvent(type, { bubbles: true,
    pointerId: 1, clientX: box.left + box.width * (0.5 + 0.3 * Math.cos(angle)),
    clientY: box.top + box.height * (0.5 + 0.3 * Math.sin(angle)) }));
  dispatch('pointerdown', 0);
  const began = performance.now(), before = count();
  const step = now => {
    const passed = (performance.now() - began) / 1000;
    dispatch('pointermove', 2 * passed);
    if (passed < seconds) return requestAnimationFrame(step);
    dispatch('pointerup', 0);
    done((count() - before) / passed);
  };
  requestAnimationFrame(step);
})"""


def of_the_server(address: str, light: np.ndarray) -> float:
    """Return the frames a second that the server sends without a browser."""
    levels = np.rint(65535 * light).astype("<u2")
    text = json.dumps({"number": 1, "shape": [*levels.shape, 1]}).encode()
    text += b" " * (-(4 + len(text)) % 8)
    message = struct.pack("<I", len(text)) + text + levels.tobytes()
    with connect(address.replace("http", "ws") + "/relight", max_size=None) as socket:
        began, count = time.perf_counter(), 0
        while time.perf_counter() - began < SECONDS / 2:
            socket.send(message)
            socket.recv()
            count += 1
        return count / (time.perf_counter() - began)


@contextmanager
def served(path: Path) -> Iterator[str]:
    """Serve a transport's page; yields its address."""
    started, stop = threading.Event(), threading.Event()
    addresses: list[str] = []

    def on_start(address: str) -> None:
        addresses.append(address)
        started.set()

    transport = InteractiveTransport(path)
    threading.Thread(
        target=run_view,
        args=(transport, ListeningAddress("127.0.0.1", 0), on_start, stop),
        daemon=True,
    ).start()
    started.wait()
    yield addresses[0]
    stop.set()


def of_the_page(address: str, lights: dict[str, dict[str, Any]]) -> None:
    """Print the pictures a second while lights are dragged, and how long exact ones take."""
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path="/usr/bin/chromium", args=["--no-sandbox"]
        )
        for name, state in lights.items():
            page = browser.new_page(viewport={"width": 1400, "height": 1000})
            page.goto(f"{address}/#{quote(json.dumps(state))}")
            page.wait_for_selector("body[data-frame]", state="attached")
            time.sleep(1)
            rate = page.evaluate(DRAG, SECONDS)
            let_go = time.perf_counter()
            page.wait_for_selector(EXACT, state="attached")
            waited = time.perf_counter() - let_go
            print(f"dragged, {name}: {rate:.0f} pictures a second, then exact in {waited:.1f} s")
            page.close()
        browser.close()


def main() -> None:
    """Print the table."""
    if len(sys.argv) > 1:
        thin, thick = ({"kind": "paint", "brush": radius} for radius in (0.5, 20))
        with served(Path(sys.argv[1])) as address:
            plain = {name: {"kind": name} for name in ("spot", "sinusoid", "pixel")}
            of_the_page(address, {**plain, "a brush of one pixel": thin, "a broad brush": thick})
        return
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "transport.zarr"
        save_transport(random_transport(Size(*PROJECTOR), WINDOW, FAR), path)
        with served(path) as address:
            y, x = np.indices(PROJECTOR)
            spot = (np.hypot(y - 64, x - 64) < PROJECTOR[0] / 6).astype(np.float32)
            wave = (0.5 + 0.5 * np.cos(x / 5)).astype(np.float32)
            for name, light in (("spot", spot), ("sinusoid", wave)):
                rate = of_the_server(address, light)
                print(f"the server alone, {name}: {rate:.0f} pictures a second")
            of_the_page(address, LIGHTS)


if __name__ == "__main__":
    main()
