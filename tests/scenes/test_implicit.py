"""Surfaces of functions, beside volumes and distances that are known."""

import numpy as np
import pytest

from nearfar.scenes.implicit import Bone, grown_together, zero_surface

CAPSULE = Bone((0.3, 0.0, 0.0), (0.3, 1.0, 0.0), (0.25, 0.25))
LOW, HIGH = (-0.5, -0.6, -0.6), (1.3, 1.6, 0.6)


def test_a_capsule_has_its_volume_and_faces_outwards():
    mesh = zero_surface(grown_together([CAPSULE], 0.01), LOW, HIGH, 0.06)
    assert mesh.is_watertight
    volume = np.pi * 0.25**2 * (1 + 4 / 3 * 0.25)
    assert mesh.volume == pytest.approx(volume, rel=0.02)


def test_points_lie_on_the_surface():
    mesh = zero_surface(grown_together([CAPSULE], 0.01), LOW, HIGH, 0.06)
    points = np.asarray(mesh.vertices)
    axis = np.stack([np.full(len(points), 0.3), points[:, 1].clip(0, 1), 0 * points[:, 0]], -1)
    np.testing.assert_allclose(np.linalg.norm(points - axis, axis=-1), 0.25, atol=1e-4)


def test_a_bone_is_thinner_towards_its_thin_end():
    bone = Bone((0.3, 0.0, 0.0), (0.3, 1.0, 0.0), (0.3, 0.1))
    points = np.asarray(zero_surface(grown_together([bone], 0.01), LOW, HIGH, 0.06).vertices)
    radius = np.hypot(points[:, 0] - 0.3, points[:, 2])
    for height, known in ((0.1, 0.28), (0.5, 0.2), (0.9, 0.12)):
        assert radius[np.abs(points[:, 1] - height) < 0.04] == pytest.approx(known, abs=0.03)


def test_bones_that_touch_grow_together_and_others_stay_apart():
    beside = Bone((0.85, 0.0, 0.0), (0.85, 1.0, 0.0), (0.25, 0.25))
    assert zero_surface(grown_together([CAPSULE, beside], 0.005), LOW, HIGH, 0.04).body_count == 2
    joined = zero_surface(grown_together([CAPSULE, beside], 0.1), LOW, HIGH, 0.04)
    assert joined.is_watertight
    assert joined.body_count == 1
