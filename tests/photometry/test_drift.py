"""Lamp and ambient light that change: followed, taken out, and told."""

from dataclasses import replace

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.errors import InputError
from nearfar.estimate.paper import estimate
from nearfar.illumination.frequencies import DC
from nearfar.illumination.pictures import natural_picture
from nearfar.photometry.drift import find_references, follow_drift
from nearfar.photometry.drift_removal import remove_drift
from nearfar.photometry.measure import measure
from nearfar.photometry.robust import robust_fit
from nearfar.plan import Sinusoid, paper_plan, with_references
from nearfar.rigs.simulated.camera import SimulatedCamera
from nearfar.rigs.simulated.drift import SimulatedDrift
from nearfar.rigs.simulated.projector import SimulatedProjector
from nearfar.workflow.evaluate import snr
from tests.conftest import QUIET
from tests.worlds import model_transport

PROJECTOR = Size(24, 30)
PLAN = paper_plan(PROJECTOR, 7, Size(3, 3), offset="reference", correspondence="none")
PHOTOS = len(PLAN.patterns)
OTHERS = tuple(p for p in PLAN.patterns if isinstance(p, Sinusoid) and p.frequency != DC)
NOISY = SimulatedCamera()
STEADY = SimulatedDrift()
LAMP = SimulatedDrift(per_100_photos=-10 / PHOTOS)
AMBIENT = SimulatedDrift(per_100_photos=100 / PHOTOS)


@pytest.fixture(scope="module")
def world():
    return model_transport(PROJECTOR, Size(24, 30), window=7, far=Size(3, 3), channels=2)


def _drifting(shoot, world, lamp, ambient, camera=NOISY, seed=0, black=0.0):
    return shoot(
        PLAN,
        world,
        camera.model_copy(update={"ambient_drift": ambient}),
        SimulatedProjector(lamp_drift=lamp, black_level=black),
        seed,
    )


def _at(drift, numbers):
    return np.array([drift.at(int(number)) for number in numbers])


@pytest.mark.parametrize("black", [0.0, 0.05])
def test_lamp_and_ambient_are_followed(world, shoot, black):
    lamp = SimulatedDrift(per_100_photos=-0.05, swing=0.02, period=80)
    ambient = SimulatedDrift(per_100_photos=0.8, swing=0.2, period=60)
    drift = follow_drift(_drifting(shoot, world, lamp, ambient, black=black)).drift
    whites, blacks = drift.references
    true = _at(lamp, whites)
    np.testing.assert_allclose(drift.lamp, np.stack([true / true.mean()] * 2, axis=1), atol=1e-3)
    changed = 0.01 * _at(ambient, blacks)
    told = drift.ambient[:, 0] + drift.ambient[:, 1] * np.median(drift.black, axis=(0, 1))
    if black == 0.0:
        np.testing.assert_allclose(
            told - told.mean(axis=0), np.stack([changed - changed.mean()] * 2, axis=1), atol=2e-4
        )
        light = float(drift.light.mean(axis=(0, 1)).min())
        assert drift.ambient_range == pytest.approx(np.ptp(changed) / light, rel=0.05)
    assert drift.lamp_range == pytest.approx(np.ptp(true) / true.mean(), abs=2e-3)


def test_a_steady_rig_is_found_steady(world, shoot):
    drift = follow_drift(_drifting(shoot, world, STEADY, STEADY)).drift
    assert drift.lamp_range < 2e-3
    assert drift.ambient_range < 2e-3


@pytest.mark.parametrize(
    ("lamp", "ambient"),
    [
        (LAMP, STEADY),
        (STEADY, AMBIENT),
        (LAMP, AMBIENT),
        (SimulatedDrift(swing=0.05, period=400), SimulatedDrift(swing=0.5, period=300)),
    ],
)
def test_without_noise_nothing_of_the_drift_is_left(world, shoot, lamp, ambient):
    plain = measure(_drifting(shoot, world, STEADY, STEADY, QUIET))
    photos = _drifting(shoot, world, lamp, ambient, QUIET)
    found = measure(photos)
    raw = measure(replace_drift(remove_drift(photos)))
    error, left = (np.abs(_rescaled(m, plain) - plain.responses).max() for m in (found, raw))
    # Straight runs are taken out to the last level; swings, to what bends between references.
    assert error < (1.5e-3 if lamp.swing else 8e-5)
    assert left > 10 * error


