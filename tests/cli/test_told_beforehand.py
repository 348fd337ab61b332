"""What commands tell before any work: the memory of a scene, and what must be run first."""

from pathlib import Path

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.scenes.cache import cached_scene, scene_memory
from tests.cli.conftest import Job, check_done, check_sentence, run_nearfar


def test_the_memory_of_a_large_scene_is_told_before_it_is_made(tmp_path: Path, monkeypatch):
    out, rig = tmp_path / "out.zarr", tmp_path / "rig.toml"
    rig.write_text('[scene]\nname = "corner"\n')
    small = run_nearfar("render", "corner", out, "--projector", "8x8")
    assert "GB of memory" not in check_done(small).out
    monkeypatch.setattr("nearfar.cli.saying.BYTES_TO_ANNOUNCE", 1)
    plan = tmp_path / "plan.json"
    made = ("plan", "--projector", "8x8", "--near", "3", "--far", "3x3", "-o", plan)
    check_done(run_nearfar(*made))
    for command in (
        ("render", "corner", out, "--projector", "8x8", "--force"),
        ("acquire", plan, tmp_path / "a.zarr", "--rig", rig),
    ):
        first = check_done(run_nearfar(*command)).out.splitlines()[0]
        assert first.startswith("the scene corner takes about ")
        assert first.endswith(" GB of memory")
    stored = check_done(run_nearfar("acquire", plan, tmp_path / "c.zarr", "--rig", out)).out
    assert "takes about" not in stored


def test_the_memory_of_a_scene_is_that_of_its_matrices():
    size = Size(16, 20)
    cached_scene("wedge", size)
    known = scene_memory("wedge", size)
    assert known.kept == known.peak == cached_scene("wedge", size).far.nbytes
    # One that is not there yet takes more while it is computed.
    new = scene_memory("wedge", Size(17, 21))
    assert new.peak > new.kept == 3 * 4 * (17 * 21) ** 2


@pytest.mark.parametrize("command", ["view", "relight", "evaluate"])
def test_what_is_not_reconstructed_yet_names_the_next_command(finished: Job, tmp_path, command):
    rest: dict[str, tuple[object, ...]] = {
        "view": ("--no-browser",),
        "relight": (finished.light, tmp_path / "relit.npy"),
        "evaluate": ("--truth", finished.truth),
    }
    acquire = f"nearfar acquire PLAN.json CAPTURE.zarr --rig {finished.apart}"
    check_sentence(run_nearfar(command, finished.apart, *rest[command]), finished.apart, acquire)
    measured = tmp_path / "T.npy"
    np.save(measured, np.ones((6, 6)))
    acquire = f"nearfar acquire PLAN.json CAPTURE.zarr --rig {measured}"
    check_sentence(run_nearfar(command, measured, *rest[command]), measured, acquire)
    reconstruct = f"nearfar reconstruct {finished.capture} TRANSPORT.zarr"
    check_sentence(run_nearfar(command, finished.capture, *rest[command]), reconstruct)
