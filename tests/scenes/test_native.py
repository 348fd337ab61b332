"""Scenes at native size: the operator beside the matrices, and beside what it approximates."""

import numpy as np
import pytest

from nearfar import scenes
from nearfar.arrays import Size
from nearfar.errors import InputError
from nearfar.scenes import cache
from nearfar.scenes.cornell import WAX
from nearfar.scenes.description import SceneDescription
from nearfar.scenes.dipole import dipole
from nearfar.scenes.native import sizes
from nearfar.scenes.native.near import Lattice, dipoles_between, step_of
from nearfar.scenes.optics import pinhole, sub_rays
from nearfar.scenes.rays import hit, surface
from nearfar.transport.dipole import diffuse_profile
from nearfar.transport.exact_operator import ExactOperator
from nearfar.workflow.evaluate import snr


@pytest.fixture
def coarse_patches(monkeypatch):
    """Twelve patches along the shorter side, whatever the projector."""
    monkeypatch.setattr(sizes, "PATCHES_ALONG", 12)


def noise(size, seed=0):
    return np.random.default_rng(seed).random(size).astype(np.float32)


@pytest.mark.parametrize(
    ("name", "least"),
    # dB of T, D, N and F under a random light; N and F differ by what patches cost where they are
    # mixed.
    [
        ("corner", (50, 65, 0, 38)),
        ("cornell", (33, 33, 24, 29)),
        ("wedge", (34, 34, 0, 24)),
        ("marble", (31, 28, 32, 32)),
    ],
)
def test_an_operator_agrees_with_the_matrices(name, least):
    size = Size(24, 24)
    dense, thin = scenes.build(name, size), scenes.build_operator(name, size)
    known, found = (each.component_pictures(noise(size)) for each in (dense, thin))
    # Both are scaled by their own brightest pixel.
    gain = np.vdot(sum(known), sum(found)) / np.vdot(sum(found), sum(found))
    assert gain == pytest.approx(1, abs=0.01)
    for one, other, decibels in zip((sum(known), *known), (sum(found), *found), least, strict=True):
        assert not (one.any() or other.any()) or snr(one, gain * other) >= decibels
    white = np.ones(size, dtype=np.float32)
    for one, other in zip(
        dense.component_pictures(white), thin.component_pictures(white), strict=True
    ):
        assert gain * other.sum() == pytest.approx(one.sum(), rel=0.03)


@pytest.mark.parametrize("name", ["cornell-aside", "wedge"])
def test_blocks_of_a_finer_projector_light_as_a_coarse_one(coarse_patches, name):
    camera = Size(24, 24)
    coarse, fine = (scenes.build_operator(name, Size(side, side), camera) for side in (12, 48))
    light = noise(coarse.projector)
    blocks = light.repeat(4, axis=0).repeat(4, axis=1)
    pairs = zip(coarse.component_pictures(light), fine.component_pictures(blocks), strict=True)
    for (one, other), least in zip(pairs, (60, 45, 30), strict=True):
        assert not (one.any() or other.any()) or snr(one, other) >= least


def test_direct_and_far_light_have_texture_finer_than_patches(coarse_patches):
    size = Size(96, 96)
    operator = scenes.build_operator("corner", size)
    scene = scenes.SCENES["corner"].compute.surfaces()
    where, eye = surface(scene.parts, range(3)), pinhole(scene.projector_view, size)
    direction, _, _ = sub_rays(eye, size, 1)
    hits = hit(where, eye.position, direction)
    way = eye.position - hits.position
    distance = np.linalg.norm(way, axis=-1)
    part = where.part[hits.face]
    cosine = np.einsum("nx,nx->n", way, where.normals[hits.face]) / distance
    albedo = np.array([each.material.albedo for each in scene.parts])[part]
    tone = np.where(part == 0, scene.parts[0].material.texture(hits.position), 1)
    expected = albedo * (tone * cosine / distance**2)[:, None]
    direct, near, far = operator.component_pictures(np.ones(size, dtype=np.float32))
    assert not near.any()
    found = direct.reshape(-1, 3)
    gain = np.median(found / expected)
    # But for pixels on the border between two boards or walls.
    assert np.mean(np.abs(found / (gain * expected) - 1) < 0.01) > 0.9
    # Across the border between two boards far light steps as their tones do.
    pixel, step = np.arange(size.pixels - 2), 2
    whole = (part[pixel] == 0) & (part[pixel + step] == 0)
    whole &= np.abs(tone[pixel + step] / tone[pixel] - 1) > 0.05
    first = pixel[whole]
    seen = far.reshape(-1, 3)[:, 0]
    steps = seen[first + step] / seen[first] / (tone[first + step] / tone[first])
    assert len(first) > 100
    assert np.median(np.abs(steps - 1)) < 0.02


