"""Methods whose patterns depend on their photos: exact where their model holds, and no further."""

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.baselines.adaptive_dual import adaptive_dual
from nearfar.baselines.arnoldi import arnoldi, arnoldi_after_direct, estimate_direct
from nearfar.baselines.parallel_single_pixel import (
    largest_window,
    parallel_single_pixel,
    window_waves,
)
from nearfar.baselines.projector_blocks import Block, Question, without_conflict
from nearfar.baselines.symmetric import rank_one, symmetric_photography
from nearfar.errors import InputError
from nearfar.rigs.simulated.camera import SimulatedCamera
from tests.baselines.rigs import decibels, shooting_of, transport_of

SIDE = Size(8, 8)


def _symmetric(rank: int, size: Size = SIDE, channels: int = 2, seed: int = 0):
    """Return a symmetric T of nonnegative entries and of a rank, in each channel."""
    generator = np.random.default_rng(seed)
    factors = generator.random((channels, size.pixels, rank))
    return np.einsum("ipk,iqk->ipq", factors, factors)


def _diagonal(size: Size = SIDE, channels: int = 2, seed: int = 1):
    generator = np.random.default_rng(seed)
    albedo = generator.uniform(0.2, 1.0, size=(channels, size.pixels))
    return np.einsum("ip,pq->ipq", albedo, np.eye(size.pixels))


# The rig, as adaptive methods see it.


def test_each_photo_counts_and_has_noise_of_its_own():
    world = transport_of(_symmetric(2), SIDE)
    shooting = shooting_of(world, 5, SimulatedCamera())
    white = np.full((1, *SIDE), 255, np.uint8)
    with pytest.raises(InputError, match="no photo was taken yet"):
        _ = shooting.camera
    one, other = shooting.shoot(white)[0], shooting.shoot(white)[0]
    assert (shooting.taken, shooting.left, shooting.camera) == (2, 3, SIDE)
    assert one.shape == (64, 2)
    assert not np.array_equal(one, other)
    # Asked for at once, the same photos come, but for the last digit of a picture.
    again = shooting_of(world, 5, SimulatedCamera()).shoot(np.repeat(white, 2, axis=0))
    np.testing.assert_allclose(again, [one, other], atol=2e-4)
    with pytest.raises(InputError, match=r"4 more photos were asked for, and 3 of 5 are left"):
        shooting.shoot(np.repeat(white, 4, axis=0))
    assert shooting.taken == 2


# Optical Arnoldi.


@pytest.mark.parametrize("is_partly_dark", [False, True])
@pytest.mark.parametrize("rank", [2, 4])
def test_a_transport_of_rank_n_is_exact_after_n_lights(rank, is_partly_dark):
    # Facets that light themselves evenly, each with an eigenvalue of its own. What white lights in
    # vain takes one light more.
    values = np.arange(rank + 1) if is_partly_dark else np.arange(1, rank + 1)
    facet = np.arange(64) % len(values)
    world = transport_of((values[facet, None] * (facet[:, None] == facet))[None], SIDE)
    photos = 2 * len(values)
    enough = arnoldi(shooting_of(world, photos))
    assert enough.lights.shape == (64, len(values))
    # Lights are rounded to 8 bits and photos to 16.
    assert decibels(enough, world, mean=0) > 60
    fewer = arnoldi(shooting_of(world, photos - 2))
    assert decibels(fewer, world, mean=0) < 30


def test_more_lights_come_nearer_and_all_are_exact():
    world = transport_of(_symmetric(40) + _diagonal(), SIDE)
    found = [decibels(arnoldi(shooting_of(world, photos)), world) for photos in (8, 32, 96, 128)]
    assert found == sorted(found)
    assert found[-1] > 50
    assert found[0] < found[-1] - 10


def test_light_outside_of_the_lights_is_relit_by_symmetry():
    # Light that spreads, of albedos that break the symmetry of the grid.
    place = np.stack(np.divmod(np.arange(64), 8), axis=1)
    spread = np.exp(-((place[:, None] - place) ** 2).sum(axis=2) / 8)
    albedo = np.random.default_rng(2).uniform(0.3, 1.0, 64)
    world = transport_of((albedo[:, None] * spread * albedo)[None], SIDE)
    found = arnoldi(shooting_of(world, 16))
    pixels = np.eye(64).reshape(64, *SIDE)
    matrix = np.stack([(found @ pixel).ravel() for pixel in pixels], axis=1)
    one_sided = found.pictures[0] @ found.lights.T
    asymmetries = [np.abs(each - each.T).max() / world.far.max() for each in (matrix, one_sided)]
    assert asymmetries[0] < 1e-3
    assert asymmetries[1] > 1e-2
    errors = [np.linalg.norm(each - world.far[0]) for each in (matrix, one_sided)]
    assert errors[0] < errors[1]


