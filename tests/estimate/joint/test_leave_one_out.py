"""Prior scales of error bars by how well responses are foretold by one another."""

from dataclasses import replace

import numpy as np
import pytest

from nearfar import choose_plan
from nearfar.arrays import Size
from nearfar.correspondence import correspond_by_phase
from nearfar.estimate.joint import errors_of_foretold, estimate_jointly
from nearfar.estimate.joint.estimate import SWEEPS
from nearfar.estimate.joint.leave_one_out import (
    LARGEST_FACTOR,
    MARGIN,
    calibrated,
    mean_errors,
)
from nearfar.estimate.joint.nuisance import amplitude_responses, prior_precision
from nearfar.estimate.joint.problem import ComponentChoice
from nearfar.illumination.frequencies import DC
from nearfar.illumination.near_basis import NearBasis
from nearfar.photometry.measure import measure
from nearfar.priors.covariance import far_variance, near_covariance
from nearfar.priors.fitted import PRIOR_SCALES
from nearfar.priors.responses import response_prior
from nearfar.rigs.simulated.camera import SimulatedCamera
from nearfar.rigs.simulated.projector import SimulatedProjector
from nearfar.rigs.simulated.rig import SimulatedRig
from nearfar.scenes.cache import cached_scene
from nearfar.scenes.hostile import hostile_transport
from nearfar.workflow.acquire import acquire_in_memory
from nearfar.workflow.diagnosis.left_out import LEAST_LOCAL_ERROR, STANDS_OUT
from tests.estimate.joint.draws import (
    COMPONENT,
    FAR,
    PROJECTOR,
    WINDOW,
    batch_of,
    centred_on_all,
    chosen_frequencies,
    drawn_rows,
    measured,
)

SCALE = 0.05
CAMERA = Size(3, 5)


@pytest.fixture(scope="module")
def drawn():
    frequencies = chosen_frequencies()
    centred = centred_on_all(frequencies)
    centres = np.tile([8, 10], (60, 1))
    rows, _ = drawn_rows(60, centres, SCALE, seed=4)
    far = np.random.default_rng(5).normal(size=(60, 1, centred.basis.count))
    far *= SCALE * np.sqrt(far_variance(centred.basis, COMPONENT))
    measurements = measured(rows, frequencies, noise=1e-3, offset=1e-3)
    responses = measurements.responses
    responses[..., 1:] += centred.uncentre(far.astype(np.float32), centres)
    batch = batch_of(measurements, centres, centred)
    # Scales are shares of white.
    scale = (SCALE / batch.white[:, 0]).astype(np.float32)
    multiplicity = np.ones(centred.basis.count, dtype=np.float32)
    return batch, centred, response_prior(COMPONENT, centred, multiplicity), scale


def errors(drawn, factor=1.0, weights=None):
    batch, centred, prior, scale = drawn
    if weights is None:
        weights = np.full(centred.basis.count, 1 / centred.basis.count, dtype=np.float32)
    return mean_errors(batch, prior, factor * scale, weights, NearBasis(WINDOW))


def test_each_response_is_foretold_as_dense_algebra_says(drawn):
    batch, centred, _, scale = drawn
    count = centred.basis.count
    weights = np.random.default_rng(0).random(count).astype(np.float32)
    weights /= weights.sum()
    patterns = centred.on_window.astype(np.float64)
    shape = patterns @ near_covariance(COMPONENT, WINDOW, PROJECTOR) @ patterns.T
    shape += np.diag(far_variance(centred.basis, COMPONENT))
    expected = []
    for c in range(3):
        design = amplitude_responses(batch, centred)[c].T.astype(np.float64)
        precision = prior_precision(batch, NearBasis(WINDOW))[c, 0]
        covariance = (scale[c] * batch.white[c, 0]) ** 2 * shape
        covariance += design @ np.diag(1 / precision) @ design.T
        covariance += batch.noise[c, 0] ** 2 * np.eye(count)
        y = batch.responses[c, 0].astype(np.float64)
        total = 0.0
        for r in range(count):
            others = np.delete(np.arange(count), r)
            gain = np.linalg.solve(covariance[np.ix_(others, others)], covariance[others, r])
            deviation = np.sqrt(covariance[r, r] - gain @ covariance[others, r])
            total += weights[r] * abs(y[r] - gain @ y[others]) / deviation
        expected.append(total / np.sqrt(2 / np.pi))
    np.testing.assert_allclose(errors(drawn, weights=weights)[:3], expected, rtol=5e-3)


@pytest.mark.parametrize("factor", [0.5, 1.0, 2.0])
def test_rows_drawn_from_the_component_tell_their_scale(drawn, factor):
    assert errors(drawn, factor).mean() * factor == pytest.approx(1.0, abs=0.08)


def test_the_mean_of_nine_varies_by_the_margin(drawn):
    assert np.std(errors(drawn)) / 3 == pytest.approx(MARGIN, rel=0.3)


