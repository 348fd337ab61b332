"""Plans for the scene of a look: sinusoids where a model holds, codes where none does."""

from itertools import count

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.plan.by_look import plan_by_look
from nearfar.plan.lamps import photos_of_every_code, plan_lamps
from nearfar.plan.look import LARGEST_FREE_SHARE, Look
from nearfar.plan.patterns import LampCode
from nearfar.priors.fitted import TYPICAL_SCENES

PROJECTOR = Size(8, 8)
NEEDED = photos_of_every_code(PROJECTOR)


def look(*, holds):
    share = LARGEST_FREE_SHARE + (-0.01 if holds else 0.01)
    return Look(TYPICAL_SCENES, 0.011, window=3, reach=0.5, wanted_window=5, free_share=share)


def test_codes_are_planned_where_no_model_holds_and_photos_suffice():
    plan = plan_by_look(PROJECTOR, NEEDED, look(holds=False))
    assert plan == plan_lamps(PROJECTOR, NEEDED)
    for planned in (
        plan_by_look(PROJECTOR, NEEDED - 1, look(holds=False)),
        plan_by_look(PROJECTOR, NEEDED, look(holds=True)),
        # A window was asked for, which codes know nothing of.
        plan_by_look(PROJECTOR, NEEDED, look(holds=False), window=3),
    ):
        assert not planned.is_of_lamps
        assert planned.correspondence == "phase"
    assert plan_by_look(PROJECTOR, NEEDED, look(holds=True)).window == 5


@pytest.mark.parametrize("checked", [True, False])
@pytest.mark.parametrize("projector", [Size(1, 11), Size(8, 8), Size(12, 13)])
def test_the_fewest_photos_of_every_code_are_told(projector, checked):
    def codes(photos):
        shown = plan_lamps(projector, photos, checked=checked).patterns
        found = [p for p in shown if isinstance(p, LampCode) and p.purpose == "direct"]
        return len({p.row for p in found}), found[0].order

    needed = photos_of_every_code(projector, checked=checked)
    assert codes(needed)[0] == codes(needed)[1]
    assert needed == next(n for n in count(needed // 2) if codes(n)[0] == codes(n)[1])


def test_more_lamps_than_can_be_told_have_no_codes():
    assert photos_of_every_code(Size(65, 65)) is None


def test_codes_tell_a_projector_pixel_with_half_the_variance_of_sinusoids():
    def variance(plan):
        used = [i for i, p in enumerate(plan.patterns) if p.purpose != "check"]
        light = np.stack([plan.draw(i).ravel() / 255 for i in used])
        with_black = np.concatenate([np.ones((len(light), 1)), light], axis=1)
        inverse = np.linalg.pinv(with_black)[1:]
        return np.mean(np.sum(inverse**2, axis=1))

    codes, sinusoids = (
        variance(plan_by_look(PROJECTOR, NEEDED, look(holds=False), window=window))
        for window in (None, 3)
    )
    assert 0.4 < codes / sinusoids < 0.6
