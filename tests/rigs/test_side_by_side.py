"""Several projectors before one camera, as one rig."""

from dataclasses import replace

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.errors import InputError
from nearfar.photometry.shared_photos import photos_of_each
from nearfar.plan import choose_plan
from nearfar.plan.sharing import shared_plan
from nearfar.rigs.calibration import Calibration
from nearfar.rigs.side_by_side import open_side_by_side, side_by_side_rig
from nearfar.rigs.simulated.camera import SimulatedCamera
from nearfar.rigs.simulated.projector import SimulatedProjector
from nearfar.rigs.simulated.rig import SimulatedRig
from nearfar.rigs.simulated.side_by_side import simulated_side_by_side
from nearfar.rigs.tables import ScreenTable
from nearfar.workflow.acquire import acquire_in_memory
from nearfar.workflow.acquire_shared import gain_of_sharing
from tests.rigs.table import TableCamera, TableScreen
from tests.worlds import model_transport

GRID, CAMERA = Size(8, 12), Size(10, 14)
SENSOR = SimulatedCamera(bits=16, shot_noise=False, read_noise=0.5)


class BothScreens:
    """What a camera sees of two screens, the second of other blocks: grids side by side."""

    def __init__(self, screens, blocks):
        self._screens, self._blocks = screens, blocks
        self.wait = screens[0].wait

    def frame(self, late):
        parts = []
        for screen, block in zip(self._screens, self._blocks, strict=True):
            screen.clock = self._screens[0].clock
            shown = screen.frame(late)
            height, width = (block * n for n in GRID)
            top, left = ((a - b) // 2 for a, b in zip(shown.shape, (height, width), strict=False))
            parts.append(shown[top : top + height, left : left + width])
            shown = shown.copy()
            shown[top : top + height, left : left + width] = 0
            assert not shown.any()
        return np.hstack(parts)


def of_response(exponent):
    """Return a calibration of a projector."""
    table = np.repeat((np.linspace(0, 1, 256) ** exponent)[:, None], 3, axis=1)
    row = tuple(map(tuple, table))
    return Calibration(
        made="2026", monitor="m", camera="c", exposure=None, response=row,
        mixing=((0.2, 0.3, 0.5 * exponent),), black=SENSOR.black_level * 65535, gain=1.0, read=1.0,
        ambient=0.0, linearity=0.0, superposition=0.0, residual=0.0,
    )  # fmt: skip


def transports():
    return [model_transport(GRID, CAMERA, window=3, far=Size(3, 3), seed=seed) for seed in (0, 1)]


def test_a_real_rig_shows_each_projector_its_part_by_its_own_response():
    """Screens of other sizes and responses; what the camera sees is light that adds up."""
    parts = [transport.dense().reshape(-1, *GRID) for transport in transports()]
    matrix = np.concatenate(parts, axis=2).reshape(CAMERA.pixels, -1)
    screens = [TableScreen(Size(72, 96)), TableScreen(Size(50, 76))]
    camera = TableCamera(
        BothScreens(screens, (6, 6)), 0.3 * matrix, CAMERA, Size(8, 24), sensor=SENSOR
    )

    def light():
        halves = np.split(camera._screen.frame(0.0) / 255.0, 2, axis=1)
        linear = np.hstack([halves[0], halves[1] ** 2.2])
        return linear.reshape(8, 6, 24, 6, 3).mean(axis=(1, 3)).reshape(-1, 3)

    camera.light = light
    rig = side_by_side_rig(
        screens, camera, GRID, [ScreenTable(), ScreenTable()], [None, of_response(2.2)],
        exposure=0.1,
    )  # fmt: skip
    assert rig.projector == Size(8, 24)
    assert [one["colour_mixing"] is None for one in rig.describe()["projectors"]] == [True, False]
    made = choose_plan(GRID, 30, checks=1)[0]
    with rig:
        taken = acquire_in_memory(shared_plan(made, 2), rig)
        gain = gain_of_sharing(rig, 2)
    # Reading noise alone, and exposures by the brighter white in turn and by the sum of both.
    white = [transport @ np.ones(GRID, np.float32) for transport in transports()]
    room = np.max(sum(white)) / np.max(white)
    assert gain.decibels == pytest.approx(3.01 - 20 * np.log10(room), abs=0.5)
    assert rig.alarms == []
    assert all(screen.closed for screen in screens)
    share = rig.camera.exposure / 0.1
    dark = SENSOR.black_level + share * SENSOR.ambient
    left, right = transports()
    for photos, own, other in zip(photos_of_each(taken), (left, right), (right, left), strict=True):
        read = photos.read(range(len(made.patterns)))
        for number in (0, 5, 11):
            light = made.draw(number).astype(np.float32) / 255
            expected = own @ light + other @ np.full(GRID, 0.5, np.float32)
            found = (read[number, ..., 0] - dark) / (0.3 * share)
            np.testing.assert_allclose(found, expected, atol=5e-3)


def rig_of(transport, **changes):
    made = SimulatedRig(transport, "one", SimulatedProjector(), SENSOR, 1.0, 3)
    return replace(made, **changes)


def test_light_of_simulated_projectors_adds_up_and_fits_the_sensor():
    left, right = transports()
    rig = simulated_side_by_side([rig_of(left, exposure=0.9), rig_of(right)], ["a", "b"])
    white = 0.9 * (left @ np.ones(GRID)) + right @ np.ones(GRID)
    assert rig.exposure * white.max() == pytest.approx(0.9, rel=1e-5)
    lights = np.random.default_rng(0).random((2, 8, 24)).astype(np.float32)
    for found, light in zip(rig.world.pictures(lights), lights, strict=True):
        expected = 0.9 * (left @ light[:, :12]) + right @ light[:, 12:]
        np.testing.assert_allclose(found[..., 0], expected, atol=1e-5)
    told = rig.describe()["projectors"]
    assert [one["transport_exposure"] for one in told] == pytest.approx(
        [0.9 * rig.exposure, rig.exposure]
    )


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"world": model_transport(GRID, Size(3, 4), window=3, far=Size(1, 1))}, "size"),
        ({"sensor": SimulatedCamera(bits=8)}, r"under \[camera\]"),
        ({"optics": SimulatedProjector(gamma=2.2)}, r"under \[projector\]"),
    ],
)
def test_projectors_that_cannot_share_photos_get_a_sentence(changes, words):
    left, right = transports()
    with pytest.raises(InputError, match=f"left and right .* {words}"):
        simulated_side_by_side([rig_of(left), rig_of(right, **changes)], ["left", "right"])


def test_rigs_of_other_cameras_get_a_sentence(tmp_path):
    for name, path in (("a", "photos"), ("b", "others")):
        (tmp_path / f"{name}.toml").write_text(f'[camera]\ndriver = "folder"\npath = "{path}"\n')
    names = [str(tmp_path / "a.toml"), str(tmp_path / "b.toml")]
    with pytest.raises(InputError, match=r"same \[camera\]"):
        open_side_by_side(names, GRID)
    with pytest.raises(InputError, match=r"same \[camera\]"):
        open_side_by_side([names[0], "cornell"], GRID)