def test_direct_light_found_first_leaves_a_low_rank():
    size = Size(8, 9)
    world = transport_of(5 * _diagonal(size) + _symmetric(2, size) / 50, size)
    shooting = shooting_of(world, 14)
    after = arnoldi_after_direct(shooting)
    assert shooting.taken == 14
    without = arnoldi(shooting_of(world, 14))
    assert decibels(after, world) > decibels(without, world) + 20
    direct = np.diagonal(world.far - _off_diagonal(world.far), axis1=1, axis2=2).T
    found = estimate_direct(shooting_of(world, 2))
    assert np.abs(found - direct).max() < 0.05 * direct.max()


def _off_diagonal(far):
    return far * (1 - np.eye(far.shape[1], dtype=np.float32))


@pytest.mark.parametrize(
    ("photos", "method", "taken", "lights"),
    [(9, arnoldi, 8, 4), (9, arnoldi_after_direct, 8, 3), (2, arnoldi, 2, 1)],
)
def test_arnoldi_takes_two_photos_a_light(photos, method, taken, lights):
    shooting = shooting_of(transport_of(_symmetric(8), SIDE), photos)
    found = method(shooting)
    assert shooting.taken == taken
    np.testing.assert_allclose(found.lights.T @ found.lights, np.eye(lights), atol=1e-9)


def test_the_lights_depend_on_the_photos():
    one, other = (
        arnoldi(shooting_of(transport_of(_symmetric(8, seed=seed), SIDE), 6)) for seed in (0, 1)
    )
    np.testing.assert_allclose(one.lights[:, 0], other.lights[:, 0])
    assert np.abs(one.lights[:, 1] - other.lights[:, 1]).max() > 0.01


def test_a_light_that_comes_back_alone_is_followed_by_a_random_one():
    # White is an eigenvector of a mirror: its photo is nothing new.
    world = transport_of(np.eye(64)[None], SIDE)
    found = arnoldi(shooting_of(world, 128))
    assert decibels(found, world) > 60


def test_arnoldi_refuses_a_camera_of_other_pixels():
    world = transport_of(np.ones((1, 16, 64)), SIDE, Size(4, 4))
    for method in (arnoldi, arnoldi_after_direct):
        with pytest.raises(InputError, match="the camera has 4x4 pixels and the projector 8x8"):
            method(shooting_of(world, 8))
    with pytest.raises(InputError, match="1 photos are too few for a light"):
        arnoldi(shooting_of(world, 1))


# Parallel single-pixel imaging.


def _windows(projector: Size, camera: Size, window: Size, seed: int = 3):
    """Return rows that are 0 outside of a window of their own, and random inside."""
    generator = np.random.default_rng(seed)
    rows = np.zeros((1, camera.pixels, *projector))
    for c in range(camera.pixels):
        y = generator.integers(0, projector.height - window.height + 1)
        x = generator.integers(0, projector.width - window.width + 1)
        inside = generator.uniform(0.5, 1.0, size=window)
        rows[0, c, y : y + window.height, x : x + window.width] = inside
    return rows.reshape(1, camera.pixels, -1)


@pytest.mark.parametrize("steps", [3, 4])
def test_rows_in_a_window_are_found_with_the_photos_of_the_window(steps):
    projector = Size(16, 15)
    world = transport_of(_windows(projector, Size(5, 6), Size(3, 4)), projector, Size(5, 6))
    shooting = shooting_of(world, 400)
    found = parallel_single_pixel(shooting, periods=Size(7, 7), steps=steps)
    # Sinusoids of 8 bits, which the method takes for exact.
    assert decibels(found, world) > 38
    largest = np.abs(found.far - world.far).max() / world.far.max()
    assert largest < 0.05
    # It saw that the window is small, and left photos of 400.
    assert 1 + steps * 14 < shooting.taken < 1 + steps * 14 + steps * 9 * 9 // 2


def test_light_beyond_the_window_is_folded_into_it():
    projector = Size(16, 15)
    world = transport_of(_windows(projector, Size(5, 6), Size(11, 11)), projector, Size(5, 6))
    photos = 1 + 3 * 14 + 3 * 24
    found = parallel_single_pixel(shooting_of(world, photos), periods=Size(7, 7), steps=3)
    assert (found.far != 0).sum(axis=2).max() <= 49
    assert decibels(found, world) < 25
    white = np.ones(projector, dtype=np.float32)
    np.testing.assert_allclose(found @ white, world @ white, atol=0.005)


