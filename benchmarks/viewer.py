"""Pictures a second in the viewer's page while its light is dragged, 128 x 128 x 3, W = 19.

Run ``python benchmarks/viewer.py``; it needs Chromium. The browser and the server share the
machine, as they do for a user. Lights that move are of one colour, of several, and all over the
grid. The rate of the server alone, without a browser, is measured in the same run. ``python
benchmarks/viewer.py TRANSPORT.zarr`` drags a white light before a transport of your own, and tells
how long the exact picture takes once the light is let go. ``python benchmarks/viewer.py --load 0 4
10`` makes its own load: a white spot is dragged while so many other processes are busy, and the
rate is printed with the time from a light to its picture on the page.
"""

import argparse
import json
import multiprocessing
import os
import statistics
import struct
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
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
  const began = performance.now(), before = count(), delays = [], widths = [];
  new MutationObserver(() => {
    delays.push(Number(document.body.dataset.delay));
    widths.push(document.getElementById('picture').width);
  }).observe(document.body, { attributeFilter: ['data-delay'] });
  const step = now => {
    const passed = (performance.now() - began) / 1000;
    dispatch('pointermove', 2 * passed);
    if (passed < seconds) return requestAnimationFrame(step);
    dispatch('pointerup', 0);
    done([(count() - before) / passed, delays, widths]);
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
            rate, *_ = page.evaluate(DRAG, SECONDS)
            let_go = time.perf_counter()
            page.wait_for_selector(EXACT, state="attached")
            waited = time.perf_counter() - let_go
            print(f"dragged, {name}: {rate:.0f} pictures a second, then exact in {waited:.1f} s")
            page.close()
        browser.close()


def _be_busy() -> None:
    with suppress(KeyboardInterrupt):
        while True:
            pass


@contextmanager
def load(processes: int) -> Iterator[None]:
    """Keep so many processes busy."""
    context = multiprocessing.get_context("spawn")
    busy = [context.Process(target=_be_busy, daemon=True) for _ in range(processes)]
    for process in busy:
        process.start()
    # They have begun, and the machine's scheduler knows them.
    time.sleep(2 + processes / 2)
    try:
        yield
    finally:
        for process in busy:
            process.terminate()
            process.join()


def under_loads(address: str, loads: list[int]) -> None:
    """Print rate and delay of a dragged spot while other processes are busy."""
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path="/usr/bin/chromium", args=["--no-sandbox"]
        )
        for processes in loads:
            page = browser.new_page(viewport={"width": 1400, "height": 1000})
            page.goto(f"{address}/#{quote(json.dumps({'kind': 'spot'}))}")
            page.wait_for_selector(EXACT, state="attached")
            with load(processes):
                rate, delays, widths = page.evaluate(DRAG, 2 * SECONDS)
                machine = os.getloadavg()[0]
                let_go = time.perf_counter()
                page.wait_for_selector(EXACT, state="attached")
                waited = time.perf_counter() - let_go
            delays.sort()
            fine = sum(width == max(widths) for width in widths) / len(widths)
            print(
                f"{processes} busy processes (the machine's load {machine:.1f}): {rate:.0f} "
                f"pictures a second; from light to picture {1000 * statistics.median(delays):.0f} "
                f"ms, 95 of 100 within {1000 * delays[int(0.95 * (len(delays) - 1))]:.0f} ms; "
                f"{100 * fine:.0f} % in full detail; exact {waited:.2f} s after the light rests",
                flush=True,
            )
            page.close()
        browser.close()


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("transport", nargs="?", type=Path)
    parser.add_argument("--load", nargs="+", type=int, metavar="PROCESSES")
    given = parser.parse_args()
    if given.transport:
        thin, thick = ({"kind": "paint", "brush": radius} for radius in (0.5, 20))
        with served(given.transport) as address:
            plain = {name: {"kind": name} for name in ("spot", "sinusoid", "pixel")}
            of_the_page(address, {**plain, "a brush of one pixel": thin, "a broad brush": thick})
        return
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "transport.zarr"
        save_transport(random_transport(Size(*PROJECTOR), WINDOW, FAR), path)
        with served(path) as address:
            if given.load:
                under_loads(address, given.load)
                return
            y, x = np.indices(PROJECTOR)
            spot = (np.hypot(y - 64, x - 64) < PROJECTOR[0] / 6).astype(np.float32)
            wave = (0.5 + 0.5 * np.cos(x / 5)).astype(np.float32)
            for name, light in (("spot", spot), ("sinusoid", wave)):
                rate = of_the_server(address, light)
                print(f"the server alone, {name}: {rate:.0f} pictures a second")
            of_the_page(address, LIGHTS)


if __name__ == "__main__":
    main()
