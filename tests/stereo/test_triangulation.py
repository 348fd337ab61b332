"""Triangulation against exact geometry."""

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.stereo import triangulate_pixels
from tests.stereo.flat import BENT, exact_pixels, plane, rig_of, sphere

SURFACES = {
    "plane": plane(np.array([0, 0, 0.7]), np.array([0.3, -0.2, -0.9])),
    "sphere": sphere(np.array([0.02, 0.0, 0.9]), 0.5),
}


def pairs(stereo, surface):
    points, q = exact_pixels(stereo, surface)
    seen = np.isfinite(points).all(axis=-1)
    rows, columns = np.nonzero(seen)
    return points[seen], np.stack([columns, rows], axis=1).astype(float), q[seen][:, ::-1]


@pytest.mark.parametrize("surface", SURFACES)
@pytest.mark.parametrize("bent", [None, BENT])
def test_exact_pixels_give_the_points_to_rounding(surface, bent):
    stereo = rig_of(Size(30, 40), Size(48, 64), bent=bent)
    points, camera, projector = pairs(stereo, SURFACES[surface])
    found = triangulate_pixels(stereo, camera, projector, np.full(camera.shape, 0.1))
    assert len(points) > 900
    np.testing.assert_allclose(found.points, points, atol=1e-9)
    assert found.miss.max() < 1e-6


def test_error_bars_hold_and_tell_errors_along_the_epipolar_line_from_others():
    stereo = rig_of(Size(60, 80), Size(96, 128), bent=BENT)
    points, camera, projector = pairs(stereo, SURFACES["sphere"])
    # More uncertain down than across.
    deviation = np.broadcast_to([0.1, 0.4], projector.shape)
    noise = np.random.default_rng(1).normal(size=projector.shape)
    found = triangulate_pixels(stereo, camera, projector + deviation * noise, deviation)
    error = np.linalg.norm(found.points, axis=1) - np.linalg.norm(points, axis=1)
    assert 0.66 < np.mean(np.abs(error) < found.deviation) < 0.70
    # What is missed is one normal number: its square is 1 on average.
    assert np.mean(found.miss**2) == pytest.approx(1, rel=0.05)
    # An estimate that took both axes alike would err more.
    alike = triangulate_pixels(
        stereo, camera, projector + deviation * noise, np.ones_like(projector)
    )
    worse = np.linalg.norm(alike.points, axis=1) - np.linalg.norm(points, axis=1)
    assert np.std(worse) > 1.01 * np.std(error)


def test_rays_that_part_meet_nowhere():
    stereo = rig_of(Size(30, 40), Size(48, 64))
    _, camera, projector = pairs(stereo, SURFACES["plane"])
    # As if the projector pixels far on its other side had lit it.
    found = triangulate_pixels(stereo, camera, projector - np.array([90, 0]), np.ones_like(camera))
    assert np.isnan(found.points).all()
    assert np.isnan(found.deviation).all()
    assert np.isnan(found.miss).all()
