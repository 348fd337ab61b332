"""The viewer's page in a browser: steps undone, values typed, the part of the scene seen."""

import json
import time

import numpy as np
import pytest

from nearfar.files.codecs import encode_png
from tests.viewer.asking import CAMERA, PROJECTOR
from tests.viewer.browsing import drag, drop, saved, seen, settled, slide, tone
from tests.waiting import wait_until

pytestmark = pytest.mark.slow


def _press(page, keys):
    page.keyboard.press(keys)
    settled(page)


def _value(page, name):
    return float(page.input_value(f"[data-of={name}]"))


def _slide_by_hand(page, name, share):
    """Drag a slider's handle from the middle on."""
    slider = page.locator(f"[data-of={name}]")
    slider.scroll_into_view_if_needed()
    box = slider.bounding_box()
    y = box["y"] + box["height"] / 2
    page.mouse.move(box["x"] + box["width"] / 2, y)
    page.mouse.down()
    page.mouse.move(box["x"] + share * box["width"], y, steps=6)
    page.mouse.up()


def test_a_stroke_a_drag_and_a_slider_are_a_step_each(open_page, address):
    page = open_page(address, {"kind": "paint"})
    assert page.is_disabled("#undo")
    drag(page, (3, 3), (3, 20))
    once = seen(page, "light")
    drag(page, (15, 3), (12, 9), (15, 20))
    twice, lit = seen(page, "light"), seen(page)
    _slide_by_hand(page, "exposure", 0.9)
    exposure = _value(page, "exposure")
    assert exposure > 3
    _press(page, "Control+z")
    assert _value(page, "exposure") == 0
    np.testing.assert_array_equal(seen(page), lit)
    _press(page, "Control+z")
    np.testing.assert_array_equal(seen(page, "light"), once)
    page.click("#undo")
    settled(page)
    assert seen(page, "light").max() == 0
    assert page.is_disabled("#undo")
    # And again, by either keys and the button.
    _press(page, "Control+y")
    np.testing.assert_array_equal(seen(page, "light"), once)
    _press(page, "Control+Shift+Z")
    np.testing.assert_array_equal(seen(page, "light"), twice)
    page.click("#redo")
    settled(page)
    assert _value(page, "exposure") == exposure
    assert page.is_disabled("#redo")
    # Something new ends what could be done again.
    _press(page, "Control+z")
    page.click("[data-kind=white]")
    settled(page)
    assert page.is_disabled("#redo")


def test_pixels_views_gains_and_what_plays_are_undone(open_page, address):
    page = open_page(address)
    page.click("#picture", position={"x": 40, "y": 40})
    page.wait_for_selector("#row:not([hidden])")
    first = page.inner_text("#pixel")
    page.focus("#picture")
    page.keyboard.press("Shift+ArrowDown")
    wait_until(lambda: page.inner_text("#pixel") != first)
    page.click("#tab-light" if page.query_selector("#tab-light") else "[data-tab=light]")
    page.click("[data-tool=reach]")
    page.wait_for_selector("#strip figure")
    page.keyboard.press("Control+z")
    assert page.get_attribute("[data-tool=relit]", "aria-pressed") == "true"
    page.keyboard.press("Control+z")
    wait_until(lambda: page.text_content("#pixel") == first)
    page.keyboard.press("Control+z")
    assert page.text_content("#pixel") == "click the scene"
    assert not page.is_visible("#mark")
    # However long it plays, it is one step.
    before = seen(page, "light")
    page.click("#play")
    wait_until(lambda: np.abs(seen(page, "light").astype(int) - before).max() > 50)
    time.sleep(0.6)
    page.click("#play")
    settled(page)
    _press(page, "Control+z")
    # It is drawn with the next frame of the screen.
    wait_until(lambda: np.array_equal(seen(page, "light"), before))
    assert page.is_disabled("#undo")


def test_a_press_does_not_part_what_plays_into_steps(open_page, address):
    page = open_page(address)
    before = seen(page, "light")

    def moves_on():
        shown = seen(page, "light")
        wait_until(lambda: not np.array_equal(seen(page, "light"), shown))

    page.click("#play")
    moves_on()
    # It plays until the button is let go.
    page.hover("#play")
    page.mouse.down()
    moves_on()
    moves_on()
    page.mouse.up()
    settled(page)
    stopped = seen(page, "light")
    # What plays once more is a step of its own.
    page.click("#play")
    moves_on()
    page.click("#play")
    settled(page)
    for light in (stopped, before):
        _press(page, "Control+z")
        wait_until(lambda light=light: np.array_equal(seen(page, "light"), light))
    assert page.is_disabled("#undo")


def test_keys_of_a_text_field_are_its_own(open_page, address):
    page = open_page(address)
    page.click("[data-kind=white]")
    page.click("#view-name")
    page.keyboard.type("night 2")
    page.keyboard.press("Control+z")
    assert page.get_attribute("[data-kind=white]", "aria-pressed") == "true"
    assert page.get_attribute("[data-solo=near]", "aria-pressed") == "false"
    assert page.inner_text("#play") == "animate"


