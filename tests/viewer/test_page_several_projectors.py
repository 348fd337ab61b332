"""The viewer's page in a real browser: several projectors before one camera, each with a light."""

import json
import subprocess
import sys
from urllib.parse import unquote

import numpy as np
import pytest

import nearfar
from nearfar.arrays import Size
from nearfar.files import encode_png, from_srgb, read_light
from nearfar.files.codecs import decode_png
from nearfar.plan import choose_plan
from nearfar.rigs.simulated.camera import SimulatedCamera
from nearfar.rigs.simulated.projector import SimulatedProjector
from nearfar.rigs.simulated.rig import SimulatedRig
from nearfar.transport.rows import of_rows
from nearfar.transport.store import load_transport, save_transport
from nearfar.viewer.interactive import InteractiveTransport
from nearfar.workflow.acquire import acquire
from nearfar.workflow.reconstruction.reconstruct import reconstruct
from tests.cli.conftest import run_nearfar
from tests.viewer.asking import CAMERA, PROJECTOR
from tests.viewer.browsing import drop, saved, seen, settled, show, slide, tone
from tests.viewer.conftest import served_view
from tests.waiting import wait_until
from tests.worlds import model_transport

pytestmark = pytest.mark.slow

# Not the size of the first one.
OTHER = Size(16, 12)
SPOT = {"kind": "spot", "x": 5, "y": 8, "radius": 4}


@pytest.fixture(scope="module")
def right(tmp_path_factory):
    """The transport of a second projector before the same camera."""
    folder = tmp_path_factory.mktemp("right")
    world = model_transport(OTHER, CAMERA, window=5, far=Size(3, 3), channels=3, seed=5)
    plan, _ = choose_plan(OTHER, 60)
    rig = SimulatedRig(world, "test", SimulatedProjector(), SimulatedCamera(), 1.0, 0)
    capture = acquire(plan, folder / "capture.zarr", rig)
    save_transport(reconstruct(capture)[0], folder / "right.zarr")
    return folder / "right.zarr"


@pytest.fixture(scope="module")
def both(stored, right):
    """The address of the page of two projectors."""
    with served_view(InteractiveTransport(stored), others=[InteractiveTransport(right)]) as here:
        yield here


def _choose(page, name):
    """Choose the light of another projector."""
    with page.expect_navigation():
        page.click(f"#projector-list button:text-is('{name}')")
    settled(page)


def _light(page, folder, projector):
    """The light that the page saves, as nearfar reads it."""
    found = read_light(saved(page, "#save-light", folder), projector)
    return np.broadcast_to(np.atleast_3d(found), (*projector, 3)).astype(np.float32)


def _check(page, picture):
    """What is shown is what Python makes, to one level in 255."""
    assert np.abs(seen(page).astype(int) - tone(picture)).max() <= 1


def test_the_stage_shows_the_sum_of_both_lights(open_page, both, transport, right, tmp_path):
    other = load_transport(right)
    page = open_page(both, {**SPOT, "colour": "#ff8040"})
    names = page.locator("#projector-list button").all_inner_texts()
    assert names == ["a scene.zarr", "right.zarr"]
    left_light = _light(page, tmp_path, PROJECTOR)
    # The other one is dark until it is chosen.
    _check(page, transport.relight(left_light))
    assert "1 projector lit" in page.inner_text("#stage-label")
    _choose(page, "right.zarr")
    assert page.url.split("#")[0].endswith("/projector/1/")
    assert page.get_attribute("#projector-list button >> nth=1", "aria-pressed") == "true"
    page.click("[data-kind=sinusoid]")
    settled(page)
    right_light = _light(page, tmp_path, OTHER)
    both_lights = [left_light, right_light]
    _check(page, nearfar.relight_together([transport, other], both_lights))
    assert "2 projectors lit" in page.inner_text("#stage-label")
    # With gains, exposure and gamma, of both.
    for name, value in (("near", 2), ("far", 0.5), ("exposure", 1)):
        slide(page, name, value)
    settled(page)
    gained = nearfar.relight_together([transport, other], both_lights, near=2.0, far=0.5)
    _check(page, 2 * gained)
    part = seen(page, "part1").astype(int)
    near = 4 * (transport.components(left_light).near + other.components(right_light).near)
    assert np.abs(part - tone(near)).max() <= 1
    # Back again: the first one's light is as it was left, and so is the look.
    _choose(page, "a scene.zarr")
    assert page.input_value("#colour") == "#ff8040"
    _check(page, 2 * gained)
    # Each is switched off by itself.
    page.uncheck("[aria-label='right.zarr is lit']")
    settled(page)
    _check(page, 2 * transport.relight(left_light, near=2.0, far=0.5))
    page.check("[aria-label='right.zarr is lit']")
    page.uncheck("[aria-label='a scene.zarr is lit']")
    settled(page)
    _check(page, 2 * other.relight(right_light, near=2.0, far=0.5))
    page.keyboard.press("Control+z")
    settled(page)
    _check(page, 2 * gained)


