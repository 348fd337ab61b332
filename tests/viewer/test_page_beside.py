"""The viewer's page in a real browser: a second transport beside the first."""

import re
from dataclasses import replace

import numpy as np
import pytest

import nearfar
from nearfar.transport.store import save_transport
from nearfar.viewer.beside import open_beside
from nearfar.viewer.interactive import InteractiveTransport
from tests.viewer.asking import CAMERA, PROJECTOR
from tests.viewer.browsing import contrast, seen, settled, slide, tone
from tests.viewer.conftest import served_view
from tests.waiting import wait_until

pytestmark = pytest.mark.slow

WHITE = np.ones(PROJECTOR, np.float32)


@pytest.fixture(scope="module")
def second(transport):
    """Another reconstruction, of half as much far-range light."""
    return replace(transport, far=0.5 * transport.far)


@pytest.fixture(scope="module")
def two(stored, second, tmp_path_factory):
    """The page of both."""
    path = tmp_path_factory.mktemp("beside") / "second.zarr"
    save_transport(second, path)
    first = InteractiveTransport(stored)
    with served_view(first, beside=open_beside(path, first)) as address:
        yield address


def _snr(page):
    """Wait for the SNR of the newest light; gives it in dB."""
    settled(page)
    wait_until(lambda: re.search(r"SNR -?[\d.]+ dB", page.inner_text("#snr")))
    return float(re.search(r"SNR (-?[\d.]+) dB", page.inner_text("#snr"))[1])


def _box(page, selector):
    return page.locator(selector).bounding_box()


def _stripe(page):
    """The light of a stripe as the page has it, by its levels."""
    shown = seen(page, "light").astype(float) / 255
    return np.where(shown <= 0.04045, shown / 12.92, ((shown + 0.055) / 1.055) ** 2.4)[..., 0]


def test_both_stand_beside_each_other_under_one_light(open_page, two, transport, second):
    page = open_page(two, {"kind": "white"})
    snr = nearfar.snr(second @ WHITE, transport @ WHITE)
    assert _snr(page) == pytest.approx(snr, abs=0.06)
    assert np.abs(seen(page) - tone(transport @ WHITE)).max() <= 1
    assert np.abs(seen(page, "before") - tone(second @ WHITE)).max() <= 1
    left, right = _box(page, "#picture"), _box(page, "#before")
    assert left["x"] + left["width"] < right["x"]
    assert left["width"] == pytest.approx(right["width"], abs=1)
    assert left["width"] / left["height"] == pytest.approx(CAMERA.width / CAMERA.height, rel=0.02)
    labels = (page.inner_text("#stage-label"), page.inner_text("#second-label"))
    assert labels == ("relit", "second.zarr")
    # Another light lights both.
    page.keyboard.press("2")
    found = _snr(page)
    light = _stripe(page)
    assert 0 < light.mean() < 0.5
    assert found == pytest.approx(nearfar.snr(second @ light, transport @ light), abs=0.1)
    assert np.abs(seen(page, "before") - tone(second @ light)).max() <= 2


def test_numbers_and_clicks_are_those_of_the_first(open_page, two, transport, second):
    page = open_page(two, {"kind": "white"})
    _snr(page)
    box = _box(page, "#picture")
    at = (
        box["x"] + 33.5 / CAMERA.width * box["width"],
        box["y"] + 12.5 / CAMERA.height * box["height"],
    )
    page.mouse.move(*at)
    page.wait_for_selector("#readout:has-text('second.zarr')")
    told = float(re.search(r"second\.zarr ([\d.]+)", page.inner_text("#readout"))[1])
    assert told == pytest.approx((second @ WHITE)[12, 33].mean(), abs=2e-4)
    page.mouse.click(*at)
    page.wait_for_selector("#mark:not([hidden])")
    wait_until(lambda: page.inner_text("#pixel") == "row 12, column 33")
    # Pointing at the second picture is pointing at the same camera pixel. Sigma comes last.
    page.wait_for_selector("#readout:has-text('±')")
    before = page.inner_text("#readout")
    page.mouse.move(2, 2)
    beside = _box(page, "#before")
    page.mouse.move(at[0] + beside["x"] - box["x"], at[1])
    wait_until(lambda: page.inner_text("#readout") == before)
    page.mouse.click(beside["x"] + 5.5 / CAMERA.width * beside["width"], at[1])
    wait_until(lambda: page.inner_text("#pixel") == "row 12, column 5")
    page.mouse.click(*at)
    wait_until(lambda: page.inner_text("#pixel") == "row 12, column 33")
    mark = _box(page, "#mark")
    assert mark["x"] + mark["width"] / 2 == pytest.approx(at[0], abs=2)


