"""Pictures a second in the viewer's page while its light is dragged, 128 x 128 x 3, W = 19.

Run ``python benchmarks/viewer.py``; it needs Chromium. The browser and the server share the
machine, as they do for a user. Lights that move are of one colour, of several, and all over the
grid. The rate of the server alone, without a browser, is measured in the same run.
"""

import json
import struct
import tempfile
import threading
import time
from pathlib import Path
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


def main() -> None:
    """Print the table."""
    folder = tempfile.TemporaryDirectory()
    path = Path(folder.name) / "transport.zarr"
    save_transport(random_transport(Size(*PROJECTOR), WINDOW, FAR), path)
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
    (address,) = addresses
    y, x = np.indices(PROJECTOR)
    spot = (np.hypot(y - 64, x - 64) < PROJECTOR[0] / 6).astype(np.float32)
    wave = (0.5 + 0.5 * np.cos(x / 5)).astype(np.float32)
    for name, light in (("spot", spot), ("sinusoid", wave)):
        print(f"the server alone, {name}: {of_the_server(address, light):.0f} pictures a second")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path="/usr/bin/chromium", args=["--no-sandbox"]
        )
        for name, state in LIGHTS.items():
            page = browser.new_page(viewport={"width": 1400, "height": 1000})
            page.goto(f"{address}/#{quote(json.dumps(state))}")
            page.wait_for_selector("body[data-frame]", state="attached")
            time.sleep(1)
            print(f"dragged, {name}: {page.evaluate(DRAG, SECONDS):.0f} pictures a second")
            page.close()
        browser.close()
    stop.set()


if __name__ == "__main__":
    main()
