"""Correspondence by phase at a large projector's own pixels, which are not all scored."""

import tracemalloc
from dataclasses import replace

import numpy as np
import pytest

from nearfar.arrays import Size, blocks
from nearfar.correspondence import coarse_to_fine, correspond_by_phase, phase
from nearfar.correspondence.ambiguity import LARGEST_EXPECTED_WRONG, expected_wrong
from nearfar.correspondence.levels import Candidates
from nearfar.correspondence.methods import method_named
from nearfar.correspondence.size import is_coarse_to_fine
from nearfar.correspondence.weighing import without_dc
from nearfar.errors import InputError
from nearfar.illumination.frequencies import (
    CHECKERBOARD,
    DC,
    far_frequencies,
    near_frequencies,
    representatives,
)
from nearfar.illumination.real_basis import real_basis
from nearfar.plan import choose_plan, paper_plan
from nearfar.plan.patterns import Sinusoid
from tests.correspondence.lit_surface import (
    in_front,
    lit_surface,
    screen_frequencies,
    two_surfaces,
)

CAMERA = Size(40, 48)
FULL_HD = Size(1080, 1920)
NO_SHADOW = np.zeros(CAMERA, dtype=bool)


def _off(found, world):
    """Return the distance of q from the truth, projector pixels; infinite where it is missed."""
    distance = np.hypot(*np.moveaxis(found.q - world.q, -1, 0))
    return np.where(np.isfinite(distance), distance, np.inf)[world.lit]


def _close_up(camera, **options):
    """Look at a fifth of the height and of the width of a full HD projector's light."""
    q = 0.4 * np.array(FULL_HD) + 0.2 * two_surfaces(FULL_HD, camera)
    return lit_surface(FULL_HD, camera, q=q, shadow=np.zeros(camera, dtype=bool), **options)


def _ambiguous(projector):
    """Frequencies that hardly tell q from places 9 pixels away: far ones are all that do."""
    far = far_frequencies(Size(5, 5), projector)
    return representatives([*far, *near_frequencies(9, Size(1, 1)), CHECKERBOARD])


@pytest.mark.parametrize(
    ("projector", "footprint"),
    [
        (Size(512, 512), (0.5, 3.0)),
        (FULL_HD, (0.5, 6.0)),
        (Size(301, 777), (0.5, 2.0)),
        (Size(2160, 3840), (0.5, 8.0)),
    ],
)
def test_lit_surfaces_are_found_to_a_tenth_of_a_pixel(projector, footprint):
    world = lit_surface(projector, CAMERA, footprint=footprint)
    found = correspond_by_phase(world.measurements, pitch=1)
    off = _off(found, world)
    assert np.median(off) < 0.05
    assert np.percentile(off, 99) < 0.25
    assert off.max() < 1.0
    assert np.all(found.confidence[world.lit] > 0.5)
    assert not found.lit[~world.lit].any()
    assert found.confidence[~world.lit].max() < 0.1
    assert found.q.dtype == found.confidence.dtype == np.float32


def test_noise_and_weak_light_make_no_jumps():
    """Direct light of a sixth of white, in photos of a quarter of the electrons."""
    world = lit_surface(FULL_HD, CAMERA, direct=(0.15, 0.2), footprint=(0.5, 1.5), noise=0.022)
    off = _off(correspond_by_phase(world.measurements, pitch=1), world)
    assert np.mean(np.isfinite(off)) > 0.95
    off = off[np.isfinite(off)]
    assert np.median(off) < 0.2
    assert off.max() < 2.0


