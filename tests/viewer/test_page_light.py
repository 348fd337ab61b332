"""The viewer's page in a real browser: its light, its look, and what is clicked."""

import time

import numpy as np
import pytest

from nearfar.files import from_srgb, read_light, read_picture, to_srgb, write_picture
from nearfar.files.codecs import decode_png, encode_png
from nearfar.illumination.pictures import natural_picture
from tests.cli.conftest import run_nearfar
from tests.viewer.asking import CAMERA, PROJECTOR
from tests.viewer.browsing import drag, drop, pictures, saved, seen, settled, show, slide, tone
from tests.waiting import LONGEST_WAIT

pytestmark = pytest.mark.slow


# The light


@pytest.mark.parametrize(
    "state",
    [
        {"kind": "white"},
        {"kind": "white", "colour": "#ff8000"},
        {"kind": "spot", "x": 5, "y": 8, "radius": 4},
        {"kind": "stripe", "angle": 30, "width": 3},
        {"kind": "sinusoid", "cycles": 3, "angle": 60, "phase": 45, "colour": "#80c0ff"},
        {"kind": "checkerboard", "side": 3, "shift": 1},
        {"kind": "pixel", "x": 7, "y": 3},
        {"kind": "paint", "strokes": [{"colour": "#ff0000", "radius": 3, "points": [4, 4, 15, 9]},
                                      {"colour": "#00ff80", "radius": 2, "points": [18, 2]}]},
    ],
    ids=lambda state: "-".join(map(str, state.values()))[:40],
)  # fmt: skip
def test_the_picture_is_that_of_relight_for_the_same_light(
    open_page, address, stored, tmp_path, state
):
    page = open_page(address, state)
    light = saved(page, "#save-light", tmp_path)
    assert run_nearfar("relight", stored, light, tmp_path / "cli.exr").status == 0
    assert run_nearfar("relight", stored, light, tmp_path / "cli.png").status == 0
    relit = read_picture(tmp_path / "cli.exr")
    assert np.abs(seen(page) - tone(relit)).max() <= 1
    png = decode_png(saved(page, "#save-png", tmp_path).read_bytes())
    assert np.abs(png.astype(int) - decode_png((tmp_path / "cli.png").read_bytes())).max() <= 1
    np.testing.assert_allclose(read_picture(saved(page, "#save-exr", tmp_path)), relit, atol=1e-5)
    # What is shown of the light is the light.
    shown = from_srgb(seen(page, "light") / np.float32(255))
    linear = read_light(light, PROJECTOR)
    np.testing.assert_allclose(
        shown, np.broadcast_to(linear.reshape(*PROJECTOR, -1), (*PROJECTOR, 3)), atol=0.006
    )


