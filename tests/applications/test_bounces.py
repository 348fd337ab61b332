"""Bounces against reflections that are known: as matrices, and between the walls of a corner."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import sparse

from nearfar import ExactTransport, bounces, natural_picture, snr, split_physically
from nearfar.arrays import Size
from nearfar.errors import InputError
from nearfar.estimate.physical.kernels import source_at
from nearfar.estimate.physical.split import Translucent
from nearfar.scenes.bounces import bounces_between
from nearfar.scenes.corner import corner
from nearfar.scenes.geometry import View
from nearfar.scenes.render import render
from tests.worlds import model_transport

SIZE = Size(6, 8)
CHANNELS = 2


class World:
    """A scene of opaque surfaces, of which the camera sees every one that is lit.

    A light l leaves surfaces as D l, and is reflected from all of them to all of them by A.
    """

    def __init__(self, reflected=0.6, seed=0, size=SIZE):
        generator = np.random.default_rng(seed)
        count = size.pixels
        self.direct = generator.uniform(0.05, 0.8, (CHANNELS, count))
        matrices = generator.uniform(0, 1, (CHANNELS, count, count)) ** 3
        self.again = reflected * matrices / matrices.sum(axis=2, keepdims=True)
        self.size = size

    def bounce(self, number, light):
        """Return the n-th bounce at the projector's pixels, (channels, P)."""
        leaving = [d * light[..., i].ravel() for i, d in enumerate(self.direct)]
        for _ in range(number - 1):
            leaving = [a @ b for a, b in zip(self.again, leaving, strict=True)]
        return np.array(leaving)

    def seen_by(self, camera, at, surface=()):
        """Return the transport of a camera whose pixels see `at`, and then rows of their own.

        Camera pixels of `surface`, rows (channels, n, P) of A, are of a surface in shadow.
        """
        all_of, first = [], []
        for i, (d, a) in enumerate(zip(self.direct, self.again, strict=True)):
            every = np.linalg.inv(np.eye(len(a)) - a)
            rest = (every - np.eye(len(a))) @ np.diag(d)
            rows, own = rest[at], np.diag(d)[at]
            if len(surface):
                rows = np.concatenate([rows, surface[i] @ every @ np.diag(d)])
                own = np.concatenate([own, np.zeros_like(surface[i])])
            all_of.append(rows)
            first.append(sparse.csr_array(own.astype(np.float32)))
        nothing = tuple(sparse.csr_array(part.shape, dtype=np.float32) for part in first)
        return ExactTransport(
            self.size, camera, tuple(first), nothing, np.array(all_of, np.float32), "world"
        )


LIGHT = np.random.default_rng(7).random((*SIZE, CHANNELS))


@pytest.mark.parametrize("reflected", [0.1, 0.6, 0.9])
def test_bounces_are_the_powers_of_one_reflection(reflected):
    """At 0.6 and above, a truncated series in K diverges."""
    world = World(reflected)
    at = np.random.default_rng(3).permutation(SIZE.pixels)
    found = bounces(world.seen_by(SIZE, at), LIGHT, 5)
    for number, picture in enumerate(found.pictures, 1):
        expected = world.bounce(number, LIGHT).T[at].reshape(picture.shape)
        np.testing.assert_allclose(picture, expected, rtol=1e-3, atol=1e-5 * expected.max())
    assert found.faults == ()


def test_what_is_in_shadow_has_its_bounces_too():
    world, shadow = World(), np.random.default_rng(5).uniform(0, 0.02, (CHANNELS, 16, SIZE.pixels))
    camera = Size(8, 8)
    found = bounces(world.seen_by(camera, np.arange(SIZE.pixels), shadow), LIGHT, 3)
    in_shadow = found.pictures.reshape(3, camera.pixels, CHANNELS)[:, SIZE.pixels :]
    assert not in_shadow[0].any()
    for number in (1, 2):
        expected = np.einsum("icp,ip->ci", shadow, world.bounce(number, LIGHT))
        np.testing.assert_allclose(in_shadow[number], expected, rtol=1e-3)


# All of it is lit and seen.
SMALL_CORNER = corner(0.8, View((1.8, 1.8, 1.8), (0.2, 0.2, 0.2), 0.45))


@pytest.mark.parametrize(
    ("camera", "wanted"),
    [
        (Size(32, 32), 38.0),
        (Size(64, 64), 36.0),
        (Size(49, 53), 35.0),
        (Size(23, 20), 27.0),
        # Between its camera pixels lie projector pixels that light none.
        (Size(10, 10), 17.0),
    ],
)
def test_bounces_between_walls_are_those_of_radiosity(camera, wanted):
    """Cameras of the projector's pixels, of finer and coarser ones."""
    projector, scene = Size(32, 32), SMALL_CORNER
    truth = render(scene, projector, camera, progress=lambda *_: None)
    light = natural_picture(projector, 3)
    expected = bounces_between(scene, light, 4, projector, camera)
    found = bounces(truth, light, 4)
    decibels = [snr(*pair) for pair in zip(expected, found.pictures, strict=True)]
    assert min(decibels) > wanted, decibels
    assert found.faults == ()
    np.testing.assert_allclose(found.pictures.sum(axis=0) + found.later, truth @ light, atol=1e-6)
    assert found.later.min() > -1e-5


@pytest.fixture(scope="module")
def measured():
    """A transport that obeys the model, its q whole."""
    return model_transport(SIZE, SIZE, window=5, far=Size(3, 3), channels=CHANNELS, seed=2)


