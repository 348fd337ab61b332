"""Photos against white and black: the same responses as by pairs, and errors that are known."""

from dataclasses import replace

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.correspondence import Correspondence, onto_projector
from nearfar.errors import InputError, PlanError
from nearfar.illumination.frequencies import CHECKERBOARD, DC
from nearfar.photometry.by_inverse import measure_pairs
from nearfar.photometry.drift_removal import remove_drift
from nearfar.photometry.measure import measure, measured_frequencies
from nearfar.photometry.measurements import Measurements
from nearfar.photometry.noise import fit_noise, mean_of_few
from nearfar.plan import Sinusoid, paper_plan, with_references
from nearfar.rigs.simulated.camera import SimulatedCamera
from nearfar.rigs.simulated.projector import SimulatedProjector
from tests.conftest import QUIET
from tests.worlds import model_transport

PROJECTOR = Size(16, 20)
PAIRS = paper_plan(PROJECTOR, 5, Size(3, 3), correspondence="none")
PLAN = paper_plan(PROJECTOR, 5, Size(3, 3), offset="reference", correspondence="none")
STRIPES = paper_plan(PROJECTOR, 5, Size(3, 3), offset="reference")
NOISY = SimulatedCamera()


@pytest.fixture(scope="module")
def wide_world():
    """As small_world, with a camera that tells its noise."""
    return model_transport(PROJECTOR, Size(24, 30), window=5, far=Size(3, 3), channels=2)


def _repeated(plan, chosen, times):
    """A plan in which some patterns are shown more often."""
    again = [p for p in plan.patterns if chosen(p)]
    return plan.model_copy(update={"patterns": plan.patterns + tuple(again) * (times - 1)})


def _is_checkerboard(pattern):
    return isinstance(pattern, Sinusoid) and pattern.frequency == CHECKERBOARD


@pytest.mark.parametrize("plan", [PLAN, STRIPES, _repeated(PLAN, _is_checkerboard, 3)])
@pytest.mark.parametrize("black", [0.0, 0.05])
def test_by_reference_and_by_pairs_agree(small_world, shoot, plan, black):
    projector = SimulatedProjector(black_level=black)
    pairs = measure(shoot(PAIRS, small_world, QUIET, projector))
    found = measure(shoot(plan, small_world, QUIET, projector))
    assert set(found.basis.frequencies) == set(pairs.basis.frequencies)
    here, there = (m.response_indices(pairs.basis.frequencies) for m in (found, pairs))
    # 16 bits: twice a rounding of the photo, and those of white and black, half a level each.
    level = 1 / 65535
    error = np.abs(found.responses[..., here] - pairs.responses[..., there])
    assert error.max() <= 3.2 * level
    np.testing.assert_allclose(found.black, pairs.black, atol=level)
    # Summed in another order.
    np.testing.assert_allclose(
        found.quantisation_error[here], pairs.quantisation_error[there], atol=1e-9
    )


def test_an_inverse_among_them_counts_with_its_sign(small_world, shoot):
    flipped = tuple(
        p.model_copy(update={"inverse": True}) if _is_checkerboard(p) else p for p in PLAN.patterns
    )
    plan = PLAN.model_copy(update={"patterns": flipped})
    found, other = (measure(shoot(p, small_world)) for p in (plan, PLAN))
    place = found.response_indices([CHECKERBOARD]), other.response_indices([CHECKERBOARD])
    np.testing.assert_allclose(
        found.responses[..., place[0]], other.responses[..., place[1]], atol=5e-5
    )


@pytest.mark.parametrize("plan", [PLAN, STRIPES])
def test_the_noise_is_what_it_is(wide_world, shoot, plan):
    plan = _repeated(plan, _is_checkerboard, 4)
    clean = measure(shoot(plan, wide_world))
    found = [measure(shoot(plan, wide_world, NOISY, seed=seed)) for seed in range(24)]
    errors = np.stack([m.responses - clean.responses for m in found])

    def told(name):
        return np.sqrt(np.mean([getattr(m, name) ** 2 for m in found]))

    light = clean.response_indices([DC])[0]
    sinusoids = np.setdiff1d(np.arange(clean.basis.count), [light])
    # The references' own error is that of all responses of a pixel; each has its own besides.
    own = told("noise") ** 2 / clean.multiplicity[sinusoids]
    shared = told("white_noise") ** 2 + told("black_noise") ** 2
    scatter = np.sqrt(np.mean(errors[..., sinusoids] ** 2, axis=(0, 1, 2)))
    np.testing.assert_allclose(scatter, np.sqrt(own + shared), rtol=0.1)
    assert np.mean(scatter) == pytest.approx(np.mean(np.sqrt(own + shared)), rel=0.02)
    assert errors[..., light].std() == pytest.approx(told("light_noise"), rel=0.05)
    between = np.mean(errors[..., sinusoids], axis=-1)
    expected = np.sqrt(shared + np.mean(own) / len(sinusoids))
    assert between.std() == pytest.approx(expected, rel=0.1)
    # As many responses as the plan shows, white for DC.
    assert clean.multiplicity[clean.response_indices([CHECKERBOARD])] == [4]
    assert clean.multiplicity[light] == sum(
        isinstance(p, Sinusoid) and p.frequency == DC and not p.inverse for p in plan.patterns
    )


