"""Synthetic translucent bodies, whose kernel and direct light are known, and scenes without."""

import re
from dataclasses import replace

import numpy as np
import pytest

from nearfar import Size, Transport
from nearfar.errors import InputError
from nearfar.estimate.physical import PhysicalErrorBars, split_physically
from nearfar.estimate.physical.kernels import kernel, source_at
from nearfar.estimate.physical.medium import SLOPES
from nearfar.estimate.physical.split import Translucent
from nearfar.illumination.frequencies import grid, representatives
from nearfar.illumination.near_basis import NearBasis, window_offsets
from nearfar.illumination.pictures import random_pattern
from nearfar.illumination.real_basis import real_basis
from nearfar.transport.dipole import diffuse_reflectance
from tests.estimate.physical.synthetic import PROJECTOR, WINDOW, transport_of

DEPTH, ATTENUATION = 1.1, 0.9
AMPLITUDE = 2.5


def window_light(coverage, *, attenuations):
    """Return the window of light under a body, (Py, Px, 2, W, W), and all of it under white."""
    steps = window_offsets(WINDOW)
    middle = WINDOW // 2
    padded = np.pad(coverage, middle)
    y, x = np.mgrid[: PROJECTOR.height, : PROJECTOR.width]
    reached = padded[y[..., None] + middle + steps[:, 0], x[..., None] + middle + steps[:, 1]]
    near = np.zeros((*PROJECTOR, 2, WINDOW, WINDOW))
    for channel, attenuation in enumerate(attenuations):
        flat = kernel(source_at(DEPTH, attenuation), middle).ravel()
        entries = AMPLITUDE * flat * reached * coverage[..., None]
        near[:, :, channel] = entries.reshape(*PROJECTOR, WINDOW, WINDOW)
    return near


@pytest.fixture(scope="module")
def wax():
    """Return a disc of wax with specks of paint on it, its coverage and its direct light."""
    y, x = np.mgrid[: PROJECTOR.height, : PROJECTOR.width]
    coverage = (np.hypot(y - 15, x - 16) < 10).astype(float)
    rng = np.random.default_rng(4)
    direct = np.repeat(rng.uniform(0.05, 0.3, (*PROJECTOR, 1)), 2, axis=2)
    near = window_light(coverage, attenuations=(ATTENUATION, 1.5 * ATTENUATION))
    return transport_of(near, direct), coverage > 0, direct, near.sum(axis=(-2, -1))


def test_what_is_moved_between_components_changes_no_picture(wax):
    transport, *_ = wax
    split = split_physically(transport)
    assert split.bodies
    for light in (
        random_pattern(PROJECTOR, 1),
        np.random.default_rng(2).random((*PROJECTOR, 2)).astype(np.float32),
    ):
        parts = split.components(light)
        np.testing.assert_allclose(sum(parts), transport @ light, atol=1e-6)