def test_footprints_of_one_or_two_projector_pixels_are_found():
    """As of a camera finer than the projector: whole pixels, and two that share the light."""
    camera = Size(12, 20)
    projector = Size(256, 320)
    pixels = np.floor(two_surfaces(projector, camera))
    basis = real_basis([DC, *(k for k in screen_frequencies(projector) if k != DC)], projector)
    y, x = pixels.astype(int).reshape(-1, 2).T
    for share in (0.0, 0.25, 0.5):
        drawn = (1 - share) * basis.patterns_at(
            np.stack([y, x], axis=-1)
        ).T + share * basis.patterns_at(np.stack([y, x + 1], axis=-1)).T
        world = lit_surface(projector, camera, noise=0.0)
        found = correspond_by_phase(
            replace(world.measurements, responses=0.6 * drawn[:, None].astype(np.float32)),
            pitch=1,
        )
        np.testing.assert_allclose(found.q, pixels + np.array([0.0, share]), atol=0.06)


def test_depth_edges_stay_where_they_are():
    world = lit_surface(FULL_HD, CAMERA, shadow=NO_SHADOW)
    front = in_front(CAMERA)
    beside = front != np.roll(front, 1, axis=1)
    beside |= np.roll(beside, -1, axis=1)
    found = correspond_by_phase(world.measurements, pitch=1)
    assert beside.sum() > 80
    assert np.max(np.abs(found.q - world.q)[beside]) < 0.5


def _mislead(monkeypatch, is_misled, shift):
    """Let the search of chosen candidates end elsewhere."""
    search = coarse_to_fine.search

    def misled(levels, weighed):
        candidates = search(levels, weighed)
        place = candidates.place + np.where(is_misled(candidates)[:, None], shift, 0)
        place = np.clip(place, 0, np.array(FULL_HD) - 1)
        return Candidates(candidates.pixel, place, candidates.score)

    monkeypatch.setattr(coarse_to_fine, "search", misled)


@pytest.mark.parametrize("wrong", [(0, 19), (40, -33), (-300, 500)])
def test_places_that_were_searched_for_wrongly_are_mended_by_neighbours(monkeypatch, wrong):
    camera = Size(24, 30)
    world = _close_up(camera)
    at = np.zeros(camera, dtype=bool)
    at[5:8, 10:13] = at[15, 3] = at[0, 0] = at[12:16, 20:24] = True
    _mislead(monkeypatch, lambda candidates: at.ravel()[candidates.pixel], wrong)
    basis = without_dc(world.measurements)
    q, _ = coarse_to_fine.correspond_coarse_to_fine(world.measurements, basis)
    assert np.abs(q - world.q).max() < 0.5
    monkeypatch.setattr(coarse_to_fine, "ROUNDS", 0)
    q, _ = coarse_to_fine.correspond_coarse_to_fine(world.measurements, basis)
    assert np.all(np.abs(q - world.q).max(axis=-1)[at] > 3)


@pytest.mark.parametrize("photos", [29, 33])
def test_few_photos_leave_no_camera_pixel_a_period_away(photos):
    # Alone, two thirds of the camera pixels are; two rounds of asking leave up to one in seven.
    projector, camera = Size(128, 128), Size(96, 96)
    plan, _ = choose_plan(projector, photos)
    shown = representatives(p.frequency for p in plan.patterns if isinstance(p, Sinusoid))
    y, x = np.indices(camera)
    world = lit_surface(
        projector,
        camera,
        q=np.stack([y + 10.0, x + 20.0], axis=-1),
        shadow=np.zeros(camera, dtype=bool),
        frequencies=shown,
        footprint=(0.05, 0.1),
    )
    found = correspond_by_phase(world.measurements, pitch=plan.pitch)
    assert np.nanmax(_off(found, world)) < 1
    assert np.mean(found.lit) > 0.99
    # Neighbours so far away as eight rounds reach have a say, and no others.
    beside = method_named("phase").rows_needed(plan)
    assert beside == 17
    tile = slice(40, 44)
    around = slice(tile.start - beside, tile.stop + beside)
    rows = world.measurements.of_pixels(
        Size(4 + 2 * beside, 96), slice(96 * around.start, 96 * around.stop)
    )
    part = correspond_by_phase(rows, pitch=plan.pitch).q[beside : beside + 4]
    np.testing.assert_allclose(part, found.q[tile], atol=1e-3)