def test_light_under_a_surface_is_the_dipole():
    sources = [dipole(WAX.medium, channel) for channel in range(3)]
    lattice = Lattice(np.zeros(3), np.array([0.1, 0.15, 0.08]), step_of(sources))
    between = dipoles_between(lattice, sources, (1.0, 0.5, 0.25))
    generator = np.random.default_rng(2)
    points = generator.random((200, 3)) * (0.1, 0.15, 0.08)
    node, weight = lattice.weights_at(points)
    assert weight.sum(axis=1) == pytest.approx(1, abs=1e-5)
    for start in range(3):
        light = np.zeros((1, 1, lattice.nodes), dtype=np.float32)
        light[0, 0, node[start]] = weight[start]
        found = (between.carry(light)[0][:, node] * weight).sum(axis=-1)
        square = np.sum((points - points[start]) ** 2, axis=1)
        for channel, share in enumerate((1.0, 0.5, 0.25)):
            expected = share * diffuse_profile(sources[channel], square)
            assert np.abs(found[channel] - expected).max() < 0.03 * expected.max()
            assert snr(expected, found[channel]) > 35


def test_direct_light_is_at_the_pixel_itself_under_a_coaxial_camera(coarse_patches):
    size = Size(40, 56)
    q = scenes.build_operator("alcove", size).correspondence
    lit = np.isfinite(q[..., 0])
    assert lit.mean() > 0.9
    assert np.abs(q - np.moveaxis(np.indices(size), 0, -1))[lit].max() < 0.01


def test_the_brightest_pixel_under_white_is_as_bright_as_of_matrices(coarse_patches):
    operator = scenes.build_operator("shelf", Size(32, 48), Size(30, 40))
    assert (operator @ np.ones((32, 48))).max() == pytest.approx(0.9, abs=1e-5)


def test_large_scenes_are_operators_and_small_ones_matrices(coarse_patches, monkeypatch):
    large, small = Size(300, 400), Size(64, 64)
    assert cache.needs_operator("corner", large)
    assert not cache.needs_operator("corner", Size(128, 128))
    assert not cache.needs_operator("corner", small, Size(256, 256))
    # One of a thousandth of the matrices' size.
    memory = cache.scene_memory("corner", large)
    assert memory.peak < 12 * large.pixels**2 / 1000
    monkeypatch.setattr(cache, "LARGEST_MATRICES", 1)
    first = cache.cached_known("corner", Size(20, 20))
    assert isinstance(first, ExactOperator)
    monkeypatch.setattr(cache, "build_operator", None)
    again = cache.cached_known("corner", Size(20, 20))
    light = noise((20, 20))
    assert np.array_equal(first @ light, again @ light)


def test_a_scene_that_is_no_surfaces_has_no_operator(monkeypatch):
    plain = SceneDescription(summary="", projector=Size(4, 4), compute=lambda *_: None)  # type: ignore[arg-type,return-value]
    monkeypatch.setattr(scenes, "SCENES", {"plain": plain})
    with pytest.raises(InputError, match="matrix alone"):
        scenes.build_operator("plain")
