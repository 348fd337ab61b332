"""Verdicts on free rows."""

import numpy as np
import pytest

from nearfar.workflow.verdict.free_rows import judge_free_rows

LAMPS, PIXELS, NOISE = 16, 4000, 0.002


@pytest.fixture(scope="module")
def world():
    return 0.02 + 0.004 * np.random.default_rng(0).normal(size=(PIXELS, LAMPS))


def _patterns(count, dark=2):
    codes = np.random.default_rng(1).integers(0, 2, (count, LAMPS)).astype(float)
    return np.concatenate([codes, np.zeros((dark, LAMPS))])


def _judge(world, patterns, checks=(), *, bent=0.0):
    exact = world @ patterns.T
    exact = exact - bent * exact**2 / exact.max() + 0.05
    photos = exact + NOISE * np.random.default_rng(2).normal(size=exact.shape)
    used = np.setdiff1d(np.arange(len(patterns)), checks)
    checks = np.array(checks, dtype=int)
    return judge_free_rows(photos[:, None], patterns, used, checks, None)


@pytest.mark.parametrize("count", [10, 40, 80])
def test_errors_of_held_out_photos_are_what_the_error_bars_expect(world, count):
    verdict = _judge(world, _patterns(count)).verdict
    assert verdict.expected_snr == pytest.approx(verdict.held_out_snr, abs=1)
    assert verdict.widening == 1.0


def test_check_photos_are_judged_by_where_there_are_any(world):
    verdict, lights = _judge(world, _patterns(40), checks=[3, 30])
    assert [light.photo for light in lights] == [3, 30]
    assert verdict.grade == "good"
    assert verdict.checked_by == "lights of the check photos"


def test_where_every_photo_is_needed_nothing_is_checked(world):
    verdict, lights = _judge(world, np.concatenate([np.eye(LAMPS), np.zeros((1, LAMPS))]))
    assert not lights
    assert verdict.causes == ("unchecked",)
    assert verdict.held_out_snr is None


def test_a_bent_response_is_in_the_held_out_photos_and_in_the_error_bars(world):
    bent, straight = (_judge(world, _patterns(80), bent=bent).verdict for bent in (0.5, 0.0))
    assert bent.held_out_snr < straight.held_out_snr - 3
    assert bent.expected_snr < straight.expected_snr - 3


def test_a_photo_that_is_not_of_its_pattern_stands_out_among_the_held_out_ones(world):
    patterns = _patterns(40)
    shown = patterns.copy()
    shown[30] = 1 - shown[30]
    generator = np.random.default_rng(2)
    photos = world @ shown.T + 0.05 + NOISE * generator.normal(size=(PIXELS, len(shown)))
    checks = np.array([3, 17, 30])
    used = np.setdiff1d(np.arange(len(patterns)), checks)
    lights = judge_free_rows(photos[:, None], patterns, used, checks, None).lights
    of = {light.photo: light for light in lights}
    # What is off is the light of lamps that were on instead of others, over the light of those.
    off = (patterns[30] - shown[30]) @ world.T
    known = 10 * np.log10(np.mean((shown[30] @ world.T) ** 2) / np.mean(off**2))
    assert of[30].snr == pytest.approx(known, abs=0.5)
    assert min(of[3].snr, of[17].snr) > of[30].snr + 10
    for photo in (3, 17):
        assert of[photo].snr == pytest.approx(of[photo].expected_snr, abs=1)
