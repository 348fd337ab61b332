"""Where photos do not fit a transport: by frequency, and over the camera."""

from dataclasses import replace

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.capture.writing import write_capture
from nearfar.illumination.frequencies import far_frequencies
from nearfar.plan import Sinusoid, choose_plan, paper_plan
from nearfar.plan.checks import is_reference
from nearfar.rigs.simulated.camera import SimulatedCamera
from nearfar.rigs.simulated.projector import SimulatedProjector
from nearfar.rigs.simulated.rig import SimulatedRig
from nearfar.transport.quality import Quality
from nearfar.transport.store import save_transport
from nearfar.transport.stored import open_transport
from nearfar.workflow.diagnosis import misfit_maps
from nearfar.workflow.diagnosis.misfit_maps import MisfitMaps, describe_worst, measure_misfit
from nearfar.workflow.verdict.verdict import Reason, Verdict, with_worst
from tests.worlds import model_transport

PROJECTOR, CAMERA = Size(12, 16), Size(12, 18)


@pytest.fixture(scope="module")
def world():
    found = model_transport(PROJECTOR, CAMERA, window=3, far=Size(3, 3), channels=2)
    return replace(found, provenance={"square": False, "method": "joint"})


@pytest.fixture
def compare(world, tmp_path):
    """Compare a transport with photos of the true one, which may be changed."""
    plan, _ = choose_plan(PROJECTOR, 60)

    def compare(transport=world, change=lambda photos: photos, exposure=1.0, plan=plan):
        rig = SimulatedRig(
            world, "test", SimulatedProjector(), SimulatedCamera(), exposure=exposure, seed=0
        )
        photos = np.stack(list(rig.shoot([plan.draw(i) for i in range(len(plan.patterns))])))
        blacks = [not plan.draw(i).any() for i in range(len(photos))]
        black = (photos[blacks] / np.float32(rig.full_scale)).mean(axis=0).astype(np.float32)
        capture = write_capture(
            plan, tmp_path / "c.zarr", list(change(photos)), full_scale=rig.full_scale, force=True
        )
        save_transport(replace(transport, black=black), tmp_path / "t.zarr", force=True)
        return plan, measure_misfit(open_transport(tmp_path / "t.zarr"), capture)

    return compare


def test_the_true_transport_misfits_by_noise_alone(compare):
    plan, misfit = compare()
    assert misfit.of_camera.shape == CAMERA
    assert not misfit.saturated.any()
    # Noise of 51 photos and 2 channels, and the small error of the model that counts as noise.
    assert 0.7 < misfit.of_camera.mean() < 1.1
    assert misfit.of_camera.max() < 2.0
    assert 0.5 < misfit.of_checks < 1.4
    shown = {p.frequency for p in plan.patterns if isinstance(p, Sinusoid) and not is_reference(p)}
    assert set(misfit.of_frequencies) == shown
    assert describe_worst(misfit) == ""


def test_a_bad_photo_stands_out_at_its_frequency_and_a_bad_part_on_the_map(compare, world):
    plan, _ = choose_plan(PROJECTOR, 60)
    number = next(i for i, p in enumerate(plan.patterns) if p.purpose == "near")

    def turned(photos):
        photos = photos.copy()
        photos[number] = photos[number, ::-1]
        return photos

    _, misfit = compare(change=turned)
    worst = max(misfit.of_frequencies, key=misfit.of_frequencies.__getitem__)
    assert worst == plan.patterns[number].frequency

    direct = world.direct.copy()
    direct[-4:, :6] *= 1.2
    _, misfit = compare(replace(world, direct=direct))
    inside = np.zeros(CAMERA, dtype=bool)
    inside[-4:, :6] = True
    assert misfit.of_camera[inside].min() > 3 * misfit.of_camera[~inside].max()
    assert "at the bottom left of the picture (misfit " in describe_worst(misfit)


@pytest.fixture
def bright(world):
    """The transport of photos whose exposure of 1.6 saturates some camera pixels."""
    quality = Quality(np.ones(CAMERA, np.float32), np.zeros(CAMERA, dtype=bool))
    return replace(1.6 * world, provenance=world.provenance, quality=quality)


