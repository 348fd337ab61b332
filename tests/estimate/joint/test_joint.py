"""The joint estimate against dense Gaussian algebra, and on worlds that obey the model."""

from dataclasses import replace

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.errors import InputError
from nearfar.estimate.joint import estimate_jointly
from nearfar.estimate.joint.clipped import solve_clipped
from nearfar.estimate.joint.nuisance import amplitude_responses, prior_precision
from nearfar.estimate.joint.solve import PosteriorMean, solve_whole
from nearfar.estimate.joint.spikes import with_spike
from nearfar.illumination.near_basis import NearBasis
from nearfar.illumination.patterns import exponential
from nearfar.illumination.real_basis import real_basis
from nearfar.priors.component import PriorComponent
from nearfar.priors.covariance import far_variance, near_covariance
from nearfar.priors.responses import response_prior
from tests.estimate.joint.draws import (
    COMPONENT,
    FAR,
    PROJECTOR,
    WINDOW,
    batch_of,
    centred_on_all,
    chosen_frequencies,
    dense,
    drawn_rows,
    measured,
    solved,
)
from tests.worlds import model_transport


@pytest.mark.parametrize("offset", [0.0, 3e-3])
def test_the_mean_is_that_of_dense_algebra_inside_and_at_the_border(offset):
    # Far inside, at one border, at a corner.
    centres = np.array([[8, 10], [7, 9], [0, 10], [8, 18], [0, 0], [15, 19], [1, 18]])
    frequencies = chosen_frequencies()
    centred = centred_on_all(frequencies)
    rows, _ = drawn_rows(len(centres), centres, 0.02)
    measurements = measured(rows, frequencies, noise=2e-3, offset=offset)
    batch = batch_of(measurements, centres, centred)
    prior = response_prior(COMPONENT, centred, measurements.multiplicity[centred.response_indices])
    found = solved(batch, prior, np.full(len(centres), 0.05), centred)
    amplitudes, windows, far, _ = dense(measurements, batch, centred, 0.05)
    scale, far_scale = np.abs(windows).max(), np.abs(far).max()
    np.testing.assert_allclose(found.near[:, 0], windows, atol=2e-3 * scale)
    np.testing.assert_allclose(found.far[:, 0], far, atol=2e-3 * far_scale)
    np.testing.assert_allclose(found.amplitudes[:, 0, 1], amplitudes[:, -1], atol=1e-4)
    if offset:
        np.testing.assert_allclose(found.amplitudes[:, 0, 0], amplitudes[:, 0], atol=1e-5)


def test_repeats_count_as_less_noise():
    centres = np.array([[8, 10], [7, 9]])
    frequencies = chosen_frequencies()
    centred = centred_on_all(frequencies)
    rows, _ = drawn_rows(len(centres), centres, 0.02)
    measurements = measured(rows, frequencies, noise=2e-3)
    nine = np.full_like(measurements.multiplicity, 9.0)
    means = [
        solved(
            batch_of(m, centres, centred),
            response_prior(COMPONENT, centred, m.multiplicity[centred.response_indices]),
            np.full(2, 0.05),
            centred,
        )
        for m in (
            replace(measurements, multiplicity=nine),
            replace(measurements, noise=measurements.noise / 3),
        )
    ]
    np.testing.assert_allclose(means[0].near, means[1].near, atol=1e-5)
    np.testing.assert_allclose(means[0].amplitudes, means[1].amplitudes, atol=1e-5)


