"""Evidence of prior components: against dense Gaussian algebra, and of rows drawn from them."""

from dataclasses import replace

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.estimate.joint import estimate_jointly, evidence
from nearfar.estimate.joint.evidence import (
    best_between_scales,
    best_of,
    log_evidence,
    log_evidence_by_row,
    log_evidences,
    prior_set,
    whiten,
)
from nearfar.estimate.joint.problem import lay_out
from nearfar.estimate.joint.sweep import sweep_once
from nearfar.illumination.frequencies import DC
from nearfar.illumination.near_basis import NearBasis
from nearfar.illumination.real_basis import real_basis
from nearfar.photometry.measurements import Measurements
from nearfar.plan.choose_frequencies import choose_frequencies
from nearfar.priors.component import PriorComponent
from nearfar.priors.fitted import LIT_COMPONENTS, PRIOR_SCALES
from nearfar.priors.responses import response_prior
from tests.estimate.joint.draws import (
    COMPONENT,
    PROJECTOR,
    WINDOW,
    batch_of,
    centred_on_all,
    chosen_frequencies,
    dense,
    drawn_rows,
    measured,
)
from tests.worlds import model_transport


def most_probable(batch, candidates):
    return best_of(log_evidences(batch, candidates, log_evidence), candidates)


@pytest.mark.parametrize("offset", [0.0, 1e-3, 1e-2])
def test_the_evidence_is_that_of_dense_algebra(offset):
    centres = np.array([[8, 10], [7, 9], [6, 12]])
    frequencies = chosen_frequencies()
    centred = centred_on_all(frequencies)
    rows, _ = drawn_rows(len(centres), centres, 0.02)
    measurements = measured(rows, frequencies, noise=2e-3, offset=offset)
    batch = batch_of(measurements, centres, centred)
    prior = response_prior(COMPONENT, centred, measurements.multiplicity[centred.response_indices])
    found = log_evidence(whiten(batch), prior)
    known = whiten(batch._replace(of_offset=batch.of_offset[:, :0]))
    by_row = log_evidence_by_row(known, prior)
    np.testing.assert_allclose(by_row, log_evidence(known, prior), rtol=1e-4, atol=0.1)
    expected = np.stack(
        [dense(measurements, batch, centred, scale)[3] for scale in PRIOR_SCALES], axis=1
    )
    # The table rounds (s / sigma)^2 to half a step, which the log evidence feels a little.
    difference = (found - found[:, :1]) - (expected - expected[:, :1])
    spread = expected.max(axis=1) - expected.min(axis=1)
    assert np.abs(difference).max(axis=1) == pytest.approx(0, abs=0.02 * spread.max() + 1.0)
    assert np.array_equal(found.argmax(axis=1), expected.argmax(axis=1))


@pytest.mark.parametrize("offset", [0.0, 1e-2])
def test_sums_by_a_compiled_loop_are_those_of_products_with_tables(offset, monkeypatch):
    """Arrays of an accelerator have the latter."""
    centres = np.array([[8, 10], [7, 9], [6, 12], [8, 11], [5, 5]])
    frequencies = chosen_frequencies()
    centred = centred_on_all(frequencies)
    rows, _ = drawn_rows(len(centres), centres, 0.02)
    # Rows of two tables, one of them of several rows.
    rows[2:] *= 3.0
    measurements = measured(rows, frequencies, noise=2e-3, offset=offset)
    whitened = whiten(batch_of(measurements, centres, centred))
    assert 1 < len(np.unique(whitened.table_step)) < len(whitened.table_step)
    prior = response_prior(COMPONENT, centred, measurements.multiplicity[centred.response_indices])
    # Determinants of many channels are more than any number.
    channels = 100
    each = {"responses", "white_ratio", "offset_ratio", "table_step", "pixel"}
    many = whitened._replace(
        **{name: np.repeat(getattr(whitened, name), channels, axis=0) for name in each}
    )
    by_loop = [log_evidence(one, prior) for one in (whitened, many)]
    monkeypatch.setattr(evidence, "is_numpy_array", lambda _array: False)
    for one, found in zip((whitened, many), by_loop, strict=True):
        np.testing.assert_allclose(log_evidence(one, prior), found, rtol=1e-11)
    np.testing.assert_allclose(by_loop[1], channels * by_loop[0], rtol=1e-11)


def test_a_camera_pixel_chooses_the_prior_component_that_it_was_drawn_from():
    generator = np.random.default_rng(3)
    centres = np.stack([generator.integers(4, 12, 200), generator.integers(4, 16, 200)], axis=1)
    frequencies = chosen_frequencies()
    centred = centred_on_all(frequencies)
    rows, _ = drawn_rows(len(centres), centres, 0.02)
    measurements = measured(rows, frequencies, noise=1e-3)
    batch = batch_of(measurements, centres, centred)
    far_from = PriorComponent(6.0, 256.0, 0.7)
    priors = [
        response_prior(one, centred, measurements.multiplicity[centred.response_indices])
        for one in (COMPONENT, far_from)
    ]
    component, scale, _ = most_probable(
        batch,
        prior_set(priors, centred, measurements.multiplicity[centred.response_indices]),
    )
    assert np.mean(component == 0) > 0.95
    # Among fewer, it keeps the numbers that they had among all.
    numbered = prior_set(
        priors, centred, measurements.multiplicity[centred.response_indices], (7, 3)
    )
    again, its_scale, _ = most_probable(batch, numbered)
    np.testing.assert_array_equal(again, np.array([7, 3])[component])
    np.testing.assert_array_equal(its_scale, scale)
    only, _, _ = most_probable(batch, numbered.only((3,)))
    assert np.all(only == 3)
    # 0.02 in photo units, of a white that is 0.5 and a little.
    white = batch.white[:, 0]
    assert np.median(scale * white) == pytest.approx(0.02, rel=0.5)


