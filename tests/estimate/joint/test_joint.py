"""The joint estimate against dense Gaussian algebra, and on worlds that obey the model."""

from dataclasses import replace

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.errors import InputError
from nearfar.estimate.joint import estimate_jointly
from nearfar.estimate.joint.cut import solve_cut
from nearfar.estimate.joint.edges import with_spike
from nearfar.estimate.joint.nuisance import columns, precision
from nearfar.estimate.joint.prior import build_prior
from nearfar.estimate.joint.solve import Found, solve_whole
from nearfar.illumination.patterns import exponential
from nearfar.illumination.real_basis import real_basis
from nearfar.transport.kinds import Kind, far_power, near_covariance
from tests.estimate.joint.draws import (
    FAR,
    KIND,
    PROJECTOR,
    WINDOW,
    band_of_all,
    chosen_frequencies,
    dense,
    drawn_rows,
    measured,
    pixels_of,
    solved,
)
from tests.worlds import model_transport


@pytest.mark.parametrize("offset", [0.0, 3e-3])
def test_the_mean_is_that_of_dense_algebra_inside_and_at_the_border(offset):
    # Far inside, at one border, at a corner.
    centres = np.array([[8, 10], [7, 9], [0, 10], [8, 18], [0, 0], [15, 19], [1, 18]])
    frequencies = chosen_frequencies()
    band = band_of_all(frequencies)
    rows, _ = drawn_rows(len(centres), centres, 0.02)
    measurements = measured(rows, frequencies, noise=2e-3, offset=offset)
    pixels = pixels_of(measurements, centres, band)
    prior = build_prior(KIND, band, measurements.multiplicity[band.places])
    found = solved(pixels, prior, np.full(len(centres), 0.05), band)
    shared, windows, far, _ = dense(measurements, pixels, band, 0.05)
    scale, far_scale = np.abs(windows).max(), np.abs(far).max()
    np.testing.assert_allclose(found.near[:, 0], windows, atol=2e-3 * scale)
    np.testing.assert_allclose(found.far[:, 0], far, atol=2e-3 * far_scale)
    np.testing.assert_allclose(found.shared[:, 0, 1], shared[:, -1], atol=1e-4)
    if offset:
        np.testing.assert_allclose(found.shared[:, 0, 0], shared[:, 0], atol=1e-5)


def test_repeats_count_as_less_noise():
    centres = np.array([[8, 10], [7, 9]])
    frequencies = chosen_frequencies()
    band = band_of_all(frequencies)
    rows, _ = drawn_rows(len(centres), centres, 0.02)
    measurements = measured(rows, frequencies, noise=2e-3)
    nine = np.full_like(measurements.multiplicity, 9.0)
    means = [
        solved(
            pixels_of(m, centres, band),
            build_prior(KIND, band, m.multiplicity[band.places]),
            np.full(2, 0.05),
            band,
        )
        for m in (
            replace(measurements, multiplicity=nine),
            replace(measurements, noise=measurements.noise / 3),
        )
    ]
    np.testing.assert_allclose(means[0].near, means[1].near, atol=1e-5)
    np.testing.assert_allclose(means[0].shared, means[1].shared, atol=1e-5)