def test_noise_follows_each_pixels_brightness(wide_world, shoot):
    bright = wide_world.with_gains(direct=0.2)
    found = [measure(shoot(PLAN, bright, NOISY, seed=seed)) for seed in range(20)]
    light = found[0].response_indices([DC])[0]
    rest = np.setdiff1d(np.arange(found[0].basis.count), [light])
    scatter = np.std([m.responses[..., rest] for m in found], axis=0)
    each = np.sqrt(np.mean(scatter**2, axis=-1))
    told = np.mean([m.noise for m in found], axis=0)
    shared = np.mean([m.white_noise**2 + m.black_noise**2 for m in found], axis=0)
    ratio = each / np.sqrt(told**2 + shared)
    assert np.median(ratio) == pytest.approx(1.0, abs=0.03)
    assert np.std(ratio) < 0.12


def test_stripes_make_white_better(wide_world, shoot):
    plain, better = (measure(shoot(plan, wide_world, NOISY)) for plan in (PLAN, STRIPES))
    # 16 + 20 photos that are nearly white.
    assert better.white_noise.mean() < 0.5 * plain.white_noise.mean()


@pytest.mark.parametrize("bits", [8, 14])
def test_two_whites_and_two_blacks_tell_the_noise(bits, shoot):
    world = model_transport(PROJECTOR, Size(40, 50), window=5, far=Size(3, 3))
    others = tuple(p for p in PLAN.patterns if not (isinstance(p, Sinusoid) and p.frequency == DC))
    plan = PLAN.model_copy(update={"patterns": with_references(others, 2, 2)})
    camera = SimulatedCamera(bits=bits)
    (model,) = remove_drift(shoot(plan, world, camera)).noise
    level = np.array([0.2, 0.4, 0.6])
    # Rounding is noise too.
    truth = (level - 0.02) / camera.full_well + (camera.read_noise / camera.full_well) ** 2
    truth = truth + 1 / (12 * (2**bits - 1) ** 2)
    np.testing.assert_allclose(np.sqrt(model.variance(level)), np.sqrt(truth), rtol=0.1)


def test_without_noise_that_of_rounding_is_left(small_world, shoot):
    found = measure(shoot(PLAN, small_world))
    assert found.noise.min() >= 2 / (65535 * np.sqrt(12)) * 0.999
    assert found.noise.max() < 3 / 65535


def test_moving_pixels_do_not_decide_the_noise(wide_world, shoot):
    photos = shoot(PLAN, wide_world, NOISY)
    still = remove_drift(photos).noise
    moved = photos.photos.copy()
    generator = np.random.default_rng(1)
    moved[:, :2] = generator.integers(500, 9000, size=moved[:, :2].shape)
    for one, other in zip(still, remove_drift(replace(photos, photos=moved)).noise, strict=True):
        level = np.array([0.1, 0.5])
        np.testing.assert_allclose(other.variance(level), one.variance(level), rtol=0.15)


def test_variances_of_few_photos_are_not_taken_for_less():
    generator = np.random.default_rng(0)
    level = generator.uniform(0.05, 0.8, size=20_000)
    gain, floor = 1 / 30_000, (4 / 30_000) ** 2
    variance = (gain * level + floor) * generator.chisquare(1, size=20_000)
    model = fit_noise(level, variance, photos=1, typical=mean_of_few)
    assert model.gain == pytest.approx(gain, rel=0.05)
    assert model.variance(np.array([0.3]))[0] == pytest.approx(gain * 0.3 + floor, rel=0.05)


@pytest.mark.parametrize("plan", [PLAN, STRIPES])
def test_rows_are_measured_on_their_own(small_world, shoot, plan):
    photos = remove_drift(shoot(plan, small_world, NOISY))
    whole, part = measure(photos), measure(photos, slice(2, 5))
    assert part.camera == Size(3, 9)
    for name in ("responses", "noise", "black", "white_noise", "black_noise", "light_noise"):
        mine = getattr(whole, name)[2 * 9 : 5 * 9]
        np.testing.assert_allclose(getattr(part, name), mine, atol=1e-7)
    cut = whole.of_pixels(Size(3, 9), slice(2 * 9, 5 * 9))
    np.testing.assert_array_equal(cut.white_noise, whole.white_noise[18:45])
    np.testing.assert_array_equal(cut.multiplicity, whole.multiplicity)


