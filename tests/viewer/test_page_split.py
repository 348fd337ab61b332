"""The viewer's page in a real browser: the model's split and the physical one."""

import threading
from dataclasses import replace

import numpy as np
import pytest

from nearfar.arrays import middles
from nearfar.estimate.physical import split_physically
from nearfar.estimate.physical.split import PhysicalComponents
from nearfar.files import read_picture
from nearfar.transport.store import save_transport
from nearfar.viewer import interactive, physical
from nearfar.viewer.interactive import InteractiveTransport
from nearfar.viewer.messages import Gains, Light
from nearfar.viewer.physical import PhysicalRelighting
from tests.cli.conftest import run_nearfar
from tests.estimate.physical.test_split import ATTENUATION, PROJECTOR, transport_of, window_light
from tests.viewer.asking import refused
from tests.viewer.browsing import pictures, saved, seen, settled, slide, tone
from tests.viewer.conftest import served_view
from tests.waiting import LONGEST_WAIT, wait_until

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def wax():
    """Return a disc of wax beside a wall that lights from one side, in three channels."""
    y, x = np.mgrid[: PROJECTOR.height, : PROJECTOR.width]
    disc = (np.hypot(y - 15, x - 16) < 6).astype(float)
    near = window_light(disc, attenuations=(ATTENUATION, 1.5 * ATTENUATION))
    near[:, :3, :, :2] += 0.01
    direct = np.random.default_rng(4).uniform(0.05, 0.3, (*PROJECTOR, 2))
    two = transport_of(near, direct)
    factors = ("direct", "near", "far", "black", "noise")
    return replace(two, **{name: getattr(two, name)[:, :, [0, 1, 1]] for name in factors})


@pytest.fixture(scope="module")
def split(wax):
    return split_physically(wax)


@pytest.fixture(scope="module")
def stored_wax(wax, tmp_path_factory):
    path = tmp_path_factory.mktemp("wax") / "wax.zarr"
    save_transport(wax, path)
    return path


@pytest.fixture(scope="module")
def page_of_wax(stored_wax):
    with served_view(InteractiveTransport(stored_wax)) as address:
        yield address


def _physical(page):
    """Wait until the frames are of the physical split."""
    wait_until(lambda: pictures(page).get("split") == "physical")
    settled(page)


def test_the_physical_components_are_shown_each_with_its_gain(
    open_page, page_of_wax, stored_wax, split, tmp_path
):
    page = open_page(page_of_wax, {"kind": "white"})
    names = [page.inner_text(f"figure:has(#part{i}) button") for i in range(3)]
    assert names == ["direct", "near-range", "far-range"]
    whole = seen(page)
    page.click("[data-split=physical]")
    _physical(page)
    assert np.abs(seen(page).astype(int) - whole).max() <= 1
    names = [page.inner_text(f"figure:has(#part{i}) button") for i in range(3)]
    assert names == ["direct", "subsurface", "inter-reflection"]
    assert "1 translucent body" in page.inner_text("#split-status")
    parts = split.components(np.ones(PROJECTOR, np.float32))
    for number, part in enumerate(parts):
        assert np.abs(seen(page, f"part{number}") - tone(part)).max() <= 1
    slide(page, "subsurface", 2)
    slide(page, "interreflection", 0.5)
    expected = parts.direct + 2 * parts.subsurface + 0.5 * parts.interreflection
    assert np.abs(seen(page) - tone(expected)).max() <= 1
    light = saved(page, "#save-light", tmp_path)
    exr = read_picture(saved(page, "#save-exr", tmp_path))
    gains = ("--gain", "subsurface=2", "--gain", "interreflection=0.5")
    out = tmp_path / "cli.exr"
    assert run_nearfar("relight", stored_wax, light, out, *gains).status == 0
    np.testing.assert_allclose(exr, read_picture(out), atol=1e-5)
    # By the keyboard: one alone, all, and the other split, whose components are not among these.
    page.keyboard.press("s")
    assert np.abs(seen(page) - tone(2 * parts.subsurface)).max() <= 1
    page.keyboard.press("n")
    assert page.get_attribute("[data-solo=subsurface]", "aria-pressed") == "true"
    page.keyboard.press("m")
    wait_until(lambda: pictures(page).get("split") == "model")
    settled(page)
    assert np.abs(seen(page).astype(int) - whole).max() <= 1
    assert page.is_visible("[data-solo=near]")
    assert not page.query_selector("[data-solo=subsurface]")


