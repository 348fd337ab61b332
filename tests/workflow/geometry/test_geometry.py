"""Calibration of the geometry from poses of a board that are known."""

from dataclasses import replace

import numpy as np
import pytest

import nearfar
from nearfar.arrays import Size
from nearfar.workflow.geometry.board import Board, find_corners, q_at_corners, require_board
from nearfar.workflow.geometry.calibrate import calibrate_geometry
from nearfar.workflow.geometry.poses import Pose
from tests.stereo.flat import BENT, board, exact_pixels, rig_of, rotation

pytest.importorskip("cv2")

CAMERA, PROJECTOR = Size(480, 640), Size(600, 800)
STEREO = rig_of(CAMERA, PROJECTOR, bent=BENT)
BOARD = Board(Size(6, 9), 0.025)
TURNS = [(0, 0, 0), (25, 5, 0), (-22, 20, 5), (5, -28, -5), (18, -20, 10), (-15, -25, 30)]
TURNS += [(30, 15, 80), (-28, 8, -20), (10, 32, 45)]


def pose(number, turns, noise=0.0):
    """Return a board where both see it, all over the pictures."""
    generator = np.random.default_rng(number)
    places = BOARD.places()
    middle = places.mean(axis=0)
    at = np.array([*generator.uniform([-0.06, -0.04], [0.06, 0.04]), generator.uniform(0.5, 0.8)])
    points = (places - middle) @ rotation(*turns).T + at
    camera = STEREO.camera.project(points)[0]
    projector = STEREO.projector.project(points @ STEREO.rotation.T + STEREO.translation)[0]
    camera, projector = (
        (pixels + noise * generator.normal(size=pixels.shape)).astype(np.float32)
        for pixels in (camera, projector)
    )
    return Pose(f"pose {number}", places, camera, projector, CAMERA, PROJECTOR)


def poses(noise=0.0):
    return [pose(number, turns, noise) for number, turns in enumerate(TURNS)]


def test_exact_poses_give_the_rig():
    found = calibrate_geometry(poses())
    assert found.stereo.error < 1e-3
    for one, other in zip(
        (found.stereo.camera, found.stereo.projector),
        (STEREO.camera, STEREO.projector),
        strict=True,
    ):
        np.testing.assert_allclose(one.matrix, other.matrix, atol=0.1)
        np.testing.assert_allclose(one.distortion[:4], BENT, atol=3e-3)
    np.testing.assert_allclose(found.stereo.rotation, STEREO.rotation, atol=1e-4)
    np.testing.assert_allclose(found.stereo.translation, STEREO.translation, atol=1e-4)
    assert found.notes == ()


def test_noisy_poses_give_it_within_the_errors_that_are_said():
    found = calibrate_geometry(poses(noise=0.2))
    assert found.camera_error == pytest.approx(0.2 * 2**0.5, rel=0.1)
    assert found.stereo.error == pytest.approx(0.2 * 2**0.5, rel=0.1)
    for lens, known, deviation in (
        (found.stereo.camera, STEREO.camera, found.camera_deviation),
        (found.stereo.projector, STEREO.projector, found.projector_deviation),
    ):
        error = np.array([lens.matrix[i, j] - known.matrix[i, j] for i, j in PLACES])
        assert (np.abs(error) < 3 * deviation).all(), (error, deviation)
    assert "9 poses" in found.describe()


PLACES = ((0, 0), (1, 1), (0, 2), (1, 2))


def test_a_pattern_pixel_may_be_a_block_of_the_projectors():
    # As if blocks of three, in the middle of a larger projector, had told q.
    corner = np.array([4, 7])
    coarse = [
        replace(
            each,
            projector=(each.projector - corner + 0.5) / 3 - 0.5,
            projector_size=Size(195, 264),
        )
        for each in poses()
    ]
    found = calibrate_geometry(coarse, scale=3, native=Size(599, 800))
    np.testing.assert_allclose(found.stereo.projector.matrix, STEREO.projector.matrix, atol=0.3)


def test_a_bad_pose_is_named():
    given = poses(noise=0.05)
    bent = given[3].camera + np.random.default_rng(1).normal(size=given[3].camera.shape)
    given[3] = replace(given[3], camera=bent.astype(np.float32))
    found = calibrate_geometry(given)
    assert any("pose 3 does not agree" in note for note in found.notes)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (poses()[:2], "2 poses of the board"),
        (poses()[:1], "1 pose of the board"),
        ([pose(n, (15, 10, 0), 0.05) for n in range(5)], "parallel boards"),
        ([*poses()[:3], replace(pose(4, TURNS[4]), camera_size=Size(48, 64))], "pose 4 has"),
    ],
)
def test_poses_that_tell_nothing_are_refused(given, words):
    with pytest.raises(nearfar.NearfarError, match=words):
        calibrate_geometry(given)


def test_corners_and_q_at_them_are_found():
    corners, camera = Size(4, 6), Size(240, 320)
    stereo = rig_of(camera, Size(192, 256), bent=BENT)
    turned, middle = rotation(15, -10, 5), np.array([0.0, 0.0, 0.6])
    seen = board(turned, middle, corners)
    rows, columns = np.indices((2 * camera.height, 2 * camera.width)) / 2 - 0.25
    fine = stereo.camera.rays(np.stack([columns.ravel(), rows.ravel()], axis=1))
    depth, albedo = seen(fine)
    drawn = np.where(np.isfinite(depth), albedo, 0.2).reshape(camera.height, 2, camera.width, 2)
    given = Board(corners, 0.03)
    found = find_corners(drawn.mean(axis=(1, 3)), given)
    places = given.places()
    points = (places - places.mean(axis=0)) @ turned.T + middle
    expected = stereo.camera.project(points)[0]
    if np.abs(found - expected).max() > 5:
        found = found[::-1]
    np.testing.assert_allclose(found, expected, atol=0.15)
    # A tenth of q is wrong, and whole projector pixels are told alone.
    q = np.rint(exact_pixels(stereo, seen)[1])
    generator = np.random.default_rng(4)
    wrong = generator.uniform(size=camera) < 0.1
    q[wrong] = generator.uniform(0, 192, (wrong.sum(), 2))
    at = q_at_corners(q, expected)
    true = stereo.projector.project(points @ stereo.rotation.T + stereo.translation)[0]
    assert np.sqrt(np.mean((at - true) ** 2)) < 0.25
    # Rounding alone is worse.
    assert np.sqrt(np.mean((np.rint(true) - true) ** 2)) > 0.25


def test_no_board_is_no_corners():
    assert find_corners(np.ones((60, 80), np.float32), BOARD) is None
    with pytest.raises(nearfar.NearfarError, match="too small"):
        require_board(Board(Size(2, 9), 1.0))
    with pytest.raises(nearfar.NearfarError, match="no side"):
        require_board(Board(Size(4, 9), float("nan")))
