"""What rows without direct light have in common, and what of it neighbours lead to expect."""

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.correspondence import correspond_by_phase
from nearfar.estimate.joint import estimate_by_sweeps, estimate_jointly, neighbours
from nearfar.estimate.joint.estimator import JointEstimator
from nearfar.estimate.joint.in_common import keep_common
from nearfar.estimate.joint.problem import lay_out
from nearfar.illumination.near_basis import NearBasis
from tests.estimate.joint.draws import FAR, PROJECTOR, WINDOW, chosen_frequencies, measured
from tests.estimate.joint.test_hostile import CAMERA as HOSTILE_CAMERA
from tests.estimate.joint.test_hostile import decibels, shot

CAMERA = Size(16, 18)
NOISE = 2e-3


def problem_of(rows, *, lit=False, noise=NOISE, offset=0.0, camera=CAMERA):
    """Lay out measured rows (C, channels, P), without q or with one q for all."""
    measurements = measured(rows, chosen_frequencies(), noise=noise, camera=camera, offset=offset)
    q = np.full((*camera, 2), 8.0 if lit else np.nan)
    return lay_out(measurements, q, NearBasis(WINDOW), "cpu")


def variance_of(problem):
    pixels = problem.pixels
    return ((pixels.noise / pixels.white) ** 2).reshape(*problem.measurements.camera, -1)


def kept(problem):
    """Return the share that is kept of each response, (Cy, Cx, R), and the noise left."""
    camera, channels = problem.measurements.camera, problem.measurements.channels
    far = np.ones((*camera, channels, problem.pixels.responses.shape[-1]))
    left = np.full(far.shape[:3], 0.2)
    share, left = keep_common(far.astype(np.float32), left, problem, variance_of(problem))
    return share[:, :, 0], left


def alike(generator, channels=1):
    """Return rows that are alike but for their brightness, with light at all frequencies."""
    row = generator.uniform(size=(1, channels, PROJECTOR.pixels))
    return row * generator.uniform(0.1, 1.0, size=(CAMERA.pixels, 1, 1)) / PROJECTOR.pixels


def unlike(generator, channels=1):
    """Return rows that know nothing of one another, of as much light."""
    size = (CAMERA.pixels, channels, PROJECTOR.pixels)
    return generator.uniform(size=size) / PROJECTOR.pixels


@pytest.mark.parametrize("channels", [1, 3])
@pytest.mark.parametrize(
    ("noise", "least"), [(1e-4, 0.98), (NOISE, 0.98), (2e-2, 0.98), (0.2, 0.9)]
)
def test_rows_that_are_alike_are_expected_as_neighbours_have_them(channels, noise, least):
    problem = problem_of(alike(np.random.default_rng(0), channels), noise=noise)
    share, left = kept(problem)
    assert share.mean() > least
    expected = 1 - 0.8 * share.mean(axis=-1, keepdims=True)
    np.testing.assert_allclose(left, np.broadcast_to(expected, left.shape), atol=1e-5)


@pytest.mark.parametrize("channels", [1, 3])
def test_nothing_is_expected_of_rows_that_have_nothing_in_common(channels):
    share, left = kept(problem_of(unlike(np.random.default_rng(0), channels)))
    assert share.mean() < 0.35
    assert left.mean() > 0.7


def test_what_is_kept_does_not_depend_on_how_bright_rows_are():
    generator = np.random.default_rng(1)
    rows = unlike(generator) + 0.3 * alike(generator)
    share, _ = kept(problem_of(rows))
    bright, _ = kept(problem_of(1000 * rows, noise=1000 * NOISE))
    np.testing.assert_allclose(share, bright, atol=2e-3)


def test_a_response_counts_by_how_often_it_was_measured():
    rows = unlike(np.random.default_rng(1))
    problem = problem_of(rows, noise=0.5 * NOISE)
    share, _ = kept(problem)
    four_times = problem._replace(
        pixels=problem.pixels._replace(noise=2 * problem.pixels.noise),
        model=problem.model._replace(multiplicity=4 * problem.model.multiplicity),
    )
    np.testing.assert_allclose(kept(four_times)[0], share, atol=1e-5)


def test_errors_of_the_references_are_no_difference_between_rows():
    rows = 0.02 * alike(np.random.default_rng(0))
    share, _ = kept(problem_of(rows, noise=1e-5, offset=1e-3))
    assert share.mean() > 0.75


