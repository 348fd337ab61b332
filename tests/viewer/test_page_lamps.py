"""The viewer's page, in a real browser, of a light stage: lamps, and no part but their light."""

import json
from dataclasses import replace

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.illumination.real_basis import basis_of_every_frequency
from nearfar.transport.model import Transport
from nearfar.transport.posterior import LEAST_SQUARES, FreePosterior
from nearfar.transport.rows import of_rows
from nearfar.transport.store import save_transport
from nearfar.viewer.interactive import InteractiveTransport
from nearfar.viewer.payloads import describe_scene
from nearfar.viewer.transport_row import transport_row
from tests.viewer.asking import ask
from tests.viewer.browsing import settled, show
from tests.viewer.conftest import served_view

LAMPS, CAMERA = Size(1, 6), Size(12, 16)
DIRECTIONS = [[1, 0, 0], [0, 1, 0], [0, 0, 1], [-1, 0, 0], [0, -1, 0], [0.6, 0, 0.8]]


@pytest.fixture(scope="module")
def stage() -> Transport:
    rows = np.random.default_rng(0).random((*CAMERA, 3, 6)).astype(np.float32) / 6
    basis, shape = basis_of_every_frequency(LAMPS), (*CAMERA, 3)
    return Transport(
        projector=LAMPS,
        correspondence=np.full((*CAMERA, 2), np.nan, np.float32),
        direct=np.zeros(shape, np.float32),
        near=np.zeros((*shape, 0, 0), np.float32),
        far=rows @ basis.patterns.T,
        far_basis=basis,
        black=np.zeros(shape, np.float32),
        noise=np.zeros(shape, np.float32),
        parts=("free",),
        provenance={"method": "light stage", "directions": DIRECTIONS},
    )


@pytest.fixture(scope="module")
def viewed(stage, tmp_path_factory):
    path = tmp_path_factory.mktemp("stage") / "stage.zarr"
    save_transport(stage, path)
    return InteractiveTransport(path)


@pytest.fixture(scope="module")
def page_of_stage(viewed):
    with served_view(viewed) as address:
        yield address


def test_the_scene_names_its_parts_and_directions(viewed):
    described = describe_scene(viewed, {})
    assert described["parts"] == ["free"]
    assert described["directions"] == DIRECTIONS


@pytest.mark.parametrize("directions", [None, [[1, 0, 0]], "up", [[1, 2], [3]], [[np.nan] * 3] * 6])
def test_directions_that_are_none_are_not_shown(viewed, directions, monkeypatch):
    monkeypatch.setitem(viewed.stored.provenance, "directions", directions)
    assert describe_scene(viewed, {})["directions"] is None


def test_maps_are_of_the_parts_that_are_there(viewed, page_of_stage):
    names = [each["name"] for each in json.loads(ask(page_of_stage, "/scene"))["maps"]]
    assert not {"near-share", "far-share", "column", "row", "confidence"} & set(names)


def test_the_row_of_a_camera_pixel_has_the_error_bars_of_its_lamps(stage):
    gains, noise, off = np.linspace(0.5, 1.5, 6), 0.003, 0.02
    posterior = FreePosterior(
        modes=np.eye(6, dtype=np.float32),
        strengths=(1 / gains).astype(np.float32),
        mean=np.zeros(6, np.float32),
        mean_variance=0.0,
        gain_errors=off * np.eye(6, dtype=np.float32),
        variance_ratio=np.full(CAMERA, LEAST_SQUARES),
    )
    known = replace(stage, noise=np.full_like(stage.noise, noise), posterior=posterior)
    row = transport_row(of_rows(known, slice(4, 5)), 3)
    assert row.header["no_errors"] == ""
    assert not row.window_error.any()
    # A lamp's photo was multiplied by its gain, and its noise with it.
    light = stage.rows(slice(4 * 16 + 3, 4 * 16 + 4))[0]
    of_channels = np.hypot(noise * gains, off * light)
    np.testing.assert_allclose(row.far_error, np.linalg.norm(of_channels, axis=0) / 3, rtol=1e-4)
    assert transport_row(of_rows(stage, slice(4, 5)), 3).header["no_errors"] != ""


def test_the_page_shows_lamps_and_no_absent_part(open_page, page_of_stage, stage):
    page = open_page(page_of_stage, {"kind": "white"})
    settled(page)
    assert page.locator("#parts").is_hidden()
    assert page.locator("#lamps").is_visible()
    about = page.locator("#about").inner_text()
    assert "6 lamps" in about
    assert "W =" not in about
    # A click in the middle lights the lamp that is straight ahead.
    page.locator("#lamps").click()
    settled(page)
    drawn = page.evaluate("""() => Array.from(document.getElementById('light')
        .getContext('2d').getImageData(0, 0, 6, 1).data).filter((_, i) => i % 4 === 0)""")
    assert drawn == [0, 0, 255, 0, 0, 0]
    box = page.locator("#light").bounding_box()
    assert box is not None
    assert box["height"] > 20


def test_a_camera_pixel_shows_light_from_each_lamp(open_page, page_of_stage):
    page = open_page(page_of_stage, {"kind": "white"})
    settled(page)
    page.locator("#picture").click()
    page.locator("#row").wait_for()
    assert page.locator("#row-window").is_hidden()
    summary = page.locator("#pixel-summary").inner_text()
    assert summary.startswith("floodlit")
    assert "direct" not in summary


def test_a_region_of_lamps_has_no_absent_part_and_no_error_bars(open_page, page_of_stage, stage):
    page = open_page(page_of_stage, {"kind": "white", "tab": "region", "region": [2, 3, 6, 9]})
    settled(page)
    page.wait_for_selector("#region-numbers:not([hidden])")
    rows = page.locator("#region-numbers tr").all_inner_texts()
    names = [row.split("\t")[0] for row in rows]
    assert names == [
        "mean of",
        "light",
        "lamp by lamp",
        "spread over the region",
        "noise of one measurement",
    ]
    mean = (stage @ np.ones(LAMPS, np.float32))[2:6, 3:9].reshape(-1, 3).mean(axis=0)
    told = [float(cell) for cell in rows[1].split("\t")[1:4]]
    np.testing.assert_allclose(told, mean, atol=1e-4)
    assert page.locator("#region-window").is_hidden()
    # Without error bars and places there is nothing but the relit scene.
    assert page.locator("#tools").is_hidden()
    # A tool that an address asks for is not opened.
    show(page, page_of_stage, {"tool": "error-bars"})
    assert page.inner_text("#stage-label") == "relit"
