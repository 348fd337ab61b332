"""Methods side by side on the command line."""

import json
from pathlib import Path

import pytest

from nearfar.workflow.rivals import RIVALS
from tests.cli.conftest import Job, check_done, check_sentence, run_nearfar
from tests.packages import forget_packages, write_package

# Methods that take no time: what each finds is tested elsewhere.
SMALL = ("--photos", "100,130", "--method", "paper", "--method", "Hadamard")


def test_a_scene_is_compared(finished: Job, tmp_path: Path):
    out = tmp_path / "comparison"
    ran = check_done(run_nearfar("compare", finished.truth, out, *SMALL))
    assert "equal photos" in ran.out
    assert "equal total exposure" in ran.out
    assert str(out / "index.html") in ran.out
    assert ran.out.splitlines()[0] == (
        "truth.npy, projector 16x20, camera 8x9: the paper's, Hadamard, each at 100, 130 photos "
        "and at equal total exposure, 9 runs in all"
    )
    assert ran.out.splitlines()[-2].startswith(("Best on pictures: ", "No two methods"))
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


PACKAGE = "faulty"
MODULE = """
from nearfar.errors import InputError
from nearfar.workflow.rivals.rival import Rival


def failing(bench, budget):
    raise InputError(f"{budget.photos} photos are not to my taste: give others.")
    yield


def stopping(bench, budget):
    raise KeyboardInterrupt
    yield


def broken(bench, budget):
    bench.note("this takes long")
    bench.progress(0.5)
    raise ValueError("a bug")
    yield


LINE = {"color": "#000000"}
FAILING = Rival(title="one that fails", line=LINE, attempts=failing)
STOPPING = Rival(title="one that is stopped", line=LINE, attempts=stopping)
BROKEN = Rival(title="one with a bug", line=LINE, attempts=broken)
"""
NAMES = ("failing", "stopping", "broken")


@pytest.fixture
def faulty(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Install a package whose methods come to nothing, each in its way."""
    folder = tmp_path / "package"
    folder.mkdir()
    entries = {name: f"{PACKAGE}:{name.upper()}" for name in NAMES}
    write_package(folder, PACKAGE, MODULE, "nearfar.rivals", entries)
    monkeypatch.syspath_prepend(str(folder))
    forget_packages(RIVALS, PACKAGE)
    yield
    forget_packages(RIVALS, PACKAGE)


@pytest.mark.usefixtures("faulty")
def test_a_method_that_fails_leaves_the_others_their_results(finished: Job, tmp_path: Path):
    out, page = tmp_path / "out", tmp_path / "page.html"
    arguments = (finished.truth, out, "--report", page, "--photos", "100")
    ran = run_nearfar("compare", *arguments, "--method", "failing", "--method", "Hadamard")
    assert ran.status == 0
    assert ran.err.startswith("warning: one that fails came to nothing at 100, ")
    assert "not to my taste" in ran.err
    found = json.loads((out / "comparison.json").read_text())
    assert found["finished"]
    assert {trial["method"] for trial in found["equal_photos"]} == {"Hadamard"}
    assert {failure["method"] for failure in found["failures"]} == {"failing"}
    for text in (page.read_text(), (out / "index.html").read_text()):
        assert "not to my taste" in text
    assert '<svg role="img" aria-label="SNR against photos and exposure"' in page.read_text()
    assert f"open {page}" in ran.out


@pytest.mark.usefixtures("faulty")
@pytest.mark.parametrize(
    ("method", "status", "said"),
    [("stopping", 130, "interrupted; what was compared until then is in "), ("broken", 1, "a bug")],
)
def test_what_is_stopped_keeps_what_it_has(
    finished: Job, tmp_path: Path, method: str, status: int, said: str
):
    out = tmp_path / "out"
    ran = run_nearfar(
        "compare", finished.truth, out, "--photos", "100", "--method", "Hadamard",
        "--method", method,
    )  # fmt: skip
    assert ran.status == status
    assert said in ran.err
    assert "stopped before its end" in ran.err
    assert ("this takes long" in ran.out) == (method == "broken")
    found = json.loads((out / "comparison.json").read_text())
    assert not found["finished"]
    assert {trial["method"] for trial in found["equal_photos"]} == {"Hadamard"}
    assert "Hadamard" in ran.out
    page = (out / "index.html").read_text()
    assert "stopped before its end" in page