def test_the_photos_of_a_window_are_those_of_the_paper():
    # 2 Ms Ns of 4 phases, less the constant, which all phases of a sinusoid sum to.
    for window in (Size(3, 3), Size(5, 4), Size(7, 8), Size(6, 6)):
        photos = window_waves(window, 4).photos
        assert photos == 4 * len(np.unique(window_waves(window, 4).frequencies, axis=0))
        own_opposites = (2 - window.height % 2) * (2 - window.width % 2)
        assert photos == 2 * window.pixels + 2 * own_opposites - 4
        largest = largest_window(Size(20, 20), photos, 4)
        assert largest.pixels >= window.pixels
        assert window_waves(largest, 4).photos <= photos
    assert largest_window(Size(20, 20), 15, 4) is None
    assert largest_window(Size(1, 20), 400, 3) == Size(1, 20)


def test_too_few_photos_give_no_window_and_take_none():
    world = transport_of(_symmetric(2), SIDE)
    shooting = shooting_of(world, 20)
    assert parallel_single_pixel(shooting, periods=Size(3, 3), steps=3) is None
    assert shooting.taken == 0
    for periods, steps, said in (
        (Size(4, 3), 3, "4 sinusoids of whole periods do not fit 8 projector pixels"),
        (Size(3, 3), 2, "2 phases tell no Fourier coefficient"),
    ):
        with pytest.raises(InputError, match=said):
            parallel_single_pixel(shooting, periods=periods, steps=steps)


# Blocks.


@pytest.mark.parametrize("size", [Size(8, 8), Size(5, 7), Size(1, 9), Size(1, 1)])
def test_parts_of_blocks_cover_each_pixel_once_on_every_level(size):
    level = [Block(0, size.height, 0, size.width)]
    for _ in range(5):
        pixels = np.concatenate([block.pixels(size) for block in level])
        assert sorted(pixels) == list(range(size.pixels))
        level = [part for block in level for part in block.parts() or [block]]
    assert {len(block.pixels(size)) for block in level} == {1}


def test_what_conflicts_is_never_lit_together():
    generator = np.random.default_rng(0)
    block = Block(0, 1, 0, 1)
    asked = [np.flatnonzero(generator.random(30) < 0.2) for _ in range(40)]
    groups = without_conflict([Question(block, each) for each in asked], Size(5, 6), 12)
    assert len(groups) <= 12
    for group in groups:
        together = np.concatenate([asked[number] for number in group])
        assert len(np.unique(together)) == len(together)
    everything = without_conflict([Question(block, each) for each in asked], Size(5, 6), 99)
    assert sorted(number for group in everything for number in group) == list(range(40))


# Adaptive dual photography.


def test_a_mirror_is_found_by_four_photos_a_level():
    world = transport_of(_diagonal(Size(16, 16), 1), Size(16, 16))
    shooting = shooting_of(world, 200)
    found = adaptive_dual(shooting, 0.01)
    # Black, white, and four levels: no two pixels conflict.
    assert shooting.taken == 2 + 4 * 4
    assert decibels(found, world) > 60


def test_blocks_that_are_lit_from_few_blocks_are_exact():
    generator = np.random.default_rng(5)
    camera = Size(6, 7)
    rows = np.zeros((2, camera.pixels, 64))
    for c in range(camera.pixels):
        rows[:, c, generator.choice(64, size=3, replace=False)] = generator.uniform(0.3, 1, (2, 3))
    world = transport_of(rows, SIDE, camera)
    shooting = shooting_of(world, 500)
    found = adaptive_dual(shooting, 0.01)
    assert decibels(found, world) > 55
    assert shooting.taken < 64 + 2 + 20
    early = shooting_of(world, 12)
    assert decibels(adaptive_dual(early, 0.01), world) < 30
    assert early.taken == 12


def test_light_below_the_threshold_is_spread_evenly_and_not_lost():
    world = transport_of(20 * _diagonal() + _symmetric(3) / 50, SIDE)
    found = adaptive_dual(shooting_of(world, 14), 0.1)
    white = np.ones(SIDE, dtype=np.float32)
    np.testing.assert_allclose(found @ white, world @ white, atol=1e-3)
    assert decibels(found, world) > 35
    # Photos that are left go to lower thresholds.
    assert decibels(adaptive_dual(shooting_of(world, 300), 0.1), world) > 45


