"""Plans for every projector pixel: chosen as for a grid of cells, with high frequencies besides."""

import hashlib
import json

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.errors import PlanError
from nearfar.illumination.frequencies import DC, as_array
from nearfar.illumination.pictures import random_pattern
from nearfar.plan import Plan, choose_frequencies, choose_plan, expect_place, parse_plan, pitch_of
from nearfar.plan.candidates import candidates, high_frequencies
from nearfar.plan.expect import (
    TYPICAL_DIRECT_DEVIATION,
    ErrorsTogether,
    expected_range,
    waves_on_window,
)
from nearfar.plan.expect_place import (
    DirectDeviation,
    direct_deviation,
    random_errors_of_direct,
)
from nearfar.plan.low_rank import ErrorsLowRank
from nearfar.plan.patterns import Sinusoid
from nearfar.plan.window import side_of_blocks
from nearfar.priors.fitted import TYPICAL_SCENES
from nearfar.transport.boxes import box_places, summed_area

FULL_HD, ULTRA_HD = Size(1080, 1920), Size(2160, 3840)


def _shown(plan: Plan, purposes: tuple[str, ...] = ("direct", "near", "far")):
    return list(
        dict.fromkeys(
            p.frequency
            for p in plan.patterns
            if isinstance(p, Sinusoid) and p.frequency != DC and p.purpose in purposes
        )
    )


# Of the patterns that were chosen before there was a pitch, and before check photos took the place
# of references. On these grids no two candidates are worth the same within rounding, so that every
# processor chooses alike.
@pytest.mark.parametrize(
    ("projector", "photos", "checks", "digest"),
    [
        (Size(31, 24), 61, None, "fef31c9b62234f4d"),
        (Size(48, 64), 200, 0, "a2664660a3b64daf"),
        (Size(1, 64), 60, None, "bc1c6abf1f480261"),
    ],
)
def test_plans_of_single_pixels_are_what_they_always_were(projector, photos, checks, digest):
    plan, _ = choose_plan(projector, photos, checks=checks)
    patterns = json.dumps(json.loads(plan.to_json())["patterns"])
    assert plan.pitch == 1
    assert hashlib.sha256(patterns.encode()).hexdigest()[:16] == digest


@pytest.mark.parametrize(("projector", "photos"), [(Size(24, 31), 61), (Size(1, 64), 60)])
def test_thin_products_choose_plans_as_good_as_whole_covariances(projector, photos, monkeypatch):
    _, by_whole = choose_plan(projector, photos)
    monkeypatch.setattr(choose_frequencies, "MOST_WHOLE", 0.0)
    plan, by_thin = choose_plan(projector, photos)
    assert plan.pitch == 1
    np.testing.assert_allclose(by_thin, by_whole, rtol=1e-8)


@pytest.mark.parametrize(
    ("projector", "photos", "is_whole"),
    [
        (Size(64, 64), 468, True),
        (Size(68, 100), 261, True),
        (Size(96, 96), 300, False),
        (Size(106, 106), 150, False),
    ],
)
def test_large_plans_are_chosen_by_thin_products(projector, photos, is_whole, monkeypatch):
    asked = RuntimeError("asked")

    def refuse(*_arguments: object) -> None:
        raise asked

    chosen_by = "ErrorsTogether" if is_whole else "ErrorsLowRank"
    monkeypatch.setattr(choose_frequencies, chosen_by, refuse)
    with pytest.raises(RuntimeError, match="asked"):
        choose_plan(projector, photos)


@pytest.mark.parametrize(
    ("projector", "photos", "pitch"),
    [
        (Size(107, 107), 60, 4),
        (Size(129, 200), 60, 4),
        (Size(257, 301), 24, 8),
        (FULL_HD, 100, 32),
        (ULTRA_HD, 60, 64),
        (Size(1, 640), 60, 16),
    ],
)
def test_a_plan_of_a_fine_projector_lies_on_its_frequencies(projector, photos, pitch):
    plan, expected = choose_plan(projector, photos)
    assert photos - 1 <= len(plan.patterns) <= photos
    assert (plan.pitch, plan.window) == (pitch, 9)
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
    projectors = (Size(540, 960), FULL_HD, ULTRA_HD)
    found = [choose_plan(projector, 200, checks=0)[0] for projector in projectors]
    cycles = []
    for plan in found:
        low = as_array(_shown(plan, ("near", "far"))) * np.array(plan.projector)
        assert np.all(np.isin([(0, 1), (1, 0), (1, 1)], np.rint(low)))
        cycles.append(np.sort(np.linalg.norm(low, axis=1)))
        assert plan.counts["direct"] == found[0].counts["direct"]
    assert len({len(each) for each in cycles}) == 1
    for each in cycles[1:]:
        np.testing.assert_allclose(each[:20], cycles[0][:20], atol=1.0)


@pytest.mark.parametrize(("photos", "pairs"), [(24, 4), (50, 4), (90, 9), (200, 15), (800, 40)])
@pytest.mark.parametrize("projector", [Size(130, 200), FULL_HD, ULTRA_HD])
def test_high_frequencies_fall_by_ratio_in_all_directions(projector, photos, pairs):
    pitch = pitch_of(projector)
    found = as_array(high_frequencies(projector, pitch, photos))
    radius = np.linalg.norm(found, axis=1)
    assert radius.max() == pytest.approx(0.4, abs=0.01)
    assert 0.5 / pitch - 0.01 < radius.min()
    assert len(found) == pairs
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


