"""Reports of reconstruct and evaluate, from the command line to what a browser would show."""

import html
import json
import re
import shutil

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.files import read_picture, write_picture
from nearfar.plan import choose_plan, paper_plan
from nearfar.report.maps import READINGS, maps_of
from nearfar.report.reconstruction import reconstruction_page
from nearfar.report.transport_page import MAXIMUM_DISPLAYED_PIXELS
from nearfar.rigs.simulated.camera import SimulatedCamera
from nearfar.rigs.simulated.projector import SimulatedProjector
from nearfar.rigs.simulated.rig import SimulatedRig
from nearfar.transport.store import load_transport
from nearfar.transport.stored import open_transport
from nearfar.workflow.acquire import acquire
from nearfar.workflow.verdict.verdict import judge_reconstruction
from tests.cli.conftest import check_done, run_nearfar
from tests.worlds import model_transport

PROJECTOR, CAMERA = Size(12, 16), Size(14, 18)


@pytest.fixture(scope="module")
def world():
    return model_transport(PROJECTOR, CAMERA, window=3, far=Size(3, 3), channels=3)


def take(plan, world, path, projector=None, exposure=1.0):
    optics = projector or SimulatedProjector()
    return acquire(plan, path, SimulatedRig(world, "test", optics, SimulatedCamera(), exposure, 0))


@pytest.fixture(scope="module")
def made(world, tmp_path_factory):
    """A capture, its transport and the report that was written with it."""
    folder = tmp_path_factory.mktemp("made")
    plan, _ = choose_plan(PROJECTOR, 40)
    take(plan, world, folder / "capture.zarr")
    ran = run_nearfar(
        "reconstruct", folder / "capture.zarr", folder / "t.zarr", "--report", folder / "r.html"
    )
    assert ran.status == 0, ran.err
    assert "report written to" in ran.out
    return folder


def stands_alone(text):
    assert not re.search(r'(src|href)="(?!data:|#)', text)
    assert re.findall(r"<script[^>]*>", text) == ['<script type="module">']
    # Names of namespaces, which browsers do not fetch.
    text = re.sub(r' xmlns(:\w+)?="[^"]*"', "", text)
    assert "http:" not in text
    assert "https:" not in text


def test_a_report_tells_of_a_reconstruction(made):
    text = (made / "r.html").read_text()
    stands_alone(text)
    transport = load_transport(made / "t.zarr")
    for name, compute in maps_of(transport).items():
        assert compute().title in text, name
    assert '<p class="verdict good"><b>good.</b> Relit pictures are off by' in text
    assert "<td>picture 101</td>" in text
    # Lights and their parts, maps, the histogram, and what photos fit.
    assert text.count("<img") == 10 + len(maps_of(transport)) + 1
    assert text.count("<svg") == 2
    # Each with how to read it; no camera pixel is saturated.
    for reading in READINGS.values():
        assert html.escape(reading) in text or reading == READINGS["noise"]
    assert "saturated: not measured" not in text
    # White is measured itself, and comes after pictures.
    assert text.index("held-out SNR_b: pictures") < text.index("floodlit picture over its error")
    assert text.index(">a picture<") < text.index(">white<")
    assert "was measured by frequency-space decomposition [1], from 40 photos" in text
    assert "whose photos no estimate used, the transport has a mean SNR_b of" in text
    assert f"nearfar reconstruct {made}/capture.zarr" in text
    assert "white and black, to measure against" in text
    assert "nearfar" in text
    assert "<td>joint</td>" in text


def test_warnings_stand_in_the_report_and_on_the_terminal(world, tmp_path):
    plan = paper_plan(PROJECTOR, 3, Size(3, 3))
    take(plan, world, tmp_path / "c.zarr", projector=SimulatedProjector(gamma=1.6))
    ran = run_nearfar(
        "reconstruct", tmp_path / "c.zarr", tmp_path / "t.zarr", "--report", tmp_path / "r.html"
    )
    assert ran.status == 0
    assert "projector or camera is not linear" in ran.err
    text = (tmp_path / "r.html").read_text()
    assert "projector or camera is not linear" in text
    assert "no cause for concern" not in text


