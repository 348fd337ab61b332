"""The viewer's page in a real browser: the inspector, its numbers, and how the page is laid out."""

import re
from dataclasses import replace

import numpy as np
import pytest

from nearfar.estimate.error_bars import ErrorBars
from nearfar.transport.store import save_transport
from nearfar.viewer.interactive import InteractiveTransport
from tests.viewer.asking import CAMERA, PROJECTOR, message, refused
from tests.viewer.browsing import seen, settled, slide
from tests.waiting import wait_until

pytestmark = pytest.mark.slow

WHITE = np.ones(PROJECTOR, np.float32)


def _box(page, selector):
    return page.locator(selector).bounding_box()


def _click(page, y, x):
    """Click a camera pixel."""
    box = _box(page, "#picture")
    across, down = box["width"] / CAMERA.width, box["height"] / CAMERA.height
    page.mouse.click(box["x"] + (x + 0.5) * across, box["y"] + (y + 0.5) * down)


def _opened(page, width, height):
    page.set_viewport_size({"width": width, "height": height})
    settled(page)


@pytest.mark.parametrize(("width", "height"), [(1900, 1000), (1400, 900)])
def test_light_scene_and_inspector_stand_side_by_side_on_a_broad_page(
    open_page, address, width, height
):
    page = open_page(address)
    _opened(page, width, height)
    _click(page, 12, 33)
    page.wait_for_selector("#row:not([hidden])")
    light, scene, panel = (_box(page, id_) for id_ in ("#light", "#picture", "#row-window"))
    assert light["x"] + light["width"] < scene["x"]
    assert scene["x"] + scene["width"] < panel["x"]
    # What answers the click is on the screen, and the page uses the screen.
    assert panel["y"] + panel["height"] < height
    assert _box(page, ".inspect")["x"] + _box(page, ".inspect")["width"] > 0.97 * width
    assert not page.is_visible("[data-tab=light]")
    # A click on the light shows a column, and the light stays.
    page.click("#light", position={"x": 30, "y": 30})
    page.wait_for_selector("#column-map:not([hidden])")
    assert page.is_visible("#light")


def test_tabs_stand_beside_the_scene_on_a_narrower_page(open_page, address):
    page = open_page(address)
    _opened(page, 1300, 900)
    assert page.get_attribute("[data-tab=light]", "aria-selected") == "true"
    _click(page, 12, 33)
    page.wait_for_selector("#row:not([hidden])")
    scene, panel = _box(page, "#picture"), _box(page, "#row-window")
    assert scene["x"] + scene["width"] < panel["x"]
    assert panel["y"] + panel["height"] < 900
    assert not page.is_visible("#light")
    # By the keyboard from tab to tab, round and round.
    page.focus("#tab-row")
    seen_tabs = []
    for _ in range(7):
        page.keyboard.press("ArrowRight")
        seen_tabs.append(page.evaluate("document.body.dataset.shownTab"))
    tabs = ["column", "map", "numbers", "region", "keyframes", "light", "row"]
    assert seen_tabs == tabs
    page.keyboard.press("ArrowLeft")
    assert page.is_visible("#light")


def test_on_a_phone_the_inspector_is_a_sheet_from_below(open_page, address):
    page = open_page(address)
    _opened(page, 390, 844)
    sheet = _box(page, ".inspect")
    assert sheet["y"] + sheet["height"] == pytest.approx(844, abs=2)
    assert sheet["height"] < 80
    _click(page, 12, 33)
    page.wait_for_selector("#row:not([hidden])")
    opened = _box(page, ".inspect")
    assert 300 < opened["height"] < 0.6 * 844
    assert _box(page, "#row-window")["y"] < 844
    page.click("#close-sheet")
    assert _box(page, ".inspect")["height"] < 80
    # On its side, scene and light stand beside each other, and the scene is not tiny.
    _opened(page, 844, 390)
    scene, light = _box(page, "#picture"), _box(page, "#light")
    assert scene["x"] + scene["width"] < light["x"]
    assert scene["width"] > 250
    assert page.evaluate("document.documentElement.scrollWidth") <= 844