def test_blocks_of_camera_pixels_are_measured_as_the_whole(small_world, shoot, monkeypatch):
    photos = remove_drift(shoot(PLAN, small_world, NOISY))
    whole = measure(photos)
    monkeypatch.setattr("nearfar.photometry.by_reference.PIXELS_AT_ONCE", 5)
    monkeypatch.setattr("nearfar.photometry.quantisation.ROWS_AT_ONCE", 7)
    np.testing.assert_array_equal(measure(photos).responses, whole.responses)


def test_the_mean_over_camera_pixels_is_that_much_better(shoot):
    fine = model_transport(PROJECTOR, Size(32, 40), window=5, far=Size(3, 3))
    whole = measure(shoot(PLAN, fine, NOISY))
    q = np.rint(fine.correspondence).astype(np.float32)
    found, _ = onto_projector([whole], Correspondence(q, np.ones(fine.camera, np.float32)))
    mine = np.flatnonzero((q.reshape(-1, 2) == (3, 4)).all(axis=-1))
    for name in ("noise", "white_noise", "black_noise", "light_noise"):
        variances = getattr(whole, name)[mine] ** 2
        expected = np.sqrt(variances.mean(axis=0) / len(mine))
        np.testing.assert_allclose(getattr(found, name)[3 * 20 + 4], expected, rtol=1e-5)


def test_measurements_by_pairs_have_no_reference_noise(wide_world, shoot):
    found = measure(shoot(PAIRS, wide_world, NOISY))
    assert np.all(found.white_noise == 0)
    assert np.all(found.black_noise == 0)
    assert np.all(found.multiplicity == 1)
    # White is the mean of all pairs.
    assert np.median(found.light_noise / found.noise) < 0.5


def test_the_noise_of_light_by_pairs_is_what_it_is(wide_world, shoot):
    found = [measure(shoot(PAIRS, wide_world, NOISY, seed=seed)) for seed in range(20)]
    light = np.stack([m.responses[..., m.response_indices([DC])[0]] for m in found])
    told = np.sqrt(np.mean([m.light_noise**2 for m in found]))
    # Sums are never dark, so the noise of black is an extrapolation of theirs.
    assert np.sqrt(light.var(axis=0, ddof=1).mean()) == pytest.approx(told, rel=0.2)


def test_what_is_left_out_of_measurements_is_a_single_measurement(small_world, shoot):
    found = measure(shoot(PAIRS, small_world, NOISY))
    plain = Measurements(
        found.camera,
        found.basis,
        found.responses,
        found.noise,
        found.black,
        found.quantisation_error,
    )
    np.testing.assert_array_equal(plain.multiplicity, np.ones(found.basis.count))
    assert np.all(plain.white_noise == 0)
    assert plain.black_noise.shape == found.noise.shape
    np.testing.assert_array_equal(plain.light_noise, found.noise)


def _without(chosen):
    return PLAN.model_copy(
        update={"patterns": tuple(p for i, p in enumerate(PLAN.patterns) if not chosen(i, p))}
    )


@pytest.mark.parametrize(
    ("plan", "message"),
    [
        (_without(lambda i, p: p.frequency == DC and p.inverse and i > 5), "black 1 times, "),
        (_without(lambda _, p: p.frequency == DC and not p.inverse), "white 0 and black"),
    ],
)
def test_references_that_are_missing_are_told(small_world, shoot, plan, message):
    with pytest.raises(InputError, match=message + ".*`offset='reference'`"):
        measured_frequencies(plan)
    with pytest.raises(InputError, match=message):
        measure(shoot(plan, small_world))


def test_a_cosine_without_its_sine_is_told(small_world, shoot):
    sine = next(i for i, p in enumerate(PLAN.patterns) if p.kind == "sine")
    with pytest.raises(InputError, match="without its sine"):
        measure(shoot(_without(lambda i, _: i == sine), small_world))


def test_a_white_that_is_saturated_everywhere_is_told(small_world, shoot):
    with pytest.raises(InputError, match="at full scale at every camera pixel of channel 0"):
        measure(shoot(PLAN, small_world.with_gains(direct=20.0, far=20.0)))


def test_complex_patterns_are_no_photos(small_world, shoot):
    photos = replace(shoot(PLAN, small_world), plan=PLAN.model_copy(update={"offset": "none"}))
    with pytest.raises(PlanError, match="complex"):
        measure(photos)
    with pytest.raises(InputError, match="without its inverse"):
        measure_pairs(photos, slice(0, 8))