def test_scales_between_those_that_are_tried_are_the_evidences_own():
    priors = tuple(response_prior(COMPONENT, *built) for built in [_built()] * 2)
    candidates = prior_set(priors, *_built(), numbers=(3, 7))
    steps = np.log2(np.array(PRIOR_SCALES))
    peaks = np.array([steps[4] + 0.3, steps[2] - 0.45, steps[0] - 2.0, steps[-1] + 0.2])
    values = -((steps - peaks[:, None]) ** 2)
    values = np.stack(
        [values - [[0.0], [5.0], [0.0], [5.0]], values - [[5.0], [0.0], [5.0], [0.0]]]
    )
    number, scale, evidence = best_between_scales(values, candidates)
    assert number.tolist() == [3, 7, 3, 7]
    expected = [*peaks[:2], steps[0], steps[-1]]
    np.testing.assert_allclose(np.log2(scale), expected, atol=1e-9)
    np.testing.assert_array_equal(evidence, best_of(values, candidates)[2])
    # Photos may be very sure of the first scale or the last.
    np.testing.assert_allclose(best_between_scales(1e5 * values, candidates)[1], scale)
    flat = np.zeros_like(values)
    assert best_between_scales(flat, candidates)[1] == pytest.approx([PRIOR_SCALES[0]] * 4)


def test_rows_without_direct_light_have_scales_between_those_that_are_tried():
    rows = np.random.default_rng(0).uniform(size=(40, 1, PROJECTOR.pixels)) / PROJECTOR.pixels
    measurements = measured(rows, chosen_frequencies(), noise=1e-3)
    q = np.full((1, 40, 2), np.nan)
    problem = lay_out(measurements, q, NearBasis(WINDOW), "cpu")
    choice = sweep_once(problem, None, lambda _share: None).choices.sweeps[-1]
    steps = np.log2(choice.prior_scale / PRIOR_SCALES[0])
    assert np.abs(steps - np.rint(steps)).mean() > 0.1


def _built():
    centred = centred_on_all(chosen_frequencies())
    return centred, np.ones(centred.basis.count, dtype=np.float32)


def test_few_responses_make_a_shortlist_and_all_choose(monkeypatch):
    generator = np.random.default_rng(3)
    centres = np.stack([generator.integers(4, 12, 100), generator.integers(4, 16, 100)], axis=1)
    frequencies = chosen_frequencies()
    centred = centred_on_all(frequencies)
    multiplicity = np.ones(centred.basis.count, dtype=np.float32)
    priors = tuple(response_prior(one, centred, multiplicity) for one in LIT_COMPONENTS)
    unscreened = prior_set(priors, centred, multiplicity)
    assert unscreened.screens is priors
    monkeypatch.setattr("nearfar.estimate.joint.evidence.SCREENING_RESPONSES", 24)
    narrowed = prior_set(priors, centred, multiplicity)
    assert len(narrowed.screening) == pytest.approx(24, abs=1)
    worse = []
    for scale in (0.003, 0.02, 0.1):
        rows, _ = drawn_rows(len(centres), centres, scale)
        batch = batch_of(measured(rows, frequencies, noise=1e-3), centres, centred)
        _, _, most = most_probable(batch, unscreened)
        component, _, found = most_probable(batch, narrowed)
        # The evidence of the chosen component is that of all responses.
        values = np.stack([log_evidence(whiten(batch), prior).max(axis=1) for prior in priors])
        # Sums of squares are float32, and how they round depends on which pixels stand beside.
        whitened = whiten(batch)
        squares = np.bincount(
            whitened.pixel, np.sum(whitened.responses.astype(np.float64) ** 2, axis=1)
        )
        rounding = np.finfo(np.float32).eps / 4 * squares
        assert np.median(rounding) < 0.3
        chosen = values[component, np.arange(100)]
        assert (np.abs(found - chosen) <= 1e-4 * np.abs(chosen) + rounding).all()
        worse.append(most - found)
    # Odds of 20 against the component that the shortlist left: hardly ever, of the 300.
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
    found = estimate_jointly(measurements, world.correspondence, window, Size(1, 1), pitch=1)
    light = np.random.default_rng(1).random(projector)
    truth = world @ light
    assert np.linalg.norm(found @ light - truth) < 0.01 * np.linalg.norm(truth)


def test_prior_components_are_different():
    assert len(set(LIT_COMPONENTS)) == len(LIT_COMPONENTS)
