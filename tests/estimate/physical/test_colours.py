"""Subsurface light at outlines has the colour of the body's."""

from dataclasses import replace

import numpy as np
import pytest

from nearfar.estimate.physical import split_physically
from nearfar.estimate.physical.colours import with_colours_of_bodies
from tests.estimate.physical.synthetic import PROJECTOR, transport_of
from tests.estimate.physical.test_split import ATTENUATION, window_light

WHITE = np.ones(PROJECTOR, np.float32)


@pytest.fixture(scope="module")
def split():
    y, x = np.mgrid[: PROJECTOR.height, : PROJECTOR.width]
    disc = (np.hypot(y - 15, x - 16) < 10).astype(float)
    near = window_light(disc, attenuations=(ATTENUATION, 1.5 * ATTENUATION))
    found = split_physically(transport_of(near, np.full((*PROJECTOR, 2), 0.2)))
    assert len(found.bodies) == 1
    return found


def with_amplitude(split, change):
    """Return a split whose body has amplitudes changed by a factor, (n, channels)."""
    (body,) = split.bodies
    return replace(split, bodies=(body._replace(amplitude=body.amplitude * change),))


def outline_of(split):
    (body,) = split.bodies
    y, x = np.divmod(body.pixels, PROJECTOR.width)
    seen = np.zeros(np.array(PROJECTOR) + 2, bool)
    seen[y + 1, x + 1] = True
    around = [seen[y + i, x + j] for i in range(3) for j in range(3)]
    return ~np.all(around, axis=0)


def test_light_of_another_colour_at_outlines_is_inter_reflection(split):
    outline = outline_of(split)
    change = np.ones((len(outline), 2))
    change[outline, 1] = 4.0
    lit = with_amplitude(split, change)
    mended = with_colours_of_bodies(lit)
    (body,), (before,), (true,) = mended.bodies, lit.bodies, split.bodies
    assert np.all(body.amplitude[outline, 1] < 0.5 * before.amplitude[outline, 1])
    np.testing.assert_allclose(body.amplitude[outline, 1], true.amplitude[outline, 1], rtol=0.5)
    np.testing.assert_array_equal(body.amplitude[:, 0], true.amplitude[:, 0])
    np.testing.assert_array_equal(body.amplitude[~outline], true.amplitude[~outline])
    np.testing.assert_allclose(sum(mended.components(WHITE)), sum(lit.components(WHITE)), atol=1e-5)


@pytest.mark.parametrize("factor", [0.2, 5.0])
def test_a_brighter_or_darker_outline_of_the_same_colour_stays(split, factor):
    change = np.where(outline_of(split), factor, 1.0)[:, None]
    lit = with_amplitude(split, change)
    (body,), (before,) = with_colours_of_bodies(lit).bodies, lit.bodies
    np.testing.assert_allclose(body.amplitude, before.amplitude, rtol=0.05)


def test_a_colour_inside_a_body_stays(split):
    (body,) = split.bodies
    inner = ~outline_of(split)
    change = np.ones((len(body.pixels), 2))
    change[inner, 0] = np.random.default_rng(1).uniform(0.2, 1, inner.sum())
    lit = with_amplitude(split, change)
    mended = with_colours_of_bodies(lit).bodies[0].amplitude
    np.testing.assert_array_equal(mended[inner], lit.bodies[0].amplitude[inner])
