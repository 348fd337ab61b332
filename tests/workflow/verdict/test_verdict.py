"""Verdicts: good where all is well, and the cause by name where it is not."""

import json
from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.capture.writing import write_capture
from nearfar.correspondence import Correspondence
from nearfar.plan import paper_plan
from nearfar.plan.checks import check_lights
from nearfar.rigs.simulated.camera import SimulatedCamera
from nearfar.rigs.simulated.projector import SimulatedProjector
from nearfar.rigs.simulated.rig import SimulatedRig
from nearfar.scenes.cache import cached_scene
from nearfar.transport.store import save_transport
from nearfar.transport.stored import open_transport
from nearfar.workflow.acquire import acquire
from nearfar.workflow.diagnosis.diagnose import find_what_spoils
from nearfar.workflow.evaluate import decibels, exposure_of
from nearfar.workflow.reconstruction.options import ReconstructionOptions
from nearfar.workflow.reconstruction.reconstruct import reconstruct_to_file
from nearfar.workflow.verdict import bands as bands_of_cameras
from nearfar.workflow.verdict.bands import CAMERA_PIXELS, bands, sampled_rows
from nearfar.workflow.verdict.by_check_photos import measure_held_out
from nearfar.workflow.verdict.verdict import judge_reconstruction
from tests.cli.conftest import run_nearfar
from tests.plans import chosen_plan

PROJECTOR = Size(24, 24)


@pytest.fixture(scope="module")
def box():
    return cached_scene("cornell", PROJECTOR)


@pytest.fixture(scope="module")
def reconstructed(box, tmp_path_factory):
    """Return the capture and the transport of a rig, by what is wrong with it."""

    @cache
    def make(photos=80, gamma=1.0, full_well=30_000.0, checks=None, exposure=0.9):
        folder = tmp_path_factory.mktemp("made")
        plan = chosen_plan(PROJECTOR, photos, checks=checks)
        camera = SimulatedCamera(full_well=full_well)
        brightest = float((box @ np.ones(PROJECTOR)).max())
        rig = SimulatedRig(
            box, "cornell", SimulatedProjector(gamma=gamma), camera, exposure / brightest, 0
        )
        capture = acquire(plan, folder / "c.zarr", rig)
        reconstruct_to_file(capture, folder / "t.zarr")
        return capture, open_transport(folder / "t.zarr")

    return make


@pytest.mark.parametrize(
    "made", [{}, {"photos": 50}, {"full_well": 3000.0}, {"photos": 120, "full_well": 1e6}]
)
def test_held_out_snr_is_the_true_one(box, reconstructed, made):
    capture, stored = reconstructed(**made)
    held_out = measure_held_out(stored, capture)
    transport = stored.rows()
    exposure = exposure_of(transport, box).factor
    true = []
    for light in check_lights(capture.plan):
        pattern = light.pattern.draw(PROJECTOR) / np.float32(255)
        known, relit = ((each @ pattern).ravel() for each in (box, transport))
        known = known * np.float32(exposure)
        true.append(decibels(np.sum(known**2), np.sum((known - relit) ** 2)))
    assert held_out.snr == pytest.approx(np.mean(true), abs=1.5)
    assert judge_reconstruction(stored, capture).grade == "good"


def test_noise_allows_what_photos_without_it_reach_beyond(reconstructed):
    noisy, quiet = (
        measure_held_out(*reconstructed(full_well=electrons)[::-1]) for electrons in (3000.0, 1e6)
    )

    def mean(errors):
        return np.mean([error / light.pair.signal for error, light in errors])

    caused = mean((light.pair.error, light) for light in noisy.lights)
    caused -= mean((light.pair.error, light) for light in quiet.lights)
    said = np.mean([10 ** (-light.noise_snr / 10) for light in noisy.lights])
    assert decibels(said, caused) == pytest.approx(0.0, abs=2.0)
    assert noisy.expected_snr < noisy.noise_snr < quiet.noise_snr - 10


def spoilt_check_photo(capture, folder, change):
    """Return the verdict where a check photo is changed, and the photo's number."""
    values = capture.read(range(len(capture.plan.patterns)), slice(None))
    light = next(each for each in check_lights(capture.plan) if not each.pattern.inverse)
    (number,) = light.photos
    values[number] = change(values[number])
    values = np.rint(values * capture.full_scale).astype(np.uint16)
    spoilt = write_capture(
        capture.plan, folder / "c.zarr", list(values), full_scale=capture.full_scale
    )
    reconstruct_to_file(spoilt, folder / "t.zarr")
    return judge_reconstruction(open_transport(folder / "t.zarr"), spoilt), number


