"""Colour lights: each channel sees its share of each primary."""

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.errors import InputError
from nearfar.plan import paper_plan
from nearfar.rigs.real.rig import RealRig
from nearfar.transport.colour import as_channels_see
from nearfar.workflow.acquire import acquire
from nearfar.workflow.calibrate import calibrate
from nearfar.workflow.reconstruction.reconstruct import reconstruct
from tests.rigs.table import TableCamera, TableScreen

PROJECTOR, CAMERA = Size(12, 16), Size(12, 16)
MIXING = np.array([[0.5, 0.1, 0.0], [0.1, 0.6, 0.1], [0.0, 0.2, 0.5]])


def _seen(table):
    return {"rig": {"colour_mixing": table}}


def test_lights_without_a_calibration_go_channel_by_channel():
    light = np.random.default_rng(0).random((4, 5, 3), dtype=np.float32)
    assert as_channels_see(light, 3, {}) is light
    assert as_channels_see(light[..., 0], 3, _seen(MIXING.tolist())).ndim == 2
    np.testing.assert_allclose(
        as_channels_see(light, 1, {}), light @ [0.2126, 0.7152, 0.0722], rtol=1e-5
    )


def test_grey_is_grey_whatever_the_mixing():
    grey = np.repeat(np.random.default_rng(0).random((4, 5, 1)), 3, axis=-1)
    np.testing.assert_allclose(as_channels_see(grey, 3, _seen(MIXING.tolist())), grey)
    one = as_channels_see(grey, 1, _seen([[0.2, 0.3, 0.5]]))
    np.testing.assert_allclose(one, grey[..., 0])


@pytest.mark.parametrize("table", [[[1.0, 0.0, 0.0]], [[0.0] * 3] * 3])
def test_a_mixing_that_does_not_fit_is_refused(table):
    with pytest.raises(InputError, match="calibrate the rig again"):
        as_channels_see(np.ones((2, 2, 3)), 3, _seen(table))


@pytest.mark.slow
@pytest.mark.parametrize("channels", [3, 1])
def test_a_calibrated_rig_relights_in_colour(channels, tmp_path):
    mixing = MIXING if channels == 3 else MIXING[:1]
    generator = np.random.default_rng(1)
    transport = np.diag(generator.uniform(0.3, 0.8, PROJECTOR.pixels)) + 2e-4
    screen = TableScreen()
    gammas = np.array([1.8, 2.2, 2.4])

    def camera():
        return TableCamera(screen, transport, CAMERA, PROJECTOR, gamma=gammas, channels=mixing)

    found = calibrate(RealRig(screen, camera(), screen.monitor.size, scale=1, exposure=0.1))
    rig = RealRig(screen, camera(), PROJECTOR, exposure=0.1, calibration=found.calibration)
    capture = acquire(paper_plan(PROJECTOR, 5, Size(3, 3)), tmp_path / "c.zarr", rig)
    measured, _ = reconstruct(capture)
    light = generator.random((*PROJECTOR, 3))
    shown = as_channels_see(light, channels, measured.provenance)
    relit = measured.relight(shown).reshape(CAMERA.pixels, channels)
    photo = transport @ light.reshape(-1, 3) @ mixing.T
    error = np.sqrt(np.mean((relit - photo) ** 2) / np.mean(photo**2))
    assert error < 0.02
    if channels == 3:
        # Channel by channel it would be far off.
        naive = measured.relight(light).reshape(CAMERA.pixels, channels)
        assert np.sqrt(np.mean((naive - photo) ** 2) / np.mean(photo**2)) > 5 * error
