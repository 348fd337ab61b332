"""Prior components of error bars, which neighbours choose together."""

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.correspondence import correspond_by_phase
from nearfar.estimate.joint import Choices, choose_components, estimate_jointly
from nearfar.estimate.joint.estimate import SWEEPS
from nearfar.estimate.joint.evidence import prior_set
from nearfar.estimate.joint.pooled_choice import (
    no_probabilities,
    pooled_choice,
    put_probabilities,
)
from nearfar.estimate.joint.problem import ComponentChoice, build_model
from nearfar.illumination.near_basis import NearBasis
from nearfar.photometry.measure import measure, measured_basis
from nearfar.plan import choose_plan
from nearfar.priors.fitted import LIT_COMPONENTS, PRIOR_SCALES
from nearfar.rigs.simulated.camera import SimulatedCamera
from nearfar.rigs.simulated.projector import SimulatedProjector
from nearfar.rigs.simulated.rig import SimulatedRig
from nearfar.scenes.hostile import hostile_transport
from nearfar.workflow.acquire import acquire_in_memory

PROJECTOR, CAMERA = Size(12, 12), Size(14, 16)
BRIGHT, DARK = 2, 7
# Rows of a tile with those beside it, and among them those of the tile.
ROWS = ((4, 12), (SWEEPS, 8 - SWEEPS))


@pytest.fixture(scope="module")
def plan():
    return choose_plan(PROJECTOR, 40)[0]


@pytest.fixture(scope="module")
def model(plan):
    basis, multiplicity = measured_basis(plan)
    return build_model(basis, multiplicity, NearBasis(plan.window, plan.pitch), "cpu")


@pytest.fixture(scope="module")
def shot(plan):
    camera = SimulatedCamera(
        full_well=1e6, read_noise=1e6 / 60, bits=16, black_level=0.1, shot_noise=False
    )
    scene = hostile_transport("glass", PROJECTOR, CAMERA)
    rig = SimulatedRig(scene, "glass", SimulatedProjector(), camera, 0.8, 0)
    measurements = measure(acquire_in_memory(plan, rig))
    return measurements, correspond_by_phase(measurements, pitch=plan.pitch).q


def unsure(model, share, generator):
    """Return probabilities of two lit components, one of which is the likelier at `share` of them.

    Nowhere are they more than 0.7 and 0.3.
    """
    evidence = np.full((len(model.lit.numbers), CAMERA.pixels, len(PRIOR_SCALES)), -np.inf)
    likelier = generator.random(CAMERA.pixels) < share
    evidence[BRIGHT, :, 3] = np.log(np.where(likelier, 0.7, 0.3))
    evidence[DARK, :, 5] = np.log(np.where(likelier, 0.3, 0.7))
    return evidence


def put(model, evidence):
    found = no_probabilities(CAMERA.pixels, model, np.zeros(1, np.float32))
    put_probabilities(found, np.arange(CAMERA.pixels), evidence, model.lit, model)
    return found


def test_neighbours_decide_where_photos_hardly_do(model):
    evidence = unsure(model, 0.75, np.random.default_rng(0))
    own = put(model, evidence)
    assert np.sum(own, axis=(1, 2)) == pytest.approx(1)
    chosen = pooled_choice(own, model, CAMERA)
    assert np.mean(own[:, BRIGHT].max(axis=1) > 0.5) == pytest.approx(0.75, abs=0.07)
    assert np.mean(chosen.prior_component == model.lit.numbers[BRIGHT]) > 0.9
    of_bright = chosen.prior_component == model.lit.numbers[BRIGHT]
    expected = np.where(of_bright, PRIOR_SCALES[3], PRIOR_SCALES[5])
    np.testing.assert_allclose(chosen.prior_scale, expected, rtol=1e-6)


def test_a_camera_pixel_whose_photos_are_sure_keeps_its_own(model):
    evidence = unsure(model, 1.0, np.random.default_rng(0))
    evidence[BRIGHT, 100, 3], evidence[DARK, 100, 5] = -30.0, 0.0
    chosen = pooled_choice(put(model, evidence), model, CAMERA).prior_component
    assert np.flatnonzero(chosen == model.lit.numbers[DARK]).tolist() == [100]


def test_no_camera_pixel_gets_a_component_of_the_other_kind(model):
    evidence = unsure(model, 1.0, np.random.default_rng(0))
    own = put(model, evidence)
    alone = np.array([100])
    dark = prior_set(model.unlit.priors[:1], model.centred, model.multiplicity, (25,))
    put_probabilities(own, alone, np.zeros((1, 1, len(PRIOR_SCALES))), dark, model)
    assert np.sum(own[100]) == pytest.approx(1)
    chosen = pooled_choice(own, model, CAMERA).prior_component
    assert np.flatnonzero(chosen >= len(LIT_COMPONENTS)).tolist() == [100]


def test_rows_beside_a_tile_tell_all_that_the_whole_camera_does(model):
    own = put(model, unsure(model, 0.5, np.random.default_rng(1)))
    whole = pooled_choice(own, model, CAMERA)
    rows, inner = (slice(first * CAMERA.width, last * CAMERA.width) for first, last in ROWS)
    some = pooled_choice(own[rows], model, Size(8, CAMERA.width))
    for mine, theirs in zip(some, whole, strict=True):
        np.testing.assert_array_equal(mine[inner], theirs[rows][inner])


def test_a_choice_from_the_first_photos_is_also_that_of_the_error_bars(plan, shot):
    chosen = choose_components(*shot, plan.window, pitch=plan.pitch)
    assert len(chosen.sweeps) == SWEEPS
    first, bars = chosen.sweeps[0], chosen.of_error_bars
    changed = np.mean(first.prior_component != bars.prior_component)
    assert 0.05 < changed < 0.95
    found = estimate_jointly(*shot, plan.window, plan.far, pitch=plan.pitch, chosen=chosen)
    np.testing.assert_array_equal(found.posterior.prior_component.ravel(), bars.prior_component)
    np.testing.assert_array_equal(found.posterior.prior_scale.ravel(), bars.prior_scale)


def test_a_given_choice_of_the_other_kind_gives_way_to_that_of_the_estimate(plan, shot):
    chosen = choose_components(*shot, plan.window, pitch=plan.pitch)
    unlit = np.full(CAMERA.pixels, len(LIT_COMPONENTS))
    bars = ComponentChoice(unlit, chosen.of_error_bars.prior_scale)
    given = Choices(chosen.sweeps, bars)
    found = estimate_jointly(*shot, plan.window, plan.far, pitch=plan.pitch, chosen=given)
    of_bars, first = found.posterior.prior_component.ravel(), chosen.sweeps[0].prior_component
    is_lit = first < len(LIT_COMPONENTS)
    assert is_lit.any()
    np.testing.assert_array_equal(of_bars, np.where(is_lit, first, unlit))
