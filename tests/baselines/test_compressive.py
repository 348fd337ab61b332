"""Compressive light transport: exact where rows are sparse, fair where they are not."""

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.baselines.choosing import best_share, held_out_share
from nearfar.baselines.compressive import PENALTY_SHARES, reconstruct_compressive
from nearfar.baselines.haar import inverse_haar
from nearfar.baselines.random_patterns import (
    CompressiveMeasurements,
    bernoulli_patterns,
    measure_by_rig,
    measure_without_noise,
)
from nearfar.errors import InputError
from nearfar.rigs.simulated.camera import SimulatedCamera
from nearfar.rigs.simulated.projector import SimulatedProjector
from nearfar.rigs.simulated.rig import SimulatedRig
from nearfar.transport.exact import ExactTransport
from tests.conftest import QUIET

PROJECTOR, CAMERA = Size(13, 17), Size(4, 6)


def _sparse_world(wavelets=4, channels=2, seed=0):
    """Each row a mean and a few wavelets; no picture is above 0.7 or below 0."""
    generator = np.random.default_rng(seed)
    rows = channels * CAMERA.pixels
    coefficients = np.zeros((rows, PROJECTOR.pixels))
    for row in coefficients:
        chosen = 1 + generator.choice(PROJECTOR.pixels - 1, size=wavelets, replace=False)
        row[chosen] = generator.choice([-1, 1], wavelets) * generator.uniform(0.5, 1, wavelets)
    pictures = inverse_haar(coefficients.reshape(-1, *PROJECTOR)).reshape(rows, -1)
    pictures -= pictures.min(axis=1, keepdims=True)
    pictures *= 0.7 / pictures.sum(axis=1, keepdims=True)
    far = pictures.reshape(channels, CAMERA.pixels, -1).astype(np.float32)
    return ExactTransport(PROJECTOR, CAMERA, (), (), far, "sparse")


def _dense_world(seed=0, channels=2):
    """Rows that are sparse but for a little of everything."""
    generator = np.random.default_rng(seed)
    world = _sparse_world(channels=channels, seed=seed)
    far = world.far + np.float32(2e-4) * generator.random(world.far.shape, dtype=np.float32)
    return ExactTransport(PROJECTOR, CAMERA, (), (), far, "dense")


def _decibels(truth, found):
    return 20 * np.log10(np.linalg.norm(truth) / np.linalg.norm(truth - found))


def test_patterns_are_fair_coins_of_their_seed():
    patterns = bernoulli_patterns(PROJECTOR, 400, seed=3)
    assert patterns.dtype == bool
    assert patterns.shape == (400, *PROJECTOR)
    assert patterns.mean() == pytest.approx(0.5, abs=0.01)
    signs = 2.0 * patterns.reshape(400, -1) - 1
    off = np.abs(signs @ signs.T / PROJECTOR.pixels - np.eye(400))
    assert off.max() < 6 / np.sqrt(PROJECTOR.pixels)
    assert np.array_equal(patterns, bernoulli_patterns(PROJECTOR, 400, seed=3))
    assert not np.array_equal(patterns, bernoulli_patterns(PROJECTOR, 400, seed=4))


def test_theory_is_the_transport_times_the_patterns():
    world = _dense_world()
    patterns = bernoulli_patterns(PROJECTOR, 50, seed=0)
    measurements = measure_without_noise(world, patterns)
    expected = world.far @ patterns.reshape(50, -1).T.astype(np.float32)
    np.testing.assert_allclose(measurements.responses, np.moveaxis(expected, 0, 1), rtol=1e-5)
    assert measurements.photos == 50


def test_photos_give_the_same_under_ambient_light_and_black_levels():
    world = _sparse_world()
    patterns = bernoulli_patterns(PROJECTOR, 70, seed=0)
    camera = QUIET.model_copy(update={"ambient": 0.1, "black_level": 0.05})
    optics = SimulatedProjector(black_level=0.05)
    measurements = measure_by_rig(SimulatedRig(world, "test", optics, camera, 1.0, 0), patterns)
    theory = measure_without_noise(world, patterns)
    assert measurements.photos == 71
    assert np.abs(measurements.responses - theory.responses).max() < 2e-5


def test_sparse_rows_are_recovered_from_few_patterns():
    world = _sparse_world()
    measurements = measure_without_noise(world, bernoulli_patterns(PROJECTOR, 70, seed=0))
    found = reconstruct_compressive(measurements)
    assert (found.projector, found.camera, found.is_apart) == (PROJECTOR, CAMERA, False)
    assert found.far.dtype == np.float32
    assert _decibels(world.far, found.far) > 80
    # The l1 norm alone takes its toll.
    assert 30 < _decibels(world.far, reconstruct_compressive(measurements, refitted=False).far) < 75
    too_few = measure_without_noise(world, bernoulli_patterns(PROJECTOR, 8, seed=0))
    assert _decibels(world.far, reconstruct_compressive(too_few).far) < 30


