"""Sweeps over half of the camera pixels, which share choices of prior components."""

import numpy as np
import pytest

import nearfar
from nearfar.arrays import Size
from nearfar.correspondence import correspond_by_phase
from nearfar.estimate.joint.estimate import choose_components, estimate_jointly
from nearfar.estimate.joint.problem import lay_out
from nearfar.estimate.joint.shared_choice import RUN, chooser_of_each
from nearfar.illumination.centred_basis import centred_basis
from nearfar.illumination.frequencies import DC, far_frequencies, representatives
from nearfar.illumination.near_basis import NearBasis
from nearfar.illumination.real_basis import real_basis
from nearfar.photometry.measure import measure
from nearfar.photometry.measurements import Measurements
from nearfar.plan import choose_plan
from nearfar.priors.covariance import covariance_of_coefficients, far_variance
from nearfar.priors.fitted import LIT_COMPONENTS, LIT_DIFFERENCES_AT_PITCH
from nearfar.rigs.simulated.camera import SimulatedCamera
from nearfar.rigs.simulated.projector import SimulatedProjector
from nearfar.rigs.simulated.rig import SimulatedRig
from nearfar.scenes.cache import cached_scene
from nearfar.workflow.acquire import acquire_in_memory
from tests.estimate.lights_together import assert_each_light_has_its_own_errors

CAMERA = Size(8, 40)
PROJECTOR = Size(70, 90)
BASIS = NearBasis(5, 4)
FREQUENCIES = [k for k in representatives(far_frequencies(Size(11, 11), PROJECTOR)) if k != DC]
# As much noise, over white, as responses count for at least.
NOISE, WHITE = 2e-3, 0.5
# A component that differences from neighbours never have.
COMPONENT = 14


@pytest.mark.parametrize("width", [1, 2, 7, 16, 37, 40])
@pytest.mark.parametrize("parity", [0, 1])
def test_the_one_that_chooses_is_in_the_row_and_near(width, parity):
    camera = Size(4, width)
    selected = np.flatnonzero(np.indices(camera).sum(axis=0).ravel() % 2 == parity)
    selected = np.random.default_rng(0).permutation(selected)
    chooser = chooser_of_each(selected, camera)
    np.testing.assert_array_equal(chooser[chooser], chooser)
    (y, x), (its_y, its_x) = (np.divmod(each, width) for each in (selected, selected[chooser]))
    np.testing.assert_array_equal(y, its_y)
    assert np.all(np.abs(x - its_x) <= RUN)
    # Rows below and above change nothing.
    own_row = selected[y == 2]
    alone = chooser_of_each(own_row, camera)
    np.testing.assert_array_equal(own_row[alone], selected[chooser[y == 2]])


def _measured(scale):
    """Measure rows that are drawn from a component at scales (Cy, Cx), with light from q."""
    draw = np.random.default_rng(3)
    centred = centred_basis(real_basis(FREQUENCIES, PROJECTOR), BASIS)
    component, number = LIT_COMPONENTS[COMPONENT], CAMERA.pixels
    y, x = np.indices(CAMERA)
    q = np.stack([30 + y, 25 + x], axis=-1).astype(float)
    covariance = covariance_of_coefficients(component, BASIS, PROJECTOR)
    near = draw.multivariate_normal(np.zeros(BASIS.count), covariance, number, method="eigh")
    far = np.sqrt(far_variance(centred.basis, component)) * draw.normal(
        size=(number, centred.basis.count)
    )
    light = WHITE * scale.reshape(-1, 1) * (near @ centred.on_window.T + far)
    direct = 0.4 * centred.basis.patterns_at(np.zeros((1, 2)))[:, 0]
    centres = q.reshape(-1, 2).astype(np.int64)
    responses = centred.uncentre((light + direct)[:, None].astype(np.float32), centres)
    responses = responses + NOISE * draw.normal(size=responses.shape)
    basis = real_basis([DC, *FREQUENCIES], PROJECTOR)
    white = np.full((number, 1, 1), WHITE)
    level = np.full((number, 1), NOISE, dtype=np.float32)
    return q, Measurements(
        CAMERA,
        basis,
        np.concatenate([white, responses], axis=-1).astype(np.float32),
        level,
        np.zeros_like(level),
        np.empty((basis.count, 0), dtype=np.float32),
    )


def _first_choice(scale):
    q, measurements = _measured(scale)
    first = choose_components(measurements, q, BASIS.window, pitch=BASIS.pitch).sweeps[0]
    is_even = np.indices(CAMERA).sum(axis=0) % 2 == 0
    return first.prior_component.reshape(CAMERA), first.prior_scale.reshape(CAMERA), is_even


def test_the_first_sweep_has_all_components_to_choose_from():
    component, _, is_even = _first_choice(np.full(CAMERA, 0.02))
    assert np.mean(~np.isin(component[is_even], LIT_DIFFERENCES_AT_PITCH)) > 0.5


def test_a_camera_pixel_whose_responses_do_not_fit_chooses_for_itself():
    scale = np.full(CAMERA, 0.002)
    bright = [(2, 4), (3, 9), (5, 29)]
    for place in bright:
        scale[place] = 0.1
    _, found, is_even = _first_choice(scale)
    chosen = np.array([found[place] for place in bright])
    assert all(is_even[place] for place in bright)
    rest = is_even.copy()
    rest[tuple(np.transpose(bright))] = False
    assert chosen.min() > 4 * found[rest].max()
    # The others share what one of each run chose.
    assert np.mean(found[rest] == np.median(found[rest])) > 0.3


def test_responses_of_a_camera_pixel_are_side_by_side():
    q, measurements = _measured(np.full(CAMERA, 0.1))
    problem = lay_out(measurements, q, BASIS, "cpu")
    found, order = problem.pixels.responses, problem.model.centred.response_indices
    assert found.flags.c_contiguous
    np.testing.assert_array_equal(found, measurements.responses[..., order])


def test_photos_with_next_to_no_noise_do_no_harm():
    # Functions of several projector pixels hold no row exactly; responses seem to say otherwise.
    size, window = Size(32, 32), 5
    scene = cached_scene("wedge", size, size)
    plan, _ = choose_plan(size, 60, window=window)
    # A single light's SNR moves by up to a decibel with the rounding of matrix products.
    lights = [np.random.default_rng(seed).random(size).astype(np.float32) for seed in range(4)]
    lights += [nearfar.natural_picture(size, seed) for seed in range(1, 5)]

    def relit(full_well):
        camera = SimulatedCamera(full_well=full_well)
        rig = SimulatedRig(scene, scene.name, SimulatedProjector(), camera, 1.0, 0)
        measurements = measure(acquire_in_memory(plan, rig))
        q = correspond_by_phase(measurements, pitch=1).q
        found = estimate_jointly(measurements, q, window, plan.far, pitch=4)
        assert_each_light_has_its_own_errors(found)
        bars, pictures = nearfar.ErrorBars(found), [found @ light for light in lights]
        truths = [scene @ light for light in lights]
        within = [
            np.mean(np.abs(picture - truth) < bars.picture(light))
            for picture, truth, light in zip(pictures, truths, lights, strict=True)
        ]
        return np.mean(list(map(nearfar.snr, truths, pictures))), np.mean(within)

    usual, _ = relit(3e4)
    for full_well in (3e6, 3e10):
        found, within = relit(full_well)
        assert found > usual
        assert 0.5 < within < 0.9