@pytest.mark.parametrize(("photos", "lights_left"), [(80, 1), (50, 0)])
@pytest.mark.parametrize(
    ("change", "cause"),
    [(lambda photo: photo[::-1, ::-1], "turned"), (lambda photo: 0.8 * photo, "exposure")],
    ids=["rotated", "darker"],
)
def test_spoilt_check_photos_tell_nothing(
    reconstructed, tmp_path, photos, lights_left, change, cause
):
    capture, stored = reconstructed(photos=photos)
    verdict, number = spoilt_check_photo(capture, tmp_path, change)
    good = judge_reconstruction(stored, capture)
    assert verdict.grade == "doubtful"
    assert [each for each in verdict.causes if each != "unchecked"] == [cause]
    assert f"hoto {number} is" in str(verdict)
    if lights_left:
        assert len(verdict.held_out.lights) == len(good.held_out.lights) - 1 == lights_left
        assert verdict.kept.widening < 2
        assert verdict.held_out.snr == pytest.approx(good.held_out.snr, abs=3)
    else:
        assert verdict.held_out is None
        assert "every check photo" in str(verdict)


def test_photos_as_far_off_as_expected_are_not_searched(reconstructed, monkeypatch):
    # One check photo fits badly, by the error of the estimate.
    capture, stored = reconstructed()

    def search(*_args, **_options):
        raise AssertionError("photos were searched")

    monkeypatch.setattr("nearfar.workflow.diagnosis.left_out.estimate_by_sweeps", search)
    assert judge_reconstruction(stored, capture).grade == "good"
    with pytest.raises(AssertionError, match="searched"):
        find_what_spoils(stored, capture)


def test_a_rig_that_is_not_linear_is_wrong_and_named(reconstructed):
    capture, stored = reconstructed(gamma=2.2)
    verdict = judge_reconstruction(stored, capture)
    assert verdict.grade == "wrong"
    assert verdict.causes[0] == "not-linear"
    assert "is not linear" in str(verdict)


def test_without_check_photos_nothing_was_checked(reconstructed):
    capture, stored = reconstructed(checks=0)
    verdict = judge_reconstruction(stored, capture)
    assert verdict.held_out is None
    assert verdict.causes == ("unchecked",)
    found = verdict.as_json()
    (reason,) = found.pop("reasons")
    assert found == {
        "verdict": "doubtful",
        "held_out_dB": None,
        "expected_dB": None,
        "planned_dB": list(capture.plan.expected_snr.pictures),
        "noise_dB": None,
        "causes": ["unchecked"],
    }
    assert str(verdict).endswith(" dB under pictures.")
    assert reason.startswith("nothing was checked: the plan has neither check photos, ")
    assert ". Known is this: one photo of white is " in reason


def test_inverse_pairs_alone_and_square_transports_are_not_checked(box, tmp_path):
    rig = SimulatedRig(box, "cornell", SimulatedProjector(), SimulatedCamera(), 1.0, 0)
    for plan, square in (
        (paper_plan(PROJECTOR, 5, (3, 3), correspondence="phase"), False),
        (chosen_plan(PROJECTOR, 60), True),
    ):
        capture = acquire(plan, tmp_path / f"{square}.zarr", rig)
        made = tmp_path / f"t-{square}.zarr"
        reconstruct_to_file(capture, made, options=ReconstructionOptions(square=square))
        (reason,) = judge_reconstruction(open_transport(made), capture).reasons
        assert reason.cause == "unchecked"
        says = "a square T" if square else "neither check photos, nor stripes"
        assert says in reason.sentence


@pytest.mark.parametrize(("offset", "photos"), [("reference", 5), ("inverse", 4)])
def test_a_handful_of_photos_is_judged(box, tmp_path, offset, photos):
    plan = paper_plan(PROJECTOR, 1, (1, 1), offset=offset, correspondence="none")
    assert len(plan.patterns) == photos
    rig = SimulatedRig(box, "cornell", SimulatedProjector(), SimulatedCamera(), 1.0, 0)
    capture = acquire(plan, tmp_path / "c.zarr", rig)
    q = box.correspondence.astype(np.float32)
    known = Correspondence(q, np.ones(q.shape[:2], dtype=np.float32))
    reconstruct_to_file(capture, tmp_path / "t.zarr", known)
    verdict = judge_reconstruction(open_transport(tmp_path / "t.zarr"), capture)
    assert (verdict.grade, verdict.causes) == ("doubtful", ("unchecked",))


