"""Correspondence by phase: exact, robust under global light, honest where there is none."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.correspondence import correspond_by_phase
from nearfar.correspondence.ambiguity import LARGEST_EXPECTED_WRONG, expected_wrong
from nearfar.errors import InputError
from nearfar.illumination.frequencies import (
    CHECKERBOARD,
    DC,
    far_frequencies,
    grid,
    near_frequencies,
    representatives,
)
from nearfar.illumination.real_basis import real_basis
from nearfar.photometry.measure import measure
from nearfar.photometry.measurements import Measurements
from nearfar.plan import paper_plan
from nearfar.rigs.simulated.camera import SimulatedCamera
from tests.worlds import ideal_measurements, model_transport

PROJECTOR = Size(24, 30)
WINDOW, FAR = 7, Size(5, 5)
# About 60 photos, all on the DFT grid.
FEW = [
    *far_frequencies(Size(5, 5), PROJECTOR),
    *grid(Size(5, 5), Size(4, 5)),
    *grid(Size(3, 3), Size(8, 10)),
    CHECKERBOARD,
]


def _world(camera=PROJECTOR, projector=PROJECTOR, near=0.2, **options):
    window = min(WINDOW, *projector)
    world = model_transport(projector, camera, window=window, far=Size(3, 3), **options)
    # Near-range entries well under the direct light's, as light in a candle is.
    return world.with_gains(near=near)


def _responses(world, frequencies, noise=0.0, seed=0):
    """Answer chosen frequencies, with normal noise."""
    basis = real_basis(representatives([DC, *frequencies]), world.projector)
    pixels, channels = world.camera.pixels, world.channels
    responses = world.rows(slice(0, pixels)).astype(np.float64) @ basis.patterns.T.astype(
        np.float64
    )
    responses += noise * np.random.default_rng(seed).normal(size=responses.shape)
    level = np.full((pixels, channels), noise, dtype=np.float32)
    return Measurements(
        camera=world.camera,
        basis=basis,
        responses=responses.astype(np.float32),
        noise=level,
        black=np.zeros_like(level),
        quantisation_error=np.zeros_like(basis.patterns),
    )


def _with_shade(world, shade):
    """Take direct and near-range light from the camera pixels in `shade`."""
    q = np.where(shade[..., None], np.nan, world.correspondence).astype(np.float32)
    return replace(
        world,
        correspondence=q,
        direct=np.where(shade[..., None], 0, world.direct),
        near=np.where(shade[..., None, None, None], 0, world.near),
    )


@pytest.mark.parametrize(
    ("size", "window", "far"),
    [
        (Size(24, 30), 7, Size(5, 5)),
        (Size(16, 16), 8, Size(4, 4)),
        (Size(19, 13), 6, Size(5, 3)),
        (Size(9, 31), 9, Size(3, 6)),
        (Size(1, 20), 1, Size(1, 11)),
        (Size(12, 1), 1, Size(7, 1)),
        (Size(8, 8), 1, Size(8, 8)),
        (Size(2, 3), 2, Size(2, 3)),
    ],
)
def test_the_papers_frequencies_find_whole_pixels(size, window, far):
    world = model_transport(size, size, window=3, far=Size(1, 1))
    alone = world.with_gains(near=0, far=0)
    found = correspond_by_phase(ideal_measurements(alone, window, far, Size(1, 1)), pitch=1)
    assert found.lit.all()
    np.testing.assert_allclose(found.q, world.correspondence, atol=0.01)
    # Far-range light responses frequencies off the DFT grid as well.
    lit_by_all = world.with_gains(near=0)
    found = correspond_by_phase(ideal_measurements(lit_by_all, window, far, Size(1, 1)), pitch=1)
    np.testing.assert_allclose(found.q, world.correspondence, atol=0.3)


def test_near_and_far_light_pull_q_by_little():
    world = _world()
    found = correspond_by_phase(ideal_measurements(world, WINDOW, FAR, Size(1, 1)), pitch=1)
    assert found.lit.all()
    np.testing.assert_allclose(found.q, world.correspondence, atol=0.35)
    assert np.median(np.abs(found.q - world.correspondence)) < 0.05


def test_a_finer_camera_falls_between_pixels():
    world = _world(Size(61, 77), fractional=True)
    found = correspond_by_phase(_responses(world.with_gains(near=0), FEW), pitch=1)
    assert found.lit.all()
    np.testing.assert_allclose(found.q, world.correspondence, atol=0.05)
    found = correspond_by_phase(_responses(world, FEW, noise=0.003), pitch=1)
    off = np.abs(found.q - world.correspondence)
    assert found.lit.all()
    assert np.percentile(off, 95) < 0.2
    assert np.mean(off > 0.5) < 0.005


def test_a_coarse_camera_pixel_gets_the_centroid():
    fine = _world(Size(24, 30), near=0.0)
    basis = real_basis(representatives([DC, *FEW]), PROJECTOR)
    measured = _responses(fine, FEW)
    camera = Size(12, 15)
    together = measured.responses.reshape(12, 2, 15, 2, 1, -1)
    coarse = Measurements(
        camera=camera,
        basis=basis,
        responses=together.mean(axis=(1, 3)).reshape(camera.pixels, 1, -1),
        noise=np.zeros((camera.pixels, 1), dtype=np.float32),
        black=np.zeros((camera.pixels, 1), dtype=np.float32),
        quantisation_error=measured.quantisation_error,
    )
    weight = fine.direct.reshape(12, 2, 15, 2, 1)
    q = (fine.correspondence.reshape(12, 2, 15, 2, 2) * weight).sum(axis=(1, 3))
    q /= weight.sum(axis=(1, 3))
    found = correspond_by_phase(coarse, pitch=1)
    assert found.lit.all()
    np.testing.assert_allclose(found.q, q, atol=0.25)


def test_light_under_a_surface_moves_no_q_to_one_side():
    camera = Size(16, 20)
    generator = np.random.default_rng(5)
    place = generator.uniform(4, np.array(PROJECTOR) - 5, size=(camera.pixels, 2))
    y, x = np.meshgrid(*(np.arange(side) for side in PROJECTOR), indexing="ij")
    down, across = (along.ravel() - q[:, None] for along, q in zip((y, x), place.T, strict=True))
    direct = np.clip(1 - np.abs(down), 0, None) * np.clip(1 - np.abs(across), 0, None)
    under = np.exp(-np.hypot(down, across) / 1.5)
    rows = 0.4 * direct + 0.6 * under / under.sum(axis=1, keepdims=True)
    world = SimpleNamespace(
        projector=PROJECTOR, camera=camera, channels=1, rows=lambda _: rows[:, None]
    )
    found = correspond_by_phase(_responses(world, FEW, noise=1e-3), pitch=1)
    assert found.lit.all()
    off = found.q.reshape(-1, 2) - place
    assert np.abs(off.mean(axis=0)).max() < 0.01
    assert np.sqrt(np.mean(off**2)) < 0.05


def test_photos_of_a_noisy_camera_move_nothing_by_half_a_pixel(shoot):
    world = _world(channels=3)
    plan = paper_plan(PROJECTOR, WINDOW, FAR, correspondence="none")
    found = correspond_by_phase(measure(shoot(plan, world, SimulatedCamera())), pitch=1)
    assert found.lit.all()
    off = np.abs(found.q - world.correspondence)
    assert off.max() < 0.5
    assert np.median(off) < 0.05


def test_a_channel_without_light_does_no_harm():
    world = _world(channels=3)
    dark = np.array([1.0, 0.0, 1e-4], dtype=np.float32)
    world = replace(
        world,
        direct=world.direct * dark,
        near=world.near * dark[:, None, None],
        far=world.far * dark[:, None],
    )
    found = correspond_by_phase(_responses(world, FEW, noise=0.002), pitch=1)
    assert found.lit.all()
    assert np.mean(np.abs(found.q - world.correspondence) < 0.5) > 0.999


def test_many_times_as_much_global_light_does_not_fool_it():
    world = _world(near=0.0)
    world = replace(world, direct=0.04 + 0 * world.direct)
    found = correspond_by_phase(_responses(world, FEW), pitch=1)
    assert found.lit.all()
    np.testing.assert_allclose(found.q, world.correspondence, atol=0.1)


def test_the_stronger_of_two_surfaces_wins():
    one = replace(_world(near=0.0), far=0 * _world().far)
    moved = np.roll(one.correspondence, (9, 11), axis=(0, 1))
    other = replace(one, correspondence=moved, direct=0.5 * one.direct)
    first, second = _responses(one, FEW), _responses(other, FEW)
    found = correspond_by_phase(
        replace(first, responses=first.responses + second.responses), pitch=1
    )
    np.testing.assert_allclose(found.q, one.correspondence, atol=0.5)


@pytest.mark.parametrize("noise", [0.0, 0.003])
def test_camera_pixels_without_direct_light_are_marked(noise):
    shade = np.zeros(PROJECTOR, dtype=bool)
    shade[5:9, 7:20] = True
    world = _with_shade(_world(channels=3), shade)
    found = correspond_by_phase(_responses(world, FEW, noise), pitch=1)
    np.testing.assert_array_equal(found.lit, ~shade)
    assert np.all(np.isnan(found.q[shade]))
    assert found.confidence[~shade].min() >= 0.5
    assert np.median(found.confidence[~shade]) > 0.9
    assert found.confidence[shade].max() < 0.5
    assert np.median(found.confidence[shade]) < 0.1


def test_near_range_light_that_is_concentrated_is_no_direct_light():
    """A crease in shade: a third of its light comes from a few pixels of the lit side."""
    shade = np.zeros(PROJECTOR, dtype=bool)
    shade[5:9, 7:20] = True
    world = _world(Size(24, 30))
    away = np.arange(-3, 4)
    blob = np.exp(-(away[:, None] ** 2 + away**2) / (2 * 1.5**2))
    near = np.where(shade[..., None, None, None], 0.1 * blob / blob.sum(), world.near)
    q = world.correspondence.copy()
    world = replace(world, direct=np.where(shade[..., None], 0, world.direct), near=near)
    found = correspond_by_phase(
        _responses(replace(world, correspondence=q), FEW, noise=0.003), pitch=1
    )
    np.testing.assert_array_equal(found.lit, ~shade)


def test_light_at_the_border_does_not_wrap_to_the_other_side():
    """All frequencies are on the DFT grid, for which row 0 follows on the last."""
    world = replace(_world(near=0.0, fractional=True), far=0 * _world().far)
    q = world.correspondence.copy()
    q[0], q[-1] = [0.3, 14.6], [22.6, 0.4]
    q[:, 0], q[:, -1] = [11.5, 0.0], [6.4, 29.0]
    world = replace(world, correspondence=q)
    for noise in (0.0, 0.01):
        found = correspond_by_phase(_responses(world, FEW, noise), pitch=1)
        assert found.lit.all()
        np.testing.assert_allclose(found.q, q, atol=0.05 if noise == 0 else 0.5)
        assert np.nanmin(found.q) >= 0
        assert np.all(found.q <= np.array(PROJECTOR) - 1)


def test_saturated_photos_still_correspond(shoot):
    """Half of the camera pixels clip under white and under the brightest sinusoids."""
    world = _world(near=0.0)
    plan = paper_plan(PROJECTOR, WINDOW, FAR, correspondence="none")
    bright = replace(world, direct=world.direct + 0.65, far=1.2 * world.far)
    found = correspond_by_phase(measure(shoot(plan, bright, SimulatedCamera())), pitch=1)
    assert found.lit.all()
    np.testing.assert_allclose(found.q, world.correspondence, atol=0.5)


@pytest.mark.parametrize("noise", [0.0, 0.01])
def test_black_photos_show_no_direct_light(noise):
    world = _world()
    black = replace(world, direct=0 * world.direct, near=0 * world.near, far=0 * world.far)
    found = correspond_by_phase(_responses(black, FEW, noise), pitch=1)
    assert not found.lit.any()
    assert np.all(np.isnan(found.q))
    assert np.all(np.isfinite(found.confidence))
    assert found.confidence.max() < 0.5


def test_rounding_in_a_black_pixel_is_no_light():
    measured = _responses(_world(), FEW)
    responses = measured.responses.copy()
    responses[37] = 1e-9 * np.random.default_rng(0).uniform(-1, 1, size=responses[37].shape)
    responses[37, :, measured.response_indices([DC])[0]] = 1e-9
    found = correspond_by_phase(replace(measured, responses=responses), pitch=1)
    assert np.flatnonzero(~found.lit).tolist() == [37]


@pytest.mark.parametrize("scale", [1e-3, 300.0])
def test_the_exposure_does_not_matter(scale):
    measured = _responses(_world(), FEW, noise=0.003)
    found = correspond_by_phase(measured, pitch=1)
    scaled = replace(
        measured,
        responses=(scale * measured.responses).astype(np.float32),
        noise=(scale * measured.noise).astype(np.float32),
    )
    again = correspond_by_phase(scaled, pitch=1)
    np.testing.assert_array_equal(again.lit, found.lit)
    np.testing.assert_allclose(again.q, found.q, atol=2e-3)
    np.testing.assert_allclose(again.confidence, found.confidence, atol=1e-3)


def test_a_block_of_camera_pixels_corresponds_on_its_own():
    measured = _responses(_world(), FEW, noise=0.003)
    whole = correspond_by_phase(measured, pitch=1)
    part = correspond_by_phase(measured.of_pixels(Size(6, 30), slice(90, 270)), pitch=1)
    assert part.q.dtype == np.float32
    assert part.confidence.dtype == np.float32
    # Its first and last rows lack neighbours, which may tell that light is not direct.
    np.testing.assert_allclose(part.q[1:-1], whole.q[4:8], atol=2e-3)
    both = part.lit & whole.lit[3:9]
    assert both.mean() > 0.9
    np.testing.assert_allclose(part.q[both], whole.q[3:9][both], atol=2e-3)


def test_light_by_way_of_another_surface_is_told_by_its_turning_round():
    # Beyond a crease, at x = 15, light may come as a mirror's image of this side of it, faint
    # over white as light between surfaces is.
    camera = Size(20, 26)
    y, x = np.meshgrid(np.arange(2.0, 22.0), np.arange(2.0, 28.0), indexing="ij")
    world = _world(camera, near=0.0, entries=0)
    direct = np.where(x > 15, 0.045, 0.25)[..., None].astype(np.float32)
    for beyond, seen in ((x, True), (30 - x, False)):
        q = np.stack([y, np.where(x > 15, beyond, x)], axis=-1).astype(np.float32)
        shown = replace(world, correspondence=q, direct=direct)
        found = correspond_by_phase(_responses(shown, FEW, noise=0.003), pitch=1)
        assert found.lit[:, :12].all()
        assert np.mean(found.lit[:, 15:-1] == seen) > 0.95


@pytest.mark.parametrize(
    "frequencies",
    [
        [],
        [CHECKERBOARD],
        # Light one window away gives the same responses.
        [CHECKERBOARD, *near_frequencies(5, Size(1, 1))],
        # Neighbours answer all but alike.
        far_frequencies(Size(3, 3), Size(64, 64)),
        # Across, nothing is told at all.
        far_frequencies(Size(31, 1), Size(64, 64)),
        [
            CHECKERBOARD,
            *near_frequencies(3, Size(1, 1)),
            *far_frequencies(Size(3, 3), Size(64, 64)),
        ],
    ],
)
def test_frequencies_that_settle_nothing_are_refused(frequencies):
    size = Size(64, 64)
    world = model_transport(size, Size(2, 2), window=3, far=Size(1, 1))
    with pytest.raises(InputError, match=r"pattern grid of 64x64 alike, .*: plan with .*\.$"):
        correspond_by_phase(_responses(world, frequencies), pitch=1)


def test_responses_without_white_are_refused():
    measured = _responses(_world(Size(2, 2)), FEW)
    kept = measured.response_indices([k for k in measured.basis.frequencies if k != DC])
    basis = real_basis([k for k in measured.basis.frequencies if k != DC], PROJECTOR)
    without = replace(measured, basis=basis, responses=measured.responses[..., kept])
    with pytest.raises(InputError, match=r"no response to white.*: .*\.$"):
        correspond_by_phase(without, pitch=1)


def test_places_that_few_others_resemble_are_settled():
    """Only opposite borders are alike: 63 rows apart, which is 9 windows and all but a period."""
    size = Size(64, 64)
    frequencies = [CHECKERBOARD, *near_frequencies(7, Size(1, 1))]
    frequencies += [k for k in far_frequencies(Size(3, 3), size) if k != DC]
    assert (
        expected_wrong(real_basis(representatives(frequencies), size), 1) < LARGEST_EXPECTED_WRONG
    )


@pytest.mark.parametrize(
    ("projector", "window", "far"),
    [
        (Size(128, 128), 19, Size(13, 13)),
        (Size(128, 128), 15, Size(13, 13)),
        (Size(68, 100), 19, Size(7, 10)),
        (Size(64, 64), 11, Size(7, 7)),
    ],
)
def test_the_papers_plans_settle_every_place(projector, window, far):
    plan = paper_plan(projector, window, far, correspondence="none")
    frequencies = representatives(pattern.frequency for pattern in plan.patterns)
    settled = expected_wrong(real_basis([k for k in frequencies if k != DC], projector), 1)
    assert settled < 1e-6 < LARGEST_EXPECTED_WRONG
    # Without far frequencies the near set repeats itself all over the grid.
    near = representatives(x.frequency for x in plan.patterns if x.purpose != "far")
    assert expected_wrong(real_basis(near, projector), 1) > 1