@pytest.mark.parametrize("kind", [KIND, Kind(2.0, 8.0, 2.0, 3.0), Kind(2.0, 8.0, 2.0, rough=1.0)])
@pytest.mark.parametrize("uneven", [False, True])
def test_cut_windows_of_every_kind_are_those_of_dense_algebra(kind, uneven):
    centres = np.array([[0, 10], [8, 19], [1, 0], [8, 10], [15, 18], [0, 10]])
    frequencies = chosen_frequencies()
    band = band_of_all(frequencies)
    rows, _ = drawn_rows(len(centres), centres, 0.02)
    measurements = measured(rows, frequencies, noise=2e-3)
    multiplicity = measurements.multiplicity.copy()
    if uneven:
        # Cosines that were shown more often than their sines.
        multiplicity[band.places[~band.basis.is_sine]] = 4.0
    prior = build_prior(kind, band, multiplicity[band.places])
    pixels = pixels_of(measurements, centres, band)
    found = solved(pixels, prior, np.full(len(centres), 0.05), band, by=solve_cut)
    spread = np.diag(1.0 / multiplicity[band.places])
    window, power = near_covariance(kind, WINDOW), far_power(band.basis, kind)
    for c in range(len(centres)):
        cut = band.on_window * pixels.inside[c]
        squared = (0.05 * float(pixels.white[c, 0])) ** 2
        direct = columns(pixels, band)[c, 0].astype(np.float64)
        covariance = squared * (cut @ window @ cut.T + np.diag(power))
        covariance += float(pixels.noise[c, 0]) ** 2 * spread
        covariance += np.outer(direct, direct) / precision(pixels)[c, 0, 0]
        x = np.linalg.solve(covariance, pixels.responses[c, 0].astype(np.float64))
        for got, exact in (
            (found.near[c, 0], squared * (window @ cut.T @ x) * pixels.inside[c]),
            (found.far[c, 0], squared * power * x),
            (found.pull[c, 0], band.on_window.T @ x),
        ):
            np.testing.assert_allclose(got, exact, atol=1e-3 * np.abs(exact).max())


def test_whole_and_cut_agree_where_nothing_is_cut():
    centres = np.array([[8, 10], [7, 9], [6, 12]])
    frequencies = chosen_frequencies()
    band = band_of_all(frequencies)
    rows, _ = drawn_rows(len(centres), centres, 0.02)
    measurements = measured(rows, frequencies, noise=2e-3, offset=1e-3)
    prior = build_prior(KIND, band, measurements.multiplicity[band.places])
    pixels = with_spike(pixels_of(measurements, centres, band), np.array([0, 3, 24]))
    one, other = (
        solved(pixels, prior, np.full(3, 0.05), band, by=solver)
        for solver in (solve_whole, solve_cut)
    )
    for name in Found._fields:
        a, b = getattr(one, name), getattr(other, name)
        np.testing.assert_allclose(a, b, atol=2e-3 * np.abs(b).max(), err_msg=name)


def test_a_world_of_the_model_is_relit_by_few_responses():
    world = model_transport(
        PROJECTOR, Size(16, 20), window=WINDOW, far=Size(3, 3), channels=2, entries=0, seed=2
    )
    world = replace(world, near=np.zeros_like(world.near))
    frequencies = chosen_frequencies(60)
    measurements = measured(
        world.dense().astype(np.float64), frequencies, noise=1e-5, camera=world.camera
    )
    found = estimate_jointly(measurements, world.correspondence, WINDOW, FAR)
    light = np.random.default_rng(0).random(PROJECTOR)
    truth = world @ light
    error = np.linalg.norm(found @ light - truth) / np.linalg.norm(truth)
    assert error < 3e-3
    assert np.abs(found.direct - world.direct).max() < 3e-3


def test_what_eight_bits_make_of_direct_light_is_no_other_light():
    world = model_transport(PROJECTOR, Size(16, 20), window=WINDOW, far=Size(3, 3), seed=2)
    world = replace(world, near=0 * world.near, far=0 * world.far)
    frequencies = chosen_frequencies(60)
    measurements = measured(
        world.dense().astype(np.float64), frequencies, noise=1e-6, camera=world.camera
    )
    basis = measurements.basis
    drawn = np.rint(127.5 + 127.5 * basis.patterns.astype(np.float64)) / 127.5 - 1
    error = (drawn - basis.patterns).astype(np.float32)
    error[0] = 0
    misdrawn = replace(
        measurements,
        responses=(
            measurements.responses + world.direct.reshape(-1, 1, 1) * error.T[:, None]
        ).astype(np.float32),
    )

    def stray(told):
        found = estimate_jointly(told, world.correspondence, WINDOW, FAR)
        return np.sqrt(np.mean(found.near**2)) / world.direct.mean()

    unknown, known = stray(misdrawn), stray(replace(misdrawn, quantisation_error=error))
    assert known < 0.3 * unknown


