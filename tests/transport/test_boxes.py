"""Boxes of projector pixels: sums by summed-area tables, and what lies beyond the border."""

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.transport.boxes import (
    box_overlaps,
    box_places,
    box_weights,
    share_of_boxes,
    spread_summed_area,
    summed_area,
)
from nearfar.transport.direct import direct_weights, look_up

PROJECTOR = Size(9, 14)


def test_a_summed_area_table_has_an_adjoint():
    draw = np.random.default_rng(0)
    light = draw.random(PROJECTOR)
    table = draw.random((PROJECTOR.height + 1) * (PROJECTOR.width + 1))
    assert np.vdot(summed_area(light), table) == pytest.approx(
        np.vdot(light, spread_summed_area(table, PROJECTOR))
    )


@pytest.mark.parametrize(
    "footprint",
    [
        (1.0, 1.0, 0.0, 0.0),
        (0.3, 2.6, 0.4, -0.7),
        (7.0, 5.5, 0.0, 1.3),
        (1e-9, 0.0, 0.0, 0.0),
        (0.0, 0.5, -2.2, 1.1),
    ],
)
def test_the_mean_of_a_footprint_is_that_of_the_pixels_under_its_boxes(footprint):
    draw = np.random.default_rng(1)
    light = draw.random(PROJECTOR)
    q = draw.random((40, 2)) * (np.array(PROJECTOR) - 1)
    q[:4] = [[0, 0], [8, 13], [0, 13], [4, 6]]
    q[4] = np.nan
    footprints = np.broadcast_to(footprint, (len(q), 4))
    found = look_up(summed_area(light), box_places(q, footprints, PROJECTOR))
    sides, skew = np.array(footprint[:2]), np.array(footprint[2:])
    reach = 8
    padded = np.pad(light, reach + 1)
    for c in range(len(q)):
        if np.isnan(q[c, 0]):
            assert found[c] == 0
            continue
        at = np.rint(q[c]).astype(int)
        y, x = at + 1
        around = padded[y : y + 2 * reach + 1, x : x + 2 * reach + 1]
        means = []
        for middle in (q[c] - at - skew, q[c] - at + skew):
            down, across = (
                box_overlaps(middle[axis : axis + 1], sides[axis : axis + 1], reach)[0]
                for axis in (0, 1)
            )
            means.append(down @ around @ across)
        assert found[c] == pytest.approx(np.mean(means), abs=1e-6)
    white = look_up(summed_area(np.ones(PROJECTOR)), box_places(q, footprints, PROJECTOR))
    np.testing.assert_allclose(white, share_of_boxes(q, footprints, PROJECTOR), atol=1e-6)


def test_a_box_of_one_pixel_is_the_bilinear_footprint():
    overlaps = box_overlaps(np.array([-0.4, 0.0, 0.3]), np.ones(3), 1)
    np.testing.assert_allclose(overlaps, [[0.4, 0.6, 0], [0, 1, 0], [0, 0.7, 0.3]], atol=1e-12)


def test_weights_of_the_nine_pixels_about_a_place_are_those_that_footprints_read():
    draw = np.random.default_rng(4)
    centres = np.stack([draw.integers(2, side - 2, 30) for side in PROJECTOR], axis=-1)
    q = centres + draw.uniform(-0.4, 0.4, centres.shape)
    footprints = np.column_stack(
        [draw.uniform(0.2, 1.6, (30, 2)), draw.uniform(-0.2, 0.2, (30, 2))]
    )
    light = draw.random(PROJECTOR)
    steps = np.arange(-1, 2)
    around = light[
        centres[:, 0, None, None] + steps[:, None], centres[:, 1, None, None] + steps
    ].reshape(-1, 9)
    found = box_weights(q, centres, footprints)
    read = look_up(summed_area(light), box_places(q, footprints, PROJECTOR))
    np.testing.assert_allclose((found * around).sum(axis=1), read, rtol=1e-9)


def test_of_boxes_of_a_pixel_the_weights_are_bilinear():
    draw = np.random.default_rng(5)
    centres = draw.integers(0, 9, (30, 2))
    q = (centres + draw.uniform(-0.5, 0.5, centres.shape)).astype(np.float32)
    single = np.tile([1.0, 1.0, 0.0, 0.0], (30, 1))
    bilinear = np.asarray(direct_weights(q, centres))[:, 0]
    np.testing.assert_allclose(box_weights(q, centres, single), bilinear, atol=1e-6)


def test_weights_beyond_the_nine_pixels_are_left_out():
    wide = box_weights(np.zeros((1, 2)), np.zeros((1, 2), int), np.array([[6.0, 6.0, 0.0, 0.0]]))
    assert wide.sum() == pytest.approx(9 / 36)
