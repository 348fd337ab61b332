"""Camera drivers by name: each reads its own [camera] table, and other packages add more."""

import json
import re
import subprocess
import sys
import tomllib
from importlib.metadata import EntryPoint
from pathlib import Path

import numpy as np
import pytest

from nearfar.errors import DeviceError, ExtensionError, UnreadableFileError
from nearfar.rigs.cameras.base import Camera
from nearfar.rigs.cameras.driver import CameraDriver, CameraTable, FoundCamera
from nearfar.rigs.cameras.registry import CAMERAS, find_cameras
from nearfar.rigs.initial import draft_rig
from nearfar.rigs.tables import RealTable, read_rig_table
from tests.cli.conftest import run_nearfar


class PinholeTable(CameraTable):
    """A [camera] table of another package's."""

    hole: float = 0.3

    def open(self, folder: Path):
        raise DeviceError(f"the pinhole of {self.hole:g} mm is closed: open it.")


def _find_pinholes() -> list[FoundCamera]:
    return [FoundCamera("pinhole", "box", "A shoe box")]


def _fail_to_find() -> list[FoundCamera]:
    raise OSError("no light\nat all")


def _find_under_another_name() -> list[FoundCamera]:
    return [FoundCamera("camera", "box", "A shoe box")]


MISNAMED = CameraDriver(PinholeTable, _find_under_another_name)
PINHOLE = CameraDriver(PinholeTable, _find_pinholes, "# Millimetres.\n# hole = 0.2\n")
BLIND = CameraDriver(PinholeTable, _fail_to_find)


@pytest.fixture
def add(monkeypatch):
    """Return a function that adds drivers as entry points of another package do."""

    def added(**references: str) -> None:
        entries = {
            name: EntryPoint(name, reference, "nearfar.cameras")
            for name, reference in references.items()
        }
        monkeypatch.setitem(CAMERAS.__dict__, "_added", entries)
        monkeypatch.setattr(CAMERAS, "_loaded", {})

    return added


def test_another_package_adds_a_camera(add, tmp_path):
    add(pinhole=f"{__name__}:PINHOLE")
    found, _ = find_cameras()
    assert FoundCamera("pinhole", "box", "A shoe box") in found
    path = tmp_path / "rig.toml"
    text = draft_rig([], [camera for camera in found if camera.driver == "pinhole"])
    path.write_text(text.replace("# hole", "hole"), encoding="utf-8")
    table = read_rig_table(path)
    assert isinstance(table, RealTable)
    assert isinstance(table.camera, PinholeTable)
    assert table.camera.hole == 0.2
    assert table.camera.device == "box"
    assert json.loads(table.model_dump_json())["camera"]["hole"] == 0.2
    ran = run_nearfar("info", path)
    assert '"hole": 0.2' in ran.out
    ran = run_nearfar("calibrate", path)
    assert ran.status == 1
    assert ran.err.strip().endswith("the pinhole of 0.2 mm is closed: open it.")


def test_a_broken_driver_hides_no_other(add, tmp_path):
    add(
        absent="nearfar.no_such_module:DRIVER",
        wrong=f"{__name__}:_find_pinholes",
        blind=f"{__name__}:BLIND",
        pinhole=f"{__name__}:PINHOLE",
    )
    found, unable = find_cameras()
    assert "pinhole" in {camera.driver for camera in found}
    for words in (
        "the camera driver 'absent' of nearfar cannot be loaded (ModuleNotFoundError",
        "the camera driver 'wrong' of nearfar is of type function, not CameraDriver",
        "the camera driver 'blind' cannot search for cameras (OSError: no light at all)",
    ):
        (told,) = [sentence for sentence in unable if words in sentence]
        assert told.endswith("package.")
    ran = run_nearfar("devices")
    assert ran.status == 0
    assert "A shoe box" in ran.out
    assert "'blind' cannot search" in ran.err
    path = tmp_path / "rig.toml"
    path.write_text('[camera]\ndriver = "absent"\n')
    with pytest.raises(ExtensionError, match="'absent' of nearfar cannot be loaded"):
        read_rig_table(path)
    path.write_text('[camera]\ndriver = "polaroid"\n')
    with pytest.raises(UnreadableFileError, match=r"no camera driver 'polaroid'.*folder.*pinhole"):
        read_rig_table(path)


def test_tables_are_read_without_the_packages_that_cameras_need():
    heavy = ("cv2", "gphoto2", "harvesters", "glfw")
    program = (
        "import sys\n"
        "from nearfar.rigs.cameras.registry import CAMERAS\n"
        "tables = [CAMERAS[name].table for name in CAMERAS.own]\n"
        f"print([name for name in {heavy} if name in sys.modules])\n"
    )
    ran = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    assert ran.stdout.strip() == "[]"


@pytest.mark.parametrize("driver", CAMERAS.own)
def test_every_setting_it_comments_on_is_one(driver):
    found = [] if driver == "folder" else [FoundCamera(driver, "x", "y")]
    text = draft_rig([], found)
    settings = re.sub(r"^# (\w+ = )", r"\1", text, flags=re.MULTILINE)
    assert settings != text
    # What cannot be left out is not among the comments.
    settings += 'producer = "maker.cti"\n' if driver == "harvesters" else ""
    RealTable.model_validate(tomllib.loads(settings))


def test_a_driver_that_lists_cameras_under_another_name_is_named(add):
    add(misnamed=f"{__name__}:MISNAMED", pinhole=f"{__name__}:PINHOLE")
    found, unable = find_cameras()
    assert {camera.driver for camera in found} >= {"pinhole"}
    assert "camera" not in {camera.driver for camera in found}
    assert any("'misnamed' lists cameras of a driver 'camera'" in said for said in unable)


@pytest.mark.parametrize(
    "frame",
    [
        np.zeros((4, 5, 1)),
        np.zeros((4, 5, 1), np.int32),
        np.zeros(20, np.uint16),
        np.zeros((4, 5), np.uint16),
        np.zeros((4, 5, 2), np.uint16),
        np.zeros((0, 5, 1), np.uint8),
        None,
    ],
)
def test_a_driver_that_gives_no_photo_is_named(frame):
    class Odd(Camera):
        full_scale = 255.0

        def take(self):
            return frame

    for frames in (1, 2):
        with pytest.raises(DeviceError, match=r"the odd camera gives frames of .* its driver must"):
            Odd("the odd camera", frames=frames, bracket=(1.0,)).photograph()
    with pytest.raises(DeviceError, match=r"the odd camera gives frames of "):
        Odd("the odd camera").take_surely()