def test_the_address_keeps_the_split_and_its_gains(open_page, page_of_wax, split):
    state = {"kind": "spot", "colour": "#ff8020", "split": "physical", "subsurface": 3}
    page = open_page(page_of_wax, {**state, "solo": "subsurface"})
    _physical(page)
    assert page.get_attribute("[data-split=physical]", "aria-pressed") == "true"
    assert page.get_attribute("[data-solo=subsurface]", "aria-pressed") == "true"
    assert page.input_value("[data-of=subsurface]") == "3"
    assert seen(page).max() > 100
    page = open_page(page_of_wax, {"split": "<b>"})
    assert page.get_attribute("[data-split=model]", "aria-pressed") == "true"


def test_the_models_split_is_shown_until_the_physical_one_is_made(
    open_page, stored_wax, monkeypatch
):
    """It is made once, for all pages; meanwhile a sentence says so and the light can be moved."""
    go_on, asked = threading.Event(), []

    def slowly(transport):
        asked.append(transport)
        assert go_on.wait(LONGEST_WAIT)
        return split_physically(transport)

    monkeypatch.setattr(physical, "split_physically", slowly)
    with served_view(InteractiveTransport(stored_wax)) as address:
        page = open_page(address, {"kind": "white", "split": "physical"})
        assert "until then the model's split is shown" in page.inner_text("#split-status")
        assert page.is_visible("[data-solo=near]")
        page.click("[data-kind=spot]")
        settled(page)
        assert pictures(page)["split"] == "model"
        go_on.set()
        _physical(page)
        other = open_page(address, {"split": "physical"})
        _physical(other)
        assert len(asked) == 1
        for one in (page, other):
            one.goto("about:blank")


def test_what_cannot_be_split_physically_says_why(open_page, serve, stored_wax, wax, tmp_path):
    address = serve(InteractiveTransport(stored_wax, memory=10**4))
    page = open_page(address, {"kind": "white"})
    page.click("[data-split=physical]")
    page.wait_for_selector("#split-status:has-text('of 1GB')")
    assert page.get_attribute("[data-split=model]", "aria-pressed") == "true"
    page.goto("about:blank")
    far_alone = replace(wax, parts=("direct", "far"), near=wax.near[..., :0, :0])
    save_transport(far_alone, tmp_path / "t.zarr")
    address = serve(InteractiveTransport(tmp_path / "t.zarr"))
    page = open_page(address, {"split": "physical"})
    assert not page.is_visible("#splits")
    page.goto("about:blank")
    status, said = refused(address, "/split", b"")
    assert status == 400
    assert "it has no near-range light" in said


@pytest.mark.parametrize("light_of", ["grey", "tinted", "coloured"])
def test_fewer_camera_pixels_are_relit_as_all_of_them_are(stored_wax, split, monkeypatch, light_of):
    monkeypatch.setattr(interactive, "MAXIMUM_COARSE_BYTES", 400_000)
    relighting = PhysicalRelighting(InteractiveTransport(stored_wax))
    assert relighting.prepare() == 1
    draw = np.random.default_rng(0)
    levels = draw.random((*PROJECTOR, 3) if light_of == "coloured" else PROJECTOR)
    colour = (1, 0.5, 0.25) if light_of == "tinted" else (1, 1, 1)
    light = Light(levels.astype(np.float32), np.array(colour, np.float32))
    whole = np.stack(split.components(light.as_array()))
    frame = relighting.relight_coarsely(light)
    assert frame.stride > 1
    assert not frame.exact
    rows, columns = (middles(side, frame.stride) for side in PROJECTOR)
    shown = frame.parts.astype(np.float32) / frame.scale
    np.testing.assert_allclose(shown, whole[:, rows][:, :, columns], rtol=2e-3, atol=1e-4)
    (exact,) = relighting.relight_exactly(light)
    np.testing.assert_allclose(exact.parts.astype(np.float32) / exact.scale, whole, atol=1e-3)
    gains = dict(zip(PhysicalComponents._fields, (1.0, 0.0, 2.0), strict=True))
    expected = split.relight(light.as_array(), **gains)
    np.testing.assert_allclose(relighting.relight(light, Gains(**gains)), expected, atol=1e-6)