def _numbers(text):
    return [float(number) for number in re.findall(r"-?\d[\d.]*(?:e-?\d+)?", text)]


def test_numbers_under_the_pointer_are_those_of_the_transport(open_page, address, transport):
    page = open_page(address, {"kind": "white", "tab": "numbers"})
    y, x = 12, 33
    box = _box(page, "#picture")
    page.mouse.move(
        box["x"] + (x + 0.5) / CAMERA.width * box["width"],
        box["y"] + (y + 0.5) / CAMERA.height * box["height"],
    )
    page.wait_for_selector("#readout:has-text('±')")
    components = transport.components(WHITE)
    whole = sum(components)[y, x]
    sigma = ErrorBars(transport).picture(WHITE)[y, x]
    shown = _numbers(page.inner_text("#readout"))
    assert shown[:2] == [y, x]
    expected = [whole.mean(), sigma.mean(), *(part[y, x].mean() for part in components)]
    np.testing.assert_allclose(shown[2:], expected, rtol=0.06, atol=2e-4)
    rows = page.locator("#numbers tr").all_inner_texts()
    assert [row.split("\t")[0] for row in rows[1:]] == [
        "light",
        "direct",
        "near-range",
        "far-range",
    ]
    bars = ErrorBars(transport)
    sigmas = [sigma, *(
        bars.picture(WHITE, direct=d, near=n, far=f)[y, x]
        for d, n, f in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    )]  # fmt: skip
    for row, part, bar in zip(rows[1:], [sum(components), *components], sigmas, strict=True):
        cells = [_numbers(cell) for cell in row.split("\t")[1:]]
        for channel in range(3):
            value, deviation = cells[channel]
            assert value == pytest.approx(part[y, x, channel], abs=2e-4, rel=0.06)
            assert deviation == pytest.approx(bar[channel], abs=1e-4, rel=0.06)
    # Without the pointer, of the pixel that was chosen; and of the light as it is.
    page.mouse.move(2, 2)
    wait_until(lambda: page.inner_text("#readout") == "")
    page.focus("#picture")
    page.keyboard.press("Enter")
    wait_until(lambda: "row 15, column 21" in page.inner_text("#numbers-pixel"))
    before = page.inner_text("#readout")
    page.keyboard.press("4")
    settled(page)
    wait_until(lambda: page.inner_text("#readout") != before)


def test_pixels_that_are_none_and_transports_without_error_bars(
    open_page, serve, transport, tmp_path
):
    save_transport(replace(transport, posterior=None), tmp_path / "t.zarr")
    address = serve(InteractiveTransport(tmp_path / "t.zarr"))
    status, said = refused(address, "/numbers", message(WHITE, y=CAMERA.height, x=0))
    assert (status, "no pixel of the camera" in said) == (400, True)
    page = open_page(address, {"kind": "white", "pixel": [3, 9], "tab": "numbers"})
    page.wait_for_selector("#numbers td")
    with page.expect_response("**/numbers") as answer:
        page.keyboard.press("1")
    assert answer.value.json()["sigma"] is None
    assert "±" not in page.inner_text("#readout")
    page.goto("about:blank")


