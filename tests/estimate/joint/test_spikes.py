"""Direct light of second surfaces."""

import numpy as np

from nearfar.arrays import Size
from nearfar.estimate.joint import estimate_by_sweeps
from nearfar.estimate.joint.spikes import expected_spikes
from nearfar.illumination.near_basis import NearBasis
from tests.estimate.joint.draws import (
    FAR,
    PROJECTOR,
    WINDOW,
    chosen_frequencies,
    drawn_rows,
    measured,
)


def test_direct_light_of_a_second_surface_is_found():
    centres = np.full((40, 2), (8, 10))
    rows, _ = drawn_rows(len(centres), centres, 0.0)
    second = np.arange(len(centres)) < 20
    rows[second, 0, 6 * PROJECTOR.width + 12] += 0.2
    measurements = measured(rows, chosen_frequencies(140), noise=1e-3)
    q = centres.astype(np.float32)[None]
    found = estimate_by_sweeps(measurements, q, WINDOW, FAR, sweeps=1, pitch=1)
    entry = found.near[0, :, 0, 0, 4]
    np.testing.assert_allclose(entry[second], 0.2, atol=0.01)
    assert np.abs(entry[~second]).max() < 0.01


def test_less_evidence_will_do_where_a_neighbour_sees_the_second_surface():
    # A row of camera pixels, the right ones on a surface that lies 4 pixels away.
    q = np.zeros((3, 10, 2))
    q[..., 0] = 8.0
    q[..., 1] = np.where(np.arange(10) < 5, 6.0, 10.0)
    spike_expected = expected_spikes(q, NearBasis(9)).reshape(3, 10, 9, 9)
    assert not spike_expected[:, :4].any()
    assert not spike_expected[:, 6:].any()
    around = np.zeros((9, 9), dtype=bool)
    around[3:6, 7:9] = True
    np.testing.assert_array_equal(spike_expected[1, 4], around)
    np.testing.assert_array_equal(spike_expected[1, 5], around[:, ::-1])
    # Too far for the window, or of camera pixels without direct light: nothing.
    q[:, 5:, 1] = 15.0
    assert not expected_spikes(q, NearBasis(9)).any()
    q[:, 5:] = np.nan
    assert not expected_spikes(q, NearBasis(9)).any()


def test_a_faint_second_surface_is_accepted_beside_its_edge_alone():
    # Two surfaces 4 projector pixels apart; every camera pixel of the left one also sees the place
    # of the right one, too faintly for its own photos alone.
    camera, faint = Size(8, 10), 0.08
    q = np.full((*camera, 2), 8.0)
    q[..., 1] = np.where(np.arange(camera.width) < 5, 7.0, 11.0)
    rows = np.zeros((camera.pixels, 1, PROJECTOR.pixels))
    flat = (q[..., 0] * PROJECTOR.width + q[..., 1]).astype(int).ravel()
    rows[np.arange(camera.pixels), 0, flat] = 0.5
    left = (q[..., 1] == 7.0).ravel()
    rows[left, 0, 8 * PROJECTOR.width + 11] = faint
    measurements = measured(rows, chosen_frequencies(140), noise=0.06, camera=camera)
    found = estimate_by_sweeps(measurements, q, 9, FAR, sweeps=1, pitch=1)
    entry = found.near[:, :, 0, 4, 8]
    beside, inner = entry[:, 4], entry[:, :3]
    assert np.mean(beside > 0.5 * faint) > 0.7
    assert np.mean(inner > 0.5 * faint) < 0.3


def test_steps_of_a_camera_that_is_as_fine_are_no_other_surface():
    y, x = np.meshgrid(np.arange(6.0), np.arange(7.0), indexing="ij")
    assert not expected_spikes(np.stack([y, x], axis=-1), NearBasis(5)).any()
