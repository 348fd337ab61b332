"""The error of a transport, from two photos that are noisier than it."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from nearfar.workflow.verdict.check_pairs import compare_pair, over_both

VALUES = 40_000


def _pictures(seed):
    generator = np.random.default_rng(seed)
    white = generator.uniform(0.1, 0.9, VALUES)
    return generator, white, white * generator.uniform(0, 1, VALUES)


def _compare(seed=0, *, error=0.01, noise=0.03, gain=1.0, claimed=None, bend=0.0):
    """Relight with an error, and photograph with noise, a lamp's gain and a bent response."""
    generator, white, known = _pictures(seed)
    relit = known + error * generator.normal(size=VALUES)
    taken = []
    for picture in (known, white - known):
        share = picture / white
        shown = gain * white * (share - bend * share * (1 - share))
        taken.append(shown + noise * generator.normal(size=VALUES))
    variance = noise**2 if claimed is None else claimed
    return compare_pair(*taken, relit, white=white, noise=variance, error_of_white=0.0)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(("error", "noise"), [(0.01, 0.03), (0.005, 0.02), (0.02, 0.005)])
def test_the_error_is_found_below_the_noise(seed, error, noise):
    pair = _compare(seed, error=error, noise=noise)
    assert pair.error == pytest.approx(error**2, abs=4 * pair.error_deviation + 0.03 * error**2)
    assert pair.photo_noise == pytest.approx(noise**2, rel=0.05)


def test_noise_alone_is_no_error():
    errors = [_compare(seed, error=0.0) for seed in range(20)]
    scaled = [pair.error / pair.error_deviation for pair in errors]
    assert np.std(scaled) == pytest.approx(1.0, abs=0.5)
    assert abs(np.mean(scaled)) < 1.0


@pytest.mark.parametrize("claimed", [0.0, 1e-5, 1.0])
def test_a_model_of_the_noise_that_is_wrong_in_scale_hides_no_error(claimed):
    # What the noise is said to be matters where the photos show more, never where they show less.
    pair = _compare(error=0.02, noise=0.03, claimed=claimed)
    assert pair.error > 0.9 * 0.02**2


def test_noise_alone_sums_to_white_within_its_deviation():
    pairs = [_compare(seed) for seed in range(40)]
    scaled = [pair.excess_share / pair.excess_deviation for pair in pairs]
    assert np.std(scaled) == pytest.approx(1.0, abs=0.3)


def test_a_lamp_that_changed_is_no_noise():
    pair = _compare(error=0.0, noise=0.001, gain=1.05)
    assert pair.excess_share == pytest.approx(0.05, rel=0.02)
    # 5 % of the picture and of its inverse.
    assert pair.error == pytest.approx(0.05**2 * pair.signal / 1.05**2, rel=0.05)


@pytest.mark.parametrize("bend", [0.2, -0.2])
def test_a_bent_response_does_not_add_up_to_white(bend):
    pair = _compare(error=0.0, noise=0.001, bend=bend)
    # Both are off by the same at every share of white, a sixth of white on average.
    assert pair.excess_share == pytest.approx(-2 * bend / 6, rel=0.05)


@pytest.mark.parametrize(("error", "of_inverse"), [(0.02, 0.01), (0.01, 0.02)])
def test_white_may_be_off_and_the_inverse_more_or_less_than_the_pattern(error, of_inverse):
    generator, white, _ = _pictures(0)
    known = white * generator.uniform(0, 0.4, VALUES)
    errors = [size * generator.normal(size=VALUES) for size in (error, of_inverse)]
    taken = [picture + 0.03 * generator.normal(size=VALUES) for picture in (known, white - known)]
    pair = compare_pair(
        *taken,
        known + errors[0],
        white=white + errors[0] + errors[1],
        noise=1.0,
        error_of_white=error**2 + of_inverse**2,
        share_of_pattern=2 * error**2 / (error**2 + of_inverse**2),
    )
    assert pair.signal == pytest.approx(np.mean(known**2) + 0.03**2, rel=0.02)
    assert pair.photo_noise == pytest.approx(0.03**2, rel=0.05)
    assert pair.error == pytest.approx(error**2, rel=0.1)
    whole = replace(pair, share_of_pattern=1.0)
    assert pair.error_deviation / whole.error_deviation == pytest.approx(pair.share_of_pattern)


def test_a_camera_without_light_shows_no_excess():
    dark = np.zeros(VALUES)
    pair = compare_pair(dark, dark + 1e-3, dark, white=dark, noise=0.0, error_of_white=0.0)
    assert pair.excess_share == 0.0


def test_sums_over_a_large_camera_lose_no_digits():
    # Pictures in steps of 1 / 65536, whose differences are exact in float32.
    generator = np.random.default_rng(0)
    white = generator.integers(20_000, 60_000, VALUES)
    known = generator.integers(0, white)
    relit = known + generator.integers(-300, 300, VALUES)
    shown, inverse = (
        picture + generator.integers(-2000, 2000, VALUES) for picture in (known, white - known)
    )
    pair = compare_pair(
        *(np.float32(picture / 65536) for picture in (shown, inverse, relit)),
        white=np.float32(white / 65536),
        noise=1.0,
        error_of_white=0.0,
    )
    first, second = shown - relit, inverse - (white - relit)
    of_sum = Fraction(int(np.sum((first + second) ** 2)), VALUES * 65536**2)
    both = Fraction(int(np.sum(first**2) + np.sum(second**2)), 2 * VALUES * 65536**2)
    assert pair.error == pytest.approx(float(both - of_sum / 2), rel=1e-11)
    assert pair.excess == pytest.approx(
        float(Fraction(int(np.sum(first + second)), VALUES * 65536)), rel=1e-11
    )
    assert pair.signal == pytest.approx(
        float(Fraction(int(np.sum(shown**2)), VALUES * 65536**2)), rel=1e-11
    )


def test_parts_of_a_camera_count_as_the_whole():
    generator, white, known = _pictures(0)
    taken = [known + 0.1 * generator.normal(size=VALUES), white - known]

    def of(part):
        return compare_pair(
            taken[0][part],
            taken[1][part],
            known[part] * 1.1,
            white=white[part],
            noise=1e-3,
            error_of_white=1e-4,
        )

    whole, joined = of(slice(None)), over_both(of(slice(0, 999)), of(slice(999, None)))
    assert joined.values == whole.values == VALUES
    assert vars(joined) == pytest.approx(vars(whole))
