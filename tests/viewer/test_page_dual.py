"""The viewer's page in a real browser: the scene as the projector sees it, lit from the camera."""

import os
import signal
import subprocess
import sys

import numpy as np
import pytest

import nearfar
from nearfar.arrays import Size
from nearfar.transport.store import save_transport
from nearfar.viewer import interactive
from nearfar.viewer.interactive import InteractiveTransport
from tests.cli.conftest import run_nearfar
from tests.viewer.asking import CAMERA, PROJECTOR, ask, message, refused, unpack
from tests.viewer.browsing import pictures, seen, settled, tone
from tests.viewer.conftest import served_view
from tests.waiting import LONGEST_WAIT, wait_until
from tests.worlds import model_transport

pytestmark = pytest.mark.slow

# A projector pixel adds up so many camera pixels.
PER_PIXEL = CAMERA.pixels / PROJECTOR.pixels


def _shows(page, expected):
    """Wait until the scene's picture is what is expected, to a step of the screen."""
    wait_until(
        lambda: (
            pictures(page).get("stage") is True
            and seen(page).shape == expected.shape
            and np.abs(seen(page) - tone(expected / PER_PIXEL)).max() <= 1
        )
    )


def _dual(transport, light):
    """Return the dual view of a light, with far-range light by reciprocity."""
    return nearfar.dual_view(transport, light, reciprocity=nearfar.find_reciprocity(transport))


def _column(transport, y, x):
    """Return the dual view of one camera pixel."""
    light = np.zeros(CAMERA, np.float32)
    light[y, x] = 1
    return _dual(transport, light)


def test_light_on_the_cameras_side_is_dragged(open_page, address, transport):
    page = open_page(address, {"kind": "white", "tool": "dual", "cameraLight": "white"})
    assert nearfar.find_reciprocity(transport).holds
    _shows(page, _dual(transport, np.ones(CAMERA, np.float32)))
    assert page.inner_text("#stage-label") == "as the projector sees it, lit from the camera"
    assert not page.is_visible("#light")
    # The smallest spot is one camera pixel.
    page.click("[data-camera-light=spot]")
    page.evaluate("""() => { const s = document.querySelector('[data-of=cameraRadius]');
        s.value = 0.5; s.dispatchEvent(new Event('input')); }""")
    box = page.locator("#camera-light").bounding_box()

    def place(y, x):
        across, down = box["width"] / CAMERA.width, box["height"] / CAMERA.height
        return box["x"] + (x + 0.5) * across, box["y"] + (y + 0.5) * down

    page.mouse.move(*place(5, 5))
    page.mouse.down()
    page.mouse.move(*place(12, 20), steps=4)
    page.mouse.up()
    _shows(page, _column(transport, 12, 20))
    # By the keyboard, one pixel on and eight.
    page.focus("#camera-light")
    page.keyboard.press("ArrowDown")
    page.keyboard.press("Shift+ArrowRight")
    _shows(page, _column(transport, 13, 28))
    # A click shows what is clicked: a camera pixel's row, in the scene a projector pixel's column.
    page.mouse.click(*place(9, 30))
    page.wait_for_selector("#pixel:has-text('row 9, column 30')")
    page.click("#picture", position={"x": 3, "y": 3})
    page.click("#tab-column")
    page.wait_for_selector("#column:has-text('row 0, column 0')")
    # The relit scene is of the camera's shape again.
    page.click("[data-tool=relit]")
    page.click("[data-tab=light]")
    settled(page)
    assert seen(page).shape[:2] == CAMERA
    assert page.is_visible("#light")


def test_components_are_sent_back_apart_with_their_gains(open_page, address, transport):
    white = np.ones(CAMERA, np.float32)
    state = {"kind": "white", "tool": "dual", "cameraLight": "white"}
    page = open_page(address, {**state, "solo": "direct"})
    direct = transport.with_gains(near=0, far=0)
    _shows(page, nearfar.dual_view(direct, white))
    said = "as the projector sees it, lit from the camera"
    assert page.inner_text("#stage-label") == f"{said}, direct light only"
    page.evaluate("""() => { const s = document.querySelector('[data-of=direct]');
        s.value = 0.5; s.dispatchEvent(new Event('input')); }""")
    _shows(page, 0.5 * nearfar.dual_view(direct, white))
    page.click("[data-solo=direct]")
    assert page.inner_text("#stage-label") == f"{said}, direct × 0.5"
    found = nearfar.find_reciprocity(transport)
    whole = nearfar.dual_view(transport.with_gains(direct=0.5), white, reciprocity=found)
    _shows(page, whole)
    # The physical split cannot be sent back: the view is whole.
    page.click("[data-split=physical]")
    _shows(page, _dual(transport, white))
    assert page.inner_text("#stage-label") == said