def test_lights_have_the_shapes_that_they_are_named_for(open_page, address, tmp_path):
    page = open_page(address)

    def light(**state):
        show(page, address, state)
        return read_light(saved(page, "#save-light", tmp_path), PROJECTOR)

    y, x = np.indices(PROJECTOR)
    assert (light(kind="white") == 1).all()
    pixel = light(kind="pixel", x=7, y=3)
    assert (pixel.sum(), pixel[3, 7]) == (1, 1)
    np.testing.assert_array_equal(light(kind="checkerboard", side=3), (x // 3 + y // 3) % 2 == 0)
    wave = light(kind="sinusoid", cycles=6, angle=90, phase=90)
    np.testing.assert_allclose(
        wave, 0.5 + 0.5 * np.cos(2 * np.pi * x * 6 / 24 - np.pi / 2), atol=1e-4
    )
    wave = light(kind="sinusoid", cycles=3, angle=0, phase=0)
    np.testing.assert_allclose(wave, 0.5 + 0.5 * np.cos(2 * np.pi * y * 3 / 24), atol=1e-4)
    stripe = light(kind="stripe", angle=90, width=4, x=10, y=5)
    np.testing.assert_allclose(stripe, np.broadcast_to(stripe[0], PROJECTOR), atol=1e-4)
    assert stripe.sum() == pytest.approx(4 * PROJECTOR.height, rel=0.01)
    spot = light(kind="spot", x=10, y=9, radius=5, soft=0.5)
    assert spot[9, 10] == 1
    assert (spot[9, 10 + 9], spot[0, 0]) == (0, 0)
    assert spot.sum() == pytest.approx(np.pi * 25, rel=0.15)


def test_the_light_is_dragged_and_painted(open_page, address, tmp_path):
    page = open_page(address)
    before = seen(page)
    drag(page, (5, 5), (14, 17))
    light = read_light(saved(page, "#save-light", tmp_path), PROJECTOR)
    y, x = (np.average(np.indices(PROJECTOR)[axis], weights=light) for axis in (0, 1))
    assert (y, x) == pytest.approx((14, 17), abs=0.5)
    assert np.abs(seen(page).astype(int) - before).max() > 20
    page.click("[data-kind=paint]")
    page.evaluate("""() => { const c = document.getElementById('colour'); c.value = '#ff2000';
        c.dispatchEvent(new Event('input')); }""")
    drag(page, (3, 3), (3, 20))
    once = read_light(saved(page, "#save-light", tmp_path), PROJECTOR)
    assert once[3, 10, 0] > 0.8
    assert once[3, 10, 2] == 0
    assert once[15].max() == 0
    drag(page, (15, 3), (15, 20))
    assert read_light(saved(page, "#save-light", tmp_path), PROJECTOR)[15, 10, 0] > 0.8
    page.click("#undo")
    settled(page)
    np.testing.assert_array_equal(read_light(saved(page, "#save-light", tmp_path), PROJECTOR), once)
    page.click("#clear")
    settled(page)
    assert not read_light(saved(page, "#save-light", tmp_path), PROJECTOR).any()
    assert seen(page).max() == 0


def test_pictures_are_dropped_and_played(open_page, address, tmp_path):
    page = open_page(address)
    picture = natural_picture(PROJECTOR, 3, colour=True)
    eight = tone(picture).astype(np.uint8)
    drop(page, "#light", "leaves.png", encode_png(eight))
    settled(page)
    light = read_light(saved(page, "#save-light", tmp_path), PROJECTOR)
    np.testing.assert_allclose(light, from_srgb(eight / np.float32(255)), atol=1e-4)
    # Of 16 bits it is linear, as the command line takes it.
    linear = np.rint(65535 * picture).astype(np.uint16)
    drop(page, "#light", "linear.png", encode_png(linear))
    page.wait_for_selector("output:has-text('2 of 2')")
    settled(page)
    light = read_light(saved(page, "#save-light", tmp_path), PROJECTOR)
    np.testing.assert_allclose(light, linear / 65535, atol=1e-4)
    assert page.input_value("[data-of=shown]") == "1"
    # Larger than the grid: it fills it.
    drop(page, "#light", "large.png", encode_png(np.full((90, 90, 3), (0, 255, 0), np.uint8)))
    page.wait_for_selector("output:has-text('3 of 3')")
    settled(page)
    light = read_light(saved(page, "#save-light", tmp_path), PROJECTOR)
    np.testing.assert_allclose(light, np.broadcast_to([0, 1, 0], light.shape))
    count = pictures(page)["count"]
    page.click("#play")
    end = time.monotonic() + LONGEST_WAIT
    shown = set()
    while len(shown) < 3 and time.monotonic() < end:
        shown.add(page.input_value("[data-of=shown]"))
        time.sleep(0.1)
    page.click("#play")
    assert len(shown) == 3
    assert pictures(page)["count"] > count
    drop(page, "#light", "x.png", b"no picture")
    page.wait_for_selector("#fault:not(:empty)")
    assert "x.png is no picture" in page.inner_text("#fault")
    drop(page, "#light", "x.exr", b"no picture")
    page.wait_for_selector("#fault:has-text('x.exr')")


@pytest.mark.parametrize("kind", ["spot", "stripe", "sinusoid", "checkerboard", "pixel"])
def test_every_light_plays(open_page, address, kind):
    page = open_page(address, {"kind": kind})
    count = pictures(page)["count"]
    first = seen(page, "light")
    page.click("#play")
    moved, end = 0, time.monotonic() + LONGEST_WAIT
    # A light that comes round again may look like the first one for a while.
    while time.monotonic() < end and (moved <= 50 or pictures(page)["count"] <= count + 2):
        moved = max(moved, np.abs(seen(page, "light").astype(int) - first).max())
    assert moved > 50
    assert pictures(page)["count"] > count + 2
    page.click("#play")
    settled(page)
    stopped = pictures(page)["count"]
    time.sleep(0.5)
    assert pictures(page)["count"] == stopped


# The look


def test_gains_and_each_component_alone(open_page, address, transport):
    page = open_page(address, {"kind": "white"})
    parts = transport.components(np.ones(PROJECTOR, np.float32))
    for number, part in enumerate(parts):
        assert np.abs(seen(page, f"part{number}") - tone(part)).max() <= 1
    slide(page, "direct", 0.5)
    slide(page, "near", 3)
    slide(page, "far", 0)
    assert np.abs(seen(page) - tone(0.5 * parts.direct + 3 * parts.near)).max() <= 1
    page.click("[data-solo=near]")
    assert np.abs(seen(page) - tone(3 * parts.near)).max() <= 1
    assert page.get_attribute("[data-solo=near]", "aria-pressed") == "true"
    page.click("[data-solo=near]")
    page.click("#reset")
    slide(page, "exposure", 1)
    assert np.abs(seen(page) - tone(2 * sum(parts))).max() <= 1
    slide(page, "gamma", 2)
    expected = np.rint(255 * to_srgb(np.clip(2 * sum(parts), 0, 1)) ** 0.5)
    assert np.abs(seen(page) - expected).max() <= 1
    page.click("#reset")
    page.click("#expose")
    bright = seen(page)
    assert 245 < np.percentile(bright, 99.5) <= 255


def test_before_and_after(open_page, address, transport, tmp_path):
    page = open_page(address, {"kind": "white"})
    assert not page.is_visible("#wiping")
    white = seen(page)
    page.click("#keep")
    assert page.is_visible("#wiping")
    page.click("[data-kind=checkerboard]")
    settled(page)
    np.testing.assert_array_equal(seen(page, "before"), white)
    slide(page, "wipe", 25)
    assert "75%" in page.evaluate("document.getElementById('before').style.clipPath")
    page.screenshot(path=tmp_path / "wipe.png")
    page.click("#forget")
    assert not page.is_visible("#before")
    # A photo of the camera, in photo units, less the black that was measured.
    photo = (transport @ np.ones(PROJECTOR, np.float32)) + transport.black
    write_picture(tmp_path / "photo.exr", photo)
    drop(page, "#stage", "photo.exr", (tmp_path / "photo.exr").read_bytes(), "")
    page.wait_for_selector("#before", state="visible")
    assert np.abs(seen(page, "before").astype(int) - white).max() <= 1
    drop(page, "#stage", "small.png", encode_png(np.zeros((3, 3), np.uint8)))
    page.wait_for_selector("#fault:has-text('small.png is 3x3')")


# Pixels and maps


def test_a_camera_pixel_is_clicked(open_page, address, transport):
    page = open_page(address)
    box = page.locator("#picture").bounding_box()
    y, x = 12, 33
    page.mouse.click(
        box["x"] + (x + 0.5) / CAMERA.width * box["width"],
        box["y"] + (y + 0.5) / CAMERA.height * box["height"],
    )
    page.wait_for_selector("#row:not([hidden])")
    assert page.inner_text("#pixel") == f"row {y}, column {x}"
    summary = page.inner_text("#pixel-summary")
    q = transport.correspondence[y, x]
    assert f"q = ({q[0]:.2f}, {q[1]:.2f})" in summary
    assert "confidence" in summary
    far = seen(page, "row-far")
    assert far.shape[:2] == tuple(PROJECTOR)
    assert np.ptp(far) > 30
    assert np.ptp(seen(page, "row-window")) > 100
    assert np.ptp(seen(page, "row-profile")) > 30
    assert seen(page, "row-spectrum").shape[0] % PROJECTOR.height == 0
    # By the keyboard: one on, and eight.
    page.focus("#picture")
    page.keyboard.press("ArrowDown")
    page.wait_for_selector(f"#pixel:has-text('row {y + 1}, column {x}')")
    page.keyboard.press("Shift+ArrowLeft")
    page.wait_for_selector(f"#pixel:has-text('row {y + 1}, column {x - 8}')")


def test_a_projector_pixel_is_clicked(open_page, address, transport):
    page = open_page(address)
    drag(page, (9, 4))
    # The light stays in view, and the tab says that there is something new.
    page.click("#tab-column.news")
    page.wait_for_selector("#column-map:not([hidden])")
    assert page.inner_text("#column") == "row 9, column 4"
    column = transport.column(9, 4).mean(axis=-1)
    shown = seen(page, "column-map").astype(int).sum(axis=-1)
    assert shown.shape == tuple(CAMERA)
    assert np.argmax(shown) in np.argsort(column.ravel())[-4:]


def test_maps_are_chosen(open_page, address):
    page = open_page(address, {"tab": "map"})
    names = [option.get_attribute("value") for option in page.query_selector_all("#maps option")]
    assert len(names) >= 8
    drawn = {}
    for name in names[1:]:
        page.select_option("#maps", name)
        page.wait_for_selector("#map-caption:has-text('grey where there is none')")
        drawn[name] = seen(page, "map")
        assert page.locator("#map-scale span").count() == 3
    # Where there is no direct light there is no q.
    assert (drawn["row"][3, 5] == 128).all()
    assert np.ptp(drawn["row"][:, 1].astype(int)) > 100
    page.hover("#map", position={"x": 50, "y": 50})
    assert page.inner_text("#map-value")
    page.click("#map", position={"x": 50, "y": 50})
    page.wait_for_selector("#row:not([hidden])")
