"""Depth from correspondence."""

from dataclasses import replace

import numpy as np
import pytest

import nearfar
from nearfar.applications.depth import FEWEST_MISSES, USUAL_FACTOR
from nearfar.arrays import Size
from tests.stereo.flat import BENT, exact_pixels, rig_of, sphere

CAMERA, PROJECTOR = Size(36, 48), Size(60, 80)
BALL = sphere(np.array([0.0, 0.0, 0.9]), 0.5)
STEREO = rig_of(CAMERA, PROJECTOR, bent=BENT)
POINTS, Q = exact_pixels(STEREO, BALL)


def seen(q, confidence=1.0):
    return nearfar.Correspondence(q, np.full(q.shape[:2], confidence))


def noisy(deviation, seed=0):
    return Q + deviation * np.random.default_rng(seed).normal(size=Q.shape)


def test_exact_q_gives_the_points():
    found = nearfar.triangulate(seen(Q), STEREO, PROJECTOR)
    np.testing.assert_allclose(found.points, POINTS, atol=1e-9)
    assert found.kept == found.lit == CAMERA.pixels
    assert found.warnings() == []


@pytest.mark.parametrize(("grid", "scale", "side"), [((30, 40), None, 2), ((20, 25), 3, 3)])
def test_a_pattern_pixel_may_be_a_block_of_the_projectors(grid, scale, side):
    # Shown in the middle, as frames are.
    corner = (np.array(PROJECTOR) - side * np.array(grid)) // 2
    q = (Q + 0.5 - corner) / side - 0.5
    found = nearfar.triangulate(seen(q), STEREO, grid, scale=scale)
    np.testing.assert_allclose(found.points, POINTS, atol=1e-9)


@pytest.mark.parametrize("deviation", [0.05, 0.3])
def test_error_bars_hold_whatever_the_noise(deviation):
    found = nearfar.triangulate(seen(noisy(deviation)), STEREO, PROJECTOR)
    error = np.linalg.norm(found.points - POINTS, axis=-1)
    assert 0.6 < np.mean(error[np.isfinite(error)] < found.deviation[np.isfinite(error)]) < 0.76


def test_errors_that_neighbours_share_are_told_by_the_misses():
    # Smooth over some camera pixels, so that they scatter hardly.
    rows, columns = np.indices(CAMERA)
    wave = np.sin(rows / 3.0) + np.sin(columns / 4.0)
    q = noisy(0.01) + 0.2 * np.stack([wave, np.cos(rows / 3.5) - np.cos(columns / 3.0)], axis=-1)
    found = nearfar.triangulate(seen(q), STEREO, PROJECTOR)
    assert found.factor > 3
    error = np.linalg.norm(found.points - POINTS, axis=-1)
    kept = np.isfinite(error)
    assert 0.6 < np.mean(error[kept] < found.deviation[kept]) < 0.76


def test_wrong_places_are_left_out_and_counted():
    q, generator = noisy(0.05), np.random.default_rng(2)
    wrong = generator.uniform(size=CAMERA) < 0.05
    q[wrong] = generator.uniform([0, 0], np.array(PROJECTOR) - 1.0, (wrong.sum(), 2))
    found = nearfar.triangulate(seen(q), STEREO, PROJECTOR)
    kept = np.isfinite(found.points[..., 2])
    assert found.kept + found.missed + found.behind == found.lit == CAMERA.pixels
    # Few of them lie on the epipolar line by chance.
    assert (kept & wrong).sum() < 0.1 * wrong.sum()
    assert (kept & ~wrong).sum() > 0.97 * (~wrong).sum()
    assert np.isnan(found.deviation[~kept]).all()


def test_what_is_not_sure_is_left_out():
    confidence = np.where(np.indices(CAMERA)[0] < 9, 0.4, 0.9)
    found = nearfar.triangulate(
        nearfar.Correspondence(Q, confidence), STEREO, PROJECTOR, least_confidence=0.5
    )
    assert found.unsure == 9 * CAMERA.width
    np.testing.assert_array_equal(np.isnan(found.points[..., 2]), confidence < 0.5)


def test_few_points_have_the_usual_factor():
    q = np.full(Q.shape, np.nan)
    q[:4, :4] = Q[:4, :4]
    found = nearfar.triangulate(seen(q), STEREO, PROJECTOR)
    assert found.lit < FEWEST_MISSES
    assert found.factor == USUAL_FACTOR
    assert found.as_json()["points"] == 16


def test_a_calibration_of_another_rig_is_told():
    turned = Q[::-1]
    (warning,) = nearfar.triangulate(seen(turned), STEREO, PROJECTOR).warnings()
    assert "misses the epipolar lines" in warning


def test_no_point_at_all_is_told_with_its_cause():
    other_way = replace(STEREO, translation=-STEREO.translation)
    (warning,) = nearfar.triangulate(seen(Q), other_way, PROJECTOR).warnings()
    assert "no point was found" in warning
    assert "R and T from the camera's frame" in warning
    (warning,) = nearfar.triangulate(
        nearfar.Correspondence(Q, np.zeros(CAMERA)), STEREO, PROJECTOR, least_confidence=0.5
    ).warnings()
    assert "accept less confidence" in warning


@pytest.mark.parametrize(
    ("q", "projector", "options", "words"),
    [
        (Q[:5], PROJECTOR, {}, "a camera of 36x48"),
        (Q, (61, 80), {}, "does not fit the calibration's projector"),
        (Q, (30, 40), {"scale": 3}, "does not fit the calibration's projector"),
        (np.full_like(Q, np.nan), PROJECTOR, {}, "nothing to triangulate"),
    ],
)
def test_what_does_not_fit_gets_a_sentence(q, projector, options, words):
    with pytest.raises(nearfar.NearfarError, match=words):
        nearfar.triangulate(seen(q), STEREO, projector, **options)
