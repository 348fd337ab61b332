"""Outputs that are made beside their place: races for a name, and what killed processes leave."""

import re
from collections.abc import Callable
from pathlib import Path

import pytest

from nearfar.errors import ExistingOutputError, StorageError
from nearfar.files import beside, check_output, new_output, renaming
from nearfar.files.beside import OLD, clear_dead, hidden_folder
from tests.files.test_output import listing
from tests.killing import killed_at
from tests.processes import barrier, start
from tests.waiting import wait_until

RACERS = 3


def anything(_folder: Path) -> bool:
    return True


def write(path: Path, kind: str, text: str) -> None:
    if kind == "file":
        path.write_text(text)
    else:
        path.mkdir()
        (path / "inner").mkdir()
        for name in "ab":
            (path / "inner" / name).write_text(text)


def replace(path: Path, kind: str, one_step: bool = True) -> None:
    """Replace whatever is there, on a system that exchanges names or on one that does not."""
    if not one_step:
        renaming._step = lambda: None  # type: ignore[assignment]
    with new_output(path, force=True, replaceable=anything) as partial:
        write(partial, kind, "new")


@pytest.mark.parametrize("kind", ["file", "folder"])
@pytest.mark.parametrize("taken", ["file", "folder", "empty folder"])
def test_a_name_that_is_taken_while_the_output_is_made_is_left(
    tmp_path: Path, kind: str, taken: str
) -> None:
    out = tmp_path / "out"
    with pytest.raises(ExistingOutputError, match=r"out exists already"), new_output(out) as new:
        write(new, kind, "new")
        out.mkdir() if taken == "empty folder" else write(out, taken, "somebody's")
        before = listing(out) if out.is_dir() else out.read_text()
    assert [path.name for path in tmp_path.iterdir()] == ["out"]
    assert (listing(out) if out.is_dir() else out.read_text()) == before


def test_a_folder_of_somebodys_that_comes_meanwhile_is_left_by_force_too(tmp_path: Path) -> None:
    out = tmp_path / "out"
    with (
        pytest.raises(ExistingOutputError, match="did not write"),
        new_output(out, force=True) as new,
    ):
        write(new, "folder", "new")
        write(out, "folder", "somebody's")
    assert listing(tmp_path)["out/inner/a"] == b"somebody's"
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


@pytest.mark.parametrize("one_step", [True, False])
@pytest.mark.parametrize("kind", ["file", "folder"])
def test_what_goes_while_the_output_is_made_is_no_fault(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kind: str, one_step: bool
) -> None:
    if not one_step:
        monkeypatch.setattr(renaming, "_step", lambda: None)
    write(tmp_path / "out", "file", "old")
    with new_output(tmp_path / "out", force=True) as new:
        write(new, kind, "new")
        (tmp_path / "out").unlink()
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


def race(path: Path, me: int, kind: str, others: object) -> None:
    try:
        with new_output(path) as partial:
            write(partial, kind, f"by {me}")
            others.wait()  # type: ignore[attr-defined]
    except ExistingOutputError as error:
        path.with_name(f"lost by {me}").write_text(str(error))


@pytest.mark.parametrize("kind", ["file", "folder"])
def test_of_outputs_that_end_at_once_one_has_the_name(tmp_path: Path, kind: str) -> None:
    out, others = tmp_path / "out", barrier(RACERS)
    racers = [start(race, out, me, kind, others) for me in range(RACERS)]
    for racer in racers:
        racer.join()
        assert racer.exitcode == 0
    lost = {me for me in range(RACERS) if (tmp_path / f"lost by {me}").exists()}
    assert len(lost) == RACERS - 1
    for me in lost:
        said = (tmp_path / f"lost by {me}").read_text()
        assert said == f"{out} exists already: choose another name or add `force=True`."
        (tmp_path / f"lost by {me}").unlink()
    winner = ({*range(RACERS)} - lost).pop()
    assert (out if kind == "file" else out / "inner" / "b").read_text() == f"by {winner}"
    assert list(tmp_path.iterdir()) == [out]