def test_each_light_is_painted_and_dropped_apart(open_page, both, transport, right):
    other = load_transport(right)
    page = open_page(both, {"kind": "white"})
    picture = np.random.default_rng(0).integers(0, 200, (*PROJECTOR, 3), dtype=np.uint8)
    drop(page, "#light", "picture.png", encode_png(picture))
    wait_until(lambda: page.get_attribute("[data-kind=picture]", "aria-pressed") == "true")
    settled(page)
    _choose(page, "right.zarr")
    page.keyboard.press("6")
    box = page.locator("#light").bounding_box()
    page.mouse.move(box["x"] + 0.2 * box["width"], box["y"] + 0.2 * box["height"])
    page.mouse.down()
    page.mouse.move(box["x"] + 0.8 * box["width"], box["y"] + 0.8 * box["height"], steps=5)
    page.mouse.up()
    settled(page)
    levels = from_srgb(seen(page, "light") / np.float32(255))
    assert 0.05 < (levels > 0).mean() < 0.9
    dropped = from_srgb(picture / np.float32(255))
    expected = nearfar.relight_together([transport, other], [dropped, levels])
    # The light is read from the screen, to half a level.
    assert np.abs(seen(page).astype(int) - tone(expected)).max() <= 2
    # An address holds both.
    wait_until(lambda: '"strokes"' in unquote(page.evaluate("location.href")))
    before, url = seen(page), page.evaluate("location.href")
    page.goto("about:blank")
    page.goto(url)
    settled(page)
    np.testing.assert_array_equal(seen(page), before)


def test_numbers_tell_each_projector(open_page, both, transport, right):
    other = load_transport(right)
    page = open_page(both, {"kind": "white", "tab": "numbers", "pixel": [12, 30], "lit": [0, 1],
                            "others": {"1": {"kind": "white"}}})  # fmt: skip
    left_light, right_light = (
        (transport @ np.ones(PROJECTOR))[12, 30],
        (other @ np.ones(OTHER))[12, 30],
    )
    wait_until(lambda: "±" in page.inner_text("#readout"))
    told = page.inner_text("#readout")
    # Frames are float16, of 11 bits.
    for name, light in (
        ("row 12, column 30: ", left_light + right_light),
        ("a scene.zarr ", left_light),
        ("right.zarr ", right_light),
    ):
        assert float(told.split(name)[1].split()[0]) == pytest.approx(light.mean(), abs=4e-4)
    assert "± " in told.split("a scene.zarr ")[1].split("(direct")[0]
    rows = [row.split("\t") for row in page.locator("#numbers tr").all_inner_texts()]
    cells = {row[0]: [cell.split("±") for cell in row[1:4]] for row in rows[1:]}
    values = {name: [float(cell[0]) for cell in mine] for name, mine in cells.items()}
    assert values["right.zarr"] == pytest.approx(right_light, abs=4e-4)
    assert values["all that are lit"] == pytest.approx(left_light + right_light, abs=4e-4)
    # Errors of two captures are independent.
    sigma = np.hypot(
        *(
            nearfar.ErrorBars(one).picture(np.ones(one.projector))[12, 30]
            for one in (transport, other)
        )
    )
    shown = [float(deviation) for _, deviation in cells["all that are lit"]]
    assert shown == pytest.approx(sigma, rel=0.03)
    beside = told.split("row 12, column 30: ")[1].split("·")[0]
    assert float(beside.split("±")[1]) == pytest.approx(sigma.mean(), rel=0.03)
    # Long names do not push numbers out of the panel.
    table, panel = (page.locator(one).bounding_box() for one in ("#numbers", "#panel-numbers"))
    assert table["x"] + table["width"] <= panel["x"] + panel["width"] + 1
    # Of the one that is left, its own.
    right_alone = {"kind": "white", "tab": "numbers", "pixel": [12, 30], "lit": [1]}
    show(page, both, {**right_alone, "others": {"1": {"kind": "white"}}})
    own = nearfar.ErrorBars(other).picture(np.ones(OTHER))[12, 30].mean()
    wait_until(
        lambda: (
            float(page.inner_text("#readout").split("·")[0].partition("±")[2] or 0)
            == pytest.approx(own, rel=0.03)
        )
    )