def test_a_measured_transport_is_inverted_as_the_paper_says(measured):
    """C (I - C)^(n-1) L with C = D T^-1, by dense matrices."""
    direct, near, far = (part.astype(np.float64) for part in measured.component_rows(slice(None)))
    found = bounces(measured, LIGHT, 3)
    for i in range(CHANNELS):
        whole = direct[:, i] + near[:, i] + far[:, i]
        cancelled = direct[:, i] @ np.linalg.inv(whole)
        left = whole @ LIGHT[..., i].ravel()
        for picture in found.pictures:
            expected = cancelled @ left
            np.testing.assert_allclose(picture[..., i].ravel(), expected, rtol=1e-3, atol=1e-4)
            left = left - expected


def test_bounces_are_linear_in_the_light_and_in_the_transport(measured):
    one, other = bounces(measured, LIGHT), bounces(2 * measured, 0.25 * LIGHT)
    np.testing.assert_allclose(other.pictures, 0.5 * one.pictures, rtol=1e-3, atol=1e-6)
    dark = bounces(measured, np.zeros(SIZE))
    assert not dark.pictures.any()
    assert dark.shares == (0.0,) * 4


def test_one_channel_is_of_two_axes():
    transport = model_transport(SIZE, SIZE, window=5, far=Size(3, 3))
    found = bounces(transport, LIGHT[..., 0], 2)
    assert found.pictures.shape == (2, *SIZE)
    assert found.later.shape == SIZE
    assert found.pictures.dtype == found.later.dtype == np.float32


def test_the_first_bounce_of_a_split_is_direct_and_subsurface_light(measured):
    pixels = np.arange(10)
    wax = Translucent(
        pixels,
        measured.correspondence.reshape(-1, 2)[:10],
        np.ones(SIZE),
        (source_at(1.0, 0.8),) * CHANNELS,
        np.zeros(10, int),
        np.full((10, CHANNELS), 0.2),
        np.ones(10),
    )
    split = replace(split_physically(measured), bodies=(wax,))
    direct, subsurface, rest = split.components(LIGHT)
    assert subsurface.max() > 0.01
    found = bounces(split, LIGHT, 2)
    np.testing.assert_allclose(found.pictures[0], direct + subsurface, atol=1e-6)
    np.testing.assert_allclose(found.pictures[1] + found.later, rest, atol=1e-6)


def test_progress_is_told(measured):
    told = []
    bounces(measured, LIGHT, 3, progress=lambda what, share: told.append((what, share)))
    assert [share for _, share in told] == pytest.approx([1 / 3, 2 / 3, 1.0])


def test_surfaces_that_the_camera_does_not_see_are_told():
    world = World()
    half = bounces(world.seen_by(Size(3, 8), np.arange(24)), LIGHT, 2)
    # The camera sees the upper half, and so knows of the row of projector pixels below.
    assert half.unseen == pytest.approx(2 / 6)
    assert "33.3% of the projector's pixels light surfaces" in half.faults[0]


def test_projector_pixels_that_light_next_to_nothing_are_not_missed():
    """What an estimate has of those beyond the scene is noise."""
    world = World()
    world.direct[:, 24:] *= 0.01
    found = bounces(world.seen_by(Size(3, 8), np.arange(24)), LIGHT, 2)
    assert found.unseen == 0
    assert found.faults == ()


def test_light_that_does_not_fade_is_told():
    growing = World(size=Size(2, 3))
    growing.again[:] = 0
    growing.again[:, 3:, :3] = 1.5
    light = np.zeros((2, 3, CHANNELS))
    light[0] = 1.0
    found = bounces(growing.seen_by(Size(2, 3), np.arange(6)), light, 2)
    assert "though light fades" in " ".join(found.faults)


def test_negative_light_is_told():
    world = World()
    world.again[:, :, ::2] *= -1
    found = bounces(world.seen_by(SIZE, np.arange(SIZE.pixels)), LIGHT, 3)
    assert found.negative[1] > 0.03
    assert "of the light of bounce 2 is negative" in " ".join(found.faults)


def test_light_that_cannot_be_cancelled_is_told():
    """A ring in which all the light goes on from each pixel to the next has no inverse."""
    size = Size(12, 12)
    count = size.pixels
    ring = np.roll(np.eye(count, dtype=np.float32), 1, axis=1)
    direct = (sparse.csr_array(np.eye(count, dtype=np.float32)),)
    nothing = (sparse.csr_array((count, count), dtype=np.float32),)
    light = np.random.default_rng(0).random(size)
    found = bounces(ExactTransport(size, size, direct, nothing, ring[None], "ring"), light, 2)
    assert found.residual > 0.01
    assert "the light that cancels a bounce is known to" in " ".join(found.faults)


def test_bad_input_gets_a_sentence(measured):
    with pytest.raises(InputError, match=r"a str was given for the transport: give what nearfar\."):
        bounces("transport.zarr", LIGHT)
    with pytest.raises(InputError, match="count is 0"):
        bounces(measured, LIGHT, 0)
    with pytest.raises(InputError, match="resize the light to 6x8"):
        bounces(measured, LIGHT[:5])
    mixed = ExactTransport(SIZE, SIZE, (), (), np.eye(48)[None], "mixed")
    with pytest.raises(InputError, match="components of mixed are not known apart"):
        bounces(mixed, LIGHT[..., 0])
    lamps = replace(measured, parts=("free",))
    with pytest.raises(InputError, match="a transport without direct light"):
        bounces(lamps, LIGHT)
