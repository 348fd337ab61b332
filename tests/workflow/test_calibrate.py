"""Calibration of rigs whose numbers are known: what is found, and what is said of bad ones."""

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.errors import DeviceError, InputError
from nearfar.report.calibration import is_calibration, write_calibration
from nearfar.rigs.calibration import read_calibration
from nearfar.rigs.opening import open_real_rig
from nearfar.rigs.real.rig import RealRig
from nearfar.rigs.simulated.camera import SimulatedCamera
from nearfar.rigs.tables import RealTable
from nearfar.workflow.calibrate import calibrate
from tests.rigs.table import TableCamera, TableScreen

PROJECTOR, CAMERA = Size(36, 48), Size(24, 32)
EVERY = np.arange(256) / 255
SENSOR = SimulatedCamera(bits=14)
LEVELS = 16383 / 30_000


def _rig(*, gamma=2.2, camera=TableCamera, **options):
    screen = TableScreen(PROJECTOR)
    generator = np.random.default_rng(5)
    seen = generator.uniform(0.2, 0.6, (CAMERA.pixels, 1)) / PROJECTOR.pixels
    transport = np.repeat(seen, PROJECTOR.pixels, axis=1)
    taken = camera(
        screen, transport, CAMERA, PROJECTOR, gamma=gamma, sensor=SENSOR, unit=1 / 60, **options
    )
    return RealRig(screen, taken, PROJECTOR, scale=1, exposure=1 / 60)


def _check_sensor(known):
    assert known.black == pytest.approx(0.02 * 16383, rel=0.01)
    assert known.gain == pytest.approx(LEVELS, rel=0.06)
    # Rounding to whole levels is noise as well.
    assert known.read == pytest.approx(np.hypot(4 * LEVELS, 12**-0.5), rel=0.15)
    assert known.ambient == pytest.approx(0.01, rel=0.05)


@pytest.mark.parametrize("gamma", [1.0, 2.2])
def test_a_rig_is_found_as_it_is(gamma, tmp_path):
    found = calibrate(_rig(gamma=gamma))
    known = found.calibration
    assert found.notes == ()
    assert np.abs(known.response_table() - EVERY[:, None] ** gamma).max() < 0.006
    assert known.residual < 0.01
    assert abs(known.superposition) < 0.01
    assert known.linearity < 0.002
    _check_sensor(known)
    write_calibration(tmp_path / "rig.calibration", found)
    assert read_calibration(tmp_path / "rig.calibration") == known
    assert is_calibration(tmp_path / "rig.calibration")


def test_a_colour_camera_tells_the_primaries_apart():
    gammas = np.array([1.8, 2.2, 2.6])
    mixing = np.array([[0.5, 0.1, 0.0], [0.1, 0.6, 0.1], [0.0, 0.2, 0.5]])
    known = calibrate(_rig(gamma=gammas, channels=mixing)).calibration
    for i, gamma in enumerate(gammas):
        assert np.abs(known.response_table()[:, i] - EVERY**gamma).max() < 0.012
    found = np.asarray(known.mixing)
    np.testing.assert_allclose(found / found.max(), mixing / mixing.max(), atol=0.01)


def test_a_glint_spoils_nothing():
    class Glinting(TableCamera):
        def take(self):
            photo = super().take()
            light = photo[3, 5].astype(float) - 0.02 * 16383
            photo[3, 5] = np.minimum(0.02 * 16383 + 12 * light, 16383)
            return photo

    found = calibrate(_rig(camera=Glinting))
    assert found.notes == ()
    _check_sensor(found.calibration)


class _Boosted(TableCamera):
    """Before a projector with a white segment."""

    def light(self):
        light = super().light()
        return light + 0.5 * light.min(axis=-1, keepdims=True)


def test_a_white_segment_is_told_and_grey_still_straightened():
    found = calibrate(_rig(camera=_Boosted))
    assert any("turn the projector's white segment" in note for note in found.notes)
    assert found.calibration.superposition < -0.2
    assert found.calibration.residual < 0.01


def test_a_camera_that_is_not_linear_is_told():
    class Bent(TableCamera):
        def take(self):
            share = super().take() / 16383
            return np.rint(16383 * share**0.7).astype(np.uint16)

    found = calibrate(_rig(camera=Bent))
    assert any("deviate from a straight line" in note for note in found.notes)


def test_a_bright_room_is_told():
    class Lit(TableCamera):
        def take(self):
            return np.minimum(super().take() + np.uint16(2000), 16383).astype(np.uint16)

    class Room(TableCamera):
        def light(self):
            return super().light() + 0.15

    found = calibrate(_rig(camera=Room))
    assert any("darken the room" in note for note in found.notes)
    # A higher black level is none.
    assert not any("darken" in note for note in calibrate(_rig(camera=Lit)).notes)


def test_a_camera_whose_exposure_cannot_be_set_is_calibrated_but_for_its_line():
    class Fixed(TableCamera):
        @property
        def exposure_limits(self):
            return None

    screen = TableScreen(PROJECTOR)
    transport = np.full((CAMERA.pixels, PROJECTOR.pixels), 0.5 / PROJECTOR.pixels)
    camera = Fixed(screen, transport, CAMERA, PROJECTOR, gamma=2.2, sensor=SENSOR, unit=1 / 60)
    found = calibrate(RealRig(screen, camera, PROJECTOR, scale=1))
    assert found.calibration.linearity is None
    assert any("black level could not be measured" in note for note in found.notes)
    assert np.abs(found.calibration.response_table() - EVERY[:, None] ** 2.2).max() < 0.006


def test_white_that_is_saturated_is_refused():
    screen = TableScreen(PROJECTOR)
    transport = np.full((CAMERA.pixels, PROJECTOR.pixels), 3.0 / PROJECTOR.pixels)
    camera = TableCamera(screen, transport, CAMERA, PROJECTOR, sensor=SENSOR, unit=1 / 60)
    with pytest.raises(DeviceError, match="saturated by white"):
        calibrate(RealRig(screen, camera, PROJECTOR, scale=1, exposure=1 / 60))


def test_a_bracket_asks_for_a_calibration(tmp_path):
    table = RealTable.model_validate({"camera": {"driver": "aravis", "bracket": [1, 4]}})
    with (
        pytest.raises(InputError, match="run nearfar calibrate first"),
        open_real_rig(tmp_path / "rig.toml", table, PROJECTOR),
    ):
        pass