def test_a_picture_that_failed_is_asked_for_once_its_projector_is_lit_again(
    open_page, both, transport, right, tmp_path
):
    other = load_transport(right)
    page = open_page(both, {**SPOT, "others": {"1": {"kind": "white"}}})
    alone = seen(page)
    refusal = {"status": 400, "json": {"fault": "it is busy."}}
    page.route("**/projector/1/tool/parts", lambda route: route.fulfill(**refusal))
    page.check("[aria-label='right.zarr is lit']")
    page.wait_for_selector("#fault:has-text('right.zarr: it is busy')")
    page.unroute("**/projector/1/tool/parts")
    page.uncheck("[aria-label='right.zarr is lit']")
    settled(page)
    np.testing.assert_array_equal(seen(page), alone)
    page.check("[aria-label='right.zarr is lit']")
    settled(page)
    expected = nearfar.relight_together(
        [transport, other], [_light(page, tmp_path, PROJECTOR), np.ones((*OTHER, 3), np.float32)]
    )
    _check(page, expected)


def test_what_is_copied_makes_the_sum_again(open_page, both, stored, right, tmp_path):
    page = open_page(both, {**SPOT, "exposure": 1.3, "near": 2})
    saved(page, "#save-light", tmp_path)
    _choose(page, "right.zarr")
    saved(page, "#save-light", tmp_path)
    shown = seen(page).astype(int)
    # What is of one light alone is not offered.
    assert page.is_disabled("#save-exr")
    page.click("#copy-as")
    command, python = (page.inner_text(f"#as-{what}") for what in ("command", "python"))
    assert "--and" in command
    (tmp_path / "a scene.zarr").symlink_to(stored)
    (tmp_path / "right.zarr").symlink_to(right)
    (name,) = {word for word in command.split() if word.endswith("relit.png")}
    subprocess.run(["sh", "-c", '"$0" -m ' + command, sys.executable], cwd=tmp_path, check=True)
    by_command = decode_png((tmp_path / name).read_bytes())
    assert np.abs(shown - by_command).max() <= 1
    (tmp_path / name).unlink()
    subprocess.run([sys.executable, "-c", python], cwd=tmp_path, check=True)
    np.testing.assert_array_equal(decode_png((tmp_path / name).read_bytes()), by_command)


def test_the_physical_split_is_of_both(open_page, both, transport, right, tmp_path):
    other = load_transport(right)
    page = open_page(both, {**SPOT, "lit": [0, 1], "others": {"1": {"kind": "white"}}})
    light = _light(page, tmp_path, PROJECTOR)
    page.click("[data-split=physical]")
    wait_until(lambda: "found" in page.inner_text("#split-status"))
    wait_until(
        lambda: json.loads(page.evaluate("document.body.dataset.frame"))["split"] == "physical"
    )
    slide(page, "subsurface", 2)
    settled(page)
    splits = [nearfar.split_physically(each) for each in (transport, other)]
    white = np.ones((*OTHER, 3), np.float32)
    pictures = [
        split.relight(shown, subsurface=2.0)
        for split, shown in zip(splits, (light, white), strict=True)
    ]
    _check(page, sum(pictures))


def test_one_projector_has_no_list_of_them(open_page, address):
    page = open_page(address)
    assert not page.is_visible("#projectors")
    show(page, address, {"lit": [7, "x"], "others": {"3": {"kind": "white"}}})
    assert page.inner_text("#fault") == ""


def test_cameras_that_differ_are_refused(stored, transport, tmp_path):
    save_transport(of_rows(transport, slice(0, 9)), tmp_path / "narrow.zarr")
    ran = run_nearfar("view", stored, "--and", tmp_path / "narrow.zarr", "--no-browser")
    assert ran.status == 1
    said = " ".join(ran.err.split())
    assert "a camera of 30x42" in said
    assert "transports of the same" in said
