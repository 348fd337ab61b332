"""Reconstructions that were stopped and resumed: equal to the bit to those never stopped."""

import random
import shutil
import signal
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.capture import open_capture
from nearfar.capture.replacing import replace_photos
from nearfar.correspondence import Correspondence
from nearfar.errors import (
    ExistingOutputError,
    InputError,
    KeptInterrupt,
    MissingFileError,
)
from nearfar.rigs.simulated.camera import SimulatedCamera
from nearfar.rigs.simulated.projector import SimulatedProjector
from nearfar.rigs.simulated.rig import SimulatedRig
from nearfar.transport.store import load_transport
from nearfar.workflow.acquire import acquire
from nearfar.workflow.reconstruction.job import tiling_of
from nearfar.workflow.reconstruction.options import ReconstructionOptions
from nearfar.workflow.reconstruction.reconstruct import reconstruct_to_file
from nearfar.workflow.reconstruction.sinks import LOG_NAME
from nearfar.workflow.verdict.keeping import judge_transport
from tests.absent import NEEDS_PYTORCH
from tests.cli.conftest import check_done, check_sentence, run_nearfar
from tests.plans import chosen_plan
from tests.processes import run_command, start
from tests.workflow.reconstruction.memory import memory_for
from tests.worlds import model_transport

CAMERA = Size(24, 6)
# So many tiles that a reconstruction is still at work when it is killed for the twentieth time.
TALL_CAMERA = Size(78, 6)
# Rows of a tile.
ROWS = 3
SLOW = """
import sys
from nearfar.capture import open_capture
from nearfar.capture.replacing import replace_photos
from nearfar.workflow.reconstruction.options import ReconstructionOptions
from nearfar.workflow.reconstruction.reconstruct import reconstruct_to_file
options = ReconstructionOptions(memory=int(sys.argv[3]), square="--square" in sys.argv)
reconstruct_to_file(open_capture(sys.argv[1]), sys.argv[2], options=options,
                    resume="--resume" in sys.argv)
"""


def into(
    path, capture, *, correspondence=None, resume=False, force=False, progress=None, **options
):
    """Reconstruct into a file, with options as keywords."""
    return reconstruct_to_file(
        capture,
        path,
        correspondence,
        ReconstructionOptions(**options),
        resume=resume,
        force=force,
        progress=progress,
    )


def _captured(camera, folder):
    world = model_transport(Size(16, 20), camera, window=5, far=Size(3, 3), channels=1)
    rig = SimulatedRig(world, "test", SimulatedProjector(), SimulatedCamera(), 0.5, 0)
    return acquire(chosen_plan(Size(16, 20), 50), folder / "c.zarr", rig)


def _memory(capture):
    """Bytes in which so few rows are worked at that there are many tiles."""
    return memory_for(ROWS, capture.plan, capture.camera, "joint", channels=1)


@pytest.fixture(scope="module")
def capture(tmp_path_factory):
    return _captured(CAMERA, tmp_path_factory.mktemp("capture"))


@pytest.fixture(scope="module")
def memory(capture):
    return _memory(capture)


@pytest.fixture(scope="module")
def whole(capture, memory, tmp_path_factory):
    path = tmp_path_factory.mktemp("whole") / "t.zarr"
    into(path, capture, memory=memory)
    return path


@pytest.fixture(scope="module")
def tall_capture(tmp_path_factory):
    return _captured(TALL_CAMERA, tmp_path_factory.mktemp("tall"))


@pytest.fixture(scope="module")
def tall_whole(tall_capture, tmp_path_factory):
    path = tmp_path_factory.mktemp("tall whole") / "t.zarr"
    into(path, tall_capture, memory=_memory(tall_capture))
    return path


def _check_same(one, other):
    names = sorted(str(p.relative_to(one)) for p in one.rglob("*"))
    assert names == sorted(str(p.relative_to(other)) for p in other.rglob("*"))
    for name in names:
        if (one / name).is_file():
            assert (one / name).read_bytes() == (other / name).read_bytes(), name


def _judged(whole, capture, folder):
    """Copy a transport, and judge the copy, as the command does."""
    copy = folder / "judged.zarr"
    shutil.copytree(whole, copy)
    judge_transport(copy, capture)
    return copy


def _stop_after(count):
    """Stop when so many rows are done."""

    def progress(what, share):
        if what == "reconstructing" and share * CAMERA.height >= count:
            raise KeyboardInterrupt

    return progress


