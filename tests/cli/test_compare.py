"""Methods side by side on the command line."""

import json
from pathlib import Path

from tests.cli.conftest import Job, check_done, check_sentence, run_nearfar

# Methods that take no time: what each finds is tested elsewhere.
SMALL = ("--photos", "100,130", "--method", "paper", "--method", "Hadamard")


def test_a_scene_is_compared(finished: Job, tmp_path: Path):
    out = tmp_path / "comparison"
    ran = check_done(run_nearfar("compare", finished.truth, out, *SMALL))
    assert "equal photos" in ran.out
    assert "equal total exposure" in ran.out
    assert str(out / "index.html") in ran.out
    check_sentence(run_nearfar("compare", finished.truth, out, *SMALL), "--force")
    found = json.loads(check_done(run_nearfar("compare", finished.truth, "--json", *SMALL)).out)
    kept = json.loads((out / "comparison.json").read_text())
    assert found == kept
    assert {trial["method"] for trial in found["equal_photos"]} == {"paper", "Hadamard"}


def test_what_cannot_be_compared_is_said(finished: Job, tmp_path: Path):
    out = tmp_path / "comparison"
    for arguments, said in (
        (("nowhere.zarr", out), "nowhere.zarr"),
        ((finished.truth, out, "--photos", "3"), "too small"),
        ((finished.truth, out, "--method", "magic"), "magic"),
        ((finished.transport, out), "transport"),
        # Before the scene is looked for: computing one takes its time.
        (("nowhere.zarr", out, "--method", "magic"), "magic"),
    ):
        check_sentence(run_nearfar("compare", *arguments), said)
        assert not out.exists()
    assert run_nearfar("compare", finished.truth, "--photos", "many").status == 2
