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
    return judge_free_rows(photos[:, None], patterns, used, np.array(checks, dtype=int), None)


@pytest.mark.parametrize("count", [10, 40, 80])
def test_errors_of_held_out_photos_are_what_the_error_bars_expect(world, count):
    verdict = _judge(world, _patterns(count))
    assert verdict.expected_snr == pytest.approx(verdict.held_out_snr, abs=1)
    assert verdict.widening == 1.0


def test_check_photos_are_judged_by_where_there_are_any(world):
    verdict = _judge(world, _patterns(40), checks=[3, 30])
    assert verdict.grade == "good"
    assert verdict.checked_by == "lights of the check photos"


def test_where_every_photo_is_needed_nothing_is_checked(world):
    verdict = _judge(world, np.concatenate([np.eye(LAMPS), np.zeros((1, LAMPS))]))
    assert verdict.causes == ("unchecked",)
    assert verdict.held_out_snr is None


def test_a_bent_response_is_in_the_held_out_photos_and_in_the_error_bars(world):
    bent, straight = (_judge(world, _patterns(80), bent=bent) for bent in (0.5, 0.0))
    assert bent.held_out_snr < straight.held_out_snr - 3
    assert bent.expected_snr < straight.expected_snr - 3