def test_it_is_cut_into_many_blocks(capture, whole, tall_capture, tall_whole):
    for each, path, least in ((capture, whole, 8), (tall_capture, tall_whole, 25)):
        options = ReconstructionOptions(memory=_memory(each))
        tiling = tiling_of(each, options, given=False)
        assert len(list(tiling.tiles())) >= least
        assert not (path / LOG_NAME).exists()


def test_what_was_interrupted_is_gone_on_with(capture, whole, memory, tmp_path):
    path = tmp_path / "t.zarr"
    given = {"memory": memory}
    with pytest.raises(
        KeptInterrupt, match=r"^interrupted; \d+ tiles? .* and `resume=True` goes on"
    ):
        into(path, capture, progress=_stop_after(10), **given)
    assert not path.exists()
    with pytest.raises(ExistingOutputError):
        into(path, capture, **given)
    for other in (
        {**given, "half": True},
        {"memory": 10**9},
        {**given, "correspondence": Correspondence(
            np.ones((*CAMERA, 2), np.float32), np.ones(CAMERA, np.float32))},
    ):  # fmt: skip
        with pytest.raises(InputError, match="was started with another"):
            into(path, capture, resume=True, **other)
    done = []
    into(
        path, capture, resume=True, progress=lambda what, share: done.append((what, share)), **given
    )
    # What was there is not worked at again, and nothing else is left out.
    assert 3 / 8 < min(share for what, share in done if what == "reconstructing") < 0.5
    _check_same(whole, path)
    assert [p.name for p in tmp_path.iterdir()] == ["t.zarr"]
    with pytest.raises(MissingFileError, match="nothing to go on with"):
        into(path, capture, resume=True, force=True, **given)


@NEEDS_PYTORCH
def test_another_device_does_not_go_on_with_it(capture, memory, tmp_path):
    path = tmp_path / "t.zarr"
    with pytest.raises(KeptInterrupt):
        into(path, capture, memory=memory, progress=_stop_after(7))
    with pytest.raises(InputError, match="was started with another"):
        into(path, capture, memory=memory, device="torch", resume=True)


def test_photos_that_were_taken_again_are_another_capture(capture, memory, tmp_path):
    path, source = tmp_path / "t.zarr", tmp_path / "c.zarr"
    shutil.copytree(capture.path, source)
    with pytest.raises(KeptInterrupt):
        into(path, open_capture(source), memory=memory, progress=_stop_after(7))
    again = replace_photos(source, [3], [capture.photos[3]])
    with pytest.raises(InputError, match="another capture"):
        into(path, again, memory=memory, resume=True)


def test_what_is_refused_says_nothing_of_tiles_of_an_earlier_job(capture, memory, tmp_path):
    path = tmp_path / "t.zarr"
    with pytest.raises(KeptInterrupt):
        into(path, capture, memory=memory, progress=_stop_after(7))
    with pytest.raises(ExistingOutputError) as there:
        into(path, capture, memory=memory)
    with pytest.raises(InputError, match="was started with another") as other:
        into(path, capture, memory=memory, half=True, resume=True)
    for refused in (there, other):
        assert "kept in" not in str(refused.value)


def test_a_capture_without_direct_light_is_relit_by_far_range_light_alone(tmp_path):
    dark = model_transport(Size(16, 20), Size(12, 6), window=5, far=Size(3, 3), channels=1)
    dark = replace(dark, direct=0 * dark.direct, near=0 * dark.near)
    rig = SimulatedRig(dark, "dark", SimulatedProjector(), SimulatedCamera(), 0.5, 0)
    shot = acquire(chosen_plan(Size(16, 20), 50), tmp_path / "c.zarr", rig)
    summary = into(tmp_path / "t.zarr", shot)
    found = load_transport(tmp_path / "t.zarr")
    assert summary.lit == 0
    assert not found.lit.any()
    light = np.random.default_rng(0).random((16, 20))
    truth = 0.5 * (dark @ light)
    assert np.linalg.norm(found @ light - truth) < 0.03 * np.linalg.norm(truth)


def test_what_was_stopped_before_its_first_block_leaves_nothing(capture, memory, tmp_path):
    with pytest.raises(KeyboardInterrupt) as stopped:
        into(tmp_path / "t.zarr", capture, memory=memory, progress=_stop_after(0))
    assert not isinstance(stopped.value, KeptInterrupt)
    assert list(tmp_path.iterdir()) == []


