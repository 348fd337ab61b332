"""Plans for the scene of a look: window and frequencies by what was seen."""

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.illumination.frequencies import DC
from nearfar.plan.by_look import plan_by_look
from nearfar.plan.candidates import lowest_first
from nearfar.plan.codes import count_of_codes
from nearfar.plan.look import LARGEST_FREE_SHARE, Look
from nearfar.plan.patterns import Sinusoid
from nearfar.priors.component import PriorComponent
from nearfar.priors.fitted import FREE, TYPICAL_SCENES
from nearfar.priors.typical import TypicalScenes

PROJECTOR = Size(8, 8)
NEEDED = count_of_codes(PROJECTOR) + 4


FREE_ROWS = TypicalScenes(((PriorComponent(0.0, 64.0, FREE), 0.01),), np.ones((1, 1)), np.ones(1))


def look(*, holds, noise=0.011):
    share = LARGEST_FREE_SHARE + (-0.01 if holds else 0.01)
    typical = TYPICAL_SCENES if holds else FREE_ROWS
    return Look(typical, noise, window=3, reach=0.5, wanted_window=5, free_share=share)


@pytest.mark.parametrize("holds", [True, False])
def test_codes_are_planned_after_a_look_as_without(holds):
    plan = plan_by_look(PROJECTOR, NEEDED + 2, look(holds=holds))
    assert plan.is_by_codes
    assert not plan.is_of_lamps
    assert plan.window == (5 if holds else 3)
    assert plan_by_look(PROJECTOR, NEEDED, look(holds=holds), checked=False).is_by_codes
    with_window = plan_by_look(PROJECTOR, NEEDED + 2, look(holds=holds), window=7)
    assert (with_window.window, with_window.is_by_codes) == (7, True)
    assert not plan_by_look(PROJECTOR, NEEDED - 1, look(holds=holds)).is_by_codes


def test_codes_tell_a_projector_pixel_with_half_the_variance_of_sinusoids():
    def variance(photos):
        plan = plan_by_look(PROJECTOR, photos, look(holds=False), checked=False)
        light = np.stack([plan.draw(i).ravel() / 255 for i in range(photos)])
        with_black = np.concatenate([np.ones((len(light), 1)), light], axis=1)
        inverse = np.linalg.pinv(with_black)[1:]
        return np.mean(np.sum(inverse**2, axis=1))

    assert 0.4 < variance(NEEDED) / variance(NEEDED - 1) < 0.6


def test_light_with_outlines_is_planned_for_at_every_frequency_where_noise_allows():
    outlined = PriorComponent(0.0, 64.0, FREE, far_power=1.5)
    seen = TypicalScenes(((outlined, 0.01),), np.ones((1, 1)), np.ones(1))
    projector, photos = Size(15, 15), 120
    lowest = lowest_first(projector)

    def shown(noise):
        planned = Look(seen, noise, window=3, reach=None, wanted_window=3, free_share=0.0)
        plan = plan_by_look(projector, photos, planned)
        return [p.frequency for p in plan.patterns if isinstance(p, Sinusoid) and p.frequency != DC]

    # As many of the lowest as there are photos for, and none twice.
    with_little_noise = shown(0.0025)
    assert set(with_little_noise) == set(lowest[: len(set(with_little_noise))])
    assert len(with_little_noise) == 2 * len(set(with_little_noise))
    # With much noise the photos are worth more where most of the light is.
    assert len(set(shown(0.2))) < len(set(with_little_noise)) / 2