def test_periods_that_photos_hardly_tell_apart_are_told_by_neighbours(monkeypatch):
    monkeypatch.setattr(phase, "require_settled", lambda basis, pitch: None)
    world = _close_up(Size(48, 32), frequencies=_ambiguous(FULL_HD), footprint=(0.5, 0.6))
    jumped = np.mean(_off(correspond_by_phase(world.measurements, pitch=1), world) > 1)
    monkeypatch.setattr(coarse_to_fine, "ROUNDS", 0)
    alone = np.mean(_off(correspond_by_phase(world.measurements, pitch=1), world) > 1)
    assert alone > 0.005
    assert jumped < alone / 2


def test_tiles_of_rows_are_those_of_the_whole(monkeypatch):
    camera = Size(36, 32)
    world = _close_up(camera, footprint=(0.5, 0.6))
    # Of four rows across all of the camera, two at a time are mended from above and from below.
    wrong = world.q[5:9].reshape(-1, 2)

    def is_misled(candidates):
        return (np.abs(candidates.place[:, None] - wrong).max(axis=-1) < 1).any(axis=1)

    _mislead(monkeypatch, is_misled, (40, -33))
    plan = paper_plan(FULL_HD, 5, Size(5, 5), correspondence="phase")
    beside = method_named("phase").rows_needed(plan)
    whole = correspond_by_phase(world.measurements, pitch=1)
    assert np.mean(_off(whole, world) > 0.5) < 0.02
    for tile in blocks(camera.height, 6):
        around = slice(max(0, tile.start - beside), min(camera.height, tile.stop + beside))
        part = world.measurements.of_pixels(
            Size(around.stop - around.start, 32), slice(32 * around.start, 32 * around.stop)
        )
        found = correspond_by_phase(part, pitch=1)
        rows = slice(tile.start - around.start, tile.stop - around.start)
        np.testing.assert_allclose(found.q[rows], whole.q[tile], atol=1e-3)
        np.testing.assert_allclose(found.confidence[rows], whole.confidence[tile], atol=1e-3)


def test_small_projectors_are_scored_at_every_place(monkeypatch):
    """Up to 2**15 pixels where windows are of single pixels, and in a single row or column."""
    projector, camera = Size(128, 128), Size(5, 6)
    assert not is_coarse_to_fine(projector, 1)
    shadow = np.zeros(camera, dtype=bool)
    world = lit_surface(projector, camera, shadow=shadow, footprint=(0.5, 0.6))
    found = correspond_by_phase(world.measurements, pitch=1)
    # Both ways agree, within what either is off by.
    basis = without_dc(world.measurements)
    q, _ = coarse_to_fine.correspond_coarse_to_fine(world.measurements, basis)
    for one in (found, replace(found, q=q)):
        assert _off(one, world).max() < 0.15
    monkeypatch.setattr(phase, "correspond_coarse_to_fine", None)
    np.testing.assert_array_equal(correspond_by_phase(world.measurements, pitch=1).q, found.q)
    assert not is_coarse_to_fine(Size(1, 2**15 + 1), 1)
    assert not is_coarse_to_fine(Size(128, 256), 1)
    assert is_coarse_to_fine(Size(128, 257), 1)
    # Windows of functions two pixels apart.
    assert is_coarse_to_fine(Size(129, 129), 2)
    small = paper_plan(projector, 5, Size(5, 5), correspondence="phase")
    assert method_named("phase").rows_needed(small) == 3


