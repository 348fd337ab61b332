"""Plans that are chosen for a number of photos."""

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.errors import PlanError
from nearfar.illumination.frequencies import CHECKERBOARD, DC
from nearfar.plan import choose_plan, parse_plan
from nearfar.plan.choose import LEAST_PHOTOS, candidates, choose_frequencies, default_window


@pytest.mark.parametrize("photos", [LEAST_PHOTOS, 61, 150])
@pytest.mark.parametrize("projector", [Size(16, 20), Size(31, 24), Size(33, 33)])
def test_a_plan_takes_no_more_photos_than_asked_for(projector, photos):
    plan, expected = choose_plan(projector, photos)
    assert photos - 1 <= len(plan.patterns) <= photos
    assert sum(plan.counts.values()) == len(plan.patterns)
    assert plan.counts["direct"] >= 1
    assert plan.counts["correspondence"] == 0
    assert (plan.offset, plan.correspondence) == ("reference", "phase")
    assert np.isfinite(expected).all()
    assert parse_plan(plan.to_json()) == plan
    for index in range(len(plan.patterns)):
        assert plan.draw(index).shape == projector


def test_every_chosen_frequency_has_its_cosine_and_its_sine():
    plan, _ = choose_plan(Size(16, 20), 60)
    shown = [(p.frequency, p.kind) for p in plan.patterns if p.frequency != DC]
    for frequency, kind in shown:
        if not frequency.is_own_negative:
            other = "sine" if kind == "cosine" else "cosine"
            assert shown.count((frequency, kind)) == shown.count((frequency, other))


def test_candidates_lie_on_the_grid_of_the_projector():
    projector = Size(20, 34)
    for k in candidates(projector, 7):
        assert k == CHECKERBOARD or (
            (k.fy * projector.height).denominator == 1 and (k.fx * projector.width).denominator == 1
        )
        assert k != DC


def test_more_photos_are_expected_to_do_better():
    expected = [choose_frequencies(Size(24, 24), n, 5).expected for n in (40, 80, 160)]
    assert np.all(np.diff([e.pictures for e in expected]) > 0)
    assert np.all(np.diff([e.random for e in expected]) > 0)


def test_the_lowest_frequencies_come_first_and_are_repeated():
    chosen = choose_frequencies(Size(32, 32), 200, 7).frequencies
    cycles = {k: max(abs(k.fy), abs(k.fx)) * 32 for k in chosen}
    repeated = [cycles[k] for k, count in chosen.items() if count > 1 and k != CHECKERBOARD]
    assert min(repeated) == 1
    assert np.mean(repeated) < np.mean(list(cycles.values()))


def test_more_noise_asks_for_more_repeats():
    quiet, loud = (choose_frequencies(Size(24, 24), 120, 5, noise=n) for n in (0.002, 0.05))
    assert len(loud.frequencies) < len(quiet.frequencies)


@pytest.mark.parametrize("side", [8, 64, 68, 128, 1080])
def test_the_default_window_is_odd_and_fits(side):
    window = default_window(Size(side, 2 * side))
    assert window % 2 == 1
    assert 1 <= window <= min(side, 25)


@pytest.mark.parametrize(
    ("projector", "photos", "window", "said"),
    [
        (Size(16, 16), 8, None, "too few"),
        (Size(4, 64), 60, None, "no pattern grid"),
        (Size(16, 20000), 60, None, "no pattern grid"),
        (Size(16, 16), 60, 17, "W = 17 does not fit"),
    ],
)
def test_what_cannot_be_chosen_is_said(projector, photos, window, said):
    with pytest.raises(PlanError, match=said):
        choose_plan(projector, photos, window=window)