def test_what_parts_receive_sums_to_what_the_block_gave():
    # Without it each cut would add the noise of its photos to white's.
    world = transport_of(
        _diagonal(Size(16, 16), 1) + _symmetric(3, Size(16, 16), 1) / 300, Size(16, 16)
    )
    found = adaptive_dual(shooting_of(world, 400, SimulatedCamera()), 0.003)
    white = np.ones(world.projector, dtype=np.float32)
    photo = shooting_of(world, 2, SimulatedCamera()).shoot(
        np.stack([np.zeros(world.projector, np.uint8), np.full(world.projector, 255, np.uint8)])
    )
    np.testing.assert_allclose((found @ white).ravel(), (photo[1] - photo[0]).ravel(), atol=1e-5)


@pytest.mark.parametrize("method", [adaptive_dual, symmetric_photography])
def test_with_nothing_to_be_tolerated_photos_go_on_as_far_as_noise_allows(method):
    world = transport_of(_symmetric(4), SIDE)
    assert decibels(method(shooting_of(world, 500), 0.0), world) > 60


@pytest.mark.parametrize(
    ("method", "photos", "limit", "words"),
    [
        (adaptive_dual, 1, 0.1, "1 photos are too few for adaptive dual photography: allow 2"),
        (symmetric_photography, 2, 0.1, "2 photos are too few for symmetric photography: allow 3"),
        (adaptive_dual, 9, -0.1, "the limit of light for adaptive dual photography is -0.1"),
        (symmetric_photography, 9, -0.1, "the limit of light for symmetric photography is -0.1"),
    ],
)
def test_blocks_are_not_cut_by_too_few_photos_or_below_0(method, photos, limit, words):
    with pytest.raises(InputError, match=words):
        method(shooting_of(transport_of(_symmetric(1), SIDE), photos), limit)


# Symmetric photography.


def test_rank_one_is_exact_and_even_where_it_is_dark():
    generator = np.random.default_rng(0)
    u, v = generator.random((2, 5)), generator.random((2, 7))
    block = np.einsum("ia,ib->iab", u, v)
    np.testing.assert_allclose(rank_one(block.sum(2), block.sum(1), 0.0), block, rtol=1e-5)
    dark = 1e-4 * generator.normal(size=(2, 5)), 1e-4 * generator.normal(size=(2, 7))
    found = rank_one(*dark, 1e-3)
    assert np.ptp(found, axis=(1, 2)).max() < 1e-9
    total = (dark[0].sum(1) + dark[1].sum(1)) / 2
    np.testing.assert_allclose(found.sum(axis=(1, 2)), total, atol=1e-9)


def test_blocks_of_rank_one_need_few_photos():
    size = Size(16, 16)
    world = transport_of(20 * _diagonal(size, 1) + _symmetric(1, size, 1) / 10, size)
    shooting = shooting_of(world, 150)
    found = symmetric_photography(shooting, 0.003)
    assert decibels(found, world) > 45
    assert shooting.taken <= 150
    np.testing.assert_allclose(found.far, found.far.transpose(0, 2, 1), atol=1e-6)
    # As many photos without symmetry.
    assert decibels(found, world) > decibels(adaptive_dual(shooting_of(world, 150), 0.003), world)


def test_symmetric_photography_comes_nearer_with_photos():
    size = Size(6, 7)
    world = transport_of(10 * _diagonal(size) + _symmetric(6, size) / 10, size)
    found = [
        decibels(symmetric_photography(shooting_of(world, photos), 0.002), world)
        for photos in (10, 40, 200)
    ]
    assert found == sorted(found)
    assert found[-1] > 50


@pytest.mark.parametrize("photos", [20, 34, 400])
def test_single_pixels_and_blocks_of_one_level_are_asked_about_together(photos):
    """Sides of 3 and 5 are cut unevenly, and a dark pixel leaves some blocks for later."""
    size = Size(3, 5)
    far = np.random.default_rng(1).random((1, size.pixels, size.pixels))
    far += far.transpose(0, 2, 1)
    far[:, 0], far[:, :, 0] = 0, 0
    world = transport_of(far, size)
    found = symmetric_photography(shooting_of(world, photos), 0.1)
    assert decibels(found, world) > 20
    np.testing.assert_allclose(found.far, found.far.transpose(0, 2, 1), atol=1e-6)


def test_symmetric_photography_refuses_a_camera_of_other_pixels():
    world = transport_of(np.ones((1, 16, 64)), SIDE, Size(4, 4))
    with pytest.raises(InputError, match="the camera has 4x4 pixels and the projector 8x8"):
        symmetric_photography(shooting_of(world, 8), 0.1)