def test_every_row_goes_to_its_own_pixel_and_channel():
    world = _sparse_world(channels=3)
    dark = np.array(world.far)
    dark[1, 5] = 0.0
    world = ExactTransport(PROJECTOR, CAMERA, (), (), dark)
    measurements = measure_without_noise(world, bernoulli_patterns(PROJECTOR, 90, seed=1))
    told = []
    found = reconstruct_compressive(measurements, progress=told.append)
    assert not found.far[1, 5].any()
    assert told[-1] == 1.0
    for channel, pixel in ((0, 0), (1, 4), (2, 23)):
        assert _decibels(world.far[channel, pixel], found.far[channel, pixel]) > 60


def test_the_best_share_is_the_best():
    world = _dense_world(channels=1)
    measurements = measure_without_noise(world, bernoulli_patterns(PROJECTOR, 80, seed=0))
    shares = (0.01, 0.3, 0.05)
    choice = best_share(measurements, world, rows=10_000, shares=shares)
    assert choice.shares == tuple(sorted(shares, reverse=True))
    scores = {}
    for i, share in enumerate(choice.shares):
        for refitted, told in ((False, choice.plain), (True, choice.refitted)):
            found = reconstruct_compressive(measurements, share, refitted=refitted)
            scores[share, refitted] = _decibels(world.far, found.far)
            assert scores[share, refitted] == pytest.approx(told[i], abs=0.1)
    assert max(scores, key=scores.get) == (choice.share, choice.is_refitted)
    assert max(scores.values()) > min(scores.values()) + 6


def test_exposure_scales_the_truth():
    world = _dense_world()
    theory = measure_without_noise(world, bernoulli_patterns(PROJECTOR, 60, seed=0))
    longer = CompressiveMeasurements(CAMERA, theory.patterns, 2 * theory.responses, 60)
    one = best_share(theory, world, rows=10, shares=[0.01])
    two = best_share(longer, world, rows=10, shares=[0.01], exposure=2.0)
    assert two.plain == pytest.approx(one.plain, abs=0.05)


def test_held_out_patterns_choose_nearly_as_well_as_the_truth():
    world = _sparse_world()
    patterns = bernoulli_patterns(PROJECTOR, 90, seed=0)
    camera = SimulatedCamera(full_well=1e9, read_noise=1e6, bits=16, shot_noise=False)
    rig = SimulatedRig(world, "test", SimulatedProjector(), camera, 1.0, 0)
    measurements = measure_by_rig(rig, patterns)
    informed = best_share(measurements, world, rows=10_000, shares=PENALTY_SHARES[:10])
    blind = held_out_share(measurements, rows=10_000)
    scores = dict(
        zip(informed.shares, zip(informed.plain, informed.refitted, strict=True), strict=True)
    )
    reached = scores[blind.share][int(blind.is_refitted)]
    best = max(*informed.plain, *informed.refitted)
    assert best - 1.5 < reached <= best
    # Noise asks for a lambda inside the grid, and a grid is not followed into the noise.
    assert PENALTY_SHARES[-1] < blind.share < PENALTY_SHARES[0]
    assert len(blind.shares) < len(PENALTY_SHARES)


def test_faults_are_told_in_a_sentence():
    world = _sparse_world()
    patterns = bernoulli_patterns(PROJECTOR, 20, seed=0)
    measurements = measure_without_noise(world, patterns)
    with pytest.raises(InputError, match=r"0 random patterns .*: ask for at least 1\.$"):
        bernoulli_patterns(PROJECTOR, 0, seed=0)
    with pytest.raises(InputError, match=r"all patterns are black, .*: draw others\.$"):
        CompressiveMeasurements(CAMERA, 0 * patterns > 0, measurements.responses, 20)
    with pytest.raises(InputError, match=r"responses of shape .* do not fit .*: give"):
        CompressiveMeasurements(CAMERA, patterns[1:], measurements.responses, 20)
    for share in (0.0, -1.0, 1.5, float("nan")):
        with pytest.raises(InputError, match=r"gives no lambda: choose one above 0 and up to 1\.$"):
            reconstruct_compressive(measurements, share)
    with pytest.raises(InputError, match=r"the light is 13x16, .*: resize the light"):
        measure_without_noise(world, bernoulli_patterns(Size(13, 16), 50, seed=0))
    rig = SimulatedRig(world, "test", SimulatedProjector(), QUIET, 1.0, 0)
    with pytest.raises(InputError, match=r"patterns are 13x16, .* is 13x17: draw them of its size"):
        measure_by_rig(rig, bernoulli_patterns(Size(13, 16), 5, seed=0))
    other = _sparse_world(channels=1)
    with pytest.raises(InputError, match=r"the truth is of .*: compare two of the same scene"):
        best_share(measurements, other)
    for shares in ((), (0.0,), (2.0,)):
        with pytest.raises(InputError, match=r"give no lambda: try some above 0 and up to 1\.$"):
            best_share(measurements, world, shares=shares)
    for held_out in (0, 20):
        with pytest.raises(InputError, match=r"of 20 patterns cannot be held out: keep back"):
            held_out_share(measurements, held_out=held_out)
