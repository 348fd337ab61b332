"""From photos to measurements: units, references, noise, and what must not matter."""

from dataclasses import replace

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.errors import InputError
from nearfar.illumination.frequencies import DC
from nearfar.photometry.by_inverse import find_pairs
from nearfar.photometry.measure import measure
from nearfar.photometry.noise import fit_noise
from nearfar.plan import paper_plan
from nearfar.rigs.simulated.camera import SimulatedCamera
from nearfar.rigs.simulated.projector import SimulatedProjector
from tests.worlds import model_transport

PLAN = paper_plan(Size(16, 20), 5, Size(3, 3))
NOISY = SimulatedCamera()


def _responses(world, measurements):
    """True responses to waves and what is left of their rounding, (C, channels, R)."""
    pairs = find_pairs(PLAN)
    waves = measurements.basis.patterns + measurements.quantisation_error
    return world.dense() @ waves[_places(measurements, pairs)].T, pairs


def _places(measurements, pairs):
    order = [
        (measurements.basis.frequencies[i], bool(sine))
        for i, sine in zip(measurements.basis.index, measurements.basis.is_sine, strict=True)
    ]
    return [order.index((pair.frequency, pair.sine)) for pair in pairs]


def test_responses_are_in_photo_units(small_world, shoot):
    measurements = measure(shoot(PLAN, small_world))
    truth, pairs = _responses(small_world, measurements)
    dc = [pair.frequency == DC for pair in pairs]
    # The DC answer stands for white less black.
    truth[..., dc] = (small_world @ np.ones(PLAN.projector)).reshape(-1, 2, 1)
    found = measurements.responses[..., _places(measurements, pairs)]
    # 16 bits: two roundings of 1/65535 each.
    np.testing.assert_allclose(found, truth, atol=2.5e-5)


@pytest.mark.parametrize(
    "camera",
    [
        SimulatedCamera(full_well=1e9, read_noise=0, bits=16, shot_noise=False, ambient=0.2),
        SimulatedCamera(full_well=1e9, read_noise=0, bits=16, shot_noise=False, black_level=0.1),
    ],
)
def test_ambient_light_and_black_level_fall_out(small_world, shoot, camera):
    plain = measure(shoot(PLAN, small_world))
    other = measure(shoot(PLAN, small_world, camera))
    np.testing.assert_allclose(other.responses, plain.responses, atol=5e-5)
    np.testing.assert_allclose(other.black, camera.ambient + camera.black_level, atol=5e-5)


def test_the_projectors_black_falls_out(small_world, shoot):
    plain = measure(shoot(PLAN, small_world))
    other = measure(shoot(PLAN, small_world, projector=SimulatedProjector(black_level=0.05)))
    np.testing.assert_allclose(other.responses, plain.responses, atol=5e-5)


def test_the_noise_is_what_it_is(small_world, shoot):
    # Over many seeds, responses scatter by the noise that each capture alone tells.
    found = [measure(shoot(PLAN, small_world, NOISY, seed=seed)) for seed in range(40)]
    place = found[0].response_indices([DC])
    keep = np.setdiff1d(np.arange(found[0].basis.count), place)
    scatter = np.std([m.responses[..., keep] for m in found], axis=0)
    told = np.mean([m.noise for m in found], axis=0)
    ratio = np.sqrt(np.mean(scatter**2, axis=-1)) / told
    assert np.median(ratio) == pytest.approx(1.0, abs=0.05)
    assert np.all(np.abs(ratio - 1) < 0.3)


def test_pair_sums_make_differences_better(small_world, shoot):
    # Under direct light alone, half of a difference's variance shows in the sum: 0.71 is left.
    small_world = small_world.with_gains(near=0, far=0)
    clean = measure(shoot(PLAN, small_world)).responses
    plain, better = [], []
    for seed in range(6):
        photos = shoot(PLAN, small_world, NOISY, seed=seed)
        measurements = measure(photos)
        pairs = find_pairs(PLAN)
        place = _places(measurements, pairs)
        read = photos.read(range(len(PLAN.patterns)), slice(None))
        difference = np.stack([read[p.photo] - read[p.inverse] for p in pairs], axis=-1)
        difference = difference.reshape(*clean.shape[:2], -1)
        kept = [i for i, p in enumerate(pairs) if p.frequency != DC]
        truth = clean[..., place][..., kept]
        plain.append(difference[..., kept] - truth)
        better.append(measurements.responses[..., place][..., kept] - truth)
    assert np.std(better) < 0.8 * np.std(plain)
    assert abs(np.mean(better)) < 0.1 * np.std(better)


def test_white_is_better_than_one_photo_of_it(small_world, shoot):
    truth = (small_world @ np.ones(PLAN.projector)).reshape(-1, 2)
    errors = []
    for seed in range(6):
        measurements = measure(shoot(PLAN, small_world, NOISY, seed=seed))
        errors.append(measurements.responses[..., measurements.response_indices([DC])[0]] - truth)
    one_photo = np.sqrt((truth.mean() + 0.02) / NOISY.full_well)
    assert np.std(errors) < 0.5 * one_photo


