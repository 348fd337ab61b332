"""A projector of more than 106 pixels a side, from plan to relit light, by the command line."""

from dataclasses import replace

import numpy as np
import pytest

import nearfar
from nearfar.arrays import Size
from nearfar.correspondence import correspond_by_phase
from nearfar.errors import InputError
from nearfar.estimate.joint import estimate_jointly
from nearfar.estimate.joint.estimator import JOINT
from nearfar.illumination.pictures import natural_picture
from nearfar.photometry.measure import measure
from nearfar.workflow.evaluate import snr
from nearfar.workflow.observers.quality import QualityObserver
from tests.cli.conftest import run_nearfar

PROJECTOR = Size(136, 150)


@pytest.fixture(scope="module")
def job(tmp_path_factory):
    """Return a folder with a plan, a capture, its transport, and the exact operator."""
    folder = tmp_path_factory.mktemp("every-pixel")
    plan, capture, rig = folder / "plan.json", folder / "capture.zarr", folder / "scene.toml"
    rig.write_text('[scene]\nname = "corner"\ncamera = "48x52"\n')
    for arguments in (
        ("plan", "--projector", PROJECTOR, "--photos", 90, "-o", plan),
        ("acquire", plan, capture, "--rig", rig),
        ("reconstruct", capture, folder / "transport.zarr", "--report", folder / "report.html"),
    ):
        done = run_nearfar(*arguments)
        assert done.status == 0, done.err
    return folder


def _truth(folder, light):
    capture = nearfar.open_capture(folder / "capture.zarr")
    rig = nearfar.open_rig(folder / "scene.toml", capture.plan.projector)
    return rig.exposure * np.asarray(rig.world @ light)


def test_lights_are_relit_at_every_pixel(job):
    transport = nearfar.load_transport(job / "transport.zarr")
    assert (transport.projector, transport.pitch) == (PROJECTOR, 4)
    picture = natural_picture(PROJECTOR, 3)
    random = np.random.default_rng(2).random(PROJECTOR).astype(np.float32)
    white = np.ones(PROJECTOR, dtype=np.float32)
    # Less than was measured on the same plan by 3 dB.
    for light, least in ((picture, 38.0), (random, 36.0), (white, 50.0)):
        assert snr(_truth(job, light), transport @ light) > least


def test_most_errors_of_pictures_are_within_two_error_bars(job):
    transport = nearfar.load_transport(job / "transport.zarr")
    picture = natural_picture(PROJECTOR, 4)
    sigma = nearfar.ErrorBars(transport).picture(picture)
    off = np.abs(transport @ picture - _truth(job, picture))
    assert 0.5 < np.mean(off < sigma) < 0.95
    assert np.mean(off < 2 * sigma) > 0.8


def test_a_light_of_another_size_is_resized_only_when_asked(job):
    np.save(job / "small.npy", natural_picture(Size(68, 75), 1))
    arguments = ("relight", job / "transport.zarr", job / "small.npy", job / "relit.npy")
    refused = run_nearfar(*arguments)
    assert refused.status == 1
    assert "--resize" in refused.err
    done = run_nearfar(*arguments, "--resize")
    assert done.status == 0, done.err
    assert "68x75 was resized to 136x150" in done.out
    light = np.load(job / "small.npy").repeat(2, axis=0).repeat(2, axis=1)
    expected = nearfar.load_transport(job / "transport.zarr") @ light
    np.testing.assert_allclose(np.load(job / "relit.npy"), expected, rtol=1e-5, atol=1e-6)


def test_its_verdict_and_its_file_say_what_it_is(job):
    done = run_nearfar("info", job / "transport.zarr")
    assert done.status == 0, done.err
    assert done.out.startswith("good")
    assert nearfar.load_transport(job / "transport.zarr").verdict.grade == "good"


def test_the_quality_while_photos_are_taken_is_that_of_the_finished_transport(job):
    capture = nearfar.open_capture(job / "capture.zarr")
    observer = QualityObserver(capture.plan, 90.0, capture.full_scale)
    for number in range(len(capture.plan.patterns)):
        observer.after_photo(number, np.asarray(capture.photos[number]))
    verdict = nearfar.load_transport(job / "transport.zarr").verdict
    assert observer.quality.snr == pytest.approx(verdict.held_out_snr, abs=1.0)


def test_a_tile_with_the_rows_beside_it_is_that_of_the_whole(job):
    capture = nearfar.open_capture(job / "capture.zarr")
    plan, measurements = capture.plan, measure(capture)
    q = correspond_by_phase(measurements, pitch=plan.pitch).q
    sizes = (plan.window, plan.far)
    whole = estimate_jointly(measurements, q, *sizes, pitch=plan.pitch)
    rows = 40
    tile = replace(
        measurements.of_pixels(Size(rows, 52), slice(0, rows * 52)),
        brightest=float(measurements.responses[..., 0].max()),
    )
    part = estimate_jointly(tile, q[:rows], *sizes, pitch=plan.pitch)
    same = slice(0, rows - JOINT.rows_beside(plan))
    assert same.stop > 10
    np.testing.assert_array_equal(part.footprint[same], whole.footprint[same])
    light = natural_picture(PROJECTOR, 5)
    np.testing.assert_allclose((part @ light)[same], (whole @ light)[same], rtol=1e-3, atol=1e-5)
    wanted = estimate_jointly(tile, q[:rows], *sizes, pitch=plan.pitch, rows=same)
    for name in ("prior_component", "prior_scale"):
        found, expected = (getattr(one.posterior, name) for one in (wanted, whole))
        np.testing.assert_array_equal(found, expected[same])


def test_rows_that_are_not_wanted_are_left_out_without_changing_those_that_are(job):
    capture = nearfar.open_capture(job / "capture.zarr")
    plan, measurements = capture.plan, measure(capture)
    q = correspond_by_phase(measurements, pitch=plan.pitch).q
    sizes = (plan.window, plan.far)
    whole = estimate_jointly(measurements, q, *sizes, pitch=plan.pitch)
    light = natural_picture(PROJECTOR, 5)
    for rows in (slice(20, 23), slice(0, 7), slice(41, 48)):
        part = estimate_jointly(measurements, q, *sizes, pitch=plan.pitch, rows=rows)
        # Products of fewer camera pixels round otherwise.
        np.testing.assert_allclose(part.footprint, whole.footprint[rows], rtol=1e-4, atol=1e-4)
        np.testing.assert_allclose(part @ light, (whole @ light)[rows], rtol=1e-3, atol=1e-5)
        np.testing.assert_allclose(part.direct, whole.direct[rows], rtol=1e-3, atol=1e-4)


def test_an_accelerator_is_refused_with_a_sentence(job):
    pytest.importorskip("torch", reason="no PyTorch")
    capture = nearfar.open_capture(job / "capture.zarr")
    with pytest.raises(InputError, match="processor alone"):
        nearfar.reconstruct(capture, device="torch")
