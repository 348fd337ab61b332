"""What a user does in the viewer's page, and what is seen of it."""

import base64
import json
import re
import time
from collections.abc import Hashable
from pathlib import Path
from typing import Any, ClassVar
from urllib.parse import quote

import numpy as np
from playwright.sync_api import Browser, ConsoleMessage, Error, Page, ViewportSize

from nearfar.files import from_srgb, to_srgb
from tests.viewer.asking import PROJECTOR
from tests.waiting import LONGEST_WAIT


class Pages:
    """Pages of a browser, used again: to start one takes longer than most of what is done in it.

    Each is emptied before it is used again, so that it knows no more than a new one.
    """

    VIEWPORT: ClassVar[ViewportSize] = {"width": 1300, "height": 900}

    def __init__(self, browser: Browser) -> None:
        self._browser = browser
        self._idle: dict[Hashable, list[Page]] = {}
        self._used: list[tuple[Hashable, Page]] = []
        self._console: list[str] = []

    def open(self, address: str, state: Any = None, **options: Any) -> Page:
        """Open an address in a page that no one else of this test has.

        Parameters
        ----------
        address : str
        state : object, optional
            What the address says after its #.
        **options
            As of Playwright's ``new_context``; or ``script``, which runs before the page's own.
        """
        kind = tuple(sorted(options.items()))
        idle = self._idle.setdefault(kind, [])
        page = idle.pop() if idle else self._start(**options)
        self._used.append((kind, page))
        show(page, address, state)
        return page

    def put_back(self) -> list[str]:
        """Empty the pages that were opened; returns what they wrote to their consoles."""
        while self._used:
            kind, page = self._used.pop()
            try:
                page.evaluate("() => { localStorage.clear(); sessionStorage.clear(); }")
                page.context.clear_cookies()
                page.mouse.move(0, 0)
                page.set_viewport_size(self.VIEWPORT)
                page.goto("about:blank")
            except Error:
                # Closed by the test, or left in a state that is none: the next one is new.
                page.context.close()
            else:
                self._idle[kind].append(page)
        said, self._console = self._console, []
        return said

    def _start(self, script: str | None = None, **options: Any) -> Page:
        context = self._browser.new_context(viewport=self.VIEWPORT, **options)
        context.set_default_timeout(1000 * LONGEST_WAIT)
        if script is not None:
            context.add_init_script(script)
        page = context.new_page()
        page.on("console", self._on_console)
        page.on("pageerror", lambda error: self._console.append(str(error)))
        return page

    def _on_console(self, line: ConsoleMessage) -> None:
        # The browser itself logs the response to a file that was refused.
        if "status of 400" not in line.text:
            self._console.append(line.text)


def show(page, address, state=None):
    """Load an address anew, though the page may show it already."""
    if page.url != "about:blank":
        page.goto("about:blank")
    page.goto(address + "/" + ("#" + quote(json.dumps(state)) if state else ""))
    settled(page)


def pictures(page):
    return json.loads(page.evaluate("document.body?.dataset.frame || '{}'"))


def settled(page):
    """Wait for the exact picture of the newest light, and all that follows from it."""
    end = time.monotonic() + LONGEST_WAIT
    before = None
    while time.monotonic() < end:
        shown = pictures(page)
        if shown.get("exact") and shown.get("newest") and shown == before:
            return
        before = shown
        time.sleep(0.15)
    raise AssertionError(shown)


def seen(page, canvas="picture"):
    """Read a canvas's pixels, (y, x, 3)."""
    height, width, text = page.evaluate(
        """id => { const c = document.getElementById(id);
        const pixels = c.getContext('2d').getImageData(0, 0, c.width, c.height).data;
        let text = '';
        for (const value of pixels) text += String.fromCharCode(value);
        return [c.height, c.width, btoa(text)]; }""",
        canvas,
    )
    # As text, for Playwright looks at each value of a list.
    pixels = np.frombuffer(base64.b64decode(text), np.uint8)
    return pixels.reshape(height, width, 4)[..., :3]


def tone(picture):
    return np.rint(255 * to_srgb(np.clip(picture, 0, 1)))


def slide(page, name, value):
    page.evaluate(
        """([name, value]) => { const s = document.querySelector(`[data-of=${name}]`);
        s.value = value; s.dispatchEvent(new Event('input')); }""",
        [name, value],
    )


def drag(page, *places):
    """Press the mouse on the light at the first of places, (y, x) in grid pixels, and move on."""
    box = page.locator("#light").bounding_box()

    def at(y, x):
        return (
            box["x"] + (x + 0.5) / PROJECTOR.width * box["width"],
            box["y"] + (y + 0.5) / PROJECTOR.height * box["height"],
        )

    page.mouse.move(*at(*places[0]))
    page.mouse.down()
    for place in places[1:]:
        page.mouse.move(*at(*place), steps=4)
    page.mouse.up()
    settled(page)


def saved(page, button, folder: Path):
    with page.expect_download() as download:
        page.click(button)
    path = folder / download.value.suggested_filename
    download.value.save_as(path)
    return path


def drop(page, target, name, data, kind="image/png"):
    page.evaluate(
        """([target, name, bytes, kind]) => {
        const given = new DataTransfer();
        const data = Uint8Array.from(atob(bytes), letter => letter.charCodeAt(0));
        given.items.add(new File([data], name, { type: kind }));
        document.querySelector(target).dispatchEvent(
          new DragEvent('drop', { dataTransfer: given, bubbles: true, cancelable: true })); }""",
        [target, name, base64.b64encode(data).decode(), kind],
    )


def contrast(page, selector):
    """Ratio of luminances of a text and what lies behind it, as WCAG has it."""
    colours = page.evaluate(
        """selector => { const at = document.querySelector(selector); let behind = at;
        const back = () => getComputedStyle(behind).backgroundColor;
        while (back() === 'rgba(0, 0, 0, 0)') behind = behind.parentElement;
        return [getComputedStyle(at).color, back()]; }""",
        selector,
    )
    light = [
        0.2126 * r + 0.7152 * g + 0.0722 * b
        for r, g, b in (
            from_srgb(np.array([int(v) for v in re.findall(r"\d+", colour)[:3]]) / np.float32(255))
            for colour in colours
        )
    ]
    return (max(light) + 0.05) / (min(light) + 0.05)
