"""Projectors of one row or one column: planned, photographed, estimated and judged as others."""

from functools import cache

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.correspondence import (
    correspond_by_gray_code,
    correspond_by_phase,
    correspond_by_stripes,
)
from nearfar.estimate.error_bars import ErrorBars
from nearfar.estimate.joint import estimate_jointly
from nearfar.illumination.pictures import standard_lights
from nearfar.photometry.measure import measure
from nearfar.plan import choose_plan, paper_plan, parse_plan
from nearfar.plan.patterns import HalfScreen
from nearfar.rigs.simulated.camera import SimulatedCamera
from nearfar.rigs.simulated.projector import SimulatedProjector
from nearfar.rigs.simulated.rig import SimulatedRig
from nearfar.transport.exact import ExactTransport
from nearfar.workflow.acquire import acquire_in_memory
from nearfar.workflow.by_codes import correspond_by_codes
from nearfar.workflow.evaluate import snr
from nearfar.workflow.from_patterns import reconstruct_from_patterns
from tests.shown import captured, fringes, white_and_black

CAMERA = Size(12, 20)
LONG = 24
ROW, COLUMN = Size(1, LONG), Size(LONG, 1)
EITHER = pytest.mark.parametrize("projector", [ROW, COLUMN], ids=["row", "column"])


def _world(projector):
    """Draw direct light at whole pixels, an exponential about it, and a slow wave."""
    generator = np.random.default_rng(0)
    number = np.arange(CAMERA.pixels)
    q = np.rint(np.linspace(0, LONG - 1, CAMERA.pixels)).astype(int)
    place = np.arange(LONG)
    phase = 0.2 * generator.uniform(size=(CAMERA.pixels, 1))
    matrix = 0.2 / LONG * (1 + 0.5 * np.cos(2 * np.pi * (place / LONG + phase)))
    matrix += 0.03 * np.exp(-np.abs(place - q[:, None]) / 1.5)
    matrix[number, q] += generator.uniform(0.2, 0.5, CAMERA.pixels)
    world = ExactTransport(projector, CAMERA, (), (), matrix[None].astype(np.float32), "line")
    return world, q.reshape(CAMERA)


def _shoot(plan):
    world, _ = _world(plan.projector)
    rig = SimulatedRig(world, "line", SimulatedProjector(), SimulatedCamera(), 1.0, 0)
    return acquire_in_memory(plan, rig)


@cache
def _estimated(projector, photos):
    plan, _ = choose_plan(projector, photos)
    measurements = measure(_shoot(plan))
    q = correspond_by_phase(measurements, pitch=plan.pitch).q
    return plan, q, estimate_jointly(measurements, q, plan.window, plan.far, pitch=plan.pitch)


@EITHER
@pytest.mark.parametrize("photos", [24, 40])
def test_a_plan_measures_along_the_line_alone(projector, photos):
    plan, _ = choose_plan(projector, photos)
    assert photos - 1 <= len(plan.patterns) <= photos
    assert parse_plan(plan.to_json()) == plan
    across = [k[projector.index(1)] for p in plan.patterns if (k := getattr(p, "frequency", None))]
    assert set(across) == {0}
    assert plan.counts["direct"] >= 1
    for index, pattern in enumerate(plan.patterns):
        drawn = plan.draw(index)
        assert drawn.shape == projector
        if isinstance(pattern, HalfScreen):
            assert 0 < drawn.mean() < 255


@EITHER
@pytest.mark.parametrize("photos", [24, 40])
def test_the_joint_estimate_relights_and_its_error_bars_hold(projector, photos):
    world, q = _world(projector)
    _, found, estimate = _estimated(projector, photos)
    along = 1 - projector.index(1)
    np.testing.assert_allclose(found[..., along], q, atol=0.2)
    np.testing.assert_array_equal(found[..., 1 - along], 0)
    bars, within = ErrorBars(estimate), []
    for light in standard_lights(projector).values():
        truth, relit = (np.reshape(t @ light, CAMERA) for t in (world, estimate))
        assert snr(truth, relit) > 38
        within.append(np.abs(relit - truth) < bars.picture(light).reshape(CAMERA))
    assert 0.55 < np.mean(within) < 0.82


def test_near_range_light_is_found_on_the_row_only():
    _, _, estimate = _estimated(ROW, 40)
    middle = estimate.window // 2
    windows = estimate.near.mean(axis=(0, 1, 2))
    assert estimate.window == 5
    assert windows[middle, middle] > windows[middle, middle + 1] > windows[middle, -1] > 0
    assert not np.delete(windows, middle, axis=0).any()


def test_a_column_is_a_row_turned():
    row, column = (_estimated(projector, 40)[2] for projector in (ROW, COLUMN))
    light = np.random.default_rng(1).uniform(size=ROW).astype(np.float32)
    np.testing.assert_allclose(row @ light, column @ light.T, atol=1e-4)


@EITHER
@pytest.mark.parametrize(
    ("method", "find"), [("stripes", correspond_by_stripes), ("gray", correspond_by_gray_code)]
)
def test_photos_of_their_own_find_q_along_the_line(projector, method, find):
    _, q = _world(projector)
    plan = paper_plan(projector, 1, (1, 1), correspondence=method)
    # A stripe on the only row would leave nothing lit, and tell nothing.
    own = [i for i, pattern in enumerate(plan.patterns) if pattern.purpose == "correspondence"]
    assert all(plan.draw(i).any() for i in own)
    found = find(_shoot(plan))
    assert found.lit.all()
    along = 1 - projector.index(1)
    np.testing.assert_allclose(found.q[..., along], q, atol=0.05)
    np.testing.assert_array_equal(found.q[..., 1 - along], 0)


@EITHER
def test_photos_of_anybody_s_fringes_find_q_along_the_line_and_relight(projector, tmp_path):
    world, q = _world(projector)
    along = 1 - projector.index(1)
    pictures = [*fringes(projector, along, [24, 8, 5], 4), *white_and_black(projector)]
    capture = captured(world, pictures, tmp_path)
    found = correspond_by_codes(capture)
    assert found.axes == ("rows", "columns")
    assert not found.warnings()
    np.testing.assert_allclose(found.correspondence.q[..., along], q, atol=0.2)
    np.testing.assert_array_equal(found.correspondence.q[..., 1 - along], 0)
    light = np.random.default_rng(1).random(projector).astype(np.float32)
    estimate = reconstruct_from_patterns(capture, found.correspondence)
    truth, relit = (np.reshape(t @ light, CAMERA) for t in (world, estimate))
    assert snr(truth, relit) > 30