@pytest.mark.parametrize(
    "component",
    [COMPONENT, PriorComponent(2.0, 8.0, 2.0, 3.0), PriorComponent(2.0, 8.0, 2.0, roughness=1.0)],
)
@pytest.mark.parametrize("uneven", [False, True])
def test_clipped_windows_of_every_component_are_those_of_dense_algebra(component, uneven):
    centres = np.array([[0, 10], [8, 19], [1, 0], [8, 10], [15, 18], [0, 10]])
    frequencies = chosen_frequencies()
    centred = centred_on_all(frequencies)
    rows, _ = drawn_rows(len(centres), centres, 0.02)
    measurements = measured(rows, frequencies, noise=2e-3)
    multiplicity = measurements.multiplicity.copy()
    if uneven:
        # Cosines that were measured more often than their sines.
        multiplicity[centred.response_indices[~centred.basis.is_sine]] = 4.0
    prior = response_prior(component, centred, multiplicity[centred.response_indices])
    batch = batch_of(measurements, centres, centred)
    found = solved(batch, prior, np.full(len(centres), 0.05), centred, by=solve_clipped)
    spread = np.diag(1.0 / multiplicity[centred.response_indices])
    window, power = (
        near_covariance(component, WINDOW, PROJECTOR),
        far_variance(centred.basis, component),
    )
    for c in range(len(centres)):
        clipped = centred.on_window * batch.inside[c]
        squared = (0.05 * float(batch.white[c, 0])) ** 2
        direct = amplitude_responses(batch, centred)[c, 0].astype(np.float64)
        covariance = squared * (clipped @ window @ clipped.T + np.diag(power))
        covariance += float(batch.noise[c, 0]) ** 2 * spread
        covariance += np.outer(direct, direct) / prior_precision(batch, NearBasis(WINDOW))[c, 0, 0]
        x = np.linalg.solve(covariance, batch.responses[c, 0].astype(np.float64))
        for got, exact in (
            (found.near[c, 0], squared * (window @ clipped.T @ x) * batch.inside[c]),
            (found.far[c, 0], squared * power * x),
            (found.score[c, 0], centred.on_window.T @ x),
        ):
            np.testing.assert_allclose(got, exact, atol=1e-3 * np.abs(exact).max())


def test_whole_and_cut_agree_where_nothing_is_cut():
    centres = np.array([[8, 10], [7, 9], [6, 12]])
    frequencies = chosen_frequencies()
    centred = centred_on_all(frequencies)
    rows, _ = drawn_rows(len(centres), centres, 0.02)
    measurements = measured(rows, frequencies, noise=2e-3, offset=1e-3)
    prior = response_prior(COMPONENT, centred, measurements.multiplicity[centred.response_indices])
    batch = with_spike(batch_of(measurements, centres, centred), np.array([0, 3, 24]))
    one, other = (
        solved(batch, prior, np.full(3, 0.05), centred, by=solver)
        for solver in (solve_whole, solve_clipped)
    )
    for name in PosteriorMean._fields:
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
    found = estimate_jointly(measurements, world.correspondence, WINDOW, FAR, pitch=1)
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
    quantisation = replace(
        measurements,
        responses=(
            measurements.responses + world.direct.reshape(-1, 1, 1) * error.T[:, None]
        ).astype(np.float32),
    )

    def stray(measurements):
        found = estimate_jointly(measurements, world.correspondence, WINDOW, FAR, pitch=1)
        return np.sqrt(np.mean(found.near**2)) / world.direct.mean()

    unknown, known = stray(quantisation), stray(replace(quantisation, quantisation_error=error))
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
    found = estimate_jointly(measurements, q, WINDOW, FAR, pitch=1)
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
    found = estimate_jointly(measurements, off, WINDOW, FAR, pitch=1)
    before, after = (np.abs(q - true).mean() for q in (off, found.correspondence))
    assert after < 0.35 * before
    # It stays where it was rounded to.
    np.testing.assert_array_equal(np.rint(found.correspondence), np.rint(off))


def test_the_offset_of_the_references_is_taken_out():
    world = model_transport(PROJECTOR, Size(16, 20), window=WINDOW, far=Size(3, 3), entries=0)
    world = replace(world, near=np.zeros_like(world.near))
    rows = world.dense().astype(np.float64)
    frequencies = chosen_frequencies()
    noisy = measured(rows, frequencies, noise=1e-4, offset=0.02, camera=world.camera)
    unaware = replace(noisy, white_noise=np.zeros_like(noisy.noise))
    light = np.asarray(exponential(frequencies[3], PROJECTOR).real)
    truth = world @ light
    errors = [
        np.linalg.norm(
            estimate_jointly(m, world.correspondence, WINDOW, FAR, pitch=1) @ light - truth
        )
        for m in (noisy, unaware)
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
        estimate_jointly(lacking, np.array([[[8.0, 10.0]]]), WINDOW, FAR, pitch=1)
