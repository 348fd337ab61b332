"""Captures whose process is killed: they are resumed, or begun anew."""

import random
import shutil
import signal
import time
from itertools import chain, count

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.capture import open_capture
from nearfar.capture.unfinished import LOG_NAME, count_photos
from nearfar.plan import paper_plan
from tests.capture.same import check_same
from tests.cli.conftest import check_done, check_sentence, run_nearfar
from tests.killing import killed_at
from tests.processes import run_command, start


def _noted(log):
    """Photos that a log notes; 0 where it is not there, or no more."""
    try:
        return log.read_bytes().count(b"\n")
    except FileNotFoundError:
        return 0


def _check_same_photos(path, other):
    one, undisturbed = open_capture(path), open_capture(other)
    np.testing.assert_array_equal(one.photos[:], undisturbed.photos[:])
    assert one.plan == undisturbed.plan


@pytest.mark.slow
def test_kill_9_at_twenty_moments_costs_nothing(tmp_path):
    generator = random.Random(0)
    plan, scene = tmp_path / "plan.json", tmp_path / "T.npy"
    plan.write_text(paper_plan(Size(16, 20), 13, Size(5, 5)).to_json())
    np.save(scene, np.random.default_rng(0).random((8, 9, 16, 20), dtype=np.float32) / 400)
    shoot = ("acquire", plan, "--rig", scene, "-q")
    whole, killed = tmp_path / "whole.zarr", tmp_path / "k" / "killed.zarr"
    check_done(run_nearfar(*shoot, whole))
    (tmp_path / "k").mkdir()
    log = tmp_path / "k" / "killed.zarr.unfinished" / LOG_NAME
    resume: list[str] = []
    kills = 0
    # On a busy machine a capture may end before it is killed; the next one is begun anew.
    for _ in range(60):
        process = start(run_command, *shoot, killed, *resume)
        # At work on its first few photos, of some hundreds in all.
        before = _noted(log)
        while process.exitcode is None and (not log.exists() or _noted(log) < before + kills % 3):
            time.sleep(0.001)
        time.sleep(generator.uniform(0, 0.01))
        process.kill()
        process.join()
        assert process.exitcode in {0, -signal.SIGKILL}
        kills += process.exitcode != 0
        resume = ["--resume"]
        if kills == 20:
            break
        if killed.exists():
            _check_same_photos(killed, whole)
            shutil.rmtree(killed)
            resume = []
    assert kills == 20
    if not killed.exists():
        check_done(run_nearfar(*shoot, killed, *resume))
    _check_same_photos(killed, whole)
    assert list((tmp_path / "k").iterdir()) == [killed]
    assert not list(killed.rglob("*.partial"))


@pytest.mark.slow
def test_killed_at_any_step_it_is_resumed_or_begun_anew_by_the_same_command(tmp_path):
    plan, scene = tmp_path / "plan.json", tmp_path / "T.npy"
    made = paper_plan(Size(4, 4), 1, Size(1, 1), offset="reference", correspondence="none")
    plan.write_text(made.to_json())
    np.save(scene, np.random.default_rng(0).random((3, 4, 4, 4), dtype=np.float32) / 40)
    whole = ("acquire", plan, tmp_path / "whole.zarr", "--rig", scene, "-q")
    check_done(run_nearfar(*whole))
    undisturbed = open_capture(tmp_path / "whole.zarr")
    kept = []
    # Every step until the first photos are noted; every other from the last photo to the end.
    for step in chain(range(25), count(52, 2)):
        folder = tmp_path / f"{step}"
        folder.mkdir()
        path = folder / "c.zarr"
        shoot = ("acquire", plan, path, "--rig", scene, "-q")
        # Where a file was being written, it is empty half of the times.
        if not killed_at(step, folder, run_command, *shoot, torn=bool(step & 2)):
            break
        photos = count_photos(folder / "c.zarr.unfinished")
        if path.exists():
            check_sentence(run_nearfar(*shoot), path, "exists already")
        else:
            # Begun anew by either where no photo was noted, if there is a folder to go on with.
            by_resume = photos or (step % 2 and (folder / "c.zarr.unfinished").exists())
            check_done(run_nearfar(*shoot, *(["--resume"] if by_resume else [])))
        kept.append(photos)
        check_same(open_capture(path), undisturbed)
    assert kept.count(0) >= 5
    assert max(kept) == len(made.patterns)