def test_negative_light_and_q_are_seen_in_a_row(open_page, serve, transport, tmp_path):
    """Light below zero is an error of the estimate: it must not look like light."""
    far = transport.far.copy()
    far[10, 10] *= -1
    save_transport(replace(transport, far=far), tmp_path / "t.zarr")
    address = serve(InteractiveTransport(tmp_path / "t.zarr"))
    page = open_page(address, {"pixel": [10, 10], "tab": "row"})
    page.wait_for_selector("#row:not([hidden])")
    row = transport.component_rows(slice(10 * CAMERA.width + 10, 10 * CAMERA.width + 11))
    values = -row.far[0].mean(axis=0).reshape(PROJECTOR)
    share = -values[values < 0].sum() / np.abs(values).sum()
    assert share > 0.5
    told = float(re.search(r"([\d.]+) % of it negative", page.inner_text("#row-negative"))[1])
    assert told == pytest.approx(100 * share, abs=0.6)
    red = seen(page, "row-far").astype(int)
    strong = np.abs(values) > 0.5 * np.abs(values).max()
    # The page's own scale ends in yellow, which is hardly redder than green.
    assert (red[..., 0] > 1.4 * red[..., 1])[strong & (values < 0)].all()
    assert (red[..., 0] < 1.2 * red[..., 1])[strong & (values > 0)].all()
    q = transport.correspondence[10, 10]
    cross, canvas = _box(page, "#row-q"), _box(page, "#row-far")
    at = (cross["x"] + cross["width"] / 2 - canvas["x"]) / canvas["width"]
    assert at * PROJECTOR.width - 0.5 == pytest.approx(q[1], abs=0.3)
    page.goto("about:blank")


def test_the_edge_of_what_is_compared_with_is_dragged(open_page, address):
    page = open_page(address, {"kind": "white"})
    page.click("#keep")
    assert page.inner_text("#stage-label") == "kept | relit"
    box = _box(page, "#picture")
    page.mouse.move(box["x"] + box["width"] / 2 + 4, box["y"] + 90)
    page.mouse.down()
    page.mouse.move(box["x"] + box["width"] / 4, box["y"] + 90, steps=3)
    page.mouse.up()
    assert float(page.input_value("[data-of=wipe]")) == pytest.approx(25, abs=1)


def test_keys_work_after_a_button_and_a_slider(open_page, address):
    page = open_page(address, {"kind": "spot"})
    page.click("[data-kind=stripe]")
    page.keyboard.press("Space")
    assert page.inner_text("#play") == "stop"
    page.keyboard.press("Space")
    page.focus("[data-of=exposure]")
    page.keyboard.press("n")
    assert page.inner_text("#stage-label") == "near-range light only"
    page.keyboard.press("a")
    slide(page, "near", 2)
    assert page.inner_text("#stage-label") == "relit, near-range × 2"
    # A rate is one of lights that move.
    settled(page)
    wait_until(lambda: "a second" not in page.inner_text("#frame-status"))


def test_an_address_out_of_range_is_brought_into_it(open_page, address):
    page = open_page(address, {"exposure": 1e9, "gamma": -3, "near": 77, "tab": "<i>"})
    assert page.input_value("[data-of=exposure]") == "12"
    assert page.input_value("[data-of=gamma]") == "0.5"
    assert page.inner_text("#stage-label") == "relit, near-range × 4"


def test_the_difference_to_what_is_compared_with_is_told_and_shown(open_page, address, transport):
    page = open_page(address, {"kind": "white"})
    page.click("#keep")
    assert page.inner_text("#snr") == "equal"
    slide(page, "near", 1.5)
    parts = transport.components(WHITE)
    reference, off = sum(parts), 0.5 * parts.near
    snr = 10 * np.log10((reference**2).sum() / (off**2).sum())
    assert _numbers(page.inner_text("#snr"))[0] == pytest.approx(snr, abs=0.1)
    page.focus("#difference")
    page.keyboard.press("Enter")
    assert page.inner_text("#stage-label") == "relit, near-range × 1.5 less kept"
    shown, mean = seen(page).astype(int), off.mean(axis=-1)
    more, less = mean > 0.02, mean < -0.02
    assert more.any()
    assert (shown[..., 0] > shown[..., 2])[more].all()
    assert (shown[..., 0] <= shown[..., 2])[less].all()
    slide(page, "near", 0.5)
    assert (seen(page).astype(int)[..., 2] > shown[..., 2])[more].all()
    assert not page.is_visible("#before")
    page.click("#forget")
    assert not page.is_visible("#comparing")
    assert page.inner_text("#stage-label") == "relit, near-range × 0.5"
