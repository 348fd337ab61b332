"""A stored transport is judged by its capture, and keeps the verdict."""

import re
import shutil
from dataclasses import replace

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.capture import open_capture
from nearfar.errors import InputError, KeptInterrupt, MissingFileError
from nearfar.plan import choose_plan
from nearfar.rigs.simulated.camera import SimulatedCamera
from nearfar.rigs.simulated.projector import SimulatedProjector
from nearfar.rigs.simulated.rig import SimulatedRig
from nearfar.transport.store import load_transport, save_transport
from nearfar.transport.store_writing import write_verdict
from nearfar.transport.stored import open_transport
from nearfar.transport.verdict import PATTERNS_SHOWN, KeptVerdict, Reason
from nearfar.workflow.acquire import acquire
from nearfar.workflow.reconstruction.reconstruct import reconstruct_to_file
from nearfar.workflow.verdict.keeping import judge_transport
from tests.cli.conftest import check_done, check_sentence, run_nearfar
from tests.metadata import change_attributes
from tests.worlds import model_transport

PROJECTOR = Size(12, 14)


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Photograph a small world twice, and reconstruct it once; nobody writes here."""
    folder = tmp_path_factory.mktemp("made")
    world = model_transport(PROJECTOR, Size(9, 8), window=5, far=Size(3, 3))
    plan, _ = choose_plan(PROJECTOR, 60)
    rig = SimulatedRig(world, "test", SimulatedProjector(), SimulatedCamera(), 1.0, 0)
    for name in ("capture.zarr", "again.zarr"):
        acquire(plan, folder / name, rig)
    reconstruct_to_file(open_capture(folder / "capture.zarr"), folder / "t.zarr")
    return folder


@pytest.fixture
def stored(made, tmp_path):
    return shutil.copytree(made / "t.zarr", tmp_path / "t.zarr")


def test_what_is_judged_is_kept(made, stored):
    light = np.ones(PROJECTOR)
    before = load_transport(stored)
    write_verdict(stored, KeptVerdict("wrong", widening=10.0))
    verdict = judge_transport(stored, open_capture(made / "capture.zarr"))
    kept = load_transport(stored)
    assert kept.verdict == verdict.kept
    assert kept.verdict.held_out_snr == verdict.held_out.snr
    np.testing.assert_array_equal(kept @ light, before @ light)
    # It is compared with the error bars that followed from the photos, and not with wider ones.
    assert kept.verdict.error_ratio > 0.2
    assert kept.verdict.widening == 1.0


def test_info_judges_and_leads_with_the_verdict(made, stored):
    # As transports of before, which do not know when their photos were taken.
    provenance = dict(open_transport(stored).provenance)
    provenance["photos"] = {
        name: value for name, value in provenance["photos"].items() if name != "taken"
    }
    change_attributes(stored, provenance=provenance)
    said = check_done(run_nearfar("info", stored)).out
    assert said.startswith("not judged: ")
    assert "--capture" in said
    said = check_done(run_nearfar("info", stored, "--capture", made / "capture.zarr")).out
    assert said.splitlines()[0] == str(open_transport(stored).verdict)
    assert check_done(run_nearfar("info", stored)).out == said


def test_another_capture_is_refused(made, stored):
    with pytest.raises(InputError, match=r"was not reconstructed from .*photos"):
        judge_transport(stored, open_capture(made / "again.zarr"))
    assert load_transport(stored).verdict is None
    for other in (stored, made / "none.zarr"):
        check_sentence(run_nearfar("info", stored, "--capture", other), other)
    for other in (made / "capture.zarr", made / "none.zarr"):
        check_sentence(run_nearfar("info", other, "--capture", made / "capture.zarr"), other)


def test_what_cannot_be_judged_gets_a_sentence(made, stored, tmp_path):
    capture = open_capture(made / "capture.zarr")
    with pytest.raises(InputError, match=r"nearfar\.open_capture returns"):
        judge_transport(stored, made / "capture.zarr")
    with pytest.raises(MissingFileError, match="is not there"):
        judge_transport(tmp_path / "none.zarr", capture)
    change_attributes(stored, provenance={})
    with pytest.raises(InputError, match="does not say how it was made"):
        judge_transport(stored, capture)


def test_a_judgement_that_is_interrupted_leaves_a_whole_transport(made, stored):
    def interrupt(_what, _share):
        raise KeyboardInterrupt

    with pytest.raises(
        KeptInterrupt, match=r"interrupted; .*t\.zarr stays as it is, and was not judged"
    ):
        judge_transport(stored, open_capture(made / "capture.zarr"), progress=interrupt)
    assert load_transport(stored).verdict is None


def test_a_check_photo_that_cannot_be_read_leaves_a_whole_transport(made, tmp_path):
    # The estimate reads no check photo, and so does not meet the damage.
    capture = shutil.copytree(made / "capture.zarr", tmp_path / "c.zarr")
    purposes = [pattern.purpose for pattern in open_capture(capture).plan.patterns]
    check = purposes.index("check")
    chunk = capture / "photos" / f"c.{check}.0.0.0"
    chunk.write_bytes(chunk.read_bytes()[:-9])
    output = tmp_path / "t.zarr"
    told = run_nearfar("reconstruct", capture, output)
    assert told.status == 1
    assert f"written to {output}" in told.out
    assert re.search(r"c\.zarr is damaged.*t\.zarr stays as it is, and was not judged", told.err)
    assert load_transport(output).verdict is None


def test_a_transport_that_is_damaged_itself_is_not_called_whole(made, stored):
    chunk = next(path for path in sorted((stored / "near").rglob("c.*")) if path.is_file())
    chunk.write_bytes(chunk.read_bytes()[:-9])
    with pytest.raises(OSError, match=r"t\.zarr is damaged") as fault:
        judge_transport(stored, open_capture(made / "capture.zarr"))
    assert "whole" not in str(fault.value)


def test_what_gains_changed_is_not_judged_by_the_photos(made, tmp_path):
    capture, before = open_capture(made / "capture.zarr"), load_transport(made / "t.zarr")
    path = tmp_path / "changed.zarr"
    for changed, gains in (
        (2 * before, "direct 2, near 2 and far 2"),
        (before.with_gains(near=3, far=0), "direct 1, near 3 and far 0"),
    ):
        save_transport(changed, path, force=True)
        assert load_transport(path).provenance == changed.provenance
        with pytest.raises(InputError, match=f"multiplied by the gains {gains} .* as it was"):
            judge_transport(path, capture)
        assert load_transport(path).verdict is None
        said = check_done(run_nearfar("info", path)).out
        assert said.startswith(f"not judged: it was multiplied by the gains {gains} ")
        check_sentence(run_nearfar("info", path, "--capture", made / "capture.zarr"), path)


def test_gains_that_cancel_leave_a_transport_to_judge(made, stored, tmp_path):
    capture, path = open_capture(made / "capture.zarr"), tmp_path / "same.zarr"
    save_transport(0.5 * (2 * load_transport(stored)), path)
    verdict, same = (judge_transport(each, capture) for each in (stored, path))
    # Gains drop the error bars.
    assert same.kept.expected_snr is None
    mine, theirs = (
        [light.pair.difference for light in each.held_out.lights] for each in (same, verdict)
    )
    assert mine == theirs


def test_what_two_levels_hide_is_said():
    bent = (Reason("not-linear", "projector or camera is not linear."),)
    shown = KeptVerdict("doubtful", bent, 35.0, checked_by=PATTERNS_SHOWN)
    assert shown.summary.endswith("Lights of other levels may be off by far more.")
    for told in (replace(shown, checked_by="pictures"), replace(shown, reasons=())):
        assert "levels" not in told.summary