def test_a_flickering_lamp_falls_out(small_world, shoot):
    photos = shoot(PLAN, small_world, SimulatedCamera(full_well=1e6, ambient=0.0, black_level=0.0))
    steady = measure(photos)
    lamp = 1 + 0.01 * np.random.default_rng(0).normal(size=(len(PLAN.patterns) // 2, 1))
    lamp = np.repeat(lamp, 2, axis=1).ravel()[: len(photos.photos)]
    flickering = replace(
        photos, photos=np.rint(photos.photos * lamp[:, None, None, None]).astype(np.uint16)
    )
    found = measure(flickering)
    keep = np.setdiff1d(np.arange(found.basis.count), found.response_indices([DC]))
    error = np.abs(found.responses - steady.responses)[..., keep]
    # A 1 % lamp on responses of up to 0.4: thousandths without the sums, next to none with them.
    assert np.sqrt(np.mean(error**2)) < 4e-4


def test_rows_are_measured_on_their_own(small_world, shoot):
    photos = shoot(PLAN, small_world)
    whole, part = measure(photos), measure(photos, slice(2, 5))
    assert part.camera == Size(3, 9)
    np.testing.assert_allclose(part.responses, whole.responses[2 * 9 : 5 * 9], atol=1e-6)


def test_dark_rows_are_measured_as_dark(small_world, shoot):
    photos = shoot(PLAN, small_world)
    shown = photos.photos.copy()
    shown[:, 3:6] = 0
    dark = measure(replace(photos, photos=shown), slice(3, 6))
    assert np.all(dark.responses == 0)
    assert np.all(dark.black == 0)
    assert np.all(np.isfinite(dark.noise))


@pytest.mark.parametrize(("gamma", "least"), [(1.1, 0.01), (2.2, 0.1)])
def test_a_projector_that_is_not_linear_is_told_by_its_sums(small_world, shoot, gamma, least):
    linear = measure(shoot(PLAN, small_world, NOISY))
    assert abs(linear.excess_of_sums) < 0.003
    bent = measure(shoot(PLAN, small_world, NOISY, SimulatedProjector(gamma=gamma)))
    assert bent.excess_of_sums < -least
    # White was photographed: it is not spoiled by sums that do not hold.
    truth = (small_world @ np.ones(PLAN.projector)).reshape(-1, 2)
    white = bent.responses[..., bent.response_indices([DC])[0]]
    assert np.abs(white - truth).mean() < 0.01 * truth.mean()


def test_dim_responses_do_not_shrink(small_world, shoot):
    # Few electrons: what a noisy rho would take away on average is given back.
    dim = SimulatedCamera(full_well=300, read_noise=0, bits=16, ambient=0, black_level=0.02)
    clean = measure(shoot(PLAN, small_world)).responses
    ratios = []
    for seed in range(30):
        found = measure(shoot(PLAN, small_world, dim, seed=seed)).responses
        ratios.append(np.vdot(found, clean) / np.vdot(clean, clean))
    assert np.mean(ratios) == pytest.approx(1.0, abs=4e-3)


def test_what_was_shot_twice_counts_as_the_mean(shoot):
    # Dropped after far frequencies that near-range light is measured at too: shot in both bands.
    plan = paper_plan(Size(24, 24), 8, Size(7, 7), dropped=Size(1, 1))
    pairs = find_pairs(plan)
    assert len({pair[:2] for pair in pairs}) < len(pairs)
    world = model_transport(Size(24, 24), Size(4, 5), window=5, far=Size(3, 3), channels=2)
    photos = shoot(plan, world, NOISY)
    measurements = measure(photos)
    taken = photos.read(range(len(plan.patterns)), slice(0, 4)).reshape(-1, 20, 2)
    order = _places(measurements, pairs)
    for place in range(1, measurements.basis.count):
        mine = [pair for pair, at in zip(pairs, order, strict=True) if at == place]
        mean = np.mean([taken[pair.photo] - taken[pair.inverse] for pair in mine], axis=0)
        found = measurements.responses[..., place]
        # What the sums' noise takes out of it is less than the noise.
        assert measurements.multiplicity[place] == len(mine)
        np.testing.assert_allclose(found, mean, atol=6 * measurements.noise.max())


def test_a_pattern_without_its_inverse_is_refused():
    broken = PLAN.model_copy(update={"patterns": PLAN.patterns[:-37][1:]})
    with pytest.raises(InputError, match="without its inverse"):
        find_pairs(broken)


def test_the_noise_model_is_found():
    generator = np.random.default_rng(0)
    level = generator.uniform(0.05, 1.6, size=5000)
    gain, floor = 1 / 30_000, (4 / 30_000) ** 2
    variance = (gain * level + 2 * floor) * generator.chisquare(100, size=5000) / 100
    model = fit_noise(level, variance)
    assert model.gain == pytest.approx(gain, rel=0.03)
    assert model.variance(np.array([0.3]))[0] == pytest.approx(gain * 0.3 + floor, rel=0.05)


def test_a_camera_of_one_brightness_has_a_noise_all_the_same():
    model = fit_noise(np.full(50, 0.5), np.full(50, 2e-6))
    assert model.variance(np.array([0.5]))[0] == pytest.approx(1e-6, rel=1e-3)
