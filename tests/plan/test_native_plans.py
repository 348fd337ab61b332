"""Plans for every projector pixel: chosen as for a grid of cells, with high frequencies besides."""

import hashlib
import json

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.errors import PlanError
from nearfar.illumination.frequencies import DC, as_array
from nearfar.illumination.pictures import natural_picture, random_pattern
from nearfar.plan import Plan, choose, choose_plan, parse_plan, pitch_of
from nearfar.plan.candidates import candidates, high_frequencies
from nearfar.plan.expect import (
    TYPICAL_DIRECT_DEVIATION,
    TYPICAL_Q_DEVIATION,
    ErrorsTogether,
    errors_of_place,
    waves_on_window,
)
from nearfar.plan.low_rank import ErrorsLowRank
from nearfar.plan.patterns import Sinusoid
from nearfar.priors.fitted import TYPICAL_SCENES

FULL_HD, ULTRA_HD = Size(1080, 1920), Size(2160, 3840)


def _shown(plan: Plan, purposes: tuple[str, ...] = ("direct", "near", "far")):
    return list(
        dict.fromkeys(
            p.frequency
            for p in plan.patterns
            if isinstance(p, Sinusoid) and p.frequency != DC and p.purpose in purposes
        )
    )


# Of the patterns that were chosen before there was a pitch. On these grids no two candidates are
# worth the same within rounding, so that every processor chooses alike.
@pytest.mark.parametrize(
    ("projector", "photos", "digest"),
    [
        (Size(31, 24), 61, "fef31c9b62234f4d"),
        (Size(48, 64), 200, "3f37ddde1f346490"),
        (Size(1, 64), 60, "bc1c6abf1f480261"),
    ],
)
def test_plans_of_single_pixels_are_what_they_always_were(projector, photos, digest):
    plan, _ = choose_plan(projector, photos)
    patterns = json.dumps(json.loads(plan.to_json())["patterns"])
    assert plan.pitch == 1
    assert hashlib.sha256(patterns.encode()).hexdigest()[:16] == digest


@pytest.mark.parametrize(("projector", "photos"), [(Size(24, 31), 61), (Size(1, 64), 60)])
def test_thin_products_choose_plans_as_good_as_whole_covariances(projector, photos, monkeypatch):
    _, by_whole = choose_plan(projector, photos)
    monkeypatch.setattr(choose, "MOST_WHOLE", 0.0)
    plan, by_thin = choose_plan(projector, photos)
    assert plan.pitch == 1
    np.testing.assert_allclose(by_thin, by_whole, rtol=1e-8)


@pytest.mark.parametrize(
    ("projector", "photos", "is_whole"),
    [
        (Size(64, 64), 468, True),
        (Size(68, 100), 261, True),
        (Size(96, 96), 300, False),
        (Size(128, 128), 150, False),
    ],
)
def test_large_plans_are_chosen_by_thin_products(projector, photos, is_whole, monkeypatch):
    asked = RuntimeError("asked")

    def refuse(*_arguments: object) -> None:
        raise asked

    chosen_by = "ErrorsTogether" if is_whole else "ErrorsLowRank"
    monkeypatch.setattr(choose, chosen_by, refuse)
    with pytest.raises(RuntimeError, match="asked"):
        choose_plan(projector, photos)


@pytest.mark.parametrize(
    ("projector", "photos", "pitch"),
    [
        (Size(129, 200), 60, 2),
        (Size(257, 301), 24, 4),
        (FULL_HD, 100, 16),
        (ULTRA_HD, 60, 32),
        (Size(1, 640), 60, 8),
    ],
)
def test_a_plan_of_a_fine_projector_lies_on_its_frequencies(projector, photos, pitch):
    plan, expected = choose_plan(projector, photos)
    assert photos - 1 <= len(plan.patterns) <= photos
    assert (plan.pitch, plan.window) == (pitch, 11)
    assert parse_plan(plan.to_json()) == plan
    assert np.isfinite(expected).all()
    for k in _shown(plan):
        assert (k.fy * projector.height).denominator == 1
        assert (k.fx * projector.width).denominator == 1
        assert not k.is_own_negative
    # Near- and far-range light ask for half a cycle a cell at most, but for rounding to a cycle.
    below = np.abs(as_array(_shown(plan, ("near", "far"))))
    assert np.all(below <= 0.5 / pitch + 0.5 / np.array(projector))


def test_photos_do_not_grow_with_the_projector():
    found = [choose_plan(projector, 60)[0] for projector in (Size(540, 960), FULL_HD, ULTRA_HD)]
    cycles = []
    for plan in found:
        low = as_array(_shown(plan, ("near", "far"))) * np.array(plan.projector)
        assert np.all(np.isin([(0, 1), (1, 0), (1, 1)], np.rint(low)))
        cycles.append(np.sort(np.linalg.norm(low, axis=1)))
        assert plan.counts["direct"] == found[0].counts["direct"]
    assert len({len(each) for each in cycles}) == 1
    for each in cycles[1:]:
        np.testing.assert_allclose(each[:20], cycles[0][:20], atol=1.0)


