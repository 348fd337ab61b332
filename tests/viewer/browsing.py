"""What a user does in the viewer's page, and what is seen of it."""

import json
import time
from pathlib import Path

import numpy as np

from nearfar.files import to_srgb
from tests.viewer.asking import PROJECTOR
from tests.waiting import LONGEST_WAIT


def pictures(page):
    return json.loads(page.evaluate("document.body.dataset.frame || '{}'"))


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
    data = page.evaluate(
        """id => { const c = document.getElementById(id);
        const pixels = c.getContext('2d').getImageData(0, 0, c.width, c.height).data;
        return [c.height, c.width, ...pixels]; }""",
        canvas,
    )
    return np.array(data[2:], dtype=np.uint8).reshape(data[0], data[1], 4)[..., :3]


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
        given.items.add(new File([new Uint8Array(bytes)], name, { type: kind }));
        document.querySelector(target).dispatchEvent(
          new DragEvent('drop', { dataTransfer: given, bubbles: true, cancelable: true })); }""",
        [target, name, list(data), kind],
    )
