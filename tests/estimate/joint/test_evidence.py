"""Which kind a camera pixel is: against dense Gaussian algebra, and as kinds are drawn."""

from dataclasses import replace

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.estimate.joint import estimate_jointly
from nearfar.estimate.joint.evidence import best_kind, evidence, screened, tell
from nearfar.estimate.joint.prior import build_prior
from nearfar.illumination.frequencies import DC
from nearfar.illumination.real_basis import real_basis
from nearfar.photometry.measurements import Measurements
from nearfar.plan.choose import choose_frequencies
from nearfar.transport.kinds import LIT, STRENGTHS, Kind
from tests.estimate.joint.draws import (
    KIND,
    band_of_all,
    chosen_frequencies,
    dense,
    drawn_rows,
    measured,
    pixels_of,
)
from tests.worlds import model_transport


@pytest.mark.parametrize("offset", [0.0, 1e-3, 1e-2])
def test_the_evidence_is_that_of_dense_algebra(offset):
    centres = np.array([[8, 10], [7, 9], [6, 12]])
    frequencies = chosen_frequencies()
    band = band_of_all(frequencies)
    rows, _ = drawn_rows(len(centres), centres, 0.02)
    measurements = measured(rows, frequencies, noise=2e-3, offset=offset)
    pixels = pixels_of(measurements, centres, band)
    prior = build_prior(KIND, band, measurements.multiplicity[band.places])
    found = evidence(tell(pixels), prior)
    expected = np.stack(
        [dense(measurements, pixels, band, strength)[3] for strength in STRENGTHS], axis=1
    )
    # The table rounds (s / sigma)^2 to half a step, which the log evidence feels a little.
    difference = (found - found[:, :1]) - (expected - expected[:, :1])
    spread = expected.max(axis=1) - expected.min(axis=1)
    assert np.abs(difference).max(axis=1) == pytest.approx(0, abs=0.02 * spread.max() + 1.0)
    assert np.array_equal(found.argmax(axis=1), expected.argmax(axis=1))


def test_a_camera_pixel_chooses_the_kind_that_it_was_drawn_from():
    generator = np.random.default_rng(3)
    centres = np.stack([generator.integers(4, 12, 200), generator.integers(4, 16, 200)], axis=1)
    frequencies = chosen_frequencies()
    band = band_of_all(frequencies)
    rows, _ = drawn_rows(len(centres), centres, 0.02)
    measurements = measured(rows, frequencies, noise=1e-3)
    pixels = pixels_of(measurements, centres, band)
    far_from = Kind(6.0, 256.0, 0.7)
    priors = [
        build_prior(kind, band, measurements.multiplicity[band.places]) for kind in (KIND, far_from)
    ]
    kind, strength, _ = best_kind(
        pixels, screened(priors, band, measurements.multiplicity[band.places])
    )
    assert np.mean(kind == 0) > 0.95
    # 0.02 in photo units, of a white that is 0.5 and a little.
    white = pixels.white[:, 0]
    assert np.median(strength * white) == pytest.approx(0.02, rel=0.5)


def test_few_responses_narrow_the_kinds_down_and_all_choose(monkeypatch):
    generator = np.random.default_rng(3)
    centres = np.stack([generator.integers(4, 12, 100), generator.integers(4, 16, 100)], axis=1)
    frequencies = chosen_frequencies()
    band = band_of_all(frequencies)
    multiplicity = np.ones(band.basis.count, dtype=np.float32)
    priors = tuple(build_prior(kind, band, multiplicity) for kind in LIT)
    unscreened = screened(priors, band, multiplicity)
    assert unscreened.screens is priors
    monkeypatch.setattr("nearfar.estimate.joint.evidence.RESPONSES", 24)
    narrowed = screened(priors, band, multiplicity)
    assert len(narrowed.chosen) == pytest.approx(24, abs=1)
    worse = []
    for strength in (0.003, 0.02, 0.1):
        rows, _ = drawn_rows(len(centres), centres, strength)
        pixels = pixels_of(measured(rows, frequencies, noise=1e-3), centres, band)
        _, _, most = best_kind(pixels, unscreened)
        kind, _, found = best_kind(pixels, narrowed)
        # What is told of the kind that was chosen is told by all responses.
        values = np.stack([evidence(tell(pixels), prior).max(axis=1) for prior in priors])
        # Sums of squares are float32, and how they round depends on which pixels stand beside.
        told = tell(pixels)
        squares = np.bincount(told.pixel, np.sum(told.responses.astype(np.float64) ** 2, axis=1))
        rounding = np.finfo(np.float32).eps / 4 * squares
        assert np.median(rounding) < 0.3
        chosen = values[kind, np.arange(100)]
        assert (np.abs(found - chosen) <= 1e-4 * np.abs(chosen) + rounding).all()
        worse.append(most - found)
    # Odds of 20 against the kind that few responses left: hardly ever, of the 300.
    assert np.mean(np.concatenate(worse) > 3.0) < 0.03


@pytest.mark.parametrize(
    ("projector", "window"),
    [(Size(1, 20), 1), (Size(1, 20), 5), (Size(20, 2), 4), (Size(16, 20), 2)],
)
def test_narrow_projectors_and_windows_are_reconstructed(projector, window):
    world = model_transport(projector, projector, window=3, far=Size(1, 1), entries=0)
    world = replace(world, near=np.zeros_like(world.near))
    frequencies = list(choose_frequencies(projector, 40, window).frequencies)
    basis = real_basis([DC, *frequencies], projector)
    rows = world.dense().astype(np.float64)
    responses = rows @ basis.patterns.T.astype(np.float64)
    noise = np.full(rows.shape[:2], 1e-4, dtype=np.float32)
    responses += 1e-4 * np.random.default_rng(0).normal(size=responses.shape)
    measurements = Measurements(
        camera=world.camera,
        basis=basis,
        responses=responses.astype(np.float32),
        noise=noise,
        black=np.zeros_like(noise),
        quantisation_error=np.zeros((basis.count, projector.pixels), dtype=np.float32),
    )
    found = estimate_jointly(measurements, world.correspondence, window, Size(1, 1))
    light = np.random.default_rng(1).random(projector)
    truth = world @ light
    assert np.linalg.norm(found @ light - truth) < 0.01 * np.linalg.norm(truth)


def test_kinds_are_different():
    assert len(set(LIT)) == len(LIT)