def test_saturated_camera_pixels_tell_nothing(compare, world, bright):
    _, misfit = compare(bright, exposure=1.6)
    camera = SimulatedCamera()
    shown = 1.6 * (world @ np.ones(PROJECTOR)) + camera.ambient + camera.black_level
    of_channels = shown >= 1
    assert np.mean(of_channels.any(axis=-1) & ~of_channels.all(axis=-1)) > 0.1
    assert np.mean(misfit.saturated == of_channels.any(axis=-1)) > 0.95
    assert np.nanmean(misfit.of_camera) < 1.2
    assert np.isfinite(misfit.of_camera[~misfit.saturated]).all()
    assert describe_worst(misfit) == ""


def test_bands_make_no_difference_and_a_large_camera_is_in_cells(compare, monkeypatch):
    _, whole = compare()
    with monkeypatch.context() as patched:
        patched.setattr(misfit_maps, "VALUES_AT_ONCE", 1)
        _, in_rows = compare()
    # The model's error is a share of the mean of white, here of each row.
    np.testing.assert_allclose(in_rows.of_camera, whole.of_camera, rtol=0.1)
    monkeypatch.setattr(misfit_maps, "CAMERA_PIXELS", CAMERA.pixels // 2)
    monkeypatch.setattr(misfit_maps, "LINES_OF_LARGE_CAMERA", 4)
    _, large = compare()
    assert large.cell == 3
    assert large.of_camera.shape == (4, 6)
    cells = whole.of_camera.reshape(4, 3, 6, 3)[:, 1].mean(axis=-1)
    np.testing.assert_allclose(large.of_camera, cells, rtol=0.1)


def test_a_cell_is_saturated_where_most_of_its_line_is(compare, bright, monkeypatch):
    _, whole = compare(bright, exposure=1.6)
    monkeypatch.setattr(misfit_maps, "CAMERA_PIXELS", CAMERA.pixels // 2)
    monkeypatch.setattr(misfit_maps, "LINES_OF_LARGE_CAMERA", 4)
    _, large = compare(bright, exposure=1.6)
    most = whole.saturated.reshape(4, 3, 6, 3)[:, 1].mean(axis=-1) > 1 / 2
    assert most.any()
    assert not most.all()
    np.testing.assert_array_equal(large.saturated, most)


def test_a_camera_that_is_all_saturated_does_not_tell(compare):
    assert compare(exposure=50.0)[1] is None


def test_plans_of_pairs_and_square_transports_do_not_tell(compare, world):
    assert compare(plan=paper_plan(PROJECTOR, 3, Size(3, 3)))[1] is None
    square = replace(world, provenance={"square": True, "method": "joint"})
    assert compare(square)[1] is None


def test_a_verdict_on_the_model_names_the_part_of_the_picture():
    of_camera = np.ones((9, 9))
    misfit = MisfitMaps({}, None, of_camera, of_camera > 99, 1)
    reasons = (Reason("model", "the model fails."), Reason("noise", "noisy."))
    verdict = Verdict("doubtful", None, reasons)
    assert with_worst(verdict, misfit) == verdict
    of_camera[:3, 3:6] = 8.0
    assert [reason.sentence for reason in with_worst(verdict, misfit).reasons] == [
        "the model fails; photos fit worst at the top of the picture (misfit 8, where noise alone "
        "makes 1).",
        "noisy.",
    ]


@pytest.mark.parametrize("third", range(3))
def test_frequencies_that_stand_out_are_named(third):
    frequencies = sorted(
        (k for k in far_frequencies(Size(7, 7), Size(24, 24)) if k > (0, 0)),
        key=lambda k: np.hypot(*map(float, k)),
    )[:18]
    values = dict.fromkeys(frequencies, 1.2)
    for k in frequencies[6 * third : 6 * third + 6]:
        values[k] = 9.0
    flat = np.ones((9, 9))
    said = describe_worst(MisfitMaps(values, None, flat, flat > 2, 1))
    first, last = (np.hypot(*map(float, frequencies[i])) for i in (6 * third, 6 * third + 5))
    assert f"at frequencies of {first:.2g} to {last:.2g} cycles per projector pixel" in said
    assert "misfit 9" in said
    # A single photo is no matter of the model.
    one = dict.fromkeys(values, 1.2) | {frequencies[6 * third]: 100.0}
    assert describe_worst(MisfitMaps(one, None, flat, flat > 2, 1)) == ""
    # What all have alike is nothing that stands out, and little misfit is no matter.
    assert describe_worst(MisfitMaps(dict.fromkeys(values, 9.0), None, flat, flat > 2, 1)) == ""
    little = {k: value / 9 for k, value in values.items()}
    assert describe_worst(MisfitMaps(little, None, flat, flat > 2, 1)) == ""
