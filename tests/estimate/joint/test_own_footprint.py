"""Footprints of camera pixels at edges, found in their own responses."""

import numpy as np

from nearfar.arrays import Size
from nearfar.estimate.joint.footprint import unit_responses
from nearfar.estimate.joint.own_footprint import own_footprints
from nearfar.illumination.centred_basis import centred_basis
from nearfar.illumination.frequencies import DC, far_frequencies, representatives
from nearfar.illumination.near_basis import NearBasis
from nearfar.illumination.real_basis import real_basis
from nearfar.photometry.measurements import Measurements
from nearfar.transport.boxes import box_places, summed_area
from nearfar.transport.direct import look_up

PROJECTOR, CAMERA, BASIS = Size(70, 90), Size(6, 8), NearBasis(5, 4)
NOISE = 0.003
# Two in three cycles a projector pixel or more fade less than half in a box of two pixels.
HIGH = [
    k
    for k in representatives(far_frequencies(Size(53, 67), PROJECTOR))
    if np.hypot(float(k.fy), float(k.fx)) > 0.15
][::60]


def _world():
    y, x = np.meshgrid(np.arange(6.0), np.arange(8.0), indexing="ij")
    q = np.stack([20.3 + 1.6 * y, 30.1 + 0.4 * y + 1.7 * x], axis=-1)
    return q, np.tile(np.float32([1.7, 1.7, 0.0, 0.0]), (CAMERA.pixels, 1))


def _measured(q, footprints):
    """Measure direct light of footprints about q, with noise."""
    centred = centred_basis(real_basis(HIGH, PROJECTOR), BASIS)
    flat = q.reshape(-1, 2)
    lit = np.isfinite(flat[:, 0])
    centres = np.nan_to_num(np.rint(flat), nan=0.0).astype(np.int64)
    offsets = np.nan_to_num(flat - centres, nan=0.0)
    direct = 0.4 * unit_responses(offsets, footprints, centred) * lit[:, None]
    white = np.full((CAMERA.pixels, 1, 1), 0.5)
    recentred = centred.uncentre(direct[:, None].astype(np.float32), centres)
    responses = np.concatenate([white, recentred], axis=-1, dtype=np.float32)
    draw = np.random.default_rng(5)
    responses += NOISE * draw.normal(size=responses.shape).astype(np.float32)
    level = np.full((CAMERA.pixels, 1), NOISE, dtype=np.float32)
    basis = real_basis([DC, *HIGH], PROJECTOR)
    nothing = np.empty((basis.count, 0), dtype=np.float32)
    return Measurements(CAMERA, basis, responses, level, level, nothing)


def test_a_camera_pixel_at_an_edge_has_the_footprint_that_its_responses_show():
    q, voted = _world()
    true_q, true = q.copy(), voted.astype(np.float64)
    # Cut by a shadow, cut aslant, and one across which q jumps.
    edges = {(2, 3): 19, (4, 1): 33, (1, 6): 14}
    true[19], true_q[2, 3] = [0.8, 1.7, 0.0, 0.0], q[2, 3] + [0.45, 0.0]
    true[33] = [0.9, 0.9, 0.4, -0.4]
    true[14] = [1.7, 0.6, 0.0, 0.8]
    found_q, found = own_footprints(_measured(true_q, true), q, voted, BASIS)
    changed = np.flatnonzero((found != voted).any(axis=1))
    assert set(edges.values()) == set(changed.tolist())
    draw = np.random.default_rng(2)
    before, after = [], []
    for light in draw.random((20, *PROJECTOR)):
        table = summed_area(light)
        seen, by_neighbours, by_itself = (
            look_up(table, box_places(places, footprints, PROJECTOR))[changed]
            for places, footprints in ((true_q, true), (q, voted), (found_q, found))
        )
        before.append(by_neighbours - seen)
        after.append(by_itself - seen)
    before, after = (np.linalg.norm(errors, axis=0) for errors in (before, after))
    assert np.all(after < 0.25 * before), (after, before)


def test_noise_has_no_footprints_of_its_own():
    q, voted = _world()
    q[3, 3] = np.nan
    voted[27] = 0.0
    found_q, found = own_footprints(_measured(q, voted), q, voted, BASIS)
    np.testing.assert_array_equal(found_q, q)
    np.testing.assert_array_equal(found, voted)


def test_without_high_frequencies_footprints_stay():
    q, voted = _world()
    basis = real_basis([DC], PROJECTOR)
    level = np.full((CAMERA.pixels, 1), NOISE, dtype=np.float32)
    nothing = np.empty((basis.count, 0), dtype=np.float32)
    white = Measurements(CAMERA, basis, level[..., None], level, level, nothing)
    found_q, found = own_footprints(white, q, voted, BASIS)
    np.testing.assert_array_equal(found_q, q)
    np.testing.assert_array_equal(found, voted)