def test_the_address_keeps_the_light_on_the_cameras_side(open_page, address, transport):
    state = {"tool": "dual", "cameraX": 7, "cameraY": 3, "cameraRadius": 0.5}
    page = open_page(address, {**state, "cameraLight": "<b>"})
    _shows(page, _column(transport, 3, 7))
    # The light falls on a dark picture of the scene, so that one sees where.
    under = seen(page, "camera-light")
    assert under.shape[:2] == CAMERA
    assert under[3, 7].min() > 150
    assert np.ptp(under[10:].max(axis=-1)) > 20
    assert under[10:].max() < 150


def test_a_camera_of_another_shape_and_a_transport_on_the_disk(
    stored, transport, tmp_path, monkeypatch
):
    monkeypatch.setattr(interactive, "BLOCK_BYTES", 50_000)
    assert len(list(InteractiveTransport(stored, memory=10**4).blocks())) > 3
    light = np.random.default_rng(1).random((*CAMERA, 3)).astype(np.float32)
    expected = _dual(transport, light)
    with served_view(InteractiveTransport(stored, memory=10**4)) as address:
        header, (halves,) = unpack(ask(address, "/tool/dual", message(light)))
        np.testing.assert_allclose(halves / header["scale"], expected, rtol=2e-3, atol=1e-2)
        assert header["brightness"] == pytest.approx(1 / PER_PIXEL)
        status, said = refused(address, "/tool/dual", message(np.ones(PROJECTOR)))
        assert status == 400
        assert f"the camera {CAMERA}" in said
    grey = model_transport(Size(12, 10), Size(8, 9), window=3, far=Size(3, 3), channels=1)
    save_transport(grey, tmp_path / "grey.zarr")
    with served_view(InteractiveTransport(tmp_path / "grey.zarr")) as address:
        _, (halves,) = unpack(ask(address, "/tool/dual", message(np.ones((8, 9, 3)))))
        assert halves.shape == (12, 10, 1)


def test_flat_fields_are_divided_out(stored, transport, tmp_path):
    generator = np.random.default_rng(3)
    flats = {
        "camera": generator.uniform(0.5, 1, CAMERA).astype("f4"),
        "projector": generator.uniform(0.5, 1, PROJECTOR).astype("f4"),
    }
    options = []
    for side, flat in flats.items():
        np.save(tmp_path / f"{side}.npy", flat)
        options += [f"--{side}-flat", tmp_path / f"{side}.npy"]
    command = [sys.executable, "-m", "nearfar", "view", stored, "--and", stored, *options]
    command += ["--port", "0", "--no-browser", "--quiet"]
    with subprocess.Popen(command, stdout=subprocess.PIPE) as running:
        address = running.stdout.readline().decode().split(" at ")[1].split(",")[0]
        light = generator.random(CAMERA).astype(np.float32)
        found = [
            unpack(ask(address, f"{path}/tool/dual", message(light)))
            for path in ("", "/projector/1")
        ]
        os.kill(running.pid, signal.SIGINT)
        running.communicate(timeout=LONGEST_WAIT)
    reciprocity = nearfar.find_reciprocity(transport)
    # The camera is the same for both; the flat field is of the first projector.
    for (header, (halves,)), of_projector in zip(found, (flats["projector"], None), strict=True):
        expected = nearfar.dual_view(
            transport,
            light,
            camera_flat=flats["camera"],
            projector_flat=of_projector,
            reciprocity=reciprocity,
        )
        np.testing.assert_allclose(halves / header["scale"], expected, rtol=2e-3, atol=1e-2)


def test_a_flat_field_that_is_none_gets_a_sentence(stored, tmp_path):
    for values, words in (
        (np.zeros(CAMERA), "black somewhere"),
        (np.ones((3, 4)), f"give a picture of {CAMERA}"),
    ):
        np.save(tmp_path / "flat.npy", values.astype("f4"))
        ran = run_nearfar("view", stored, "--camera-flat", tmp_path / "flat.npy", "--no-browser")
        assert ran.status == 1
        assert words in ran.err
