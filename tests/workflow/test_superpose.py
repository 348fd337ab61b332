"""Relit by stored photos alone: exact for sums of patterns, with honest error bars."""

from functools import cache

import numpy as np
import pytest

import nearfar
from nearfar.arrays import Size
from nearfar.errors import InputError
from nearfar.rigs.simulated.camera import SimulatedCamera
from nearfar.rigs.simulated.projector import SimulatedProjector
from nearfar.rigs.simulated.rig import SimulatedRig
from nearfar.transport.exact import ExactTransport
from nearfar.workflow import superpose as superposing
from tests.conftest import QUIET
from tests.shown import captured, cornell, random_binary, white_and_black

pytestmark = pytest.mark.slow(minutes=0.2)

PROJECTOR, CAMERA = Size(12, 10), Size(14, 20)
DARK = {"ambient": 0.08, "black_level": 0.05}


@pytest.fixture(scope="module")
def world():
    """Rows without any structure, which no model of transport would hold."""
    generator = np.random.default_rng(0)
    far = generator.random((2, CAMERA.pixels, PROJECTOR.pixels), dtype=np.float32) ** 4
    far *= np.float32(0.6) / far.sum(axis=2).max()
    return ExactTransport(PROJECTOR, CAMERA, (), (), far)


def _capture(folder, world, plan, camera, **optics):
    projector = SimulatedProjector(black_level=0.03, **optics)
    rig = SimulatedRig(world, "test", projector, camera, 1.0, 0)
    return nearfar.acquire(plan, folder / "capture.zarr", rig)


@cache
def _plan(offset):
    if offset == "inverse":
        return nearfar.paper_plan(PROJECTOR, window=3, far=(3, 3))
    return nearfar.choose_plan(PROJECTOR, 60)[0]


@pytest.fixture(params=["inverse", "reference"])
def plan(request):
    return _plan(request.param)


def _light_of(plan, channels=None, seed=3):
    """Return a sum of differences of patterns, within [0, 1]."""
    generator = np.random.default_rng(seed)
    patterns = np.stack([plan.draw(k) for k in range(len(plan.patterns))]) / 255
    weights = generator.normal(size=(len(patterns), *([channels] if channels else [])))
    light = np.tensordot(weights.T, patterns - patterns[0], axes=1) / len(patterns)
    return np.moveaxis(light, 0, -1) if channels else light


@pytest.mark.parametrize("channels", [None, 2])
def test_sums_of_patterns_are_exact_whatever_the_scene(plan, channels, world, tmp_path):
    capture = _capture(tmp_path, world, plan, QUIET.model_copy(update=DARK))
    light = _light_of(plan, channels)
    found = nearfar.superpose(capture, light)
    truth = world @ light.astype(np.float32)
    assert found.missing < 2e-3
    assert found.missing_decibels < -54
    np.testing.assert_allclose(found.shown, light, atol=2e-3)
    assert nearfar.snr(truth, found.picture) > 45
    white = nearfar.superpose(capture, np.ones(PROJECTOR)).picture
    np.testing.assert_allclose(white, world @ np.ones(PROJECTOR, dtype=np.float32), atol=1e-3)


def test_error_bars_hold_the_errors_of_noise(plan, world, tmp_path):
    capture = _capture(tmp_path, world, plan, SimulatedCamera(full_well=3000.0, **DARK))
    light = nearfar.natural_picture(PROJECTOR, seed=1)
    found = nearfar.superpose(capture, light)
    errors = found.picture - world @ found.shown
    assert 0.62 < np.mean(np.abs(errors) < found.sigma) < 0.75
    assert np.sqrt(np.mean(errors**2)) == pytest.approx(np.sqrt(np.mean(found.sigma**2)), rel=0.2)