def test_what_was_killed_before_its_first_block_is_replaced_or_gone_on_with(
    capture, whole, memory, tmp_path
):
    # As kill -9 leaves it while the first tile is worked at: a log and no store.
    for again in ({"force": True}, {"resume": True}):
        path = tmp_path / f"{next(iter(again))}.zarr"
        folder = Path(f"{path}.unfinished")
        with pytest.raises(KeptInterrupt):
            into(path, capture, memory=memory, progress=_stop_after(4))
        first, *_ = (folder / LOG_NAME).read_bytes().splitlines(keepends=True)
        shutil.rmtree(folder)
        folder.mkdir()
        (folder / LOG_NAME).write_bytes(first)
        into(path, capture, memory=memory, **again)
        _check_same(whole, path)


@pytest.mark.parametrize("what", ["files", "a capture", "a transport", "a file"])
def test_a_folder_that_holds_something_else_is_not_gone_on_with(
    capture, whole, memory, tmp_path, what
):
    path, folder = tmp_path / "t.zarr", tmp_path / "t.zarr.unfinished"
    if what == "files":
        folder.mkdir()
        (folder / "precious.txt").write_text("mine")
    elif what == "a file":
        folder.write_text("mine")
    else:
        shutil.copytree(capture.path if what == "a capture" else whole, folder)
    before = sorted(folder.rglob("*"))
    for options in ({"resume": True}, {"force": True}, {"resume": True, "force": True}, {}):
        with pytest.raises(ExistingOutputError, match=r"t\.zarr\.unfinished"):
            into(path, capture, memory=memory, **options)
    for option in ("--resume", "--force"):
        ran = run_nearfar("reconstruct", capture.path, path, option)
        check_sentence(ran, folder, "nothing that this command has left", "choose another name")
    assert sorted(folder.rglob("*")) == before
    assert list(tmp_path.iterdir()) == [folder]


def _length(log):
    """Bytes of a log; 0 where it is not there, or no more."""
    try:
        return log.stat().st_size
    except FileNotFoundError:
        return 0


@pytest.mark.slow(minutes=1.5)
def test_kill_9_at_twenty_moments_costs_nothing(
    tall_capture, tall_whole, tmp_path, tmp_path_factory
):
    generator = random.Random(0)
    path = tmp_path / "t.zarr"
    log = Path(f"{path}.unfinished") / LOG_NAME
    memory = f"{_memory(tall_capture) / 1e6}MB"
    command = ("reconstruct", tall_capture.path, path, "--memory", memory, "-q")
    undisturbed = _judged(tall_whole, tall_capture, tmp_path_factory.mktemp("judged"))
    kills = 0
    # On a busy machine it may end before it is killed; the next one is begun anew.
    for _ in range(60):
        resume = ["--resume"] if log.parent.exists() else []
        process = start(run_command, *command, *resume)
        # From its first reading on, to a tile or so.
        while not log.parent.exists() and process.exitcode is None:
            time.sleep(0.001)
        before = _length(log)
        while process.exitcode is None and _length(log) == before:
            if kills % 4 == 0 and generator.random() < 0.02:
                break
            time.sleep(0.01)
        time.sleep(generator.uniform(0, 0.02))
        process.kill()
        process.join()
        assert process.exitcode in {0, -signal.SIGKILL}
        kills += process.exitcode != 0
        if kills == 20:
            break
        if path.exists():
            # Killed while it was judged, it has no verdict.
            if process.exitcode == 0:
                _check_same(undisturbed, path)
            shutil.rmtree(path)
    assert kills == 20
    if path.exists():
        shutil.rmtree(path)
    resume = ["--resume"] if log.parent.exists() else []
    check_done(run_nearfar(*command, *resume))
    assert list(tmp_path.iterdir()) == [path]
    _check_same(undisturbed, path)


def test_by_the_command_line_with_a_torn_log(capture, whole, memory, tmp_path):
    path = tmp_path / "t.zarr"
    options = (capture.path, path, "--memory", f"{memory / 1e6}MB")
    ran = run_nearfar("reconstruct", *options, "--resume")
    assert ran.status == 1
    assert "nothing to go on with" in ran.err
    with pytest.raises(KeptInterrupt):
        into(path, open_capture(capture.path), memory=memory, progress=_stop_after(10))
    log = tmp_path / "t.zarr.unfinished" / LOG_NAME
    log.write_bytes(log.read_bytes()[:-9])
    ran = run_nearfar("reconstruct", *options, "--resume")
    assert ran.status == 0, ran.err
    _check_same(_judged(whole, capture, tmp_path), path)
    assert load_transport(path).camera == CAMERA
