"""Correspondence by codes: what a camera pixel's sequence of levels tells."""

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.correspondence.codes import prepare_codes
from nearfar.correspondence.photo_order import FOLLOWED, explained_share, find_order
from nearfar.correspondence.places import find_places, is_lit, typical_misfit
from nearfar.errors import InputError
from nearfar.scenes.cache import cached_scene
from tests.shown import (
    as_picture,
    fringes,
    gray_code,
    micro_phase_shifting,
    photograph,
    random_binary,
    white_and_black,
    with_inverses,
)

SIZE = Size(32, 32)
SIDE = 32


def _levels(pictures, axis):
    """Return the levels of pictures of one axis along that axis, (N, down, across)."""
    levels = np.array(pictures, dtype=np.float32) / np.float32(255)
    return levels[:, :, :1] if axis == 0 else levels[:, :1]


def _codes(pictures, axis, groups=None):
    groups = np.zeros(len(pictures), dtype=int) if groups is None else np.array(groups)
    return [prepare_codes(_levels(pictures, axis), groups)]


@pytest.fixture(scope="module", params=["cornell", "cornell-aside", "shelf"])
def world(request):
    found = cached_scene(request.param, SIZE, Size(48, 48))
    return found * (0.9 / (found @ np.ones(SIZE, dtype=np.float32)).max())


SETS = {
    "Gray code and inverses": lambda axis: with_inverses(gray_code(SIZE, axis)),
    "Gray code, white, black": lambda axis: [*gray_code(SIZE, axis), *white_and_black(SIZE)],
    "fringes of three periods": lambda axis: fringes(SIZE, axis, [32, 8, 4], 3),
    "8-step fringes": lambda axis: fringes(SIZE, axis, [32, 8], 8),
    "micro phase shifting": lambda axis: micro_phase_shifting(SIZE, axis),
    "black lines": lambda axis: [
        255 - as_picture(np.moveaxis(np.tile(line, (SIDE, 1)), 1, axis)) for line in np.eye(SIDE)
    ],
}


@pytest.mark.parametrize("name", SETS)
def test_each_method_finds_direct_light_under_global_light_and_noise(world, name):
    lit = world.lit.ravel()
    for axis in (0, 1):
        pictures = SETS[name](axis)
        photos = np.array([photo.mean(axis=-1) for photo in photograph(world, pictures)])
        sequences = photos.reshape(len(photos), -1).T.astype(np.float64)
        codes = _codes(pictures, axis)
        found = find_places(sequences, codes, typical_misfit(sequences, codes))
        sure = is_lit(found, sequences)
        off = np.abs(found.place[:, axis] - world.correspondence.reshape(-1, 2)[:, axis])
        assert sure[lit].mean() > 0.85
        assert np.mean(off[sure & lit] < 0.5) > 0.92
        assert np.median(off[sure & lit]) < 0.15


def test_random_codes_tell_both_axes(world):
    pictures = random_binary(SIZE, 60)
    photos = np.array([photo.mean(axis=-1) for photo in photograph(world, pictures)])
    sequences = photos.reshape(len(photos), -1).T.astype(np.float64)
    codes = [prepare_codes(np.array(pictures) / np.float32(255), np.zeros(60, dtype=int))]
    found = find_places(sequences, codes, typical_misfit(sequences, codes))
    sure, lit = is_lit(found, sequences), world.lit.ravel()
    off = np.abs(found.place - world.correspondence.reshape(-1, 2)).max(axis=1)
    assert sure[lit].mean() > 0.9
    assert np.mean(off[sure & lit] < 0.5) > 0.95
    # Elsewhere near-range light may stand out as direct light does.
    assert sure[~lit].sum() <= 0.35 * np.count_nonzero(~lit)