def test_light_under_a_surface_is_known_at_q_where_all_of_a_body_shares_its_kernel(wax):
    """The transport calls a part of it direct; the split takes it back, speck by speck."""
    transport, body, direct, under = wax
    taken = 0.3 * transport.near[..., WINDOW // 2, WINDOW // 2]
    near = transport.near.copy()
    near[..., WINDOW // 2, WINDOW // 2] -= taken
    mixed = transport_of(near, direct + taken)
    split = split_physically(mixed)
    (found,) = split.bodies
    for source, attenuation in zip(found.sources, (ATTENUATION, 1.5 * ATTENUATION), strict=True):
        assert source.real == pytest.approx(DEPTH, rel=0.02)
        assert source.attenuation == pytest.approx(attenuation, rel=0.04)
    y, x = np.mgrid[: PROJECTOR.height, : PROJECTOR.width]
    inner = np.hypot(y - 15, x - 16) < 7
    parts = split.components(np.ones(PROJECTOR, np.float32))
    assert np.abs(parts.direct - direct)[inner].mean() < 0.02 * direct[inner].mean()
    assert np.abs(taken)[inner].mean() > 0.08 * direct[inner].mean()
    assert np.abs(parts.subsurface - under)[inner].mean() < 0.06 * under[inner].mean()
    assert np.abs(parts.subsurface[~body]).mean() < 0.02 * under[body].mean()


@pytest.mark.parametrize("shift", [0.45])
def test_places_between_projector_pixels_have_the_same_medium(shift):
    """A camera pixel between two projector pixels sees the mean of their kernels."""
    reach = WINDOW // 2
    flat = kernel(source_at(DEPTH, ATTENUATION), reach + 1)
    weights = np.outer([1 - shift, shift], [1 - shift, shift])
    rounded = int(np.rint(shift))
    near = np.zeros((*PROJECTOR, 2, WINDOW, WINDOW))
    for i in range(2):
        for j in range(2):
            first = (1 + rounded - i, 1 + rounded - j)
            part = flat[first[0] : first[0] + WINDOW, first[1] : first[1] + WINDOW]
            near += AMPLITUDE * weights[i, j] * part
    direct = np.full((*PROJECTOR, 2), 0.2)
    split = split_physically(transport_of(near, direct, shift=shift))
    (found,) = split.bodies
    for source in found.sources:
        assert source.real == pytest.approx(DEPTH, rel=0.01)
    np.testing.assert_allclose(split.direct[8:24, 8:24], 0.2, atol=0.01)


def test_light_from_one_side_is_inter_reflection():
    near = window_light(np.ones(PROJECTOR), attenuations=(ATTENUATION, ATTENUATION))
    near[..., : WINDOW // 2 + 1, :] = 0
    transport = transport_of(near, np.full((*PROJECTOR, 2), 0.3))
    split = split_physically(transport)
    assert not split.bodies
    parts = split.components(np.ones(PROJECTOR, np.float32))
    assert not parts.subsurface.any()
    np.testing.assert_allclose(parts.interreflection, near.sum(axis=(-2, -1)), atol=1e-4)


def test_a_body_whose_medium_the_window_cannot_tell_is_not_taken_for_translucent():
    """Light as from a great depth is even as far as kernels are compared."""
    steps = window_offsets(WINDOW)
    even = 0.01 * np.exp(-((np.hypot(*steps.T) / 4.5) ** 4)).reshape(WINDOW, WINDOW)
    near = np.broadcast_to(even, (*PROJECTOR, 2, WINDOW, WINDOW))
    split = split_physically(transport_of(near, np.full((*PROJECTOR, 2), 0.3)))
    assert not split.bodies


def test_a_kernel_holds_all_the_light_of_a_flat_surface():
    source = source_at(DEPTH, ATTENUATION)
    flat = kernel(source, 30)
    assert flat.sum() == pytest.approx(float(diffuse_reflectance(source)), rel=0.01)
    np.testing.assert_allclose(flat, flat.T, rtol=1e-9)
    np.testing.assert_allclose(flat, flat[::-1], rtol=1e-9)
    slanted = kernel(source, 30, (0.0, 1.3))
    assert slanted[30, 33] < 0.7 * flat[30, 33]
    assert slanted[33, 30] < flat[33, 30]
    assert slanted[33, 30] > slanted[30, 33]


def test_kernels_many_projector_pixels_wide_need_fewer_samples():
    wide = source_at(8 * DEPTH, ATTENUATION / 8)
    dense = kernel(wide, 40, (0.6, 0.0))
    for samples, relative in ((3, 1e-3), (1, 1e-2)):
        np.testing.assert_allclose(kernel(wide, 40, (0.6, 0.0), samples), dense, rtol=relative)


@pytest.mark.parametrize("corner", [(0, 0), (3, 19), (20, 22)])
def test_light_under_a_body_is_the_sum_of_kernels_wherever_it_lies(corner):
    down, across = corner
    coverage = np.zeros(PROJECTOR)
    coverage[down : down + 10, across : across + 9] = np.linspace(0.2, 1.0, 9)
    # One camera pixel sees the body beyond what lights it.
    places = np.array([[down + 4, across + 3], [down + 1, across + 8], [16, 16]])
    slope = np.array([0, 3, 0])
    source = source_at(DEPTH, 0.3 * ATTENUATION)
    body = Translucent(
        np.arange(3), places.astype(float), coverage, (source,), slope, np.ones((3, 1)), np.ones(3)
    )
    light = random_pattern(PROJECTOR, 5).astype(float)
    expected = []
    for (y, x), one in zip(places, slope, strict=True):
        flat = kernel(source, 32, SLOPES[one])[32 - y : 64 - y, 32 - x : 64 - x]
        expected.append(np.sum(flat * coverage * light))
    found = body.under(light.reshape(1, -1), PROJECTOR)
    np.testing.assert_allclose(found[:, 0], expected, rtol=2e-3)


def test_other_things_than_transports_are_refused():
    with pytest.raises(InputError, match="transport"):
        split_physically(np.eye(4))
    with pytest.raises(InputError, match="split"):
        PhysicalErrorBars(np.eye(4))


# The second is deeper than cells of two projector pixels tell, and fitted in wider ones.
@pytest.mark.parametrize(
    ("side", "depth", "attenuation"), [(64, 2 * DEPTH, ATTENUATION / 2), (96, 5.0, 0.2)]
)
def test_where_functions_are_of_several_projector_pixels_media_are_the_same(
    side, depth, attenuation
):
    """Subsurface light is given by its responses; cells are two projector pixels wide."""
    projector, pitch, camera = Size(side, side), 8, Size((side - 4) // 3, (side - 4) // 3)
    y, x = np.mgrid[: camera.height, : camera.width]
    places = 3 * np.stack([y, x], axis=-1) + 3
    basis = real_basis(representatives(grid(projector, projector)), projector)
    flat = AMPLITUDE * kernel(source_at(depth, attenuation), side)
    rows = np.stack(
        [flat[side - y : 2 * side - y, side - x : 2 * side - x] for y, x in places.reshape(-1, 2)]
    )
    far = basis.analyse(rows.reshape(camera.pixels, -1)) / basis.weights
    count = NearBasis(9, pitch).count
    transport = Transport(
        projector=projector,
        correspondence=places.astype(np.float32),
        direct=np.full((*camera, 1), 0.3, np.float32),
        near=np.zeros((*camera, 1, count), np.float32),
        far=far.reshape(*camera, 1, basis.count).astype(np.float32),
        far_basis=basis,
        black=np.zeros((*camera, 1), np.float32),
        noise=np.full((*camera, 1), 1e-3, np.float32),
        pitch=pitch,
        footprint=np.broadcast_to(np.float32([1, 1, 0, 0]), (*camera, 4)),
    )
    split = split_physically(transport)
    (found,) = split.bodies
    assert found.sources[0].real == pytest.approx(depth, rel=0.04)
    assert found.sources[0].attenuation == pytest.approx(attenuation, rel=0.04)
    white = np.ones(projector, np.float32)
    parts = split.components(white)
    inner = slice(6, 14)
    np.testing.assert_allclose(parts.direct[inner, inner], 0.3, rtol=0.02)
    np.testing.assert_allclose(
        parts.subsurface[inner, inner].mean(), rows.sum(axis=(1, 2)).max(), rtol=0.03
    )
    np.testing.assert_allclose(sum(parts), transport @ white, atol=1e-5)


def test_a_transport_without_near_range_light_is_refused(wax):
    transport, *_ = wax
    without = replace(transport, near=transport.near[..., :0, :0], parts=("direct", "far"))
    with pytest.raises(InputError, match="no near-range light"):
        split_physically(without)


def test_a_notebook_shows_the_physical_components(wax):
    transport, *_ = wax
    shown = split_physically(transport)._repr_html_()
    assert shown.count("<img") == 4
    for name in ("floodlit", "direct", "subsurface", "inter-reflection", "translucent bodies"):
        assert name in shown
    for name in ("near", "far"):
        assert f">{name}" not in shown
    shares = [float(share) for share in re.findall(r"(-?[\d.]+)% of the light", shown)]
    assert sum(shares) == pytest.approx(100, abs=0.2)
    assert shares[1] > 20
