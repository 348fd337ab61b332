"""The viewer's page in a real browser: what it says while files are read, and when they fail."""

import sys

import numpy as np
import pytest

from nearfar.files.codecs import encode_npy, encode_png
from tests.viewer.asking import PROJECTOR
from tests.viewer.browsing import contrast, drop, seen, settled, slide
from tests.waiting import wait_until

pytestmark = pytest.mark.slow

LINEAR = np.full(PROJECTOR, 0.25, np.float32)


def _is_lit(page, level):
    """Whether the light is of one level everywhere."""
    return bool(np.all(seen(page, "light") == level))


def test_a_file_that_is_read_is_named_until_it_is_there(open_page, address):
    page = open_page(address)
    drop(page, "#light", "quarter.npy", encode_npy(LINEAR), "")
    page.wait_for_selector("#reading:has-text('reading quarter.npy')")
    page.wait_for_selector("output:has-text('1 of 1')")
    assert page.inner_text("#reading") == ""
    # On the scene, too, and when it fails.
    drop(page, "#stage", "torn.exr", b"no picture", "")
    page.wait_for_selector("#reading:has-text('reading torn.exr')")
    page.wait_for_selector("#fault:has-text('torn.exr')")
    assert page.inner_text("#reading") == ""


def test_a_fault_stays_until_its_own_file_goes_well_or_it_is_closed(open_page, address):
    page = open_page(address)
    picture = encode_png(np.full((*PROJECTOR, 3), 60, np.uint8))
    drop(page, "#light", "torn.png", b"no picture")
    page.wait_for_selector("#fault:has-text('torn.png is no picture')")
    # Neither another file nor another light takes it away.
    drop(page, "#light", "leaves.png", picture)
    wait_until(lambda: _is_lit(page, 60))
    page.click("[data-kind=sinusoid]")
    page.click("#play")
    before = seen(page, "light")
    wait_until(lambda: not np.array_equal(seen(page, "light"), before))
    page.click("#play")
    settled(page)
    assert "torn.png is no picture" in page.inner_text("#fault")
    # Two faults are told side by side, and the page stays where it is.
    top = page.locator("#stage").bounding_box()["y"]
    drop(page, "#light", "x.exr", b"no picture", "")
    page.wait_for_selector("#fault:has-text('x.exr')")
    assert "torn.png" in page.inner_text("#fault")
    assert page.locator("#stage").bounding_box()["y"] == top
    drop(page, "#light", "torn.png", picture)
    wait_until(lambda: "torn.png" not in page.inner_text("#fault"))
    assert "x.exr" in page.inner_text("#fault")
    page.keyboard.press("Escape")
    assert page.inner_text("#fault") == ""
    drop(page, "#light", "y.png", b"no picture")
    page.wait_for_selector("#fault:has-text('y.png')")
    page.focus("#fault button")
    page.keyboard.press("Enter")
    assert page.inner_text("#fault") == ""


def test_of_several_files_those_that_are_pictures_are_taken(open_page, address):
    page = open_page(address)
    page.set_input_files(
        "#pictures",
        [
            {"name": "torn.png", "mimeType": "image/png", "buffer": b"no picture"},
            {
                "name": "good.png",
                "mimeType": "image/png",
                "buffer": encode_png(np.full((*PROJECTOR, 3), 60, np.uint8)),
            },
        ],
    )
    page.wait_for_selector("output:has-text('1 of 1')")
    wait_until(lambda: _is_lit(page, 60))
    assert "torn.png" in page.inner_text("#fault")


def test_a_map_that_fails_leaves_nothing_behind(open_page, address):
    page = open_page(address, {"tab": "map"})
    refusal = {"status": 400, "json": {"fault": "there is no such map."}}
    page.route("**/map/row", lambda route: route.fulfill(**refusal))
    page.select_option("#maps", "error")
    page.wait_for_selector("#map-caption:has-text('grey')")
    page.select_option("#maps", "row")
    page.wait_for_selector("#fault:has-text('no such map')")
    assert page.inner_text("#map-caption") == ""
    assert not page.is_visible("#map")
    # Another one goes well, and the fault of the one before is over.
    page.select_option("#maps", "error")
    page.wait_for_selector("#map-caption:has-text('grey')")
    assert page.inner_text("#fault") == ""


def test_the_wipe_s_edge_is_dragged_where_the_scene_is_enlarged(open_page, address):
    page = open_page(address, {"viewZoom": 2, "viewX": 0.25, "viewY": 0.25})
    page.click("#keep")
    slide(page, "wipe", 20)
    box = page.locator("#edge").bounding_box()
    scene = page.locator("#scene-view").bounding_box()
    page.mouse.move(box["x"] + 1, box["y"] + 60)
    page.mouse.down()
    page.mouse.move(scene["x"] + 0.8 * scene["width"], box["y"] + 60, steps=4)
    page.mouse.up()
    assert float(page.input_value("[data-of=wipe]")) == pytest.approx(40, abs=1)


def test_a_film_without_its_package_says_how_to_get_it(open_page, address, monkeypatch):
    monkeypatch.setitem(sys.modules, "cv2", None)
    frames = [{"kind": "spot"}, {"kind": "white"}]
    page = open_page(address, {"keyframes": frames, "tab": "keyframes"})
    page.click("#film-mp4")
    page.wait_for_selector("#fault:has-text('nearfar[film]')")
    assert not page.is_visible("#film-cancel")


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [390, 844, 1300, 1900])
def test_what_is_kept_and_said_is_readable_by_day_and_night(open_page, address, scheme, width):
    frames = [{"kind": "spot"}, {"kind": "sinusoid"}]
    page = open_page(address, {"keyframes": frames}, color_scheme=scheme)
    page.set_viewport_size({"width": width, "height": 390 if width == 844 else 900})
    page.fill("#view-name", "a name that is longer than the place for it, by far")
    page.press("#view-name", "Enter")
    page.hover("[data-tool=compensation]")
    assert contrast(page, "#tip") >= 4.5
    drop(page, "#light", "x.exr", b"no picture", "")
    page.wait_for_selector("#reading:has-text('x.exr')")
    assert contrast(page, "#reading") >= 4.5
    page.wait_for_selector("#fault:has-text('x.exr')")
    fault = page.locator("#fault").bounding_box()
    texts = "#fault span, #fault button, #keyframes .name, #film-length, #views button, .word"
    for selector in f"{texts}, #view-zoom".split(", "):
        assert contrast(page, selector) >= 4.5, selector
    page.keyboard.press("Escape")
    page.click("#copy-as")
    for selector in ("#copying p", "#copying pre", "#copying h2"):
        assert contrast(page, selector) >= 4.5, selector
    for box in (fault, page.locator("#copying").bounding_box()):
        assert 0 <= box["x"] <= box["x"] + box["width"] <= width
    assert page.evaluate("document.documentElement.scrollWidth") <= width