def test_some_photos_are_as_they_are_among_all(world, shoot):
    photos = remove_drift(_drifting(shoot, world, LAMP, AMBIENT))
    references = find_references(PLAN)
    kept = [n for n in range(PHOTOS) if n % 3 == 0 or n in (*references.whites, *references.blacks)]
    some = photos.only(np.array(kept))
    assert some.plan.patterns == tuple(PLAN.patterns[n] for n in kept)
    rows = slice(2, 9)
    np.testing.assert_allclose(
        some.read(range(len(kept)), rows), photos.read(kept, rows), rtol=0, atol=1e-6
    )
    grey = np.full((4, 2), 0.3)
    np.testing.assert_allclose(some.variance(grey), photos.variance(grey), rtol=0.2)
    for mine, expected in zip(some.drift.references, find_references(some.plan), strict=True):
        np.testing.assert_array_equal(mine, expected)


def test_the_noise_of_some_photos_is_theirs_alone(world, shoot):
    repeated = (*PLAN.patterns[:-2], *OTHERS[:8], *PLAN.patterns[-2:])
    plan = PLAN.model_copy(update={"patterns": repeated})
    shot = shoot(plan, world, NOISY)
    again = np.arange(PHOTOS - 2, PHOTOS + 6)
    turned = shot.photos.copy()
    turned[again] = turned[again, ::-1]
    photos = remove_drift(replace(shot, photos=turned))
    grey = np.full((4, 2), 0.3)
    plain = remove_drift(shoot(PLAN, world, NOISY)).variance(grey)
    assert (photos.variance(grey) > 2 * plain).all()
    some = photos.only(np.setdiff1d(np.arange(len(repeated)), again))
    np.testing.assert_allclose(some.variance(grey), plain, rtol=0.2)


def test_the_noise_of_some_photos_is_that_of_rounding_at_least(world, shoot):
    coarse = QUIET.model_copy(update={"bits": 8})
    # Black reads the same level in all photos; others are off the levels once drift is removed.
    photos = remove_drift(_drifting(shoot, world, LAMP, STEADY, coarse))
    some = photos.only(np.arange(PHOTOS))
    rounding = 1 / 255**2 / 12
    assert (some.variance(np.array([[0.0, 0.0], [0.3, 0.3]])) > 0.99 * rounding).all()


def replace_drift(photos):
    """The same photos, nothing taken out."""
    drift = photos.drift
    nothing = replace(drift, ambient=0 * drift.ambient, lamp=np.ones_like(drift.lamp))
    return replace(photos, drift=nothing)


def _rescaled(found, plain):
    """Responses per unit of white: what lamp counts as 1 is a matter of definition."""
    light = found.response_indices([DC])[0]
    gain = plain.responses[..., light].sum(axis=0) / found.responses[..., light].sum(axis=0)
    return found.responses * gain[:, None]


def _relighting(photos, world):
    """SNR_b, mean over pictures, up to the lamp's unit."""
    measurements = measure(photos)
    transport = estimate(
        measurements, world.correspondence, PLAN.window, PLAN.far, PLAN.dropped, rounds=8
    )
    found = []
    for seed in range(3):
        light = natural_picture(PROJECTOR, seed)
        truth, picture = world @ light, transport @ light
        found.append(snr(truth * (np.vdot(truth, picture) / np.vdot(truth, truth)), picture))
    return np.mean(found)


def test_drift_costs_next_to_nothing(world, shoot):
    lost, lost_raw = [], []
    for seed in range(2):
        still = _relighting(_drifting(shoot, world, STEADY, STEADY, seed=seed), world)
        photos = _drifting(shoot, world, LAMP, AMBIENT, seed=seed)
        lost.append(still - _relighting(photos, world))
        lost_raw.append(still - _relighting(replace_drift(remove_drift(photos)), world))
    assert np.mean(lost) < 0.5
    assert np.mean(lost_raw) > 5


def test_ambient_light_has_a_picture_of_its_own(world, shoot):
    photos = _drifting(shoot, world, STEADY, STEADY, QUIET)
    y, x = np.indices(world.camera)
    window = 2000 * (1 + np.sin(x / 4) * np.cos(y / 5))[..., None]
    share = np.linspace(0, 2, PHOTOS)[:, None, None, None]
    lit = np.rint(photos.photos + share * window).astype(np.uint16)
    plain = measure(photos).responses
    found = measure(replace(photos, photos=lit)).responses
    assert np.abs(found - plain).max() < 1e-4
    raw = measure(replace_drift(remove_drift(replace(photos, photos=lit)))).responses
    assert np.abs(raw - plain).max() > 0.01


