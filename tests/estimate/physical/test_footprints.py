"""Direct light at a wax disc, of which an estimate takes what fades for blur of the projector."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import ndimage

from nearfar import PhysicalErrorBars, Size, Transport, save_transport, split_physically
from nearfar.estimate.physical.error_bars import OF_BOXES
from nearfar.estimate.physical.footprints import footprints
from nearfar.estimate.physical.kernels import kernel, source_at
from nearfar.illumination.frequencies import grid, representatives
from nearfar.illumination.near_basis import NearBasis
from nearfar.illumination.real_basis import real_basis
from nearfar.priors.component import PriorComponent
from nearfar.transport.boxes import box_axes
from nearfar.transport.posterior import Posterior
from nearfar.viewer.interactive import InteractiveTransport
from nearfar.viewer.physical import PhysicalRelighting

SIDE, RADIUS, PITCH = 48, 13, 4
PROJECTOR = Size(SIDE, SIDE)
DIRECT, AMPLITUDE = 0.3, 2.5
SOURCE = source_at(1.4, 0.4)
BLUR = 0.75


@pytest.fixture(scope="module")
def basis():
    return real_basis(representatives(grid(PROJECTOR, PROJECTOR)), PROJECTOR)


def disc():
    """Return which camera pixels, and projector pixels, are of wax; q is each one's own."""
    y, x = np.mgrid[:SIDE, :SIDE]
    return np.hypot(y - SIDE // 2, x - SIDE // 2) < RADIUS


def transport_of(footprint, far, basis):
    y, x = np.mgrid[:SIDE, :SIDE].astype(np.float32)
    return Transport(
        projector=PROJECTOR,
        correspondence=np.stack([y, x], axis=-1),
        direct=np.full((*PROJECTOR, 1), DIRECT, np.float32),
        near=np.zeros((*PROJECTOR, 1, NearBasis(9, PITCH).count), np.float32),
        far=far.reshape(*PROJECTOR, 1, basis.count).astype(np.float32),
        far_basis=basis,
        black=np.zeros((*PROJECTOR, 1), np.float32),
        noise=np.full((*PROJECTOR, 1), 1e-3, np.float32),
        pitch=PITCH,
        footprint=footprint,
    )


def squares(sides):
    """Return upright footprints (Py, Px, 4) of some sides (Py, Px)."""
    sides = np.broadcast_to(sides, PROJECTOR)
    return np.stack([sides, sides, 0 * sides, 0 * sides], axis=-1).astype(np.float32)


def blurred(blur):
    return np.hypot(1.0, blur)


@pytest.fixture(scope="module")
def wax(basis):
    """Return an estimate of a disc of wax whose footprints are too wide, with the right rows."""
    inside = disc()
    footprint = squares(np.where(inside, blurred(BLUR), 1.0))
    flat = AMPLITUDE * kernel(SOURCE, SIDE)
    rows = np.zeros((SIDE**2, *PROJECTOR))
    q = np.stack(np.mgrid[:SIDE, :SIDE], axis=-1).reshape(-1, 2)
    axes = box_axes(q, footprint.reshape(-1, 4), PROJECTOR)
    for c in np.flatnonzero(inside):
        y, x = q[c]
        rows[c] = flat[SIDE - y : 2 * SIDE - y, SIDE - x : 2 * SIDE - x] * inside
        sides, shares = axes.shares(c)
        rows[c][sides] -= DIRECT * shares
        rows[c, y, x] += DIRECT
    far = basis.analyse(rows.reshape(SIDE**2, -1)) / basis.weights
    return transport_of(footprint, far, basis)


@pytest.fixture(scope="module")
def split(wax):
    return split_physically(wax)


def test_direct_light_beside_light_that_was_taken_for_blur_is_as_bright_as_it_is(wax, split):
    (body,) = split.bodies
    assert body.sources[0].real == pytest.approx(SOURCE.real, rel=0.04)
    rng = np.random.default_rng(2)
    for light in (np.ones(PROJECTOR), rng.uniform(0, 1, PROJECTOR)):
        parts = split.components(light.astype(np.float32))
        inner = disc()
        # Pixel by pixel the disc gives back its light directly, and through no blur.
        error = (parts.direct - DIRECT * light)[inner]
        assert np.sqrt(np.mean(error**2)) < 0.02 * DIRECT
        np.testing.assert_allclose(sum(parts), wax @ light.astype(np.float32), atol=1e-5)


def test_footprints_at_wax_are_blurred_as_what_stands_beside_it(wax):
    inside = disc()
    for beside, at_wax, wanted in (
        (0.0, BLUR, 0.0),
        (0.5, BLUR, 0.5),  # a projector that blurs
        (1.0, BLUR, BLUR),  # one that blurs what is farther away
    ):
        footprint = squares(np.where(inside, blurred(at_wax), blurred(beside)))
        transport = replace(wax, footprint=footprint)
        found = footprints(transport, inside).reshape(*PROJECTOR, 4)
        np.testing.assert_allclose(found[inside], squares(blurred(wanted))[inside], atol=1e-5)
        assert np.array_equal(found[0], footprint[0])


def test_a_camera_pixel_that_sees_less_than_those_about_it_keeps_its_footprint(wax):
    inside = disc()
    footprint = squares(np.where(inside, blurred(BLUR), 1.0))
    footprint[SIDE // 2, SIDE // 2] = 0.4, 1.0, 0.1, 0.0
    found = footprints(replace(wax, footprint=footprint), inside).reshape(*PROJECTOR, 4)
    narrow = footprint[SIDE // 2, SIDE // 2].copy()
    np.testing.assert_array_equal(found[SIDE // 2, SIDE // 2], narrow)
    np.testing.assert_allclose(found[SIDE // 2, SIDE // 2 + 1], [1, 1, 0, 0], atol=1e-5)


def test_error_bars_of_direct_light_go_with_the_light_on_the_splits_footprints(wax):
    # One of every 17 frequencies, from slow to fast.
    frequencies = tuple(representatives(grid(PROJECTOR, PROJECTOR))[1::17])
    ones = np.ones((*PROJECTOR, 1), np.float32)
    posterior = Posterior(
        prior_components=(PriorComponent(0.8, 64.0, 1.5),),
        frequencies=frequencies,
        multiplicity=np.ones(real_basis(frequencies, PROJECTOR).count, np.float32),
        prior_component=np.zeros(PROJECTOR, np.uint8),
        prior_scale=np.full(PROJECTOR, 1e-3, np.float32),
        white=ones,
        offset_noise=1e-4 * ones,
        light_noise=1e-4 * ones,
        share_of_white=ones,
        noise_share=ones,
    )
    bars = PhysicalErrorBars(split_physically(replace(wax, posterior=posterior)))
    light = np.random.default_rng(5).uniform(0, 1, PROJECTOR).astype(np.float32)
    inner = ndimage.binary_erosion(disc(), iterations=3)
    white = bars.components(np.ones(PROJECTOR, np.float32))
    found = bars.components(light).direct[inner]
    np.testing.assert_allclose(found, (white.direct * light)[inner], rtol=1e-3)
    # Of what direct light may have too much of, subsurface light has too little.
    assert np.all(white.direct[inner] > 0.9 * OF_BOXES * DIRECT)
    assert np.all(white.subsurface[inner] > 0.9 * OF_BOXES * DIRECT)


def test_the_viewer_relights_some_camera_pixels_through_their_footprints(wax, split, tmp_path):
    save_transport(wax, tmp_path / "wax.zarr")
    physical = PhysicalRelighting(InteractiveTransport(tmp_path / "wax.zarr"))
    physical.prepare()
    rows, columns = np.arange(20, 31, 2), np.arange(17, 29, 3)
    light = np.random.default_rng(3).uniform(0, 1, PROJECTOR).astype(np.float32)
    some = physical.pixels(rows, columns).components(light)
    for part, whole in zip(some, split.components(light), strict=True):
        np.testing.assert_allclose(part, whole[np.ix_(rows, columns)], atol=1e-5)


def test_where_nothing_stands_beside_wax_footprints_stay(wax):
    everywhere = np.ones(PROJECTOR, bool)
    assert np.array_equal(footprints(wax, everywhere), wax.boxes)


def test_single_pixels_have_no_footprint_to_change(wax):
    window = np.zeros((*PROJECTOR, 1, 9, 9), np.float32)
    single = replace(wax, pitch=1, footprint=None, near=window)
    assert np.array_equal(footprints(single, disc()), single.boxes)
    assert split_physically(single).footprint is None
