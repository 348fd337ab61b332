"""A package outside nearfar adds one of each, is installed, and runs by the command line."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from nearfar.plan import read_plan
from nearfar.transport.store import load_transport
from tests.rigs.displays import one_monitor

PACKAGE = Path(__file__).parent / "extension_package"
GRID = "12x16"
DIRECT, FAR = 0.5, 0.1

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """Return a function that runs a command where the package is installed."""
    folder = tmp_path_factory.mktemp("extended")
    command = [
        sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-index",
        "--no-build-isolation", "--disable-pip-version-check", "--target", folder / "there",
        PACKAGE,
    ]  # fmt: skip
    subprocess.run([str(word) for word in command], check=True)
    paths = [str(folder / "there"), os.environ.get("PYTHONPATH", "")]
    environment = os.environ | {
        "PYTHONPATH": os.pathsep.join(path for path in paths if path),
        "XDG_CACHE_HOME": str(folder / "cache"),
    }

    def ran(*words, **variables):
        done = subprocess.run(
            [sys.executable, "-m", "nearfar", *map(str, words)],
            cwd=folder, env=environment | variables, capture_output=True, text=True, check=False,
        )  # fmt: skip
        assert done.returncode == 0, done.stderr
        return done.stdout

    ran.folder = folder
    return ran


@pytest.fixture(scope="module")
def plan(run):
    words = ("--projector", GRID, "--near", 3, "--far", "3x3", "--correspondence", "binary")
    run("plan", *words, "-o", "plan.json", "--quiet")
    return run.folder / "plan.json"


def _white(folder):
    np.save(folder / "white.npy", np.ones((12, 16), np.float32))
    return "white.npy"


def test_help_lists_the_names_of_the_package(run):
    for command, name in (
        ("plan", "binary"),
        ("reconstruct", "ridge"),
        ("compare", "card"),
        ("compare", "scan"),
    ):
        assert name in run(command, "--help"), command
    assert "A mirror of the screen" in run("devices")


def test_its_method_and_patterns_are_planned_and_drawn(run, plan):
    patterns = json.loads(plan.read_text())["patterns"]
    # Four bits of rows and of columns, each beside its inverse.
    assert [pattern["kind"] for pattern in patterns[-9:-7]] == ["binary rows", "binary columns"]
    assert sum(pattern["purpose"] == "correspondence" for pattern in patterns) == 16
    run("export", plan, "patterns", "--quiet")
    assert len(list((run.folder / "patterns").glob("*.png"))) == len(patterns)
    # Where the package is not installed, the plan is refused by name.
    with pytest.raises(OSError, match="correspondence method 'binary', which is not installed"):
        read_plan(plan)


def test_its_scene_is_shot_and_its_method_finds_q(run, plan):
    run("acquire", plan, "card.zarr", "--rig", "card", "--quiet")
    run("reconstruct", "card.zarr", "card-transport.zarr", "--method", "paper", "--quiet")
    transport = load_transport(run.folder / "card-transport.zarr")
    np.testing.assert_array_equal(
        transport.correspondence, np.moveaxis(np.indices((12, 16)), 0, -1)
    )
    run("relight", "card-transport.zarr", _white(run.folder), "card.npy", "--quiet")
    relit = np.load(run.folder / "card.npy")
    np.testing.assert_allclose(relit, np.median(relit), rtol=0.03)


def test_its_camera_sees_the_screen(run, plan):
    (run.folder / "rig.toml").write_text(
        f'[projector]\nsettle = 1\n[camera]\ndriver = "mirror"\ngrid = "{GRID}"\n'
        "exposure = 0.016667\n"
    )
    # Most of a larger screen's time would go into its pixels, drawn in software.
    with one_monitor("256x192") as display:
        run("acquire", plan, "seen.zarr", "--rig", "rig.toml", "--quiet", DISPLAY=display)
    run("reconstruct", "seen.zarr", "seen-transport.zarr", "--method", "ridge", "--quiet")
    run("relight", "seen-transport.zarr", _white(run.folder), "seen.npy", "--quiet")
    np.testing.assert_allclose(np.load(run.folder / "seen.npy"), DIRECT + FAR, rtol=0.03)


def test_its_rival_is_compared(run):
    words = ("compare", "card", "--projector", GRID, "--photos", "40", "--json")
    found = json.loads(run(*words, "--method", "scan", "--method", "joint"))
    trials = {trial["method"]: trial for trial in found["equal_photos"]}
    assert trials["scan"]["photos"] == 13
    # White light is all a row scan can do on a card.
    assert trials["scan"]["white"] > 25 > trials["scan"]["random"]