@pytest.fixture(scope="module")
def box():
    plan, _ = choose_plan(Size(16, 16), 60, checks=0)
    truth = cached_scene("cornell", Size(16, 16))
    rig = SimulatedRig(truth, "cornell", SimulatedProjector(), SimulatedCamera(), 1.0, 0)
    measurements = measure(acquire_in_memory(plan, rig))
    return measurements, correspond_by_phase(measurements, pitch=1).q, plan.window


def test_good_photos_are_foretold_as_well_as_expected(box):
    found = errors_of_foretold(*box)
    assert set(found) == set(box[0].basis.frequencies) - {DC}
    mean, local = np.array(list(found.values())).T
    assert 0.3 < np.median(mean) < 2
    assert mean.max() < 3
    assert local.max() < LEAST_LOCAL_ERROR


@pytest.mark.parametrize("place", [5, 12])
def test_a_frequency_whose_photos_are_dimmed_stands_out(box, place):
    measurements, q, window = box
    basis = measurements.basis
    dimmed = measurements.responses.copy()
    dimmed[..., np.asarray(basis.index) == place] *= 0.5
    found = errors_of_foretold(replace(measurements, responses=dimmed), q, window)
    worst, second = sorted(found, key=found.get)[:-3:-1]
    assert worst == basis.frequencies[place]
    assert found[worst].mean > STANDS_OUT * found[second].mean


def test_a_frequency_that_is_off_in_one_place_stands_out_there(box):
    measurements, q, window = box
    basis, camera = measurements.basis, measurements.camera
    changed = measurements.responses.reshape(*camera, *measurements.responses.shape[1:]).copy()
    changed[4:8, 8:12, :, np.asarray(basis.index) == 9] *= 0.5
    responses = changed.reshape(measurements.responses.shape)
    found = errors_of_foretold(replace(measurements, responses=responses), q, window)
    worst = max(found, key=lambda frequency: found[frequency].local)
    assert worst == basis.frequencies[9]
    assert found[worst].local > 2 * max(found[k].local for k in found if k != worst)


def test_without_direct_light_nothing_is_known(box):
    measurements, q, window = box
    found = errors_of_foretold(measurements, np.full_like(q, np.nan), window)
    assert np.isnan([each.mean for each in found.values()]).all()


def test_neighbours_count_together_and_only_where_there_is_direct_light():
    found = np.full(CAMERA, 1.2, dtype=np.float32)
    found[1, 2] = 2.1
    found[:, 0] = np.nan
    scale = np.full(CAMERA.pixels, SCALE, dtype=np.float32)
    choice = ComponentChoice(np.zeros(CAMERA.pixels, dtype=np.int64), scale)
    changed = calibrated(choice, found.ravel(), CAMERA)
    np.testing.assert_array_equal(changed.prior_component, choice.prior_component)
    factor = (changed.prior_scale / SCALE).reshape(CAMERA)
    np.testing.assert_allclose(factor[:, 0], 1.0, rtol=1e-6)
    # One has a neighbourhood of six, the others of nine.
    np.testing.assert_allclose(factor[1, 1:4], np.array([1.35, 1.3, 1.3]) - MARGIN, rtol=1e-5)
    np.testing.assert_allclose(factor[:, 4], 1.2 - MARGIN, rtol=1e-5)


def test_scales_are_never_lowered_nor_raised_without_end():
    scale = np.full(CAMERA.pixels, SCALE, dtype=np.float32)
    choice = ComponentChoice(np.zeros(CAMERA.pixels, dtype=np.int64), scale)
    for error, factor in ((0.3, 1.0), (50.0, LARGEST_FACTOR)):
        found = calibrated(choice, np.full(CAMERA.pixels, error, np.float32), CAMERA)
        np.testing.assert_allclose(found.prior_scale, factor * SCALE, rtol=1e-6)


def test_rows_beside_a_tile_tell_all_that_the_whole_camera_does():
    camera = Size(16, 20)
    rows = hostile_transport("hair", PROJECTOR, camera).rows(slice(0, camera.pixels))
    measurements = measured(
        rows.astype(np.float64), chosen_frequencies(), noise=5e-4, camera=camera
    )
    q = correspond_by_phase(measurements, pitch=1).q
    whole = estimate_jointly(measurements, q, WINDOW, FAR, pitch=1).posterior.prior_scale
    plain = np.log2(whole / PRIOR_SCALES[0])
    # Many of them are raised.
    assert np.mean(np.abs(plain - np.rint(plain)) > 0.01) > 0.3
    first, last = 4, 12
    pixels = slice(first * camera.width, last * camera.width)
    some = measurements.of_pixels(Size(last - first, camera.width), pixels)
    part = estimate_jointly(some, q[first:last], WINDOW, FAR, pitch=1).posterior.prior_scale
    inner = slice(SWEEPS, -SWEEPS)
    np.testing.assert_allclose(part[inner], whole[first:last][inner], rtol=1e-5)
