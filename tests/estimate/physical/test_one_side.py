"""Inter-reflection that reaches camera pixels of a body from one side is no subsurface light."""

import numpy as np
import pytest

from nearfar.estimate.physical import split_physically
from nearfar.estimate.physical import splitting as splitting_module
from nearfar.estimate.physical.body import bodies_at
from nearfar.estimate.physical.footprints import footprints
from nearfar.estimate.physical.kernels import kernel, source_at
from nearfar.estimate.physical.medium import media_of
from nearfar.estimate.physical.one_side import with_light_from_one_side
from nearfar.estimate.physical.responses import waves_of
from nearfar.estimate.physical.translucent import translucent
from nearfar.illumination.near_basis import window_offsets
from tests.estimate.physical.synthetic import PROJECTOR, WINDOW, transport_of

DEPTH, ATTENUATION, AMPLITUDE = 0.9, 0.5, 2.5
WHITE = np.ones(PROJECTOR, np.float32)
STEPS = window_offsets(WINDOW)
UNDER = AMPLITUDE * kernel(source_at(DEPTH, ATTENUATION), WINDOW // 2).ravel()
# Creases are so many projector pixels apart; columns up to this distance have light from one side.
APART, NEAR = 16, 4
INNER = slice(8, -8)


def light_across_creases():
    """Return light that columns at creases have from one side, (Py, Px, W * W)."""
    column = np.arange(PROJECTOR.width) % APART
    found = np.zeros((*PROJECTOR, len(STEPS)))
    for side, near in ((1, column < NEAR), (-1, column >= APART - NEAR)):
        blob = np.exp(-np.sum((STEPS - (0, 3.5 * side)) ** 2, axis=-1) / (2 * 1.8**2))
        found += near[:, None] * 0.4 * UNDER.sum() * blob / blob.sum()
    return found


def split_of(window):
    """Return the split of a surface with some light about q, (Py, Px, W * W)."""
    near = np.repeat(window[:, :, None], 2, axis=2).reshape(*PROJECTOR, 2, WINDOW, WINDOW)
    return split_physically(transport_of(near, np.full((*PROJECTOR, 2), 0.2)))


def off(split):
    """Return how far subsurface light is off, as a share of it, far from the border."""
    subsurface = split.components(WHITE).subsurface
    y, x = np.mgrid[: PROJECTOR.height, : PROJECTOR.width]
    places = np.stack([y, x], axis=-1)[:, :, None] + STEPS
    true = (UNDER * np.all((places >= 0) & (places < PROJECTOR), axis=-1)).sum(axis=-1)
    return np.abs(subsurface / true[..., None] - 1)[INNER, INNER].mean()


@pytest.fixture
def alone(monkeypatch):
    """Leave out that light from one side is looked for, once it is called.

    What bodies have of inter-reflection at least is left out at once: it mends a part of the same.
    """
    monkeypatch.setattr(splitting_module, "with_least_interreflection", lambda split: split)

    def leave_out():
        monkeypatch.setattr(splitting_module, "with_light_from_one_side", lambda _, media: media)

    return leave_out


def test_light_across_a_crease_is_no_subsurface_light(alone):
    window = UNDER + light_across_creases()
    split = split_of(window)
    np.testing.assert_allclose(sum(split.components(WHITE)), split.transport @ WHITE, atol=1e-5)
    alone()
    without = split_of(window)
    assert off(without) > 0.02
    assert off(split) < 0.4 * off(without)
    (body,), (other,) = split.bodies, without.bodies
    fading, other_fading = body.sources[0].attenuation, other.sources[0].attenuation
    assert abs(np.log(fading / ATTENUATION)) < abs(np.log(other_fading / ATTENUATION))


def test_a_kernel_with_more_light_on_one_side_keeps_it(alone):
    """A curved surface has such a kernel; nothing is taken from its subsurface light."""
    cosine = STEPS[:, 1] / np.maximum(np.hypot(*STEPS.T), 1.0)
    window = np.broadcast_to(UNDER * (1 + 0.3 * cosine), (*PROJECTOR, len(STEPS)))
    split = split_of(window)
    alone()
    np.testing.assert_array_equal(split.direct, split_of(window).direct)


def test_a_body_without_light_from_one_side_keeps_its_medium(alone):
    window = np.broadcast_to(UNDER, (*PROJECTOR, len(STEPS)))
    split = split_of(window)
    alone()
    assert split.bodies[0].sources == split_of(window).bodies[0].sources


def test_next_to_an_outline_no_light_comes_from_one_side(alone):
    """A kernel that is cut off there has light on one side as well."""
    coverage = np.zeros(PROJECTOR)
    coverage[:, 12:17] = 1.0
    padded = np.pad(coverage, WINDOW // 2)
    y, x = np.mgrid[: PROJECTOR.height, : PROJECTOR.width]
    reached = padded[y[..., None] + STEPS[:, 0] + 6, x[..., None] + STEPS[:, 1] + 6]
    window = UNDER * reached * coverage[..., None] * (1 + 0.3 * (STEPS[:, 1] > 1))
    split = split_of(window)
    assert split.bodies
    alone()
    np.testing.assert_array_equal(split.direct, split_of(window).direct)


def test_by_few_responses_light_stays_as_bright_as_it_is():
    """Three of them cannot tell direct light, a kernel and its odd ones apart."""
    window = UNDER + light_across_creases()
    near = np.repeat(window[:, :, None], 2, axis=2).reshape(*PROJECTOR, 2, WINDOW, WINDOW)
    transport = transport_of(near, np.full((*PROJECTOR, 2), 0.2))
    seen = translucent(transport)
    every = waves_of(transport)
    few = every._replace(cycles=every.cycles[:2], has_sine=np.array([True, False]))
    (body,) = bodies_at(transport, seen, footprints(transport, seen), few)
    media = media_of(body)
    found = with_light_from_one_side(body, media)
    assert np.abs(found.direct).max() < 10 * np.abs(media.direct).max()
    assert found.amplitude.max() < 10 * media.amplitude.max()
    assert found.amplitude.min() >= 0