def test_what_was_never_shown_is_told_and_is_all_that_is_missing(plan, world, tmp_path):
    capture = _capture(tmp_path, world, plan, QUIET.model_copy(update=DARK))
    inside = _light_of(plan)
    patterns = np.stack([plan.draw(k).ravel() for k in range(len(plan.patterns))]) / 255
    differences = np.linalg.svd(patterns - patterns.mean(axis=0))[2]
    # The last of all directions is none of the patterns'.
    outside = differences[-1].reshape(PROJECTOR)
    outside *= np.linalg.norm(inside) / np.linalg.norm(outside)
    found = nearfar.superpose(capture, inside + outside)
    assert found.missing == pytest.approx(np.sqrt(0.5), rel=0.01)
    assert found.missing_decibels == pytest.approx(-3.0, abs=0.1)
    np.testing.assert_allclose(found.shown, inside, atol=2e-3)
    nothing = nearfar.superpose(capture, outside)
    assert nothing.missing > 0.999
    assert np.abs(nothing.picture).max() < 1e-3


def test_drift_is_taken_out_where_references_follow_it(world, tmp_path):
    plan = _plan("reference")
    camera = QUIET.model_copy(update=DARK)
    drifting = _capture(tmp_path, world, plan, camera, lamp_drift={"per_100_photos": 0.2})
    light = _light_of(plan)
    truth = world @ light.astype(np.float32)
    # The lamp of the middle of the capture is not that of its beginning.
    found = nearfar.superpose(drifting, light).picture
    scale = float(np.sum(found * truth) / np.sum(truth**2))
    assert 0.95 < scale < 1.15
    assert nearfar.snr(scale * truth, found) > 40


def test_saturated_camera_pixels_have_no_error_bar(plan, world, tmp_path):
    capture = _capture(tmp_path, world, plan, SimulatedCamera(black_level=0.5))
    photos = capture.read(slice(None))
    is_saturated = (photos >= 1).any(axis=0)
    assert 0 < is_saturated.mean() < 1
    found = nearfar.superpose(capture, nearfar.natural_picture(PROJECTOR, seed=1))
    assert not np.isinf(found.sigma[~is_saturated]).any()
    # In every photo that may count.
    assert np.isinf(found.sigma[(photos >= 1).mean(axis=0) > 0.6]).all()


def test_photos_of_anybodys_patterns_serve(tmp_path):
    size, scene = Size(8, 16), cornell(Size(8, 16), Size(9, 12))
    patterns = [*random_binary(size, 30), *white_and_black(size)]
    capture = captured(scene, patterns, tmp_path)
    light = (0.5 * patterns[3] + 0.2 * patterns[8]) / 255
    found = nearfar.superpose(capture, light)
    assert found.missing < 0.01
    assert nearfar.snr(scene @ light.astype(np.float32), found.picture) > 35
    # No patterns add up to nothing, so nothing tells the noise.
    assert found.sigma is None


def test_lights_that_cannot_be_summed_are_refused(plan, world, tmp_path):
    capture = _capture(tmp_path, world, plan, SimulatedCamera())
    for light, said in (
        (np.zeros(PROJECTOR), "the light is black"),
        (np.ones((3, 3)), "12x10"),
        (np.full(PROJECTOR, np.nan), "finite"),
    ):
        with pytest.raises(InputError, match=said):
            nearfar.superpose(capture, light)


def test_patterns_that_are_drawn_a_few_at_a_time_make_the_same_picture(
    world, tmp_path, monkeypatch
):
    plan = _plan("reference")
    capture, light = _capture(tmp_path, world, plan, QUIET), _light_of(plan)
    whole = nearfar.superpose(capture, light)
    monkeypatch.setattr(superposing, "PATTERN_VALUES", 2 * 7 * PROJECTOR.pixels)
    monkeypatch.setattr(superposing, "PIXELS_AT_ONCE", 50)
    few = nearfar.superpose(capture, light)
    np.testing.assert_allclose(few.picture, whole.picture, atol=1e-6)
    np.testing.assert_allclose(few.shown, whole.shown, atol=1e-6)