def test_both_are_enlarged_and_moved_together(open_page, two):
    page = open_page(two, {"kind": "white"})
    _snr(page)
    part = _box(page, "#second-part")
    at = (part["x"] + 0.75 * part["width"], part["y"] + 0.25 * part["height"])
    page.mouse.move(*at)
    page.keyboard.down("Control")
    page.mouse.wheel(0, -400)
    page.keyboard.up("Control")
    wait_until(lambda: page.inner_text("#view-zoom") == "4x")
    first, second = _box(page, "#picture"), _box(page, "#before")
    apart = part["x"] - _box(page, ".part >> nth=0")["x"]
    assert second["width"] == pytest.approx(4 * part["width"], rel=0.01)
    # The point below the pointer stays, and the same point of the first is above its own.
    assert (at[0] - second["x"]) / second["width"] == pytest.approx(0.75, abs=0.01)
    assert (second["x"] - first["x"], second["y"]) == pytest.approx((apart, first["y"]), abs=1)
    # A drag that crosses into the other picture goes on as it began.
    page.keyboard.down("Shift")
    page.mouse.down()
    page.mouse.move(at[0] - part["width"], at[1], steps=4)
    page.mouse.up()
    page.keyboard.up("Shift")
    right_edge = _box(page, "#before")
    assert right_edge["x"] + right_edge["width"] == pytest.approx(part["x"] + part["width"], abs=1)
    assert _box(page, "#picture")["x"] == pytest.approx(right_edge["x"] - apart, abs=1)
    # As an edge between the two, one lies on the other.
    page.click("#arrangement")
    first, second = _box(page, "#picture"), _box(page, "#before")
    assert second == first


def test_the_wipe_and_the_signed_difference_by_the_keyboard(open_page, two, transport, second):
    page = open_page(two, {"kind": "white"})
    _snr(page)
    page.focus("#arrangement")
    page.keyboard.press("Enter")
    assert page.inner_text("#stage-label") == "second.zarr | relit"
    assert page.is_visible("#edge")
    over, under = _box(page, "#before"), _box(page, "#picture")
    assert over["x"] == pytest.approx(under["x"], abs=1)
    slide(page, "wipe", 25)
    clip = page.evaluate("document.getElementById('before').style.clipPath")
    assert "75%" in clip
    page.focus("#difference")
    page.keyboard.press("Enter")
    assert page.inner_text("#stage-label") == "relit less second.zarr"
    off = (0.5 * transport.components(WHITE).far).mean(axis=-1)
    shown = seen(page).astype(int)
    assert (shown[..., 0] > shown[..., 2])[off > 0.02].all()
    # Its range is that of the difference, until one is typed.
    high = float(page.locator("#difference-figure .scale span").last.inner_text())
    assert high == pytest.approx(np.percentile(np.abs(off), 99), rel=0.05)
    page.focus("#difference-figure summary")
    page.keyboard.press("Enter")
    page.focus("#difference-figure input")
    page.keyboard.type("2")
    page.keyboard.press("Enter")
    dark = seen(page).astype(int)
    assert np.abs(dark - [40, 40, 44]).max() < 80
    ticks = page.locator("#difference-figure .scale span").all_inner_texts()
    assert ticks == ["-2", "0", "2"]


def test_gains_are_of_both_and_the_reference_can_be_another(open_page, two, transport, second):
    page = open_page(two, {"kind": "white", "near": 0, "far": 2})
    gains = {"near": 0.0, "far": 2.0}
    pictures = [each.relight(WHITE, **gains) for each in (second, transport)]
    assert _snr(page) == pytest.approx(nearfar.snr(*pictures), abs=0.06)
    slide(page, "far", 0)
    wait_until(lambda: page.inner_text("#snr") == "equal")
    page.click("#keep")
    assert page.inner_text("#second-label") == "kept"
    page.click("#compare-beside")
    wait_until(lambda: page.inner_text("#second-label") == "second.zarr")
    assert not page.is_visible("#compare-beside")
    page.click("#forget")
    assert not page.is_visible("#before")
    assert page.inner_text("#stage-label") == "relit, near-range × 0, far-range × 0"
    page.click("#compare-beside")
    wait_until(lambda: page.is_visible("#before"))


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize(("width", "height"), [(390, 844), (844, 390), (1300, 900), (1900, 1000)])
def test_both_are_seen_on_every_screen(open_page, two, scheme, width, height):
    page = open_page(two, {"kind": "white"}, color_scheme=scheme)
    page.set_viewport_size({"width": width, "height": height})
    _snr(page)
    left, right = _box(page, "#picture"), _box(page, "#before")
    assert left["x"] >= 0
    assert right["x"] + right["width"] <= width
    assert right["width"] > 150
    if height > 390:
        assert right["y"] + right["height"] < height
    for selector in ("#snr", "#second-label", "#stage-label", "#difference", "#arrangement"):
        assert contrast(page, selector) >= 4.5, selector
    assert page.evaluate("document.documentElement.scrollWidth") <= width


def test_the_second_is_not_compared_while_something_else_is_shown(open_page, two):
    page = open_page(two, {"kind": "white"})
    _snr(page)
    for tool in ("error-bars", "dual"):
        page.click(f"[data-tool={tool}]")
        wait_until(lambda: not page.is_visible("#comparing"))
        assert not page.is_visible("#before")
    page.click("[data-tool=relit]")
    wait_until(lambda: page.is_visible("#before"))
