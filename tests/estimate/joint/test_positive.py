"""Windows that are raised to where no transport is negative."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize

from nearfar.arrays import Size
from nearfar.correspondence import correspond_by_phase
from nearfar.estimate.joint import estimate_jointly, positive
from nearfar.estimate.joint.positive import raise_to
from nearfar.illumination.near_basis import window_offsets
from nearfar.scenes.hostile import hostile_transport
from nearfar.transport import near
from tests.estimate.joint.draws import FAR, PROJECTOR, WINDOW, chosen_frequencies, measured
from tests.worlds import model_transport


def _draw(seed=0, rows=200, entries=15):
    generator = np.random.default_rng(seed)
    values = generator.normal(0.3, 1.0, (rows, 2, entries)).astype(np.float32)
    least = generator.normal(-0.3, 0.3, values.shape).astype(np.float32)
    free = np.broadcast_to(generator.random((rows, 1, entries)) < 0.8, values.shape)
    return values, least, free


def test_nothing_is_below_and_sums_stay():
    values, least, free = _draw()
    found = raise_to(values, least, free)
    possible = np.sum((values - least) * free, axis=-1) > 0
    assert possible.mean() > 0.9
    assert np.all((found - least)[free & possible[..., None]] > -1e-5)
    np.testing.assert_allclose(
        np.sum(found * free, axis=-1), np.sum(values * free, axis=-1), atol=1e-4
    )
    np.testing.assert_array_equal(found[~free], values[~free])
    np.testing.assert_array_equal(found[~possible], values[~possible])


def test_what_is_above_stays_and_once_is_enough():
    values, least, free = _draw()
    above = np.maximum(values, least + 0.01)
    np.testing.assert_allclose(raise_to(above, least, free), above, atol=1e-6)
    once = raise_to(values, least, free)
    np.testing.assert_allclose(raise_to(once, least, free), once, atol=1e-5)


def test_they_are_the_nearest_such_values():
    values, least, free = _draw(seed=3, rows=4, entries=8)
    found = raise_to(values, least, free)
    for row in range(len(values)):
        chosen = free[row, 0]
        start = values[row, 0, chosen].astype(np.float64)
        floor = least[row, 0, chosen].astype(np.float64)
        if np.sum(start - floor) <= 0:
            continue
        best = minimize(
            lambda x, start=start: np.sum((x - start) ** 2),
            np.maximum(start, floor),
            jac=lambda x, start=start: 2 * (x - start),
            bounds=[(value, None) for value in floor],
            constraints={"type": "eq", "fun": lambda x, start=start: np.sum(x - start)},
        )
        np.testing.assert_allclose(found[row, 0, chosen], best.x, atol=2e-3)


@pytest.mark.parametrize("noise", [1e-3, 1e-2])
def test_an_estimate_has_no_negative_transport_in_its_windows(noise):
    world = model_transport(PROJECTOR, Size(16, 20), window=WINDOW, far=Size(3, 3), entries=0)
    world = replace(world, near=np.zeros_like(world.near))
    measurements = measured(
        world.dense().astype(np.float64), chosen_frequencies(), noise=noise, camera=world.camera
    )
    found = estimate_jointly(measurements, world.correspondence, WINDOW, FAR, pitch=1)
    rows = found.dense()[:, 0]
    centres = near.centre(found.correspondence, PROJECTOR)
    inside = near.inside(centres, WINDOW, PROJECTOR)
    apart = np.abs(window_offsets(WINDOW)).max(axis=1) > 1
    places = near.window_pixels(centres, WINDOW, PROJECTOR)
    entries = np.where(inside & apart, np.take_along_axis(rows, places, axis=1), 0.0)
    # A window that noise leaves no light at all has none to give.
    light = entries.sum(axis=1) > 0
    assert light.mean() > 0.97
    assert entries[light].min() > -1e-5 * rows.max()
    # White is what the photos say.
    white = found @ np.ones(PROJECTOR)
    np.testing.assert_allclose(white.ravel(), measurements.responses[:, 0, 0], atol=1e-4)


def test_photos_fit_once_windows_are_raised(monkeypatch):
    camera, noise = Size(16, 20), 5e-4
    rows = hostile_transport("hair", PROJECTOR, camera).rows(slice(0, camera.pixels))
    measurements = measured(
        rows.astype(np.float64), chosen_frequencies(), noise=noise, camera=camera
    )
    q = correspond_by_phase(measurements, pitch=1).q

    def misfit():
        found = estimate_jointly(measurements, q, WINDOW, FAR, pitch=1)
        fitted = found.dense() @ measurements.basis.patterns.T
        return np.sqrt(np.mean((fitted - measurements.responses)[found.lit.ravel()] ** 2))

    mended = misfit()
    monkeypatch.setattr(positive, "ROUNDS", 0)
    raised = misfit()
    assert raised > 20 * noise
    assert mended < raised / 5
