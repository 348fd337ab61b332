"""Inter-reflection on translucent bodies has no dark lines."""

from dataclasses import replace

import numpy as np
import pytest

from nearfar.estimate.physical import split_physically
from nearfar.estimate.physical.dark_creases import without_dark_creases
from tests.estimate.physical.synthetic import PROJECTOR, transport_of
from tests.estimate.physical.test_split import ATTENUATION, window_light

WHITE = np.ones(PROJECTOR, np.float32)
INNER = slice(10, 21)
COLUMN = 16


@pytest.fixture(scope="module")
def split():
    """Return the split of a disc of wax of some albedo, whose light has even light beside it."""
    y, x = np.mgrid[: PROJECTOR.height, : PROJECTOR.width]
    disc = (np.hypot(y - 15, x - 16) < 11).astype(float)
    near = window_light(disc, attenuations=(ATTENUATION, 1.5 * ATTENUATION)) + 0.003
    near *= np.random.default_rng(5).uniform(0.5, 1, PROJECTOR)[..., None, None, None]
    found = split_physically(transport_of(near, np.full((*PROJECTOR, 2), 0.2)))
    assert len(found.bodies) == 1
    return found


def with_column(split, factor):
    """Return a split whose subsurface light is stronger or weaker in a column."""
    (body,) = split.bodies
    change = np.where(body.pixels % PROJECTOR.width == COLUMN, factor, 1.0)[:, None]
    return replace(split, bodies=(body._replace(amplitude=body.amplitude * change),))


def parts_of(split):
    parts = split.components(WHITE)
    return parts.subsurface[INNER, COLUMN], parts.interreflection[INNER, COLUMN]


def test_a_dark_line_is_as_bright_as_half_about_it(split):
    dark = with_column(split, 1.3)
    mended = without_dark_creases(dark)
    true, found, before = (parts_of(one) for one in (split, mended, dark))
    assert np.abs(before[0] / true[0] - 1).min() > 0.29
    assert np.abs(found[0] / true[0] - 1).max() < 0.1
    np.testing.assert_allclose(sum(found), sum(true), rtol=1e-4)


def test_a_bright_line_stays(split):
    bright = with_column(split, 0.8)
    found, before = parts_of(without_dark_creases(bright)), parts_of(bright)
    np.testing.assert_allclose(found[0], before[0], rtol=1e-9)


def test_albedo_of_camera_pixels_makes_no_line(split):
    found = without_dark_creases(split)
    (body,), (before,) = found.bodies, split.bodies
    inner = np.hypot(*(np.divmod(before.pixels, PROJECTOR.width) - np.array([[15], [16]]))) < 7
    assert np.abs(body.amplitude / before.amplitude - 1)[inner].mean() < 0.02


def test_where_few_about_a_camera_pixel_are_of_the_body_it_stays(split):
    (body,) = split.bodies
    line = body.pixels % PROJECTOR.width == COLUMN
    thin = body._replace(
        pixels=body.pixels[line],
        places=body.places[line],
        slope=body.slope[line],
        amplitude=body.amplitude[line] * np.linspace(0.5, 1.5, line.sum())[:, None],
        explained=body.explained[line],
    )
    alone = replace(split, bodies=(thin,))
    (found,) = without_dark_creases(alone).bodies
    np.testing.assert_array_equal(found.amplitude, thin.amplitude)


def test_subsurface_light_loses_no_more_than_half_of_itself(split):
    dark = with_column(split, 50.0)
    found, before = parts_of(without_dark_creases(dark)), parts_of(dark)
    np.testing.assert_allclose(found[0], 0.5 * before[0], rtol=1e-6)


def test_without_a_body_nothing_changes(split):
    empty = replace(split, bodies=())
    assert without_dark_creases(empty) is empty
