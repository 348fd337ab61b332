"""The viewer's page in a real browser: a region of the scene, and held-out photos."""

import json
import re
from urllib.parse import unquote

import numpy as np
import pytest

from nearfar.applications.masks import ProbingMask
from nearfar.applications.probe import probe
from nearfar.capture import open_capture
from nearfar.estimate.error_bars import ErrorBars
from nearfar.transport.stored import open_transport
from nearfar.viewer.held_out import photo_maps
from nearfar.viewer.interactive import InteractiveTransport
from tests.viewer.asking import CAMERA, PROJECTOR
from tests.viewer.browsing import seen, settled
from tests.waiting import wait_until

pytestmark = pytest.mark.slow

WHITE = np.ones(PROJECTOR, np.float32)
REGION = np.s_[6:13, 10:25]


def _at(page, y, x):
    """Where a camera pixel is on the screen."""
    box = page.locator("#picture").bounding_box()
    across, down = box["width"] / CAMERA.width, box["height"] / CAMERA.height
    return box["x"] + (x + 0.5) * across, box["y"] + (y + 0.5) * down


def _drag(page, start, end):
    page.mouse.move(*_at(page, *start))
    page.mouse.down()
    page.mouse.move(*_at(page, *end), steps=5)
    page.mouse.up()


def _table(page):
    rows = [row.split("\t") for row in page.locator("#region-numbers tr").all_inner_texts()]
    return {row[0]: [float(cell) for cell in row[1:4]] for row in rows[1:]}


def _ready(page, region):
    """Wait for the numbers of a region, by how many camera pixels it has."""
    pixels = np.zeros(CAMERA)[region].size
    page.wait_for_selector(f"#region-note:has-text('{pixels} camera pixel')")


def _check_numbers(page, transport, light, region):
    parts = transport.components(light)
    found = _table(page)
    sigma = ErrorBars(transport).picture(light)

    def mean(picture):
        return picture[region].reshape(-1, 3).mean(axis=0)

    expected = {
        "light": mean(sum(parts)),
        "direct": mean(parts.direct),
        "near-range": mean(parts.near),
        "far-range": mean(parts.far),
        "spread over the region": (sum(parts)[region]).reshape(-1, 3).std(axis=0),
        "± of one camera pixel": np.sqrt(mean(sigma**2)),
        "noise of one measurement": np.sqrt(mean(transport.noise**2)),
    }
    assert list(found) == list(expected)
    for name, values in expected.items():
        # Four decimals, and two digits of what is below a thousandth.
        np.testing.assert_allclose(found[name], values, rtol=0.06, atol=6e-5, err_msg=name)


def test_a_region_is_dragged_on_the_scene(open_page, address, transport):
    page = open_page(address, {"kind": "white"})
    # Backwards is a region as well.
    _drag(page, (12, 24), (6, 10))
    _ready(page, REGION)
    assert page.get_attribute("#tab-region", "aria-selected") == "true"
    _check_numbers(page, transport, WHITE, REGION)
    # It was no click.
    assert not page.is_visible("#mark")
    mark, picture = (page.locator(id_).bounding_box() for id_ in ("#region-mark", "#picture"))
    across, down = picture["width"] / CAMERA.width, picture["height"] / CAMERA.height
    assert mark["x"] - picture["x"] == pytest.approx(10 * across, abs=1)
    assert mark["width"] == pytest.approx(15 * across, abs=1)
    assert mark["height"] == pytest.approx(7 * down, abs=1)
    # The mean row is drawn as a row of one camera pixel is.
    rows = transport.component_rows(slice(None)).far.reshape(*CAMERA, 3, *PROJECTOR)
    far = rows[REGION].mean(axis=(0, 1, 2))
    shown = seen(page, "region-far").astype(int).sum(axis=-1)
    assert np.corrcoef(shown.ravel(), np.log(np.maximum(far, 1e-6)).ravel())[0, 1] > 0.8
    assert page.locator("#region-plots figure:has(#region-spectrum)").inner_text()
    assert "105 camera pixels' rows" in page.inner_text("#region-spectrum-title")
    # A click is one as before, and the region stays.
    page.mouse.click(*_at(page, 20, 30))
    page.wait_for_selector("#mark:not([hidden])")
    wait_until(lambda: page.inner_text("#pixel") == "row 20, column 30")
    assert page.is_visible("#region-mark")
    # Its numbers follow the light.
    page.click("#tab-region")
    page.keyboard.press("7")
    settled(page)
    # There are none until those of the new light come.
    wait_until(lambda: _table(page).get("light", [np.inf])[0] < 0.05)