def test_saturated_pixels_are_mapped_and_reported(world, tmp_path):
    plan, _ = choose_plan(PROJECTOR, 40)
    capture = take(plan, world, tmp_path / "c.zarr", exposure=1.8)
    ran = run_nearfar(
        "reconstruct", tmp_path / "c.zarr", tmp_path / "t.zarr", "--report", tmp_path / "r.html"
    )
    assert ran.status == 0, ran.err
    assert "are saturated" in ran.err
    assert "are saturated" in (tmp_path / "r.html").read_text()
    quality = load_transport(tmp_path / "t.zarr").quality
    white = next(i for i in range(40) if plan.draw(i).min() == 255)
    expected = (capture.photos[white] >= capture.full_scale).any(axis=-1)
    np.testing.assert_array_equal(quality.saturated, expected)
    assert 0 < expected.mean() < 1
    np.save(tmp_path / "light.npy", np.full(PROJECTOR, 0.5, dtype=np.float32))
    for name in ("bars.npy", "bars.exr", "bars.png"):
        bars = ("relight", tmp_path / "t.zarr", tmp_path / "light.npy", tmp_path / name)
        check_done(run_nearfar(*bars, "--error-bars"))
    found = np.load(tmp_path / "bars.npy")
    np.testing.assert_array_equal(np.isposinf(found).all(axis=-1), expected)
    assert not np.isnan(found).any()
    assert (read_picture(tmp_path / "bars.png")[expected] == 255).all()
    text = (tmp_path / "r.html").read_text()
    maps = maps_of(load_transport(tmp_path / "t.zarr"))
    # On all maps but their own, and on that of misfit.
    assert text.count("saturated: not measured") == len(maps)
    assert f"<b>{expected.mean():.1%}</b>" in text
    for name in ("column", "picture-error", "direct-error", "far-share"):
        found = maps[name]()
        np.testing.assert_array_equal(found.saturated, expected)
        assert np.isnan(found.values[expected]).all()
        assert np.isfinite(found.values[~expected]).any()
        assert found.low < found.high


def test_a_report_is_not_overwritten_and_refused_before_any_work(made, tmp_path):
    (tmp_path / "r.html").write_text("kept")
    where = ("reconstruct", made / "capture.zarr", tmp_path / "t.zarr")
    ran = run_nearfar(*where, "--report", tmp_path / "r.html")
    assert ran.status == 1
    assert "r.html" in ran.err
    assert not (tmp_path / "t.zarr").exists()
    assert (tmp_path / "r.html").read_text() == "kept"
    ran = run_nearfar(*where, "--report", tmp_path / "r.html", "--force")
    assert ran.status == 0
    assert "Relit, and taken apart" in (tmp_path / "r.html").read_text()


@pytest.mark.parametrize(
    ("report", "words"),
    [
        ("capture.zarr", "does not end in .html"),
        ("t.zarr", "does not end in .html"),
        ("r.txt", ".html"),
        ("none/r.html", "none"),
    ],
)
def test_a_report_replaces_no_other_file_of_the_command(made, tmp_path, report, words):
    shutil.copytree(made / "capture.zarr", tmp_path / "capture.zarr")
    (tmp_path / "q.html").write_text("an input")
    ran = run_nearfar(
        "reconstruct", tmp_path / "capture.zarr", tmp_path / "t.zarr", "--report",
        tmp_path / report, "--force",
    )  # fmt: skip
    assert ran.status == 1
    assert words in ran.err
    assert (tmp_path / "capture.zarr" / "zarr.json").exists()
    assert not (tmp_path / "t.zarr").exists()
    ran = run_nearfar(
        "evaluate", made / "t.zarr", "--truth", tmp_path / "q.html", "--report",
        tmp_path / "q.html", "--force",
    )  # fmt: skip
    assert "is an input of this command and is kept" in ran.err
    assert (tmp_path / "q.html").read_text() == "an input"


def test_a_large_camera_is_thinned_out(made, monkeypatch):
    from nearfar.capture import open_capture

    monkeypatch.setattr(
        "nearfar.report.transport_page.MAXIMUM_DISPLAYED_PIXELS", CAMERA.pixels // 3
    )
    stored, capture = open_transport(made / "t.zarr"), open_capture(made / "capture.zarr")
    page = reconstruction_page(stored, capture, judge_reconstruction(stored, capture))
    assert "One in 2 of the camera's rows and columns is shown" in page
    assert CAMERA.pixels < MAXIMUM_DISPLAYED_PIXELS


@pytest.mark.parametrize("channels", [1, 2])
def test_a_transport_of_any_channels_has_one(tmp_path, channels):
    world = model_transport(PROJECTOR, CAMERA, window=3, far=Size(3, 3), channels=channels)
    plan, _ = choose_plan(PROJECTOR, 40)
    take(plan, world, tmp_path / "c.zarr")
    ran = run_nearfar(
        "reconstruct", tmp_path / "c.zarr", tmp_path / "t.zarr", "--method", "joint",
        "--report", tmp_path / "r.html",
    )  # fmt: skip
    assert ran.status == 0, ran.err
    stands_alone((tmp_path / "r.html").read_text())


