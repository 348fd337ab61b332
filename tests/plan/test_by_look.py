"""Plans for the scene of a look: sinusoids where a model holds, codes where none does."""

from itertools import count

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.illumination.frequencies import DC
from nearfar.plan.by_look import plan_by_look
from nearfar.plan.candidates import lowest_first
from nearfar.plan.expect import expected_of_codes
from nearfar.plan.lamps import photos_of_every_code, plan_lamps, shares_of_photos
from nearfar.plan.look import LARGEST_FREE_SHARE, Look
from nearfar.plan.patterns import LampCode, Sinusoid
from nearfar.plan.references import FEWEST
from nearfar.priors.component import PriorComponent
from nearfar.priors.fitted import FREE, TYPICAL_SCENES
from nearfar.priors.typical import TypicalScenes

PROJECTOR = Size(8, 8)
NEEDED = photos_of_every_code(PROJECTOR)


FREE_ROWS = TypicalScenes(((PriorComponent(0.0, 64.0, FREE), 0.01),), np.ones((1, 1)), np.ones(1))


def look(*, holds, noise=0.011):
    share = LARGEST_FREE_SHARE + (-0.01 if holds else 0.01)
    typical = TYPICAL_SCENES if holds else FREE_ROWS
    return Look(typical, noise, window=3, reach=0.5, wanted_window=5, free_share=share)


def test_codes_are_planned_where_nothing_is_known_of_rows_and_photos_suffice():
    plan = plan_by_look(PROJECTOR, NEEDED, look(holds=False))
    assert plan.is_of_lamps
    assert plan.patterns == plan_lamps(PROJECTOR, NEEDED).patterns
    for planned in (
        plan_by_look(PROJECTOR, NEEDED - 1, look(holds=False)),
        # What is known of rows before any photo is worth more than their power.
        plan_by_look(PROJECTOR, NEEDED, look(holds=True, noise=0.05)),
        # A window was asked for, which codes know nothing of.
        plan_by_look(PROJECTOR, NEEDED, look(holds=False), window=3),
    ):
        assert not planned.is_of_lamps
        assert planned.correspondence == "phase"
    assert plan_by_look(PROJECTOR, NEEDED, look(holds=True, noise=0.05)).window == 5


def test_without_noise_codes_are_planned_for_any_scene():
    plan = plan_by_look(PROJECTOR, NEEDED, look(holds=True, noise=1e-5))
    assert plan.is_of_lamps
    assert plan.expected_snr.pictures[0] > 80


def test_the_expectation_is_what_least_squares_leave_of_noise():
    plan = plan_lamps(PROJECTOR, NEEDED, checked=False)
    light = np.stack([plan.draw(i).ravel() / 255 for i in range(NEEDED)])
    inverse = np.linalg.pinv(np.concatenate([np.ones((NEEDED, 1)), light], axis=1))[1:]
    # The response to a sinusoid is twice a photo, and has twice its noise; white is 1.
    noise = 0.01
    covariance = (noise / 2) ** 2 * inverse @ inverse.T * PROJECTOR.pixels
    shown = np.random.default_rng(0).random((4000, PROJECTOR.pixels))
    error = np.einsum("np,pq,nq->n", shown, covariance, shown).mean() / PROJECTOR.pixels
    found = 10 * np.log10(np.mean(shown.mean(axis=1) ** 2 + 1 / 12) / error)
    references, _, codes = shares_of_photos(PROJECTOR, NEEDED, checked=False)
    expected = expected_of_codes(PROJECTOR, codes, references, noise).random
    assert expected == pytest.approx(found, abs=0.5)


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


def test_references_and_checks_leave_room_for_all_codes():
    order = shares_of_photos(PROJECTOR, NEEDED, checked=True).codes
    for photos in range(NEEDED, 2 * NEEDED):
        shares = shares_of_photos(PROJECTOR, photos, checked=True)
        assert 2 * shares.references + shares.checks + shares.codes == photos
        assert shares.codes >= order
        assert shares.references >= FEWEST
        assert shares.checks >= 1
