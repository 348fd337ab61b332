"""Gray code: its patterns, what they decode to, and where they cannot."""

from dataclasses import replace

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.correspondence import (
    correspond_by_gray_code,
    correspond_by_stripes,
    has_gray_code,
)
from nearfar.correspondence.methods import method_of
from nearfar.errors import InputError
from nearfar.illumination.patterns import gray_bits
from nearfar.photometry.in_memory import PhotosInMemory
from nearfar.plan import GrayCode, paper_plan, parse_plan
from nearfar.rigs.simulated.camera import SimulatedCamera
from nearfar.rigs.simulated.projector import SimulatedProjector
from nearfar.rigs.simulated.rig import SimulatedRig
from nearfar.scenes.cache import cached_scene
from nearfar.workflow.acquire import acquire_in_memory
from tests.worlds import model_transport

SIZES = [Size(16, 16), Size(13, 18), Size(33, 7), Size(9, 64)]


def _found(photos):
    """Correspondence by the method of the photos' plan."""
    return method_of(photos.plan).find(photos, slice(0, photos.camera.height), measure=None)


def _plan(projector, correspondence="gray"):
    side = min(5, *projector)
    return paper_plan(projector, side, Size(3, 3), correspondence=correspondence)


def _codes(plan, kind):
    return [p for p in plan.patterns if isinstance(p, GrayCode) and p.kind == kind]


@pytest.mark.parametrize("projector", [*SIZES, Size(1080, 1920)])
def test_neighbours_differ_in_one_bit_and_all_have_a_code(projector):
    plan = paper_plan(projector, 5, Size(3, 3), correspondence="gray")
    for kind, side, axis in (
        ("gray rows", projector.height, 0),
        ("gray columns", projector.width, 1),
    ):
        codes = _codes(plan, kind)
        assert len(codes) == 2 * gray_bits(side) == 2 * int(np.ceil(np.log2(side)))
        drawn = {(code.bit, code.inverse): code.draw(projector) for code in codes}
        for (bit, inverse), pattern in drawn.items():
            assert set(np.unique(pattern)) <= {0, 255}
            # The same all along the other axis, and the inverse of its inverse.
            np.testing.assert_array_equal(pattern, pattern.take([0], axis=1 - axis) + 0 * pattern)
            np.testing.assert_array_equal(pattern, 255 - drawn[bit, not inverse])
        words = np.stack(
            [drawn[bit, False].take(0, axis=1 - axis) for bit in range(gray_bits(side))]
        )
        assert len(np.unique(words, axis=1).T) == side
        np.testing.assert_array_equal((np.diff(words.astype(int), axis=1) != 0).sum(axis=0), 1)
    assert plan.counts["correspondence"] == sum(2 * gray_bits(side) for side in projector)
    assert parse_plan(plan.to_json()) == plan


@pytest.mark.parametrize("projector", SIZES)
def test_whole_pixels_are_found_exactly(projector, shoot):
    world = model_transport(projector, projector, window=3, far=Size(3, 3), channels=2)
    # Direct light outshines the rest.
    world = replace(world, near=0.2 * world.near, far=0.2 * world.far)
    found = _found(shoot(_plan(projector), world))
    np.testing.assert_array_equal(found.q, world.correspondence)
    assert (found.confidence > 0.999).all()


def test_a_projectors_own_pixels_are_found():
    projector, camera = Size(1080, 1920), Size(6, 8)
    plan = _plan(projector)
    q = np.random.default_rng(0).integers(0, projector, size=(*camera, 2))
    photos = np.full((len(plan.patterns), *camera, 1), 0.5, dtype=np.float32)
    for photo, pattern in zip(photos, plan.patterns, strict=True):
        if isinstance(pattern, GrayCode):
            along = q[..., 0 if pattern.kind == "gray rows" else 1]
            white = ((along ^ (along >> 1)) >> pattern.bit) % 2 != pattern.inverse
            photo[..., 0] = 0.1 + 0.6 * white
    photos += 0.002 * np.random.default_rng(1).normal(size=photos.shape)
    found = _found(PhotosInMemory(plan, photos, 1.0))
    np.testing.assert_array_equal(found.q, q)


def test_blocks_of_rows_are_those_of_the_whole(shoot):
    world = model_transport(SIZES[1], Size(12, 9), window=3, far=Size(3, 3), channels=2)
    photos = shoot(_plan(SIZES[1]), world)
    whole = correspond_by_gray_code(photos)
    part = correspond_by_gray_code(photos, slice(4, 9))
    np.testing.assert_array_equal(part.q, whole.q[4:9])


