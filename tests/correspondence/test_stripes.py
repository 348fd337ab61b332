"""Correspondence by stripes: exact, robust under global light, honest where there is none."""

from dataclasses import replace

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.correspondence import (
    correspond_by_stripes,
    given_correspondence,
    onto_projector,
    read_correspondence,
)
from nearfar.errors import InputError, NearfarError
from nearfar.photometry.in_memory import PhotosInMemory
from nearfar.photometry.measure import measure
from nearfar.plan import Stripe, paper_plan
from nearfar.rigs.simulated.camera import SimulatedCamera
from tests.worlds import model_transport

PROJECTOR = Size(24, 30)
PLAN = paper_plan(PROJECTOR, 7, Size(3, 3))


def _world(camera=PROJECTOR, **options):
    world = model_transport(PROJECTOR, camera, window=7, far=Size(3, 3), **options)
    # Near-range entries well under the direct light's, as light in a candle is.
    return world.with_gains(near=0.2)


def test_whole_pixels_are_found_exactly(shoot):
    world = _world()
    found = correspond_by_stripes(shoot(PLAN, world))
    assert found.lit.all()
    # Lopsided near-range light pulls the centroid a little; without any it is
    # exact, but for what bends in far-range light.
    np.testing.assert_allclose(found.q, world.correspondence, atol=0.25)
    found = correspond_by_stripes(shoot(PLAN, world.with_gains(near=0)))
    np.testing.assert_allclose(found.q, world.correspondence, atol=0.01)


def test_a_projectors_own_pixels_are_found():
    projector, camera = Size(1080, 1920), Size(6, 8)
    plan = paper_plan(projector, 5, Size(3, 3))
    q = np.random.default_rng(0).integers(1, np.array(projector) - 1, size=(*camera, 2))
    photos = np.full((len(plan.patterns), *camera, 1), 0.8, dtype=np.float32)
    for photo, pattern in zip(photos, plan.patterns, strict=True):
        if isinstance(pattern, Stripe):
            along = q[..., 0 if pattern.kind == "black row" else 1]
            photo[..., 0] -= 0.4 * (along == pattern.index)
    photos += 0.002 * np.random.default_rng(1).normal(size=photos.shape)
    found = correspond_by_stripes(PhotosInMemory(plan, photos, 1.0))
    assert found.lit.all()
    np.testing.assert_allclose(found.q, q, atol=0.05)


def test_noise_moves_nothing_by_half_a_pixel(shoot):
    world = _world(channels=3)
    found = correspond_by_stripes(shoot(PLAN, world, SimulatedCamera()))
    assert found.lit.mean() > 0.999
    off = np.abs(found.q - world.correspondence)[found.lit]
    assert off.max() < 0.5
    assert np.mean(off < 1e-3) > 0.95


def test_a_finer_camera_falls_between_pixels(shoot):
    world = _world(Size(61, 77), fractional=True)
    found = correspond_by_stripes(shoot(PLAN, world))
    assert found.lit.all()
    off = np.abs(found.q - world.correspondence)
    assert np.percentile(off, 95) < 0.1
    assert off.max() < 0.5
    plain = correspond_by_stripes(shoot(PLAN, world.with_gains(near=0)))
    np.testing.assert_allclose(plain.q, world.correspondence, atol=0.02)


def test_global_light_ten_times_the_direct_does_not_fool_it(shoot):
    world = _world()
    far = world.far.copy()
    world = replace(world, direct=0.02 + 0 * world.direct, far=far, near=0 * world.near)
    found = correspond_by_stripes(shoot(PLAN, world))
    assert found.lit.all()
    np.testing.assert_allclose(found.q, world.correspondence, atol=0.1)


@pytest.mark.parametrize("noisy", [False, True])
def test_camera_pixels_without_direct_light_are_marked(shoot, noisy):
    world = _world(channels=3)
    q = world.correspondence.copy()
    q[5:9, 7:20] = np.nan
    lit = np.isfinite(q[..., 0])
    dark = ~lit[..., None]
    world = replace(
        world,
        correspondence=q,
        direct=np.where(dark, 0, world.direct),
        near=np.where(dark[..., None, None], 0, world.near),
    )
    photos = shoot(PLAN, world, SimulatedCamera()) if noisy else shoot(PLAN, world)
    found = correspond_by_stripes(photos)
    np.testing.assert_array_equal(found.lit, lit)
    assert np.all(np.isnan(found.q[~lit]))
    assert found.confidence[lit].min() > 0.999
    if noisy:
        assert np.median(found.confidence[~lit]) < 0.9