def test_plans_with_few_high_frequencies_find_weak_direct_light():
    """On a projector all of whose places could be scored; they are at a pitch of 1."""
    projector = Size(136, 150)
    plan, _ = choose_plan(projector, 200)
    assert plan.pitch > 1
    shown = representatives(p.frequency for p in plan.patterns if isinstance(p, Sinusoid))
    world = lit_surface(
        projector, Size(30, 36), frequencies=shown, direct=(0.2, 0.4), footprint=(0.3, 0.6)
    )
    found = correspond_by_phase(world.measurements, pitch=plan.pitch)
    assert not found.lit[~world.lit].any()
    off = _off(found, world)
    assert np.median(off) < 0.1
    assert np.percentile(off, 99) < 0.25
    missed = ~correspond_by_phase(world.measurements, pitch=1).lit[world.lit]
    assert np.mean(missed) > 0.3
    assert method_named("phase").rows_needed(plan) > 1


def test_light_by_way_of_another_surface_is_told_by_its_turning_round():
    camera = Size(24, 30)
    y, x = np.meshgrid(np.arange(100.0, 124.0), np.arange(200.0, 230.0), indexing="ij")
    shadow = np.zeros(camera, dtype=bool)
    for beyond, seen in ((x, True), (430 - x, False)):
        q = np.stack([y, np.where(x > 215, beyond, x)], axis=-1)
        world = lit_surface(
            FULL_HD, camera, q=q, shadow=shadow, direct=(0.085, 0.086), footprint=(0.5, 0.6)
        )
        found = correspond_by_phase(world.measurements, pitch=1)
        assert found.lit[:, :14].all()
        assert np.mean(found.lit[:, 17:-1] == seen) > 0.95


def test_black_camera_pixels_and_channels_do_no_harm():
    camera = Size(16, 20)
    world = lit_surface(FULL_HD, camera, channels=3, shadow=np.zeros(camera, dtype=bool))
    lit = np.ones((camera.pixels, 3), dtype=np.float32)
    lit[:, 1] = 0.0
    lit[37] = 0.0
    measurements = replace(
        world.measurements,
        responses=world.measurements.responses * lit[..., None],
        noise=world.measurements.noise * lit,
    )
    found = correspond_by_phase(measurements, pitch=1)
    assert np.flatnonzero(~found.lit).tolist() == [37]
    assert np.median(np.abs(found.q - world.q)[found.lit]) < 0.05
    dark = correspond_by_phase(replace(measurements, responses=0 * measurements.responses), pitch=1)
    assert not dark.lit.any()
    assert dark.confidence.max() < 0.5


def test_light_at_the_border_does_not_wrap_to_the_other_side():
    camera = Size(8, 9)
    q = np.empty((*camera, 2))
    q[:4], q[4:] = [2.0, 700.3], [1077.4, 1917.6]
    q[:, ::3, 0] = 500.25
    q[:, 1::3, 1] = 2.3
    world = lit_surface(
        FULL_HD, camera, q=q, shadow=np.zeros(camera, dtype=bool), footprint=(0.5, 0.6)
    )
    found = correspond_by_phase(world.measurements, pitch=1)
    np.testing.assert_allclose(found.q, q, atol=0.3)


def test_frequencies_that_settle_nothing_are_refused():
    camera = Size(4, 4)
    low = far_frequencies(Size(3, 3), FULL_HD)
    for frequencies in (low, near_frequencies(5, Size(1, 1)), _ambiguous(FULL_HD)):
        world = lit_surface(FULL_HD, camera, frequencies=representatives(frequencies))
        with pytest.raises(InputError, match="leave places on the pattern grid of 1080x1920 alike"):
            correspond_by_phase(world.measurements, pitch=1)
    basis = real_basis([k for k in screen_frequencies(FULL_HD) if k != DC], FULL_HD)
    assert expected_wrong(basis, 1) < LARGEST_EXPECTED_WRONG / 100


def test_no_array_has_a_value_for_each_place():
    """That would be 8 MB for a photo or a camera pixel, of which there are hundreds."""
    world = lit_surface(FULL_HD, CAMERA)
    tracemalloc.start()
    try:
        correspond_by_phase(world.measurements, pitch=1)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert peak < 12 * 4 * FULL_HD.pixels
