"""Changes of exposure of single photos, beside what a wrong model looks like."""

from types import SimpleNamespace

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.plan.patterns import HalfScreen
from nearfar.workflow.diagnosis.explanations import exposure_change
from nearfar.workflow.diagnosis.misfit import PhotoFits

HALVES = (HalfScreen(kind="left half-screen"), HalfScreen(kind="left half-screen", inverse=True))
SHAPE = (12, 15, 2)
NOISE = 1e-3


def _fits(photos, relit):
    draw = np.random.default_rng(8)
    noisy = photos + NOISE * draw.normal(size=photos.shape)
    black = np.zeros(SHAPE)
    variance = np.full(photos.shape, NOISE**2)
    plan = SimpleNamespace(patterns=HALVES[: len(photos)], projector=Size(8, 8))
    of_plan = SimpleNamespace(plan=plan)
    return PhotoFits(noisy, relit, variance, black, np.ones(SHAPE), without_drift=of_plan)


def _relit():
    share = np.random.default_rng(3).uniform(0.1, 0.9, SHAPE)
    return np.stack([share, 1.0 - share])


@pytest.mark.parametrize("changed", [[0], [1], [0, 1]])
def test_a_change_of_exposure_is_found_beside_its_inverse(changed):
    relit = _relit()
    photos = relit.copy()
    photos[changed] *= 0.98
    fits = _fits(photos, relit)
    for number in changed:
        found = exposure_change(fits, number)
        assert found.gain == pytest.approx(-0.02, abs=1e-3)
        assert found.misfit == pytest.approx(1.0, abs=0.2)


def test_photos_that_sum_to_white_were_not_exposed_otherwise():
    relit = _relit()
    wrong = 0.02 * relit[0]
    photos = relit + np.stack([-wrong, wrong])
    for number in (0, 1):
        assert exposure_change(_fits(photos, relit), number).misfit == np.inf
    # Alone, the same photo is explained by an exposure.
    assert exposure_change(_fits(photos[:1], relit[:1]), 0).misfit == pytest.approx(1.0, abs=0.2)


@pytest.mark.parametrize(("gain", "misfit"), [(-0.9, pytest.approx(1.0, abs=0.2)), (-1.5, np.inf)])
def test_no_exposure_takes_away_more_than_all_light(gain, misfit):
    # As of a photo of another pattern, bright where its own is dark.
    relit = _relit()[:1]
    assert exposure_change(_fits((1 + gain) * relit, relit), 0).misfit == misfit