def test_a_dropped_picture_is_removed_and_comes_back(open_page, address):
    page = open_page(address)
    for level in (60, 120):
        drop(page, "#light", f"{level}.png", encode_png(np.full((*PROJECTOR, 3), level, np.uint8)))
        wait_until(lambda level=level: (seen(page, "light") == level).all())
    page.click("#add-keyframe")
    slide(page, "shown", 0)
    settled(page)
    page.click("#remove-picture")
    settled(page)
    assert (seen(page, "light") == 120).all()
    assert page.inner_text("[data-for=picture] output") == "1 of 1"
    # The keyframe of the other one follows it.
    page.click("#tab-keyframes")
    page.click("#keyframes .name")
    settled(page)
    assert (seen(page, "light") == 120).all()
    page.click("[data-tab=light]")
    page.click("#remove-picture")
    settled(page)
    assert page.is_disabled("#remove-picture")
    assert page.inner_text("#keyframes") == ""
    _press(page, "Control+z")
    _press(page, "Control+z")
    assert (seen(page, "light") == 60).all()
    assert page.inner_text("[data-for=picture] output") == "1 of 2"


def test_values_are_typed(open_page, address, transport):
    page = open_page(address, {"kind": "white"})
    output = page.locator("label:has([data-of=exposure]) output")
    output.click()
    page.keyboard.type("1,5 EV")
    page.keyboard.press("Enter")
    assert _value(page, "exposure") == 1.5
    assert output.inner_text() == "+1.5 EV"
    white = transport @ np.ones(PROJECTOR, np.float32)
    assert np.abs(seen(page) - tone(2**1.5 * white)).max() <= 1
    # Nothing but a number is taken, no further than the slider goes; Esc leaves it as it was.
    for typed, expected in (("dark", 1.5), ("99", 12), ("-99", -6)):
        output.focus()
        page.keyboard.type(typed)
        page.keyboard.press("Enter")
        assert _value(page, "exposure") == expected
    output.focus()
    page.keyboard.type("3")
    page.keyboard.press("Escape")
    assert _value(page, "exposure") == -6
    assert output.inner_text() == "-6.0 EV"


def test_the_scene_is_enlarged_and_moved(open_page, address):
    page = open_page(address)
    box = page.locator("#scene-view").bounding_box()
    whole = page.locator("#picture").bounding_box()
    assert whole["width"] == pytest.approx(box["width"], abs=1)
    # About the pointer: what is there stays there.
    x, y = box["x"] + 0.75 * box["width"], box["y"] + 0.25 * box["height"]
    page.mouse.move(x, y)
    page.keyboard.down("Control")
    page.mouse.wheel(0, -400)
    page.keyboard.up("Control")
    wait_until(lambda: page.inner_text("#view-zoom") == "4x")
    large = page.locator("#picture").bounding_box()
    assert large["width"] == pytest.approx(4 * box["width"], rel=0.01)
    assert (x - large["x"]) / large["width"] == pytest.approx(0.75, abs=0.01)
    assert (y - large["y"]) / large["height"] == pytest.approx(0.25, abs=0.01)
    # Clicked where it is enlarged, a pixel is the right one.
    page.mouse.click(x, y)
    row, column = int(0.25 * CAMERA.height), int(0.75 * CAMERA.width)
    page.wait_for_selector(f"#pixel:has-text('row {row}, column {column}')")
    # Shift drags it, and drags no further than its border.
    page.keyboard.down("Shift")
    page.mouse.move(box["x"] + 30, box["y"] + 200)
    page.mouse.down()
    page.mouse.move(box["x"] + 230, box["y"] + 200, steps=3)
    page.mouse.up()
    page.keyboard.up("Shift")
    assert page.locator("#picture").bounding_box()["x"] == pytest.approx(large["x"] + 200, abs=2)
    assert page.inner_text("#pixel") == f"row {row}, column {column}"
    # By the keyboard alone; the camera pixel that is chosen stays in view.
    page.focus("#picture")
    for _ in range(9):
        page.keyboard.press("Control+ArrowLeft")
    assert page.locator("#picture").bounding_box()["x"] == pytest.approx(box["x"], abs=1)
    page.keyboard.press("ArrowDown")
    page.wait_for_selector(f"#pixel:has-text('row {row + 1}, column {column}')")
    mark = page.locator("#mark").bounding_box()
    assert box["x"] < mark["x"] < box["x"] + box["width"]
    page.keyboard.press("0")
    assert page.locator("#picture").bounding_box()["width"] == pytest.approx(box["width"], abs=1)
    page.keyboard.press("+")
    assert page.inner_text("#view-zoom") == "1.4x"
    page.click("[data-view=out]")
    assert page.inner_text("#view-zoom") == "whole scene"