def test_a_camera_pixel_between_two_is_shared_by_them(shoot):
    projector = Size(16, 20)
    world = model_transport(projector, Size(40, 50), window=3, far=Size(3, 3), channels=1)
    q = np.stack(np.meshgrid(np.linspace(1, 14, 40), np.linspace(1, 18, 50), indexing="ij"), -1)
    direct = np.full((40, 50, 1), 0.5, np.float32)
    world = replace(
        world,
        correspondence=q.astype(np.float32),
        direct=direct,
        near=0 * world.near,
        far=0.2 * world.far,
    )
    found = correspond_by_gray_code(shoot(_plan(projector), world))
    off = np.abs(found.q - q).max(axis=-1)
    assert np.isfinite(off).all()
    assert off.max() < 0.5
    assert np.median(off) < 0.2


def test_camera_pixels_without_direct_light_are_left_out(shoot):
    projector = Size(16, 20)
    world = model_transport(projector, projector, window=3, far=Size(3, 3), channels=1)
    dark = world.correspondence.copy()
    dark[4:8, 3:9] = np.nan
    lit = np.isfinite(dark[..., :1])
    world = replace(
        world,
        correspondence=dark,
        direct=world.direct * lit,
        near=world.near * lit[..., None, None],
    )
    found = correspond_by_gray_code(shoot(_plan(projector), world, SimulatedCamera()))
    np.testing.assert_array_equal(found.lit, lit[..., 0])
    assert found.confidence[4:8, 3:9].max() < 0.999


@pytest.mark.parametrize("name", ["cornell", "cornell-aside"])
def test_scenes_with_noise_are_found_about_as_well_as_by_stripes(name):
    scene = cached_scene(name, Size(32, 32))
    rig = SimulatedRig(scene, name, SimulatedProjector(), SimulatedCamera(), 1.0, 0)
    truth = scene.correspondence
    shares, recalls = [], []
    for how in ("gray", "stripes"):
        plan = paper_plan(scene.projector, 5, Size(3, 3), correspondence=how)
        found = _found(acquire_in_memory(plan, rig))
        both = found.lit & np.isfinite(truth[..., 0])
        off = np.abs(found.q - truth).max(axis=-1)[both]
        shares.append(np.mean(off <= 1.0))
        recalls.append(both.sum() / np.isfinite(truth[..., 0]).sum())
    assert shares[0] > 0.98
    assert recalls[0] > 0.9 * recalls[1]


def test_what_is_no_gray_code_is_said(shoot):
    world = model_transport(SIZES[0], Size(4, 5), window=3, far=Size(3, 3), channels=1)
    stripes = shoot(_plan(SIZES[0], "stripes"), world)
    assert not has_gray_code(stripes.plan)
    with pytest.raises(InputError, match="no Gray code"):
        correspond_by_gray_code(stripes)
    np.testing.assert_array_equal(_found(stripes).q, correspond_by_stripes(stripes).q)
    plan = _plan(SIZES[0])
    missing = plan.first(len(plan.patterns) - 1)
    assert has_gray_code(plan)
    assert not has_gray_code(missing)
    with pytest.raises(ValueError, match="no bit 4"):
        type(plan).model_validate(
            {**plan.model_dump(), "patterns": [*plan.patterns, GrayCode(kind="gray rows", bit=4)]}
        )


def _photos_of_bits(projector, bits, share):
    """Photos in which camera pixels answer the code with `share` of white, as `bits` say."""
    plan = paper_plan(projector, 3, Size(3, 3), correspondence="gray")
    pixels = len(next(iter(bits.values())))
    photos = np.full((len(plan.patterns), 1, pixels, 1), 0.5, dtype=np.float32)
    for number, pattern in enumerate(plan.patterns):
        if isinstance(pattern, GrayCode):
            on = bits[pattern.kind][:, pattern.bit] != pattern.inverse
            photos[number, 0, :, 0] += np.where(on, share / 2, -share / 2)
    # Of surfaces dark and bright.
    photos *= np.linspace(0.2, 1.0, pixels, dtype=np.float32)[:, None]
    photos += np.random.default_rng(0).normal(0, 1e-4, photos.shape).astype(np.float32)
    return PhotosInMemory(plan, photos, 1.0)


def _bits_of(places, count):
    gray = places ^ (places >> 1)
    return (gray[:, None] >> np.arange(count)) & 1 == 1


def test_codes_that_no_pattern_pixel_has_are_no_direct_light():
    projector = Size(20, 20)
    places = np.arange(32)
    bits = {kind: _bits_of(places, 5) for kind in ("gray rows", "gray columns")}
    found = correspond_by_gray_code(_photos_of_bits(projector, bits, 0.4))
    np.testing.assert_array_equal(found.lit[0], places < 20)
    np.testing.assert_array_equal(found.q[0, :20, 0], places[:20])


@pytest.mark.parametrize(("share", "lit"), [(0.4, True), (0.06, True), (0.02, False)])
def test_light_that_is_next_to_none_of_white_is_not_direct(share, lit):
    places = np.arange(16)
    bits = {kind: _bits_of(places, 4) for kind in ("gray rows", "gray columns")}
    found = correspond_by_gray_code(_photos_of_bits(Size(16, 16), bits, share))
    assert found.lit.all() == lit
    assert found.lit.any() == lit