@pytest.mark.parametrize("photos", [24, 200, 800])
@pytest.mark.parametrize("projector", [Size(130, 200), FULL_HD, ULTRA_HD])
def test_high_frequencies_fall_by_ratio_in_all_directions(projector, photos):
    pitch = pitch_of(projector)
    found = as_array(high_frequencies(projector, pitch, photos))
    radius = np.linalg.norm(found, axis=1)
    assert radius.max() == pytest.approx(0.4, abs=0.01)
    assert 0.5 / pitch - 0.01 < radius.min()
    assert len(found) == pytest.approx(0.15 * photos / 2, abs=0.5) or len(found) in (4, 40)
    # No step of phase is so large that noise in one leaves the next ambiguous.
    ratio = radius[:-1] / radius[1:]
    assert np.all(ratio < (0.8 * pitch) ** (1 / len(found)) * 1.1)
    angle = np.rad2deg(np.arctan2(found[:, 0], found[:, 1])) % 180
    for direction in (0, 45, 90, 135):
        away = np.abs(angle - direction)
        assert np.minimum(away, 180 - away).min() < 2


def test_a_hat_answers_as_the_sum_over_its_pixels():
    projector, pitch = Size(96, 80), 8
    frequencies = [*candidates(projector, 3, pitch)[::5], *high_frequencies(projector, pitch, 200)]
    cosines, sines = waves_on_window(frequencies, 3, pitch)
    away = np.arange(-pitch + 1, pitch)
    hat = (1 - np.abs(away) / pitch) / pitch
    for k, cosine, sine in zip(frequencies, cosines, sines, strict=True):
        found = []
        for y in (-pitch, 0, pitch):
            for x in (-pitch, 0, pitch):
                down = hat @ np.exp(2j * np.pi * float(k.fy) * (y + away))
                across = hat @ np.exp(2j * np.pi * float(k.fx) * (x + away))
                found.append(down * across)
        np.testing.assert_allclose(cosine, np.real(found), atol=1e-12)
        np.testing.assert_allclose(sine, np.imag(found), atol=1e-12)


@pytest.mark.parametrize(("projector", "window"), [(Size(14, 17), 5), (Size(14, 17), 4)])
def test_thin_products_expect_what_whole_covariances_do(projector, window):
    listed = candidates(projector, window)
    whole = ErrorsTogether(listed, projector, window, TYPICAL_SCENES)
    thin = ErrorsLowRank(listed, projector, window, 1, TYPICAL_SCENES, most=30)
    generator = np.random.default_rng(3)
    for candidate in [listed.index(k) for k in listed if k.is_own_negative] + list(
        generator.integers(len(listed), size=24)
    ):
        whole.condition_on(int(candidate), 0.011)
        thin.condition_on(int(candidate), 0.011)
    np.testing.assert_allclose(thin.errors(), whole.errors(), rtol=1e-9)
    gains = whole.gains(0.011)
    np.testing.assert_allclose(thin.gains(0.011), gains, rtol=1e-6, atol=1e-6 * gains.max())


def test_light_that_is_looked_up_beside_its_place_is_wrong_by_its_slope():
    projector = Size(150, 200)
    beside = np.random.default_rng(0).normal(0.0, TYPICAL_Q_DEVIATION, (2, 4000))
    place = np.random.default_rng(1).integers(0, (149, 199), (4000, 2)).T
    of_pictures, of_random = errors_of_place(projector, 2)
    light = random_pattern(projector, 0).astype(np.float64)
    y, x = place
    at, below, right = light[y, x], light[y + 1, x], light[y, x + 1]
    wrong = TYPICAL_DIRECT_DEVIATION * (beside[0] * (below - at) + beside[1] * (right - at))
    assert of_random == pytest.approx(np.mean(wrong**2), rel=0.1)
    assert of_pictures == 0.0
    picture = natural_picture(Size(512, 512), 1).astype(np.float64)
    slope = sum(np.mean(np.diff(picture, axis=axis) ** 2) for axis in (0, 1))
    # What it makes of pictures is a hundredth of that.
    assert slope * (TYPICAL_DIRECT_DEVIATION * TYPICAL_Q_DEVIATION) ** 2 < 0.02 * of_random
    assert not np.any(errors_of_place(projector, 1))


def test_a_window_that_does_not_fit_at_its_pitch_is_refused():
    with pytest.raises(PlanError, match=r"W = 69 at a pitch of 16 .* between 1 and 68"):
        choose_plan(FULL_HD, 60, window=69)