def test_camera_pixels_without_direct_light_keep_far_light_alone():
    world = model_transport(PROJECTOR, Size(16, 20), window=WINDOW, far=Size(3, 3), entries=0)
    q = world.correspondence.copy()
    q[3:6] = np.nan
    dark = replace(
        world,
        correspondence=q,
        direct=world.direct * np.isfinite(q[..., :1]),
        near=np.zeros_like(world.near),
    )
    measurements = measured(
        dark.dense().astype(np.float64), chosen_frequencies(), noise=1e-4, camera=world.camera
    )
    found = estimate_jointly(measurements, q, WINDOW, FAR)
    assert not found.direct[3:6].any()
    assert not found.near[3:6].any()
    for values in (found.direct, found.near, found.far):
        assert np.isfinite(values).all()
    light = np.random.default_rng(0).random(PROJECTOR)
    truth, relit = (dark @ light)[3:6], (found @ light)[3:6]
    assert np.linalg.norm(truth - relit) < 0.01 * np.linalg.norm(truth)


def test_a_q_that_is_a_little_off_is_put_right():
    generator = np.random.default_rng(4)
    camera = Size(12, 14)
    y, x = np.meshgrid(np.arange(2.0, 14.0), np.arange(3.0, 17.0), indexing="ij")
    true = np.stack([y, x], axis=-1) + generator.uniform(0.2, 0.45, (*camera, 2))
    world = model_transport(PROJECTOR, camera, window=WINDOW, far=Size(3, 3), entries=0)
    world = replace(world, correspondence=true.astype(np.float32), near=np.zeros_like(world.near))
    off = true + 0.01 * generator.normal(size=true.shape)
    measurements = measured(
        world.dense().astype(np.float64), chosen_frequencies(), noise=1e-3, camera=camera
    )
    found = estimate_jointly(measurements, off, WINDOW, FAR)
    before, after = (np.abs(q - true).mean() for q in (off, found.correspondence))
    assert after < 0.35 * before
    # It stays where it was rounded to.
    np.testing.assert_array_equal(np.rint(found.correspondence), np.rint(off))


def test_the_offset_of_the_references_is_taken_out():
    world = model_transport(PROJECTOR, Size(16, 20), window=WINDOW, far=Size(3, 3), entries=0)
    world = replace(world, near=np.zeros_like(world.near))
    rows = world.dense().astype(np.float64)
    frequencies = chosen_frequencies()
    told = measured(rows, frequencies, noise=1e-4, offset=0.02, camera=world.camera)
    untold = replace(told, white_noise=np.zeros_like(told.noise))
    light = np.asarray(exponential(frequencies[3], PROJECTOR).real)
    truth = world @ light
    errors = [
        np.linalg.norm(estimate_jointly(m, world.correspondence, WINDOW, FAR) @ light - truth)
        for m in (told, untold)
    ]
    assert errors[0] < 0.3 * errors[1]


def test_responses_without_white_are_refused():
    rows, _ = drawn_rows(1, np.array([[8, 10]]), 0.01)
    measurements = measured(rows, chosen_frequencies())
    basis = real_basis(chosen_frequencies(), PROJECTOR)
    lacking = replace(
        measurements,
        basis=basis,
        responses=measurements.responses[..., 1:],
        quantisation_error=measurements.quantisation_error[1:],
        multiplicity=measurements.multiplicity[1:],
    )
    with pytest.raises(InputError, match="lack white"):
        estimate_jointly(lacking, np.array([[[8.0, 10.0]]]), WINDOW, FAR)