@pytest.mark.parametrize("name", SETS)
def test_neither_offset_nor_albedo_matters(name):
    generator = np.random.default_rng(0)
    pictures = SETS[name](1)
    codes, levels = _codes(pictures, 1), _levels(pictures, 1)[:, 0]
    place = generator.uniform(1, SIDE - 2, 200)
    left = np.floor(place).astype(int)
    share = place - left
    clean = (levels[:, left] * (1 - share) + levels[:, left + 1] * share).T.astype(np.float64)
    plain = find_places(clean, codes, 1e-4)
    np.testing.assert_allclose(plain.place[:, 1], place, atol=0.02)
    np.testing.assert_array_equal(plain.place[:, 0], 0)
    scaled = clean * generator.uniform(0.01, 5, (200, 1)) + generator.uniform(0, 3, (200, 1))
    changed = find_places(scaled, codes, 1e-4)
    np.testing.assert_allclose(changed.place, plain.place, atol=2e-3)
    np.testing.assert_allclose(changed.confidence, plain.confidence, atol=0.05)


def test_contrast_may_differ_between_two_levels_and_many():
    pictures = [*gray_code(SIZE, 1), *white_and_black(SIZE), *fringes(SIZE, 1, [16], 3)]
    groups = [0] * 7 + [1] * 3
    codes, levels = _codes(pictures, 1, groups), _levels(pictures, 1)[:, 0]
    sequences = levels.T.astype(np.float64)
    sequences[:, 7:] = 0.2 + 0.3 * sequences[:, 7:]
    found = find_places(sequences, codes, 1e-4)
    np.testing.assert_allclose(found.place[:, 1], np.arange(SIDE), atol=1e-3)
    np.testing.assert_allclose(found.explained, 1.0, atol=1e-5)


def test_codes_that_repeat_tell_no_place():
    pictures = fringes(SIZE, 1, [8], 4)
    codes = _codes(pictures, 1)
    found = find_places(_levels(pictures, 1)[:, 0].T.astype(np.float64), codes, 1e-4)
    assert found.confidence.max() < 0.5


def test_places_that_share_a_code_are_their_middle():
    cells = np.repeat(np.arange(8), 4)
    pictures = with_inverses(
        [as_picture(np.tile((cells ^ cells >> 1) >> bit & 1, (SIDE, 1))) for bit in range(3)]
    )
    codes = _codes(pictures, 1)
    found = find_places(_levels(pictures, 1)[:, 0].T.astype(np.float64), codes, 1e-4)
    np.testing.assert_allclose(found.place[:, 1], cells * 4 + 1.5, atol=1e-4)


def test_noise_alone_is_no_direct_light():
    generator = np.random.default_rng(0)
    pictures = with_inverses(gray_code(SIZE, 1))
    codes = _codes(pictures, 1)
    noise = generator.normal(1.0, 0.01, (4000, len(pictures)))
    assert not is_lit(find_places(noise, codes, 1e-3), noise).any()


@pytest.mark.parametrize(
    "pictures", [white_and_black(SIZE), gray_code(SIZE, 1)[:2], [gray_code(SIZE, 1)[0]] * 6]
)
def test_patterns_that_cannot_tell_places_are_refused(pictures):
    with pytest.raises(InputError, match="too few to tell places"):
        _codes(pictures, 1)


@pytest.mark.parametrize(
    ("order", "words"),
    [
        (lambda n: np.arange(n)[::-1], "reverse"),
        (lambda n: np.roll(np.arange(n), 1), "one place too late"),
        (lambda n: np.roll(np.arange(n), -2), "2 places too early"),
        (lambda n: np.array(sorted(range(n), key=str)), "names as text"),
        (lambda n: np.arange(n).reshape(-1, 2)[:, ::-1].ravel(), "swapped with the one of its"),
        (lambda n: np.arange(n).reshape(-1, 2).T.ravel(), "stand"),
    ],
)
def test_photos_in_another_order_are_noticed_and_named(order, words):
    generator = np.random.default_rng(0)
    pictures = [*with_inverses(gray_code(SIZE, 1)), *fringes(SIZE, 1, [32, 8], 4)]
    codes, levels = _codes(pictures, 1), _levels(pictures, 1)[:, 0]
    places = generator.integers(0, SIDE, 500)
    right = 0.1 + 0.5 * levels[:, places].T.astype(np.float64)
    right += generator.normal(0, 0.005, right.shape)
    every = np.arange(len(pictures))
    assert explained_share(right, codes) > 0.95
    taken = right[:, order(len(pictures))]
    assert explained_share(taken, codes) < FOLLOWED
    found = find_order(taken, every, codes, len(pictures))
    assert found is not None
    assert words in found.description
    np.testing.assert_allclose(taken[:, found.numbers], right)
