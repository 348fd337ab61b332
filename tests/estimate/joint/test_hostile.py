"""What photos say beyond the prior, on transports that are not direct + near + far."""

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.correspondence import correspond_by_phase
from nearfar.estimate.error_bars import ErrorBars
from nearfar.estimate.joint import estimate, estimate_jointly
from nearfar.photometry.measure import measure
from nearfar.plan import choose_plan
from nearfar.rigs.simulated.camera import SimulatedCamera
from nearfar.rigs.simulated.projector import SimulatedProjector
from nearfar.rigs.simulated.rig import SimulatedRig
from nearfar.scenes.hostile import hostile_transport
from nearfar.workflow.acquire import acquire_in_memory

PROJECTOR, CAMERA = Size(12, 12), Size(12, 12)


def shot(name, photos, noise, projector=PROJECTOR):
    """Photograph a hostile transport: the truth in photo units, plan and measurements."""
    scene = hostile_transport(name, projector, CAMERA)
    plan, _ = choose_plan(projector, photos)
    camera = SimulatedCamera(
        full_well=1e6, read_noise=1e6 * noise, bits=16, black_level=0.1, shot_noise=False
    )
    rig = SimulatedRig(scene, name, SimulatedProjector(), camera, 0.8, 0)
    return 0.8 * scene.rows(slice(None)), plan, measure(acquire_in_memory(plan, rig))


def decibels(truth, found):
    return 10 * np.log10(np.sum(truth**2) / np.sum((found - truth) ** 2))


def inverse_dft(measurements):
    return measurements.basis.synthesise(measurements.responses)


@pytest.mark.parametrize("photos", [60, 120])
def test_direct_light_that_photos_do_not_show_is_not_believed(photos):
    truth, plan, measurements = shot("dense", photos, 1 / 200)
    # The brightest entry of each row, where direct light would seem to come from.
    q = np.stack(np.divmod(truth[:, 0].argmax(axis=1), PROJECTOR.width), axis=-1)
    q = q.reshape(*CAMERA, 2).astype(np.float32)
    found = estimate_jointly(measurements, q, plan.window, plan.far, pitch=plan.pitch)
    assert not found.lit.any()
    assert not found.direct.any()
    assert not found.near.any()
    assert decibels(truth, found.rows(slice(None))) > decibels(truth, inverse_dft(measurements))


@pytest.mark.parametrize("name", ["dense", "hair", "glass"])
def test_with_as_many_photos_as_unknowns_the_estimate_is_least_squares(name):
    truth, plan, measurements = shot(name, 173, 1 / 2000)
    q = correspond_by_phase(measurements, pitch=plan.pitch).q
    found = estimate_jointly(measurements, q, plan.window, plan.far, pitch=plan.pitch)
    by_least_squares = inverse_dft(measurements)
    assert decibels(truth, by_least_squares) > 30
    rows = found.rows(slice(None))
    assert decibels(truth, rows) > decibels(truth, by_least_squares) - 0.1
    # In every row, also where q would have to move farther than it may.
    mine, theirs = (np.linalg.norm(each - truth, axis=-1) for each in (rows, by_least_squares))
    assert np.max(mine / theirs) < 1.3


@pytest.mark.parametrize("noise", [1 / 200, 1 / 60])
def test_errors_of_rows_without_order_lie_within_their_bars(noise):
    truth, plan, measurements = shot("dense", 90, noise)
    q = correspond_by_phase(measurements, pitch=plan.pitch).q
    found = estimate_jointly(measurements, q, plan.window, plan.far, pitch=plan.pitch)
    bars = ErrorBars(found)
    random = np.random.default_rng(0).random((4, *PROJECTOR))
    single = np.eye(PROJECTOR.pixels)[::13].reshape(-1, *PROJECTOR)
    for lights in (random, single):
        within = [
            np.abs((found @ light).ravel() - truth[:, 0] @ light.ravel())
            < bars.picture(light).ravel()
            for light in lights
        ]
        assert 0.6 < np.mean(within) < 0.78


def test_the_light_of_a_row_stays_where_direct_light_would_be_negative():
    truth, plan, measurements = shot("hair", 173, 1 / 2000)
    q = correspond_by_phase(measurements, pitch=plan.pitch).q
    found = estimate_jointly(measurements, q, plan.window, plan.far, pitch=plan.pitch)
    error = np.linalg.norm(found.rows(slice(None)) - truth, axis=-1)
    assert found.direct.min() >= 0
    assert error.max() < 0.02 * np.linalg.norm(truth, axis=-1).max()


def test_errors_of_lamps_with_an_edge_are_about_as_large_as_their_bars():
    projector = Size(15, 15)
    truth, plan, measurements = shot("lamps", 158, 1 / 2000, projector)
    nowhere = np.full((*CAMERA, 2), np.nan, dtype=np.float32)
    found = estimate_jointly(measurements, nowhere, plan.window, plan.far, pitch=plan.pitch)
    bars = ErrorBars(found)
    # Camera pixels see the same edge, so that it takes many lights to tell.
    lights = np.random.default_rng(0).random((60, *projector))
    errors = [(found @ light).ravel() - truth[:, 0] @ light.ravel() for light in lights]
    expected = [bars.picture(light).ravel() for light in lights]
    assert 0.6 < np.mean(np.square(errors)) / np.mean(np.square(expected)) < 1.8


def test_bars_leave_out_noise_that_neighbours_take_off_where_there_is_no_direct_light(monkeypatch):
    projector = Size(15, 15)
    truth, plan, measurements = shot("lamps", 158, 1 / 100, projector)
    nowhere = np.full((*CAMERA, 2), np.nan, dtype=np.float32)
    found = estimate_jointly(measurements, nowhere, plan.window, plan.far, pitch=plan.pitch)
    # Half of what is taken off, and never more.
    assert 0.5 <= found.posterior.noise_share.min() <= found.posterior.noise_share.max() < 0.8
    lights = np.random.default_rng(0).random((60, *projector))
    bars = ErrorBars(found)
    within = [
        np.abs((found @ light).ravel() - truth[:, 0] @ light.ravel()) < bars.picture(light).ravel()
        for light in lights
    ]
    assert 0.55 < np.mean(within) < 0.8
    # Rows of camera pixels with direct light have edges that neighbours blur.
    truth, plan, measurements = shot("hair", 120, 1 / 100)
    q = correspond_by_phase(measurements, pitch=plan.pitch).q
    found = estimate_jointly(measurements, q, plan.window, plan.far, pitch=plan.pitch)
    assert found.lit.any()
    # What their residuals have in common is little there, and is all that is left out.
    shares = found.posterior.noise_share[found.lit]
    assert 0.5 <= shares.min() <= shares.max() <= 1.0
    assert shares.mean() > 0.9
    monkeypatch.setattr(
        estimate, "with_remainder", lambda problem, rows: (rows, np.ones_like(problem.pixels.white))
    )
    found = estimate_jointly(measurements, q, plan.window, plan.far, pitch=plan.pitch)
    assert np.all(found.posterior.noise_share[found.lit] == 1.0)