@pytest.mark.parametrize("one_step", [True, False])
@pytest.mark.parametrize(
    ("old", "new"), [("folder", "folder"), ("file", "folder"), ("file", "file")]
)
def test_killed_at_any_moment_the_old_or_the_new_is_whole(
    tmp_path: Path, old: str, new: str, one_step: bool
) -> None:
    out, step = tmp_path / "out", 0
    write(out, old, "old")
    before = listing(tmp_path)
    replace(out, new)
    after = listing(tmp_path)
    seen = []
    while True:
        replace(out, old)
        for path in sorted((tmp_path / "out").rglob("*")):
            if path.is_file():
                path.write_text("old")
        if old == "file":
            out.write_text("old")
        if not killed_at(step, tmp_path, replace, out, new, one_step):
            break
        if not one_step:
            # Where names cannot be exchanged, the next command that writes there mends it.
            check_output(out, force=True, replaceable=anything)
        now = {name: data for name, data in listing(tmp_path).items() if not name.startswith(".")}
        assert now in (before, after)
        seen.append(now == after)
        check_output(out, force=True, replaceable=anything)
        assert list(tmp_path.iterdir()) == [out]
        step += 1
    # It was killed on either side of the moment that counts.
    assert set(seen) == {False, True}
    assert seen == sorted(seen)


def hold(path: Path) -> None:
    with new_output(path) as partial:
        write(partial, "folder", "mine")
        path.with_name("held").touch()
        wait_until(path.with_name("go on").exists)


def test_what_a_killed_process_left_is_cleared_and_what_a_living_one_makes_is_not(
    tmp_path: Path,
) -> None:
    process = start(hold, tmp_path / "out")
    try:
        wait_until((tmp_path / "held").exists)
        living = _hidden(tmp_path)
        assert len(living) == 1
        assert killed_at(4, tmp_path, replace, tmp_path / "other", "folder")
        assert len(_hidden(tmp_path)) == 2
        check_output(tmp_path / "any")
        assert _hidden(tmp_path) == living
    finally:
        (tmp_path / "go on").touch()
        process.join()
    assert process.exitcode == 0
    assert sorted(path.name for path in tmp_path.iterdir()) == ["go on", "held", "out"]


def _hidden(folder: Path) -> set[Path]:
    return {path for path in folder.iterdir() if path.name.startswith(".")}


def test_what_is_not_surely_ones_own_is_left(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert killed_at(3, tmp_path, replace, tmp_path / "out", "folder")
    (dead,) = tmp_path.iterdir()
    others = [".out.partial", ".git", ".out.01234567-01234567.partial", f"{dead.name[1:]}"]
    for name in others:
        (tmp_path / name).mkdir()
        (tmp_path / name / "precious").touch()
    (tmp_path / dead.name.replace("partial", "png")).touch()
    others.append(dead.name.replace("partial", "png"))
    with monkeypatch.context() as patch:
        patch.setattr(beside, "_is_own", lambda _folder: False)
        clear_dead(tmp_path)
    assert dead.exists()
    clear_dead(tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(others)
    assert (tmp_path / others[0] / "precious").exists()


def test_what_stood_aside_gives_way_to_nobody_and_is_kept(tmp_path: Path) -> None:
    # As a process leaves it that was killed between its two renames, and somebody took the name.
    with hidden_folder(tmp_path / "out", OLD) as aside:
        name = aside.name
    (aside / "0").mkdir(parents=True)
    write(aside / "0" / "out", "folder", "old")
    write(tmp_path / "out", "file", "somebody's")
    for _ in range(2):
        clear_dead(tmp_path)
        assert (tmp_path / "out").read_text() == "somebody's"
        assert (aside / "0" / "out" / "inner" / "a").read_text() == "old"
    (tmp_path / "out").unlink()
    with pytest.raises(ExistingOutputError, match="exists already"):
        check_output(tmp_path / "out")
    assert (tmp_path / "out" / "inner" / "a").read_text() == "old"
    assert not (tmp_path / name).exists()


@pytest.mark.parametrize(
    "cannot", [lambda folder: folder / ("x" * 256), lambda _folder: Path("/proc/self/x")]
)
def test_what_cannot_be_written_is_refused_before_any_work(
    tmp_path: Path, cannot: Callable[[Path], Path]
) -> None:
    path = cannot(tmp_path)
    with pytest.raises(StorageError, match=re.escape(f"{path} could not be written")):
        check_output(path)


def test_the_longest_name_is_written(tmp_path: Path) -> None:
    # Of letters of three bytes and of one, 255 bytes in all.
    for name in ("x" * 255, "\u5149" * 85):
        check_output(tmp_path / name)
        with new_output(tmp_path / name) as partial:
            partial.write_text(name)
        assert (tmp_path / name).read_text() == name