def test_colours_are_shown_one_at_a_time(open_page, address, transport, tmp_path):
    page = open_page(address, {"kind": "white"})
    white = transport @ np.ones(PROJECTOR, np.float32)
    for number, colour in enumerate(("red", "green", "blue")):
        page.click(f"[data-channel={colour}]")
        expected = np.repeat(tone(white[..., number])[..., None], 3, axis=-1)
        assert np.abs(seen(page) - expected).max() <= 1
    assert saved(page, "#save-png", tmp_path).name == "a-scene-white-relit-blue.png"
    page.click("[data-channel='']")
    assert np.abs(seen(page) - tone(white)).max() <= 1


def test_exposure_follows_the_light(open_page, address):
    page = open_page(address, {"kind": "white"})
    page.click("#metering")
    bright = _value(page, "exposure")
    page.click("[data-kind=pixel]")
    settled(page)
    assert _value(page, "exposure") > bright + 1
    assert 245 < np.percentile(seen(page), 99.5) <= 255
    # What follows the light is no step of its own.
    _press(page, "Control+z")
    assert page.get_attribute("[data-kind=white]", "aria-pressed") == "true"
    wait_until(lambda: _value(page, "exposure") == bright)
    slide(page, "exposure", 2)
    assert page.get_attribute("#metering", "aria-pressed") == "false"
    page.click("[data-kind=spot]")
    settled(page)
    assert _value(page, "exposure") == 2


def test_views_are_kept_by_name(open_page, address):
    page = open_page(address, {"kind": "stripe", "exposure": 1, "viewZoom": 2, "channel": "red"})
    stripe = seen(page)
    page.fill("#view-name", "a stripe")
    page.press("#view-name", "Enter")
    page.click("[data-kind=white]")
    page.click("#reset")
    page.keyboard.press("0")
    wait_until(lambda: "white" in page.evaluate("decodeURIComponent(location.hash)"))
    page.reload()
    settled(page)
    page.click("#views button:has-text('a stripe')")
    settled(page)
    np.testing.assert_array_equal(seen(page), stripe)
    assert page.inner_text("#view-zoom") == "2x"
    # It is one step.
    _press(page, "Control+z")
    assert page.get_attribute("[data-kind=white]", "aria-pressed") == "true"
    page.click("[aria-label='remove the view a stripe']")
    page.reload()
    settled(page)
    assert page.inner_text("#views") == ""


@pytest.mark.parametrize("kept", ["{", "[1,{}]", '[{"name":"x","state":{"kind":5,"radius":1e99}}]'])
def test_views_that_were_tampered_with_do_no_harm(open_page, address, kept):
    page = open_page(address)
    page.evaluate("kept => localStorage.setItem('nearfar-views-a scene.zarr', kept)", kept)
    page.reload()
    settled(page)
    for button in page.query_selector_all("#views li button:first-child"):
        button.click()
        settled(page)
    assert page.get_attribute("[data-kind=spot]", "aria-pressed") == "true"


@pytest.mark.parametrize(
    "given",
    [
        {"exposure": 1e9, "zoom": 1e9, "radius": -1e9, "viewZoom": 1e9, "cameraRadius": 1e9},
        {"kind": "sinusoid", "cycles": 1e9, "phase": -1e9, "angle": 1e9, "viewX": -7, "seconds": 0},
        {"kind": "checkerboard", "side": 0, "shift": 1e9, "x": 1e300, "channel": "infrared"},
    ],
)
def test_numbers_of_an_address_go_no_further_than_sliders(open_page, address, given):
    page = open_page(address, given)
    for slider in page.query_selector_all("[data-of]"):
        value, low, high, name = slider.evaluate("e => [e.value, e.min, e.max, e.dataset.of]")
        assert float(low) <= float(value) <= float(high)
        shown = page.evaluate("decodeURIComponent(location.hash.slice(1))")
        assert name not in (json.loads(shown) if shown else {}) or name in given
    assert page.evaluate("document.documentElement.scrollWidth") <= 1300
    assert page.locator("#picture").bounding_box()["width"] < 64.1 * 1300


def test_words_are_explained_under_the_pointer_and_the_focus(open_page, address):
    page = open_page(address, {"pixel": [10, 10], "tab": "row"})
    page.wait_for_selector("#row:not([hidden])")
    for selector, said in (
        ("[data-solo=near]", "N: what comes from the window about q"),
        ("[data-tool=dual]", "as the projector would photograph it"),
        (".k-far", "cycles per projector pixel"),
        ("#panel-row [data-word=q]", "lights this camera pixel directly"),
    ):
        page.mouse.move(1, 1)
        page.wait_for_selector("#tip", state="hidden")
        page.hover(selector)
        page.wait_for_selector(f"#tip:has-text('{said}')")
    page.keyboard.press("Escape")
    page.wait_for_selector("#tip", state="hidden")
    # By the keyboard.
    page.focus("[data-split=physical]")
    page.keyboard.press("Tab")
    page.keyboard.press("Shift+Tab")
    page.wait_for_selector("#tip:has-text('how light travels')")
    # It stays on the screen of a phone.
    page.set_viewport_size({"width": 390, "height": 844})
    page.hover("[data-tool=compensation]")
    tip = page.locator("#tip").bounding_box()
    assert 0 <= tip["x"] < tip["x"] + tip["width"] <= 390