@pytest.mark.parametrize("width", [390, 1300])
def test_a_finger_drags_a_region_only_when_it_is_told_to(open_page, address, width):
    page = open_page(address, {"kind": "white"}, has_touch=True)
    page.set_viewport_size({"width": width, "height": 900})
    page.click("#tab-region")
    touch = page.context.new_cdp_session(page)

    def drag_by_finger(start, end):
        for kind, place in (("touchStart", start), ("touchMove", end), ("touchEnd", None)):
            points = [dict(zip("xy", _at(page, *place), strict=True))] if place else []
            touch.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

    drag_by_finger((6, 10), (12, 24))
    assert not page.is_visible("#region-mark")
    page.tap("#region-drag")
    # On a phone the sheet is out of the way meanwhile.
    assert page.is_visible("#panel-region") == (width > 860)
    drag_by_finger((6, 10), (12, 24))
    _ready(page, REGION)
    assert page.is_visible("#region-mark")
    # Once: after it, a finger scrolls again.
    assert page.get_attribute("#region-drag", "aria-pressed") == "false"


def test_a_mouse_alone_is_not_asked_for_a_finger(open_page, address):
    page = open_page(address, {"tab": "region"})
    assert not page.is_visible("#region-drag")


def test_light_of_a_region_by_distance_is_what_probing_makes(open_page, address, transport):
    mask = ProbingMask.beyond(4.0)
    light = np.broadcast_to(WHITE[..., None], (*PROJECTOR, 3))
    total = transport.relight(light)[REGION].mean()
    expected = probe(transport, light, mask)[REGION].mean()
    state = {"kind": "white", "tool": "reach", "range": "beyond", "reach": 4, "tab": "region"}
    page = open_page(address, {**state, "region": [6, 10, 13, 25]})
    line = "#region-by-distance:has-text('light from 4 px or more away')"
    text = page.locator(line).inner_text()
    found, share = map(float, re.search(r": ([\d.]+), ([\d.]+) %", text).groups())
    assert found == pytest.approx(expected, rel=0.01, abs=6e-5)
    assert share == pytest.approx(100 * expected / total, rel=0.01, abs=0.06)
    # It is of the light by distance alone.
    page.click("[data-tool=relit]")
    wait_until(lambda: page.inner_text("#region-by-distance") == "")


def test_a_region_is_typed_by_the_keyboard_alone(open_page, address, transport):
    page = open_page(address, {"kind": "white", "tab": "row"})
    page.focus("#tab-row")
    for _ in range(4):
        page.keyboard.press("ArrowRight")
    assert page.evaluate("document.activeElement.id") == "tab-region"
    for text in ("6", "12", "10", "24"):
        page.keyboard.press("Tab")
        if text == "6":
            while page.evaluate("document.activeElement.id") != "region-top":
                page.keyboard.press("Tab")
        page.keyboard.type(text)
    page.keyboard.press("Enter")
    _ready(page, REGION)
    # The digits chose no other light.
    assert page.get_attribute("[data-kind=white]", "aria-pressed") == "true"
    _check_numbers(page, transport, WHITE, REGION)
    # What is outside of the camera says where its ends are.
    page.keyboard.press("Control+a")
    page.keyboard.type("99")
    page.keyboard.press("Enter")
    assert "columns from 0 to 41" in page.inner_text("#region-status")
    page.focus("#region-about")
    page.keyboard.press("Enter")
    _ready(page, np.s_[11:20, 17:26])
    wait_until(lambda: '"region":[11,17,20,26]' in unquote(page.evaluate("location.href")))
    page.focus("#region-none")
    page.keyboard.press("Enter")
    assert not page.is_visible("#region-mark")
    assert not page.is_visible("#region-numbers")


def test_an_address_holds_the_region(open_page, address, transport):
    page = open_page(address, {"kind": "white", "tab": "region", "region": [6, 10, 13, 25]})
    _ready(page, REGION)
    _check_numbers(page, transport, WHITE, REGION)


def test_held_out_photos_are_told_under_the_pointer(open_page, serve, stored):
    maps = photo_maps(open_transport(stored), open_capture(stored.parent / "capture.zarr"))
    address = serve(InteractiveTransport(stored), photo_maps=maps)
    page = open_page(address, {"kind": "white", "tab": "numbers", "map": "held-out"})
    page.mouse.move(*_at(page, 12, 33))
    page.wait_for_selector("#readout:has-text('off at held-out photos')")
    told = re.search(r"off at held-out photos ([\d.]+) %", page.inner_text("#readout"))
    assert float(told[1]) == pytest.approx(maps["held-out"].values[12, 33], rel=0.06)
    last = page.locator("#numbers tr").last.inner_text()
    assert last.split("\t")[0] == "off at held-out photos"
    assert told[1] in last
    page.click("#tab-map")
    page.wait_for_selector("#map-caption:has-text('that no estimate used')")
    page.goto("about:blank")
    listed = json.loads(page.request.get(f"{address}/scene").text())["maps"]
    assert [each["name"] for each in listed][-2:] == ["held-out", "misfit"]
