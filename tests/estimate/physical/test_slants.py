"""Slanted footprints on projector pixels, and what direct light through them is told by."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import ndimage
from scipy.signal import fftconvolve

from nearfar import Size
from nearfar.estimate.physical import slants
from nearfar.estimate.physical.body import bodies_at
from nearfar.estimate.physical.kernels import FLAT, kernel, source_at
from nearfar.estimate.physical.medium import amplitudes
from nearfar.estimate.physical.responses import waves_of
from nearfar.estimate.physical.slants import SlantedFootprints, slanted_footprints
from nearfar.transport.near import centre
from tests.estimate.physical.synthetic import PROJECTOR, WINDOW, transport_of

D, S = 0.2, 0.3
# Samples of a box on each side.
DENSE = 200


def sampled(q, box, projector):
    """Return the share of each projector pixel, (Py, Px), by samples of both boxes."""
    height, width, *shift = box
    along = (np.arange(DENSE) + 0.5) / DENSE - 0.5
    found = np.zeros(projector)
    for side in (-1, 1):
        y, x = (
            np.rint(middle + side * aside + extent * along).astype(int)
            for middle, aside, extent in zip(q, shift, (height, width), strict=True)
        )
        y, x = y[(y >= 0) & (y < projector[0])], x[(x >= 0) & (x < projector[1])]
        np.add.at(found, (y[:, None], x[None]), 1.0)
    return found / found.sum()


def slanted_transport(slope=0.5):
    """Return a transport of a body whose q moves across, too, from one row to the next."""
    y, x = np.mgrid[: PROJECTOR.height, : PROJECTOR.width]
    seen = (abs(y - 15) < 5) & (abs(x - 15) < 6)
    nothing = np.zeros((*PROJECTOR, 2))
    transport = transport_of(np.zeros((*nothing.shape, WINDOW, WINDOW)), nothing)
    q = np.where(seen[..., None], np.stack([y, x + slope * (y - 15)], axis=-1), np.nan)
    return replace(transport, correspondence=q.astype(np.float32)), seen


@pytest.mark.parametrize(
    ("q", "box"),
    [
        ((6.0, 8.0), (1.0, 1.1, 0.0, 0.6)),
        ((6.3, 7.6), (1.2, 1.5, 0.2, -0.5)),
        # Cut off by the projector's border.
        ((0.1, 15.2), (1.0, 1.6, 0.1, 0.8)),
    ],
)
def test_shares_and_responses_are_those_of_both_boxes(q, box):
    projector = Size(12, 16)
    one = SlantedFootprints(np.array([0]), np.array([q]), np.array([box]), projector)
    every = np.stack(np.indices(projector), axis=-1).reshape(1, -1, 2)
    expected = sampled(q, box, projector)
    np.testing.assert_allclose(one.shares_on(every)[0], expected.ravel(), atol=5e-3)
    assert one.shares_on(every).sum() == pytest.approx(1.0)
    rounded = np.rint([q]).astype(int)
    transport, _ = slanted_transport()
    waves = waves_of(transport)
    drawn = np.exp(2j * np.pi * ((every[0] - rounded) @ waves.cycles.T))
    np.testing.assert_allclose(
        one.to_waves(rounded, waves)[0], one.shares_on(every)[0] @ drawn, atol=1e-9
    )


def test_footprints_are_slanted_where_q_moves_across_from_row_to_row():
    transport, seen = slanted_transport()
    found = slanted_footprints(transport, seen.ravel())
    # At a corner, too few of those around tell how q moves.
    assert set(np.flatnonzero(ndimage.binary_erosion(seen))) <= set(found.pixels.tolist())
    assert set(found.pixels.tolist()) <= set(np.flatnonzero(seen))
    upright, _ = slanted_transport(0.0)
    assert not len(slanted_footprints(upright, seen.ravel()).pixels)
    assert not len(slanted_footprints(transport, np.zeros(seen.size, bool)).pixels)


def test_direct_light_of_a_slanted_body_is_not_taken_for_light_under_its_surface(monkeypatch):
    transport, seen = slanted_transport()
    footprints = slanted_footprints(transport, seen.ravel())
    source = source_at(0.7, 1.2)
    blurred = kernel(source, 12)
    every = np.stack(np.indices(PROJECTOR), axis=-1).reshape(1, -1, 2)
    near = np.zeros_like(transport.near).reshape(-1, 2, WINDOW, WINDOW)
    middles = centre(transport.correspondence, PROJECTOR)[footprints.pixels]
    shares = footprints.shares_on(np.broadcast_to(every, (len(middles), *every.shape[1:])))
    for pixel, share, (y, x) in zip(footprints.pixels, shares, middles, strict=True):
        image = share.reshape(PROJECTOR)
        row = np.pad(D * image + S * fftconvolve(image, blurred, mode="same"), WINDOW)
        first = y + WINDOW - WINDOW // 2, x + WINDOW - WINDOW // 2
        near[pixel] = row[first[0] : first[0] + WINDOW, first[1] : first[1] + WINDOW]
    transport = replace(transport, near=near.reshape(transport.near.shape).astype(np.float32))

    def found():
        (body,) = bodies_at(transport, seen, transport.boxes, waves_of(transport))
        # Light of kernels that the window does not hold is left out there.
        body = replace(body, covered=np.ones_like(body.covered))
        mine = np.flatnonzero(np.isin(body.pixels, footprints.pixels))
        shape = body.to_kernel(source, FLAT, mine)
        return amplitudes(body, 0, shape, np.ones(shape.shape[1]), mine)

    np.testing.assert_allclose(found().direct, D, rtol=0.02)
    np.testing.assert_allclose(found().subsurface, S, rtol=0.03)
    # Through the projector pixels about q alone, a part of it is missing.
    monkeypatch.setattr(slants, "LEAST_EXTENT", np.inf)
    assert np.median(found().direct) < 0.93 * D