@pytest.mark.parametrize("size", [Size(8, 8), Size(9, 12), Size(11, 8)])
def test_small_projectors_correspond(shoot, size):
    world = model_transport(size, size, window=3, far=Size(1, 1), entries=0)
    world = replace(world, near=np.zeros_like(world.near))
    found = correspond_by_stripes(shoot(paper_plan(size, 3, Size(1, 1)), world, SimulatedCamera()))
    assert found.lit.all()
    np.testing.assert_allclose(found.q, world.correspondence, atol=0.2)


def test_rows_correspond_on_their_own(shoot):
    photos = shoot(PLAN, _world())
    whole, part = correspond_by_stripes(photos), correspond_by_stripes(photos, slice(3, 9))
    np.testing.assert_array_equal(part.q, whole.q[3:9])


def test_a_plan_without_stripes_is_told(shoot):
    plan = paper_plan(PROJECTOR, 7, Size(3, 3), correspondence="none")
    with pytest.raises(InputError, match="give the correspondence with `correspondence`"):
        correspond_by_stripes(shoot(plan, _world(Size(3, 3))))


def test_correspondence_goes_out_and_comes_in(tmp_path):
    q = _world(fractional=True).correspondence.copy()
    q[2, 3] = np.nan
    np.save(tmp_path / "q.npy", q.astype(np.float64))
    found = read_correspondence(tmp_path / "q.npy", PROJECTOR, PROJECTOR)
    np.testing.assert_allclose(found.q, q, atol=1e-5)
    assert found.lit.sum() == PROJECTOR.pixels - 1
    assert found.confidence[2, 3] == 0


def test_the_former_name_of_q_still_works():
    found = given_correspondence(np.ones((2, 3, 2)), Size(2, 3), PROJECTOR)
    with pytest.warns(DeprecationWarning, match="now called q"):
        assert found.pixels is found.q


@pytest.mark.parametrize(
    ("q", "message"),
    [
        (np.zeros((24, 30)), "24x30, the photos need 24x30x2"),
        (np.zeros((30, 24, 2)), "the photos need"),
        (np.full((24, 30, 2), np.nan), "all of it is NaN"),
        (np.full((24, 30, 2), 27.0), "points off the projector"),
        (np.full((24, 30, 2), -3), "points off the projector"),
    ],
)
def test_correspondence_that_cannot_be_is_refused(q, message):
    with pytest.raises(InputError, match=message):
        given_correspondence(q, PROJECTOR, PROJECTOR)


def test_a_file_that_is_no_correspondence_is_refused(tmp_path):
    (tmp_path / "a.npy").write_bytes(b"no array")
    np.savez(tmp_path / "b.npz", q=np.zeros((24, 30, 2)))
    for name in ("a.npy", "b.npz", "c.npy"):
        with pytest.raises(NearfarError, match=name):
            read_correspondence(tmp_path / name, PROJECTOR, PROJECTOR)


def test_the_square_transport_averages_the_camera_pixels_of_a_projector_pixel(shoot):
    small = Size(10, 12)
    plan = paper_plan(small, 5, Size(3, 3))
    world = model_transport(small, Size(20, 24), window=5, far=Size(3, 3))
    photos = shoot(plan, world)
    correspondence = given_correspondence(world.correspondence, Size(20, 24), small)
    halves = [measure(photos, slice(0, 7)), measure(photos, slice(7, 20))]
    measurements, own = onto_projector(halves, correspondence)
    whole = measure(photos)
    q = np.rint(world.correspondence).reshape(-1, 2).astype(int)
    for y, x in ((0, 0), (4, 7), (9, 11)):
        mine = (q == (y, x)).all(axis=1)
        np.testing.assert_allclose(
            measurements.responses[y * 12 + x], whole.responses[mine].mean(axis=0), atol=1e-5
        )
    assert measurements.camera == small
    np.testing.assert_array_equal(own[3, 5], (3, 5))
    # A projector pixel that lights no camera pixel has no direct light to give.
    sparse = correspondence.q.copy()
    sparse[(np.rint(sparse) == (4, 7)).all(axis=-1)] = np.nan
    _, own = onto_projector(halves, given_correspondence(sparse, Size(20, 24), small))
    assert np.isnan(own[4, 7]).all()