@pytest.mark.parametrize("black", [0.0, 0.1])
def test_whites_and_blacks_may_be_shot_at_other_times(world, shoot, black):
    # The mean of the whites is one of dim ambient light, that of the blacks of a bright one.
    plan = PLAN.model_copy(update={"patterns": with_references(OTHERS, 2, 7)})
    count = len(plan.patterns)
    ambient = SimulatedDrift(swing=1.0, period=2 * count)
    lamp = SimulatedDrift(swing=0.5, period=2 * count) if black else STEADY
    photos = shoot(
        plan,
        world,
        QUIET.model_copy(update={"ambient": 0.05, "ambient_drift": ambient}),
        SimulatedProjector(lamp_drift=lamp, black_level=black),
    )
    drift = follow_drift(photos).drift
    light = (world @ np.ones(PROJECTOR)) * _at(lamp, drift.references.whites).mean()
    np.testing.assert_allclose(drift.light, light, atol=3e-4)
    steadied = drift.remove_from(
        photos.read(drift.references.blacks, slice(None)), drift.references.blacks, slice(None)
    )
    np.testing.assert_allclose(steadied, np.stack([drift.black] * 7), atol=5e-5)


def test_what_moves_or_saturates_does_not_decide(world, shoot):
    photos = _drifting(shoot, world, LAMP, AMBIENT)
    still = follow_drift(photos).drift
    spoiled = photos.photos.copy()
    generator = np.random.default_rng(0)
    spoiled[:, 3:6] = generator.integers(300, 9000, size=spoiled[:, 3:6].shape)
    spoiled[:, 10:12] = 16383
    drift = follow_drift(replace(photos, photos=spoiled)).drift
    np.testing.assert_allclose(drift.lamp, still.lamp, atol=1e-3)
    rest = np.r_[0:3, 6:10, 12:24]
    for number in range(0, PHOTOS, 9):
        one, other = (
            d.remove_from(photos.read([number], slice(None)), [number], slice(None))[:, rest]
            for d in (still, drift)
        )
        np.testing.assert_allclose(other, one, atol=1e-3)


def test_a_channel_without_light_is_taken_as_steady(world, shoot):
    photos = _drifting(shoot, world, LAMP, STEADY)
    dark = photos.photos.copy()
    dark[..., 1] = np.random.default_rng(0).integers(300, 304, size=dark[..., 1].shape)
    drift = follow_drift(replace(photos, photos=dark)).drift
    assert np.all(drift.lamp[:, 1] == 1.0)
    assert drift.lamp_range == pytest.approx(0.1, abs=0.01)
    assert np.all(np.isfinite(measure(replace(photos, photos=dark)).responses))


def test_a_lamp_that_failed_is_told(world, shoot):
    photos = _drifting(shoot, world, STEADY, STEADY)
    whites, blacks = find_references(PLAN)
    failed = photos.photos.copy()
    failed[whites[2]] = failed[blacks[2]]
    with pytest.raises(InputError, match=f"photo {whites[2]}, of white"):
        measure(replace(photos, photos=failed))


@pytest.mark.parametrize("which", [0, 2, -1])
def test_a_black_that_shows_white_is_told_from_a_lamp_that_failed(world, shoot, which):
    photos = _drifting(shoot, world, STEADY, STEADY)
    whites, blacks = find_references(PLAN)
    late = photos.photos.copy()
    late[blacks[which]] = late[whites[which]]
    with pytest.raises(InputError, match=f"photo {blacks[which]}, of black, shows light"):
        measure(replace(photos, photos=late))


def test_robust_fits_are_exact_and_deaf():
    generator = np.random.default_rng(0)
    shapes = np.stack([np.ones(2000), generator.uniform(size=2000)])
    values = 0.3 * shapes[0] - 1.7 * shapes[1]
    values[:600] += generator.uniform(1, 50, size=600)
    found, _ = robust_fit(shapes, values)
    np.testing.assert_allclose(found, [0.3, -1.7], atol=1e-6)
    noisy = values + 0.01 * generator.normal(size=2000)
    found, error = robust_fit(shapes[:1], noisy + 1.7 * shapes[1])
    assert found[0] == pytest.approx(0.3, abs=5 * error)
    assert error == pytest.approx(0.01 / np.sqrt(1400), rel=0.8)


def test_shapes_that_are_alike_or_nothing_do_no_harm():
    shapes = np.stack([np.ones(50), np.full(50, 0.2), np.zeros(50)])
    found, _ = robust_fit(shapes, np.full(50, 0.7))
    assert found @ shapes[:, 0] == pytest.approx(0.7)
    assert found[2] == 0
    nothing, error = robust_fit(np.zeros((1, 50)), np.ones(50))
    assert nothing[0] == 0
    assert error == np.inf
