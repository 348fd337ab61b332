"""RIG.toml of real rigs: what is written, what is read, what is refused."""

import shutil

import numpy as np
import pytest

import nearfar
from nearfar.arrays import Size
from nearfar.errors import DeviceError, UnreadableFileError
from nearfar.rigs.cameras.driver import FoundCamera
from nearfar.rigs.cameras.folder import FolderCamera
from nearfar.rigs.initial import draft_rig
from nearfar.rigs.monitors import Monitor
from nearfar.rigs.opening import open_rig
from nearfar.rigs.tables import RealTable, read_rig_table
from tests.cli.conftest import run_nearfar

MONITORS = (
    Monitor(0, "eDP-1", Size(1080, 1920), (0, 0), 60.0),
    Monitor(1, 'A "projector"', Size(800, 1280), (0, 1920), 120.0),
)
FOUND = [FoundCamera("aravis", "Maker-1", "Maker\nOne"), FoundCamera("opencv", "/dev/video0", "C")]


@pytest.mark.parametrize("monitors", [(), MONITORS[:1], MONITORS])
@pytest.mark.parametrize("cameras", [[], FOUND, FOUND[1:]])
def test_what_init_writes_is_read(tmp_path, monitors, cameras):
    text = draft_rig(monitors, cameras)
    (tmp_path / "rig.toml").write_text(text, encoding="utf-8")
    table = read_rig_table(tmp_path / "rig.toml")
    assert isinstance(table, RealTable)
    assert table.projector.monitor == (monitors[-1].name if monitors else None)
    assert table.camera.driver == (cameras[0].driver if cameras else "folder")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('[camera]\ndriver = "polaroid"\n', "camera"),
        ('[camera]\ndriver = "aravis"\nexposures = 1\n', "no such key"),
        ('[camera]\ndriver = "aravis"\nexposure = 0\n', "exposure"),
        ('[camera]\ndriver = "aravis"\nexposure = "long"\n', "exposure"),
        ('[camera]\ndriver = "aravis"\naverage = 0\n', "average"),
        ('[camera]\ndriver = "aravis"\nbracket = [2.0, 1.0]\n', "begins with 1"),
        ('[camera]\ndriver = "aravis"\nbracket = [1.0, 2.5]\n', "whole"),
        ('[camera]\ndriver = "aravis"\nregion = "big"\n', "region"),
        ('[camera]\ndriver = "folder"\n', "path"),
        ('[projector]\nbrightness = 2.0\n[camera]\ndriver = "aravis"\n', "brightness"),
        ('[projector]\nlamp = 1\n[camera]\ndriver = "aravis"\n', "no such key"),
    ],
)
def test_a_real_rig_that_cannot_be_is_named(tmp_path, text, words):
    path = tmp_path / "rig.toml"
    path.write_text(text)
    with pytest.raises(UnreadableFileError, match=words) as refused:
        read_rig_table(path)
    assert "rig.toml" in str(refused.value)


def test_a_real_rig_is_opened_too_and_its_camera_given_back(tmp_path, monkeypatch):
    monkeypatch.setenv("DISPLAY", "")
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    closed = []
    monkeypatch.setattr(FolderCamera, "close", lambda camera: closed.append(camera.name))
    path = tmp_path / "rig.toml"
    path.write_text('[camera]\ndriver = "folder"\npath = "."\n')
    with pytest.raises(DeviceError, match="set DISPLAY"):
        open_rig(path, Size(4, 4))
    assert closed == [f"folder {tmp_path}"]


def test_a_simulated_rig_is_a_context_and_works_without(tmp_path):
    np.save(tmp_path / "T.npy", np.full((1, 1, 4, 4), 0.01, np.float32))
    white = [np.full((4, 4), 255, np.uint8)]
    with open_rig(tmp_path / "T.npy", Size(4, 4)) as rig:
        photos = list(rig.shoot(white))
    np.testing.assert_array_equal(list(rig.shoot(white)), photos)
    with (
        pytest.warns(DeprecationWarning, match="use nearfar.open_rig"),
        nearfar.opened_rig(str(tmp_path / "T.npy"), Size(4, 4), told=print) as old,
    ):
        np.testing.assert_array_equal(list(old.shoot(white)), photos)


def test_without_a_display_commands_say_so(tmp_path, monkeypatch):
    monkeypatch.setenv("DISPLAY", "")
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    photos = tmp_path / "photos"
    photos.mkdir()
    path = tmp_path / "rig.toml"
    path.write_text('[camera]\ndriver = "folder"\npath = "photos"\n')
    plan = tmp_path / "p.json"
    run_nearfar("plan", "--projector", "8x8", "--near", 3, "--far", "3x3", "-o", plan)
    for command in (("calibrate", path), ("acquire", plan, tmp_path / "c.zarr", "--rig", path)):
        ran = run_nearfar(*command)
        assert ran.status == 1, ran
        assert "set DISPLAY" in ran.err
    assert not (tmp_path / "c.zarr").exists()
    # A calibration that is there is replaced where that is asked for, and nothing else is.
    (tmp_path / "rig.calibration").mkdir()
    (tmp_path / "rig.calibration" / "calibration.json").write_text("{}")
    assert "--force" in run_nearfar("calibrate", path).err
    assert "set DISPLAY" in run_nearfar("calibrate", path, "--force").err
    (tmp_path / "rig.calibration" / "calibration.json").rename(tmp_path / "rig.calibration" / "my")
    assert "did not write" in run_nearfar("calibrate", path, "--force").err
    (tmp_path / "rig.calibration" / "my").rename(tmp_path / "rig.calibration" / "calibration.json")
    assert (
        "is no calibration" in run_nearfar("acquire", plan, tmp_path / "c.zarr", "--rig", path).err
    )
    shutil.rmtree(tmp_path / "rig.calibration")
    ran = run_nearfar("devices")
    assert ran.status == 0
    assert "set DISPLAY" in ran.err
    ran = run_nearfar("init", tmp_path / "new.toml")
    assert ran.status == 0
    assert isinstance(read_rig_table(tmp_path / "new.toml"), RealTable)
    ran = run_nearfar("init", tmp_path / "new.toml")
    assert ran.status == 1
    assert "--force" in ran.err
    assert run_nearfar("init", tmp_path / "new.ini").status == 1