@pytest.mark.parametrize("box", [0.6, 1.0, 2.5])
def test_a_random_light_is_wrong_by_what_enters_and_leaves_a_box(box, monkeypatch):
    monkeypatch.setattr(expect_place, "TYPICAL_BOX", box)
    projector, off = Size(150, 200), np.array([0.004, 0.007])
    generator = np.random.default_rng(0)
    light = random_pattern(projector, 0).astype(np.float64)
    at = generator.uniform(10, 140, (100_000, 2))
    beside = at + generator.normal(0.0, off, at.shape)
    table = summed_area(light)
    footprints = np.tile([box, box, 0.0, 0.0], (len(at), 1))
    boxes = [box_places(q, footprints, projector) for q in (at, beside)]
    seen, looked_up = (np.sum(table[b.pixels] * b.weights, axis=1) for b in boxes)
    wrong = TYPICAL_DIRECT_DEVIATION * (looked_up - seen)
    expected = random_errors_of_direct(DirectDeviation(off, 0.0))
    assert expected == pytest.approx(np.mean(wrong**2), rel=0.05)
    # What is wrong in the amount of direct light is wrong in all that the box sees.
    of_amount = random_errors_of_direct(DirectDeviation(off, 0.01)) - expected
    assert of_amount == pytest.approx(np.var(0.01 * seen), rel=0.05)


def test_high_frequencies_tell_direct_light_as_well_as_least_squares():
    projector, noise, box = Size(256, 256), 0.011, expect_place.TYPICAL_BOX
    times = {k: 1 + place % 2 for place, k in enumerate(high_frequencies(projector, 8, 200))}
    cycles = np.repeat(as_array(list(times)), list(times.values()), axis=0)
    of_box = np.prod(np.sinc(box * cycles), axis=1)

    def responses(amount: float, q: np.ndarray) -> np.ndarray:
        waves = amount * of_box * np.exp(-2j * np.pi * cycles @ q)
        return np.concatenate([waves.real, waves.imag])

    at, step = np.array([0.3, -0.2]), 1e-5
    slopes = [
        (responses(0.5 + amount, at + off) - responses(0.5 - amount, at - off)) / (2 * step)
        for amount, off in ((step, np.zeros(2)), (0, np.array([step, 0])), (0, np.array([0, step])))
    ]
    left = np.sqrt(np.diag(np.linalg.inv(np.array(slopes) @ np.array(slopes).T / noise**2)))
    found = direct_deviation(times, projector, noise)
    assert found.amount == pytest.approx(left[0], rel=1e-3)
    floor = expect_place.Q_DEVIATION_FLOOR
    np.testing.assert_allclose(np.sqrt(found.q**2 - floor**2), left[1:], rtol=0.03)


def test_what_photos_do_not_tell_of_direct_light_is_expected_as_before():
    found = direct_deviation({}, Size(1, 640), 0.011)
    assert found.amount == TYPICAL_DIRECT_DEVIATION
    np.testing.assert_allclose(found.q, [0.0, 1.0], atol=1e-4)


# SNR_b under pictures and a random light that were measured (docs/decisions/0042): corner and
# cornell-aside, cameras of 320x320 and 400x400.
@pytest.mark.parametrize(
    ("projector", "measured"),
    [
        (Size(256, 256), (46.0, 50.9)),
        (Size(512, 512), (46.1, 51.9)),
        (FULL_HD, (43.5, 55.0)),
        (Size(256, 256), (44.6, 43.4)),
        (Size(512, 512), (44.3, 40.0)),
    ],
)
def test_what_was_measured_lies_in_the_range_that_is_expected(projector, measured):
    plan, expected = choose_plan(projector, 200)
    expected_snr = expected_range(expected, plan.pitch)
    ranges = (expected_snr.pictures, expected_snr.random)
    for value, (low, high) in zip(measured, ranges, strict=True):
        assert low <= value <= high
    assert plan.expected_snr == expected_snr


def test_a_window_that_does_not_fit_at_its_pitch_is_refused():
    with pytest.raises(PlanError, match=r"W = 35 at a pitch of 32 .* between 1 and 34"):
        choose_plan(FULL_HD, 60, window=35)


@pytest.mark.parametrize(
    ("projector", "block"),
    [
        ((136, 150), 2),
        ((256, 256), 4),
        ((1080, 1920), 12),
        ((2160, 3840), 24),
        ((4320, 7680), 48),
        ((1, 1920), 20),
        # Nothing divides both sides.
        ((257, 301), 3),
    ],
)
def test_blocks_leave_a_grid_of_single_cells_that_is_no_coarser_than_it_must(projector, block):
    assert side_of_blocks(Size(*projector)) == block
    grid = Size(*(max(1, side // block) for side in projector))
    assert pitch_of(grid) == 1
    assert min(side for side in grid if side > 1) >= 53
