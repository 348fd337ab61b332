"""How finely pictures are relit while the light moves."""

import itertools

import pytest

from nearfar.viewer.pace import FIRST_PATIENCE, Pace


def _rate(pace, pictures, seconds_of_level):
    """Let pictures take as long as their level does; returns the levels."""
    levels = []
    for _ in range(pictures):
        levels.append(pace.level)
        pace.took(seconds_of_level(pace.level))
    return levels


@pytest.mark.parametrize("finest", [0.001, 0.03, 0.06, 0.1, 0.25, 0.9])
def test_pictures_come_ten_times_a_second_wherever_some_level_allows_it(finest):
    # A level has a fourth of the camera pixels of the one before.
    def seconds(level):
        return finest / 4**level

    levels = _rate(Pace(3), 20, seconds)
    assert len(set(levels[3:])) == 1
    assert seconds(levels[-1]) < 0.1
    # Not more coarsely than that takes.
    assert levels[-1] == 0 or seconds(levels[-1] - 1) > 1 / 15


def test_pictures_become_fine_again_once_the_machine_is_idle():
    pace = Pace(3)
    assert _rate(pace, 5, lambda _level: 1.0)[-1] == 2
    assert _rate(pace, 5, lambda level: 0.01 / 4**level)[-1] == 0


def test_a_finer_level_is_tried_again_and_ever_more_rarely_if_it_is_too_fine():
    # The page's screen takes 20 ms, and the finest level is too fine by far.
    pace = Pace(2)
    levels = _rate(pace, 40 * FIRST_PATIENCE, lambda level: 0.2 if level == 0 else 0.02)
    trials = [n for n, level in enumerate(levels) if level == 0]
    waits = [after - before for before, after in itertools.pairwise(trials)]
    assert len(waits) > 2
    assert all(longer > 1.5 * shorter for shorter, longer in itertools.pairwise(waits))
    # Once it is not, it stays.
    assert _rate(pace, 40 * FIRST_PATIENCE, lambda _level: 0.02)[-1] == 0


def test_one_late_picture_changes_nothing():
    pace = Pace(3)
    for seconds in [0.02, 0.1] * 50:
        pace.took(seconds)
    assert pace.level == 0
