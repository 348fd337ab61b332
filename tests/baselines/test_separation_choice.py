"""Which patterns separate."""

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.baselines.separation_choice import choose_patterns
from nearfar.plan.recognition import recognise
from tests.shown import fringes, white_and_black


@pytest.mark.parametrize("size", [Size(1, 32), Size(24, 32)])
def test_all_phases_of_a_frequency_are_taken_or_none(size):
    periods, steps = [32 / cycles for cycles in range(1, 9)], 4
    pictures = [*fringes(size, 1, periods, steps), *white_and_black(size)]
    shown = [np.asarray(picture, np.float32) / np.float32(255) for picture in pictures]
    choice = choose_patterns(recognise(shown), lambda number: shown[number])
    for numbers in (*choice.left_out.values(), [p.number for p in choice.structured]):
        counts = np.bincount(np.array(numbers) // steps, minlength=len(periods))
        assert set(counts) <= {0, steps}
    assert min(pattern.period for pattern in choice.structured) == pytest.approx(4, abs=0.01)
