"""A simulated rig's screen and camera: calibrated and previewed as real ones are."""

import json

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.capture import open_capture
from nearfar.plan import choose_plan
from nearfar.rigs.calibration import calibration_folder, read_calibration
from nearfar.rigs.opening import open_rig, open_rig_to_calibrate
from nearfar.rigs.simulated.devices import UNIT_SECONDS
from nearfar.rigs.tables import read_rig_table
from tests.cli.conftest import check_done, check_sentence, run_nearfar
from tests.worlds import model_transport

PROJECTOR, CAMERA = Size(12, 14), Size(9, 8)
GAMMA, BLACK = 2.2, 0.03


@pytest.fixture(scope="module", params=[1, 3])
def rig(request, tmp_path_factory):
    """A RIG.toml of a bent response before a stored transport of one or three channels."""
    folder = tmp_path_factory.mktemp("rig")
    world = model_transport(PROJECTOR, CAMERA, window=5, far=Size(3, 3), channels=request.param)
    shape = (*CAMERA, request.param, *PROJECTOR)
    dense = np.moveaxis(world.rows(slice(None)).reshape(shape), 2, 4)
    np.save(folder / "T.npy", dense)
    path = folder / "rig.toml"
    path.write_text(
        '[scene]\ntransport = "T.npy"\n'
        f"[projector]\ngamma = {GAMMA}\nblack_level = 0.01\n[camera]\nblack_level = {BLACK}\n"
    )
    return path


@pytest.fixture(scope="module")
def calibrated(rig):
    check_done(run_nearfar("calibrate", rig))
    return read_calibration(calibration_folder(rig))


def test_calibration_finds_what_the_rig_was_made_of(rig, calibrated):
    levels = np.linspace(0, 1, 256)[:, None]
    assert np.abs(calibrated.response_table() - levels**GAMMA).max() < 0.01
    camera = read_rig_table(rig).camera
    assert calibrated.sensor.black == pytest.approx(BLACK * camera.full_scale, rel=0.01)
    assert calibrated.sensor.gain == pytest.approx(camera.full_scale / camera.full_well, rel=0.1)
    assert calibrated.linearity < 1e-3
    assert calibrated.superposition == pytest.approx(0, abs=0.01)
    # Each channel sees its own primary, a grey camera the mean of all.
    mixing = np.asarray(calibrated.mixing)
    if len(mixing) == 3:
        others = mixing[~np.eye(3, dtype=bool)]
        assert np.abs(others).max() < 0.01 * np.diag(mixing).min()
    else:
        np.testing.assert_allclose(mixing, 1 / 3, rtol=0.02)


def test_patterns_are_linear_once_the_rig_is_calibrated(rig, calibrated):
    ramp = [np.full(PROJECTOR, level, np.uint8) for level in (0, 64, 128, 192, 255)]
    with open_rig(rig, PROJECTOR) as opened:
        photos = np.stack([photo.astype(float) for photo in opened.shoot(ramp)])
    light = (photos - photos[0]).mean(axis=(1, 2, 3))
    wanted = np.array([0, 64, 128, 192, 255]) / 255
    # A step of a bright level is 1 % of white, and each photo has noise.
    np.testing.assert_allclose(light / light[-1], wanted, atol=0.01)
    described = opened.describe()
    assert described["calibration"] == calibrated.made
    # In colours as well: each channel has the light of its own primary.
    colours = np.zeros((1, *PROJECTOR, 3), np.uint8)
    colours[..., 1] = 128
    if photos.shape[-1] == 3:
        (green,) = list(opened.shoot(colours))
        over = (green - photos[0]).mean(axis=(0, 1)) / (photos[-1] - photos[0]).mean(axis=(0, 1))
        np.testing.assert_allclose(over, [0, 128 / 255, 0], atol=0.01)


def test_a_capture_is_good_after_calibration_and_bent_before(rig, calibrated, tmp_path):
    plan, _ = choose_plan(PROJECTOR, 60)
    (tmp_path / "plan.json").write_text(plan.to_json())
    alone = rig.with_name("alone.toml")
    alone.write_text(rig.read_text())
    found = {}
    for name, path in (("before", alone), ("after", rig)):
        capture, transport = tmp_path / f"{name}.zarr", tmp_path / f"{name}-t.zarr"
        acquired = run_nearfar("acquire", tmp_path / "plan.json", capture, "--rig", path)
        # A bent response raises alarms.
        assert acquired.status == 0, acquired.err
        ran = run_nearfar("reconstruct", capture, transport, "--json")
        found[name] = json.loads(ran.out)
        assert open_capture(capture).rig.get("calibration") == (
            calibrated.made if name == "after" else None
        )
    assert "not-linear" in found["before"]["causes"]
    assert found["after"]["verdict"] == "good"
    assert found["after"]["held_out_dB"] > found["before"]["held_out_dB"] + 10


def test_a_longer_exposure_has_more_of_all_light(rig):
    with open_rig_to_calibrate(rig, read_rig_table(rig)) as opened:
        white = np.full(PROJECTOR, 255, np.uint8)
        opened.camera.set_exposure(UNIT_SECONDS / 2)
        half = opened.photograph(white).mean()
        opened.camera.set_exposure(UNIT_SECONDS)
        whole = opened.photograph(white).mean()
        black = BLACK * opened.full_scale
        assert whole - black == pytest.approx(2 * (half - black), rel=0.01)
        # A photo of the same frame has another noise.
        assert (opened.photograph(white) != opened.photograph(white)).any()


def test_a_scene_that_is_not_there_is_named(tmp_path):
    path = tmp_path / "rig.toml"
    path.write_text('[scene]\ntransport = "gone.npy"\n')
    for command in ("calibrate", "preview"):
        check_sentence(run_nearfar(command, path), "gone.npy")
    assert sorted(tmp_path.iterdir()) == [path]
