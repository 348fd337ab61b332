"""How finely pictures are relit while the light moves."""

import pytest

from nearfar.viewer.pace import Pace


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
