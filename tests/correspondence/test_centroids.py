"""Centroids of direct light, between pixels and beside near-range light."""

import numpy as np
import pytest

from nearfar.correspondence.centroids import centroids

OFFSETS = np.arange(-2, 3)


def _places(count=400, seed=0):
    return 10 + np.random.default_rng(seed).uniform(0, 1, size=(count, 2))


def _to_half_a_pixel(places):
    """Round to half a pixel, as a search for q does."""
    return np.rint(2 * places) / 2


def _squares(around):
    """Round places up from the middle between pixels, as correspondence does."""
    return np.floor(around + 0.5).astype(np.int64)


def _distances(middles, places):
    """Distances of entries from places along each axis, (2, C, 5)."""
    return OFFSETS + (middles - places).T[..., None]


def _direct(middles, places):
    """Bilinear weights of direct light at places, (C, 5, 5)."""
    down, across = np.clip(1 - np.abs(_distances(middles, places)), 0, None)
    return down[:, :, None] * across[:, None]


def _near_range(middles, places, length=1.2):
    """Near-range light about places, (C, 5, 5)."""
    down, across = _distances(middles, places)
    return np.exp(-np.hypot(down[:, :, None], across[:, None]) / length)


def test_direct_light_between_pixels_is_found_exactly():
    places = _places()
    around = _to_half_a_pixel(places)
    middles = _squares(around)
    found = centroids(_direct(middles, places), middles, around)
    np.testing.assert_allclose(found, places, atol=1e-12)


def test_near_range_light_moves_no_centroid_to_one_side():
    places = _places(4000)
    around = _to_half_a_pixel(places)
    middles = _squares(around)
    entries = _direct(middles, places) + 0.1 * _near_range(middles, places)
    off = centroids(entries, middles, around) - places
    # All entries of a square move it by 0.025 on each axis, as squares reach further up than down.
    whole = middles + np.stack(
        [
            np.einsum("cij,i->c", entries, OFFSETS) / entries.sum(axis=(1, 2)),
            np.einsum("cij,j->c", entries, OFFSETS) / entries.sum(axis=(1, 2)),
        ],
        axis=1,
    )
    assert np.all((whole - places).mean(axis=0) > 0.02)
    assert np.abs(off.mean(axis=0)).max() < 0.003
    assert np.sqrt(np.mean(off**2)) < 0.3 * np.sqrt(np.mean((whole - places) ** 2))


def test_mirrored_entries_have_mirrored_centroids():
    rng = np.random.default_rng(3)
    middles = np.full((50, 2), 10)
    entries, around = rng.uniform(size=(50, 5, 5)), middles + rng.uniform(-0.5, 0.5, (50, 2))
    found = centroids(entries, middles, around) - middles
    mirrored = centroids(entries[:, ::-1, ::-1], middles, 2 * middles - around) - middles
    np.testing.assert_allclose(mirrored, -found, atol=1e-12)
    turned = centroids(entries.swapaxes(1, 2), middles, around[:, ::-1]) - middles
    np.testing.assert_allclose(turned[:, ::-1], found, atol=1e-12)


@pytest.mark.parametrize("far", [(0, 0), (4, 4), (0, 4)])
def test_light_two_pixels_away_does_not_count(far):
    middles = np.array([[10, 10]])
    entries = np.zeros((1, 5, 5))
    entries[0, 2, 2], entries[0][far] = 1.0, 0.9
    found = centroids(entries, middles, middles.astype(float))
    np.testing.assert_allclose(found, middles, atol=1e-12)


def test_without_light_close_by_places_stay():
    middles = np.array([[10, 10], [7, 3]])
    around = middles + 0.5
    np.testing.assert_array_equal(centroids(np.zeros((2, 5, 5)), middles, around), around)
