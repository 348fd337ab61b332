"""Captures without check photos: what stripes, Gray code, inverse pairs and repeats tell."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from benchmarks.spoils import SPOILS, shoot_plan

from nearfar.arrays import Size
from nearfar.capture.writing import write_capture
from nearfar.illumination.frequencies import DC
from nearfar.photometry.by_inverse import find_pairs
from nearfar.plan import choose_plan, paper_plan
from nearfar.rigs.simulated.camera import SimulatedCamera
from nearfar.transport.stored import open_transport
from nearfar.workflow.diagnosis.diagnose import find_what_spoils
from nearfar.workflow.diagnosis.inverse_pairs import find_motion_by_pairs
from nearfar.workflow.diagnosis.misfit import fit_photos, serves
from nearfar.workflow.diagnosis.sample import sample_camera
from nearfar.workflow.evaluate import decibels, exposure_of
from nearfar.workflow.reconstruction.options import ReconstructionOptions
from nearfar.workflow.reconstruction.reconstruct import reconstruct_to_file
from nearfar.workflow.verdict.by_correspondence import measure_by_correspondence
from nearfar.workflow.verdict.correspondence_lights import correspondence_lights
from nearfar.workflow.verdict.repeats import measure_repeats
from nearfar.workflow.verdict.verdict import judge, judge_reconstruction

PROJECTOR = Size(16, 16)


@pytest.fixture(scope="module")
def reconstructed(tmp_path_factory):
    """Return the shot, the capture and the transport of a plan, by what spoils its photos."""

    @cache
    def shot_of(offset, correspondence, window):
        if offset is None:
            return shoot_plan("cornell", choose_plan(PROJECTOR, 60, checks=0)[0])
        plan = paper_plan(
            PROJECTOR,
            window,
            (window - 2, window - 2),
            offset=offset,
            correspondence=correspondence,
        )
        return shoot_plan("cornell", plan)

    @cache
    def make(offset, correspondence, method="joint", spoil=None, strength=0.0, window=5):
        shot = shot_of(offset, correspondence, window)
        photos = shot.photos if spoil is None else SPOILS[spoil].apply(shot, strength)
        folder = tmp_path_factory.mktemp("made")
        capture = write_capture(
            shot.plan, folder / "c.zarr", list(photos), full_scale=shot.full_scale
        )
        options = ReconstructionOptions(method=method)
        reconstruct_to_file(capture, folder / "t.zarr", options=options)
        return shot, capture, open_transport(folder / "t.zarr")

    return make


def _true_snr(shot, transport, lights):
    exposure = np.float32(exposure_of(transport, shot.truth).factor)
    found = []
    for light in lights:
        known, relit = ((each @ light.light).ravel() for each in (shot.truth, transport))
        known = known * exposure
        found.append(decibels(np.sum(known**2), np.sum((known - relit) ** 2)))
    return float(np.mean(found))


@pytest.mark.parametrize(
    ("offset", "correspondence", "method"),
    [
        ("inverse", "stripes", "paper"),
        ("inverse", "gray", "joint"),
        ("reference", "stripes", "paper"),
        ("reference", "gray", "joint"),
    ],
)
def test_held_out_snr_is_the_true_one_of_the_same_lights(
    reconstructed, offset, correspondence, method
):
    shot, capture, stored = reconstructed(offset, correspondence, method)
    held_out = measure_by_correspondence(stored, capture)
    lights = correspondence_lights(capture.plan)
    assert len(held_out.lights) == 4
    coarse = [light for light in lights if not light.is_fine]
    assert held_out.snr == pytest.approx(_true_snr(shot, stored.rows(), coarse), abs=2.0)
    fine = [light for light in lights if light.is_fine]
    of_fine = np.mean([light.snr for light in held_out.fine])
    assert of_fine == pytest.approx(_true_snr(shot, stored.rows(), fine), abs=2.5)
    assert (held_out.expected_snr is None) == (method == "paper")
    verdict = judge(held_out, [])
    assert verdict.grade == "good"
    assert str(verdict).startswith("good: Relit half-screens and wide bars are off by ")
    assert ("at least" in str(verdict)) == held_out.is_least


@pytest.mark.parametrize("offset", ["inverse", None])
def test_repeats_tell_the_noise_of_a_capture_without_checks(reconstructed, offset):
    shot, capture, stored = reconstructed(offset, "phase")
    found = measure_repeats(capture, stored.provenance)
    white = 0.9 * np.asarray(shot.truth @ np.ones(PROJECTOR)).ravel()
    white /= white.max()
    electrons = SimulatedCamera().full_well
    expected = decibels(np.sum(white**2), np.sum(white / electrons))
    assert found.white_snr == pytest.approx(expected, abs=1.0)
    assert found.scatter == pytest.approx(1.0, abs=0.1)
    assert max(found.lamp, found.ambient) < 0.01
    assert (found.excess is None) == (offset is None)
    assert f"{found.white_snr:.1f} dB over its noise" in str(judge_reconstruction(stored, capture))


@pytest.mark.parametrize("offset", ["inverse", None])
def test_repeats_tell_the_noise_of_what_is_not_saturated(reconstructed, tmp_path, offset):
    shot, _, stored = reconstructed(offset, "phase")
    photos = shot.counts(1.3 * shot.photos.astype(np.float64))
    bright = write_capture(shot.plan, tmp_path / "c.zarr", list(photos), full_scale=shot.full_scale)
    found = measure_repeats(bright, stored.provenance)
    white = np.asarray(shot.truth @ np.ones(PROJECTOR))
    white *= 0.9 / white.max()
    usable = ~(photos == photos.max()).any(axis=0).reshape(white.shape)
    assert 0.5 < usable.mean() < 0.9
    camera = SimulatedCamera()
    electrons = camera.full_well * (white + camera.ambient) + camera.read_noise**2
    noise = electrons / camera.full_well**2
    expected = decibels(np.sum(white[usable] ** 2), np.sum(noise[usable]))
    assert found.white_snr == pytest.approx(expected, abs=0.5)
    assert found.scatter == pytest.approx(1.0, abs=0.1)


@pytest.mark.parametrize(("count", "tells"), [(1, False), (2, True)])
def test_a_single_pair_does_not_tell_that_the_light_changed(reconstructed, tmp_path, count, tells):
    shot, _, stored = reconstructed("inverse", "phase")
    pairs = find_pairs(shot.plan)
    white = [pair for pair in pairs if pair.frequency == DC]
    others = [pair for pair in pairs if not pair.frequency.is_own_negative][:count]
    numbers = [n for pair in (*white, *others) for n in (pair.photo, pair.inverse)]
    patterns = tuple(shot.plan.patterns[number] for number in numbers)
    capture = write_capture(
        shot.plan.model_copy(update={"patterns": patterns}),
        tmp_path / "c.zarr",
        list(shot.photos[numbers]),
        full_scale=shot.full_scale,
    )
    found = measure_repeats(capture, stored.provenance)
    assert (found.lamp is not None) == tells
    assert ("the light changed by" in str(found)) == tells


def test_pairs_tell_that_the_response_is_not_linear(reconstructed):
    _, capture, stored = reconstructed("inverse", "phase", "joint", "gamma", 1.1)
    assert measure_repeats(capture, stored.provenance).excess < -0.01
    verdict = judge_reconstruction(stored, capture)
    assert verdict.causes == ("not-linear", "unchecked")


def test_stripes_and_gray_code_are_no_photos_that_do_not_fit(reconstructed):
    _, capture, stored = reconstructed("reference", "gray")
    sample = sample_camera(capture, lambda _: None)
    misfit = fit_photos(sample.without_drift(), sample.of_transport(stored)).misfit
    own = serves(capture.plan, "correspondence")
    assert np.all(misfit[own] == 0)
    assert np.all(misfit[~own] > 0)


def test_gray_code_tells_that_the_response_is_not_linear(reconstructed):
    _, capture, stored = reconstructed("reference", "gray", "paper", "gamma", 1.2)
    verdict = judge(measure_by_correspondence(stored, capture), [])
    assert verdict.causes == ("not-linear",)


def test_good_photos_are_not_accused_whatever_the_method(reconstructed):
    # The paper's estimate is farther from these photos than noise is.
    _, capture, stored = reconstructed("reference", "gray", "paper", window=7)
    assert find_what_spoils(stored, capture) == []


def test_pairs_tell_that_the_camera_moved(reconstructed):
    shot, capture, stored = reconstructed("inverse", "gray", "joint", "camera moved, pixels", 0.3)
    verdict = judge_reconstruction(stored, capture)
    assert verdict.grade != "good"
    assert verdict.causes == ("moved",)
    (found,) = find_what_spoils(stored, capture)
    # A pair is two photos, and one of them lies between.
    assert abs(found.photo - shot.half) <= 2
    assert found.pixels == pytest.approx(0.3, abs=0.1)


def test_fine_lights_count_where_they_are_far_beyond_the_error_bars(reconstructed):
    _, capture, stored = reconstructed("inverse", "gray")
    held_out = measure_by_correspondence(stored, capture)
    fine = tuple(replace(each, expected_error=each.expected_error / 100) for each in held_out.fine)
    verdict = judge(replace(held_out, fine=fine), [])
    assert (verdict.grade, verdict.causes) == ("doubtful", ("model",))
    assert verdict.held_out.snr == held_out.snr


def test_few_pairs_tell_of_no_motion(reconstructed):
    _, capture, _ = reconstructed("inverse", "gray")
    sample = sample_camera(capture, lambda _: None)
    few = sample.plan.first(2)
    assert find_motion_by_pairs(replace(sample, plan=few, photos=sample.photos[:2])) == []


def _with_rows(monkeypatch, stored, change):
    """Change what is read of a stored transport."""
    rows = type(stored).rows
    monkeypatch.setattr(type(stored), "rows", lambda self, *which: change(rows(self, *which)))


def test_what_saturated_camera_pixels_hold_does_not_matter(reconstructed, monkeypatch):
    _, capture, stored = reconstructed("reference", "gray")
    found = []
    for factor in (1, 5):

        def change(block, factor=factor):
            saturated = np.arange(block.camera.pixels).reshape(block.camera) % 3 == 0
            direct = np.where(saturated[..., None], factor, 1) * block.direct
            quality = replace(block.quality, saturated=saturated)
            return replace(block, direct=direct, quality=quality)

        with monkeypatch.context() as patched:
            _with_rows(patched, stored, change)
            found.append(measure_by_correspondence(stored, capture))
    assert found[0] == found[1]
    assert found[0] != measure_by_correspondence(stored, capture)


def test_a_camera_of_saturated_pixels_checks_nothing(reconstructed, monkeypatch):
    _, capture, stored = reconstructed("reference", "gray")

    def saturated(block):
        every = np.ones_like(block.quality.saturated)
        return replace(block, quality=replace(block.quality, saturated=every))

    _with_rows(monkeypatch, stored, saturated)
    assert measure_by_correspondence(stored, capture) is None
    (reason,) = judge_reconstruction(stored, capture).reasons
    assert reason.sentence.startswith("nothing was checked: every camera pixel is saturated.")
