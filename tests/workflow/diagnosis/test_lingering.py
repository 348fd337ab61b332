"""Patterns that linger are told by photos of white alone, which all must tell the same share."""

import numpy as np
import pytest

from nearfar.faults.of_photos import PatternsLinger
from nearfar.workflow.diagnosis.lingering import find_lingering_patterns
from nearfar.workflow.diagnosis.misfit import Fits

PHOTOS, WHITES = 60, np.array([1, 20, 40, 58])
NOISE, CAMERA = 0.005, (20, 24)


def fits_of(shares, *, gains=None, dark=(), seed=0):
    """Return fits of photos that hold shares of the one before, and gains of the lamp by photo.

    The numbers in `dark` are photos of black.
    """
    rng = np.random.default_rng(seed)
    white = rng.uniform(0.3, 0.8, (*CAMERA, 3))
    relit = white * rng.uniform(0.2, 0.8, (PHOTOS, *CAMERA, 3))
    relit[WHITES], relit[list(dark)] = white, 0.0
    shares = np.broadcast_to(shares, PHOTOS)[:, None, None, None]
    photos = relit.copy()
    photos[1:] = (1 - shares[1:]) * relit[1:] + shares[1:] * relit[:-1]
    if gains is not None:
        photos *= gains[:, None, None, :]
    photos += NOISE * rng.standard_normal(photos.shape)
    return Fits(photos, relit, np.full_like(photos, NOISE**2), np.zeros_like(white), white)


@pytest.mark.parametrize("share", [0.01, 0.02, 0.2])
def test_the_share_of_the_pattern_before_is_told(share):
    (found,) = find_lingering_patterns(fits_of(share), WHITES)
    assert found.share == pytest.approx(share, rel=0.1)
    assert isinstance(found, PatternsLinger)
    assert f"{found.share:.1%} of the pattern before" in str(found)


@pytest.mark.parametrize("seed", range(20))
def test_noise_and_drift_of_each_channel_are_no_lingering_pattern(seed):
    gains = 1 + np.linspace(0, 0.3, PHOTOS)[:, None] * [1.0, 0.5, -0.5]
    assert find_lingering_patterns(fits_of(0.0, gains=gains, seed=seed), WHITES) == []


def test_a_drift_of_each_channel_does_not_hide_it():
    gains = 1 + np.linspace(0, 0.1, PHOTOS)[:, None] * [1.0, 0.5, -0.5]
    (found,) = find_lingering_patterns(fits_of(0.02, gains=gains), WHITES)
    assert found.share == pytest.approx(0.02, rel=0.15)


@pytest.mark.parametrize(
    "shares",
    [
        pytest.param(np.where(np.arange(PHOTOS) == 20, 0.1, 0.0), id="in one photo of white"),
        pytest.param(np.where(np.arange(PHOTOS) == 20, 0.0, 0.1), id="in all but one of white"),
        pytest.param(-0.02, id="less than none"),
        pytest.param(0.002, id="hardly any"),
    ],
)
def test_where_photos_of_white_do_not_all_hold_it_nothing_lingers(shares):
    assert find_lingering_patterns(fits_of(shares), WHITES) == []


def test_photos_of_white_after_black_or_too_few_of_them_tell_nothing():
    # Less light than there was is another lamp.
    after_black = fits_of(0.05, dark=WHITES - 1)
    assert find_lingering_patterns(after_black, WHITES) == []
    mostly = fits_of(0.05, dark=WHITES[:2] - 1)
    assert find_lingering_patterns(mostly, WHITES) == []
    one = fits_of(0.05, dark=WHITES[:1] - 1)
    assert len(find_lingering_patterns(one, WHITES)) == 1
    assert find_lingering_patterns(fits_of(0.05), WHITES[:2]) == []


def test_photos_without_light_tell_nothing():
    fits = fits_of(0.05)
    nothing = np.zeros_like(fits.relit)
    dark = Fits(nothing, nothing, fits.variance, fits.black, np.zeros_like(fits.white))
    assert find_lingering_patterns(dark, WHITES) == []