def test_low_frequencies_in_common_are_kept_where_high_ones_are_not():
    generator = np.random.default_rng(2)
    y, x = (np.arange(side) / side for side in PROJECTOR)
    slow = 1 + 0.5 * np.cos(2 * np.pi * (y[:, None] + x)).ravel()
    rows = unlike(generator)
    rows = 0.3 * (rows - rows.mean(axis=-1, keepdims=True)) + slow / PROJECTOR.pixels
    problem = problem_of(rows)
    basis = problem.model.centred.basis
    cycles = np.hypot(*(basis.cycles * np.array(PROJECTOR)).T)[basis.index]
    share, _ = kept(problem)
    assert share[..., cycles < 2].mean() > 0.9
    assert share[..., cycles >= 4].mean() < 0.5


def test_rows_with_direct_light_or_alone_stay_as_they_are():
    rows = unlike(np.random.default_rng(0))
    share, left = kept(problem_of(rows, lit=True))
    assert (share == 1).all()
    assert (left == 0.2).all()
    problem = problem_of(rows)
    lit = np.ones(CAMERA, dtype=bool)
    lit[5, 7] = False
    lit[:, 12:] = False
    problem = problem._replace(pixels=problem.pixels._replace(lit=lit.ravel()))
    share, _ = kept(problem)
    assert (share[lit] == 1).all()
    assert (share[5, 7] == 1).all()
    assert share[:, 12:].mean() < 0.5


@pytest.mark.parametrize("noise", [0.0, 1e-7])
def test_photos_without_noise_and_dark_rows_are_finite(noise):
    rows = unlike(np.random.default_rng(0))
    rows[:40] = 0.0
    share, left = kept(problem_of(rows, noise=noise))
    assert ((share >= 0) & (share <= 1)).all()
    assert np.isfinite(left).all()


def test_a_row_depends_on_rows_near_it_alone():
    rows = unlike(np.random.default_rng(0))
    share, _ = kept(problem_of(rows))
    other = rows.reshape(*CAMERA, 1, -1).copy()
    other[10:] = other[10:11, :1]
    changed, _ = kept(problem_of(other.reshape(rows.shape)))
    np.testing.assert_allclose(share[:7], changed[:7], atol=1e-4)
    assert np.abs(share[7] - changed[7]).max() > 1e-3


def test_where_a_camera_begins_makes_no_difference_within():
    rows = unlike(np.random.default_rng(0)) + 0.2 * alike(np.random.default_rng(1))
    problem, fewer = problem_of(rows), Size(CAMERA.height - 3, CAMERA.width)
    pixels = type(problem.pixels)._make(each[3 * CAMERA.width :] for each in problem.pixels)
    measurements = problem_of(rows[3 * CAMERA.width :], camera=fewer).measurements
    share, _ = kept(problem._replace(pixels=pixels, measurements=measurements))
    np.testing.assert_allclose(share[3:], kept(problem)[0][6:], atol=1e-5)


def test_blocks_of_camera_rows_make_no_difference(monkeypatch):
    problem = problem_of(unlike(np.random.default_rng(0)) + 0.2 * alike(np.random.default_rng(1)))
    share, left = kept(problem)
    monkeypatch.setattr(neighbours, "BYTES_AT_ONCE", 1)
    assert neighbours.rows_at_once(share) == 1
    by_row, left_by_row = kept(problem)
    np.testing.assert_array_equal(by_row, share)
    np.testing.assert_array_equal(left_by_row, left)


def test_a_tile_with_its_halo_is_estimated_as_the_whole():
    generator, halo = np.random.default_rng(3), JointEstimator().halo
    rows = 3 * unlike(generator) + alike(generator)
    whole_of = measured(rows, chosen_frequencies(), noise=5e-3, camera=CAMERA)
    q = np.full((*CAMERA, 2), np.nan, dtype=np.float32)

    def far_of(measurements, places):
        return estimate_jointly(measurements, places, WINDOW, FAR, pitch=1).far

    whole, row = far_of(whole_of, q), 8
    around = slice(row - halo, row + halo + 1)
    pixels = slice(CAMERA.width * around.start, CAMERA.width * around.stop)
    part = whole_of.of_pixels(Size(2 * halo + 1, CAMERA.width), pixels)
    np.testing.assert_allclose(far_of(part, q[around])[halo], whole[row], atol=2e-6)


def test_rows_of_no_order_are_estimated_as_well_as_each_alone():
    truth, plan, measurements = shot("dense", 144, 1 / 200)
    q = correspond_by_phase(measurements, pitch=plan.pitch).q
    assert np.isnan(q).all()

    def by(sweeps):
        found = estimate_by_sweeps(
            measurements, q, plan.window, plan.far, pitch=plan.pitch, sweeps=sweeps
        )
        return decibels(truth.reshape(HOSTILE_CAMERA.pixels, 1, -1), found.rows(slice(None)))

    assert by(3) > by(1) - 0.1