def test_the_command_ends_with_the_verdict(reconstructed, tmp_path):
    capture, _ = reconstructed()
    said = run_nearfar("reconstruct", capture.path, tmp_path / "t.zarr")
    assert said.status == 0, said.err
    assert said.out.splitlines()[-1].startswith("good: Relit pictures are off by ")
    said = run_nearfar("reconstruct", capture.path, tmp_path / "t.zarr", "--force", "--json")
    found = json.loads(said.out)
    assert list(found) == [
        "verdict",
        "held_out_dB",
        "expected_dB",
        "planned_dB",
        "noise_dB",
        "causes",
        "reasons",
    ]
    low, high = found["planned_dB"]
    assert low < found["held_out_dB"] < high
    assert f", planned for {low:.0f} to {high:.0f} dB under pictures, " in str(
        open_transport(tmp_path / "t.zarr").verdict
    )
    assert found["noise_dB"] > found["expected_dB"]
    assert found["verdict"] == "good"
    assert abs(found["held_out_dB"] - found["expected_dB"]) < 3
    assert found["causes"] == []


@pytest.mark.parametrize("camera", [Size(5, 7), Size(64, 64), Size(1000, 2000), Size(3, 400_000)])
def test_bands_are_spread_and_few(camera):
    found = bands(camera)
    assert found
    assert all(0 <= rows.start < rows.stop <= camera.height for rows in found)
    assert all(b.start >= a.stop for a, b in pairwise(found))
    count = sum(rows.stop - rows.start for rows in found) * camera.width
    assert count <= max(2 * CAMERA_PIXELS, 8 * camera.width)
    if camera.pixels <= CAMERA_PIXELS:
        assert count == camera.pixels


@pytest.mark.parametrize("camera", [Size(5, 7), Size(64, 64), Size(1000, 2000), Size(3, 400_000)])
def test_sampled_rows_are_spread_and_of_few_slices(camera):
    found = sampled_rows(camera)
    rows = [row for each in found for row in range(*each.indices(camera.height))]
    assert rows
    assert len(rows) == len(set(rows))
    assert np.ptp(np.diff(rows)) == 0 if len(rows) > 1 else True
    assert len(rows) * camera.width <= max(2 * CAMERA_PIXELS, camera.width)
    if camera.pixels <= CAMERA_PIXELS:
        assert rows == list(range(camera.height))
    else:
        assert len(found) == 1
        # As far from one end as from the other, to a step.
        assert abs(rows[0] - (camera.height - 1 - rows[-1])) <= camera.height / len(rows)


def test_bands_of_any_height_are_the_whole_camera(reconstructed, monkeypatch):
    capture, stored = reconstructed()
    found = []
    for rows in (5, 24):
        monkeypatch.setattr(bands_of_cameras, "ROWS_PER_BAND", rows)
        found.append(measure_held_out(stored, capture))
    assert stored.camera == Size(24, 24)
    for one, other in zip(*(each.lights for each in found), strict=True):
        # How the error is shared with the inverse is a ratio in each band.
        mine, theirs = (vars(each.pair) | {"share_of_pattern": 1.0} for each in (one, other))
        assert mine == pytest.approx(theirs, rel=1e-5)
        assert one.expected_error == pytest.approx(other.expected_error, rel=1e-5)
        assert one.unmeasured_error == pytest.approx(other.unmeasured_error, rel=1e-5)


def test_what_saturated_camera_pixels_hold_does_not_matter(reconstructed, tmp_path):
    capture, stored = reconstructed()
    transport = stored.rows()
    saturated = np.arange(transport.camera.pixels).reshape(transport.camera) % 3 == 0
    held_out = []
    for factor in (1, 5):
        direct = np.where(saturated[..., None], factor, 1) * transport.direct
        quality = replace(transport.quality, saturated=saturated)
        path = tmp_path / f"{factor}.zarr"
        save_transport(replace(transport, direct=direct, quality=quality), path)
        held_out.append(measure_held_out(open_transport(path), capture))
    assert held_out[0] == held_out[1]
    assert held_out[0] != measure_held_out(stored, capture)


def test_rows_that_are_all_saturated_are_left_out(reconstructed, tmp_path):
    capture, stored = reconstructed()
    transport = stored.rows()
    for rows, is_checked in ((slice(0, 8), True), (slice(None), False)):
        saturated = transport.quality.saturated.copy()
        saturated[rows] = True
        quality = replace(transport.quality, saturated=saturated)
        path = tmp_path / f"{is_checked}.zarr"
        save_transport(replace(transport, quality=quality), path)
        verdict = judge_reconstruction(open_transport(path), capture)
        assert (verdict.held_out is not None) == is_checked
        if is_checked:
            assert np.isfinite(verdict.held_out.snr)
        else:
            assert "every camera pixel is saturated" in str(verdict)
