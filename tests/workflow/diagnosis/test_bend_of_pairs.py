"""The bend of the response, told by photos of inverse patterns whatever was estimated."""

from types import SimpleNamespace

import numpy as np
import pytest

from nearfar.plan.patterns import HalfScreen, Picture
from nearfar.workflow.diagnosis.bend_of_pairs import bend_of_pairs
from nearfar.workflow.diagnosis.misfit import PhotoFits

PAIRS = (
    HalfScreen(kind="left half-screen"),
    Picture(seed=1),
    HalfScreen(kind="left half-screen", inverse=True),
    Picture(seed=1, inverse=True),
)
SHAPE = (30, 40, 2)
NOISE = 0.01


def bent(seed, bend, *, patterns=PAIRS, error=0.05):
    """Return fits of a wrong estimate to photos by a camera whose response bends."""
    generator = np.random.default_rng(seed)
    white = generator.uniform(0.2, 0.9, SHAPE)
    known = [generator.uniform(0, 1, SHAPE) * white for _ in range(2)]
    light = np.stack([*known, *(white - each for each in known)])
    wrong = [each + error * generator.normal(size=SHAPE) for each in known]
    relit = np.stack([*wrong, *(white - each for each in wrong)])
    read = light + bend * light * (light - white / 2) / white.max()
    # White itself reads what the response makes of it.
    white = white + bend * white * (white / 2) / white.max()
    relit[2:] = white - relit[:2]
    photos = read + NOISE * generator.normal(size=light.shape)
    count = len(patterns)
    return PhotoFits(
        photos[:count],
        relit[:count],
        np.full(photos[:count].shape, NOISE**2),
        np.zeros(SHAPE),
        white,
        without_drift=SimpleNamespace(plan=SimpleNamespace(patterns=patterns)),
    )


@pytest.mark.parametrize("bend", [-0.05, 0.05])
def test_the_bend_is_found_beside_a_wrong_estimate(bend):
    assert bend_of_pairs(bent(0, bend)).size == pytest.approx(bend, abs=0.008)


def test_a_linear_response_has_none_within_its_deviation():
    found = [bend_of_pairs(bent(seed, 0.0)) for seed in range(30)]
    scaled = [each.size / each.deviation for each in found]
    assert np.std(scaled) == pytest.approx(1.0, abs=0.35)
    assert abs(np.mean(scaled)) < 0.7


def test_without_pairs_nothing_is_told():
    assert bend_of_pairs(bent(0, 0.05, patterns=PAIRS[:2])) is None


def test_all_pairs_share_a_bend_and_a_photo_under_other_exposure_bends_its_own_alone():
    fits = bent(0, -0.08, error=0.0)
    assert bend_of_pairs(fits).shared == pytest.approx(0.08, abs=0.01)
    good = bent(0, 0.0, error=0.0)
    good.photos[0] *= 1.1
    found = bend_of_pairs(good)
    assert abs(found.size) > 0.03
    assert found.shared < 0.005


def test_one_pair_shares_nothing():
    patterns = (PAIRS[0], Picture(seed=3), PAIRS[2], Picture(seed=4, inverse=True))
    found = bend_of_pairs(bent(0, -0.08, patterns=patterns, error=0.0))
    assert found.size < -0.05
    assert found.shared == 0.0