def test_an_evaluation_by_truth(made, world, tmp_path):
    np.save(tmp_path / "T.npy", np.moveaxis(world.dense(), 1, 2))
    ran = run_nearfar(
        "evaluate", made / "t.zarr", "--truth", tmp_path / "T.npy", "--report", tmp_path / "e.html"
    )
    assert ran.status == 0, ran.err
    text = (tmp_path / "e.html").read_text()
    stands_alone(text)
    assert "SNR_t of every camera pixel" in text
    kept = open_transport(made / "t.zarr").verdict
    assert kept is not None
    # The verdict leads, if there is one.
    assert text.index("<h1>") < text.index(f"<b>{kept.grade}.</b>") < text.index('class="fact')
    assert ran.out.index("snr_b_pictures") < ran.out.index("white")
    # Means and percentiles are a table.
    (head,) = re.findall(r"^dB +mean .*", ran.out, re.MULTILINE)
    (row,) = re.findall(r"^snr_t +\d.*", ran.out, re.MULTILINE)
    assert len(row.split()) == len(head.split())
    assert re.search(r"<td>random</td>.*<td>white</td>", text)
    assert "by frequency-space decomposition [1]" in text
    found = float(re.search(r"white +(\d+\.\d+) dB", ran.out).group(1))
    # Both are rounded from the same figure, to two digits and to one.
    shown = [float(cell) for cell in re.findall(r"<td>(\d+\.\d) dB</td>", text)]
    assert min(abs(cell - found) for cell in shown) < 0.056


def test_noise_of_the_arithmetic_is_no_figure_but_in_json(made, tmp_path):
    """A transport beside its own rows: what is left is rounding."""
    transport = load_transport(made / "t.zarr")
    np.save(tmp_path / "T.npy", np.moveaxis(transport.dense(), 1, 2))
    command = ("evaluate", made / "t.zarr", "--truth", tmp_path / "T.npy")
    ran = check_done(run_nearfar(*command, "--report", tmp_path / "e.html"))
    text = (tmp_path / "e.html").read_text()
    for shown in (ran.out, text):
        assert "exact to rounding" in shown
        # What is taken apart anew, the components, is no better than before.
        assert not re.search(r"(white|random)\W+(td\W+)*1[2-9]\d\.\d+ dB", shown)
    assert "All rows and all frequencies are exact to rounding" in text
    assert "difference × 1<" in text
    kept = json.loads(check_done(run_nearfar(*command, "--json")).out)
    assert kept["snr_b"]["random"] > 120


def test_an_evaluation_by_photos(made, world, tmp_path):
    folder = tmp_path / "photos"
    folder.mkdir()
    light = np.random.default_rng(0).random(PROJECTOR).astype(np.float32)
    write_picture(folder / "a<b.light.npy", light)
    transport = load_transport(made / "t.zarr")
    write_picture(folder / "a<b.photo.npy", (world @ light).astype(np.float32) + transport.black)
    ran = run_nearfar(
        "evaluate", made / "t.zarr", "--photos", folder, "--report", tmp_path / "e.html", "--json"
    )
    assert ran.status == 0, ran.err
    text = (tmp_path / "e.html").read_text()
    stands_alone(text)
    assert "a&lt;b" in text
    assert "a<b" not in text
    shutil.rmtree(folder)


def test_an_evaluation_in_other_units_says_so_on_the_terminal_and_in_its_page(
    made, world, tmp_path
):
    dense = np.moveaxis(world.dense(), 1, 2).reshape(*CAMERA, *PROJECTOR, 3)
    np.save(tmp_path / "T.npy", 1000 * dense)
    page = tmp_path / "e.html"
    ran = run_nearfar("evaluate", made / "t.zarr", "--truth", tmp_path / "T.npy", "--report", page)
    assert ran.status == 0
    assert "is in other units than the rig recorded" in ran.err
    text = page.read_text()
    stands_alone(text)
    assert "is in other units than the rig recorded" in text
    assert "difference × 1<" in text
    np.save(tmp_path / "T.npy", dense)
    ran = run_nearfar(
        "evaluate", made / "t.zarr", "--truth", tmp_path / "T.npy", "--report", page, "--force"
    )
    assert ran.err == ""
    gain = int(re.search(r"difference × (\d+)<", page.read_text())[1])
    assert gain > 1
    assert f"shown {gain} times as bright" in page.read_text()
