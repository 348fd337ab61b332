"""Renaming in one step, and what stands in for it where there is no such step."""

import errno
import os
from collections.abc import Callable
from pathlib import Path

import pytest

from nearfar.files import renaming
from nearfar.files.renaming import exchange, rename_if_free
from tests.processes import barrier, start

# Where the system has the step, where it has hard links, and where it has neither.
WAYS = ("one step", "links", "nothing")
ROUNDS = 10
RACERS = 4


def be_without(way: str, patch: Callable[[object, str, object], None] = setattr) -> None:
    """Let this process find what a way has, and no more."""
    if way != "one step":
        patch(renaming, "_step", lambda: None)
    if way == "nothing":

        def link(*_arguments: object) -> None:
            raise OSError(errno.EPERM, "Operation not permitted")

        patch(os, "link", link)


def make(path: Path, kind: str) -> None:
    if kind == "file":
        path.write_text(path.name)
    elif kind == "dangling link":
        path.symlink_to(path.with_name("nowhere"))
    else:
        path.mkdir()
        if kind == "full folder":
            (path / "inner").write_text(path.name)


def content(path: Path) -> object:
    if path.is_symlink():
        return path.readlink()
    return path.read_text() if path.is_file() else [(p.name, content(p)) for p in path.iterdir()]


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("kind", ["file", "full folder"])
def test_a_free_name_is_taken(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, way: str, kind: str
) -> None:
    be_without(way, monkeypatch.setattr)
    make(tmp_path / "new", kind)
    before = content(tmp_path / "new")
    rename_if_free(tmp_path / "new", tmp_path / "there")
    assert content(tmp_path / "there") == before
    assert [path.name for path in tmp_path.iterdir()] == ["there"]


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("kind", ["file", "full folder"])
@pytest.mark.parametrize("there", ["file", "full folder", "empty folder", "dangling link"])
def test_a_name_that_is_taken_is_left_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, way: str, kind: str, there: str
) -> None:
    be_without(way, monkeypatch.setattr)
    make(tmp_path / "new", kind)
    make(tmp_path / "there", there)
    before = {path.name: content(path) for path in tmp_path.iterdir()}
    with pytest.raises(FileExistsError):
        rename_if_free(tmp_path / "new", tmp_path / "there")
    assert {path.name: content(path) for path in tmp_path.iterdir()} == before


@pytest.mark.parametrize("way", WAYS)
def test_what_is_not_there_takes_no_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, way: str
) -> None:
    be_without(way, monkeypatch.setattr)
    with pytest.raises(FileNotFoundError):
        rename_if_free(tmp_path / "gone", tmp_path / "there")
    assert list(tmp_path.iterdir()) == []


def race(folder: Path, me: int, kind: str, way: str, others: object) -> None:
    """Try to give something of one's own one name, together with others, again and again."""
    be_without(way)
    for number in range(ROUNDS):
        make(folder / f"{number}-by-{me}", kind)
        others.wait()  # type: ignore[attr-defined]
        try:
            rename_if_free(folder / f"{number}-by-{me}", folder / f"{number}")
        except FileExistsError:
            (folder / f"{number}-lost-by-{me}").touch()


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("kind", ["file", "full folder"])
def test_of_several_that_race_one_has_the_name(tmp_path: Path, kind: str, way: str) -> None:
    others = barrier(RACERS)
    racers = [start(race, tmp_path, me, kind, way, others) for me in range(RACERS)]
    for racer in racers:
        racer.join()
        assert racer.exitcode == 0
    for number in range(ROUNDS):
        winner = tmp_path / f"{number}"
        by = content(winner if kind == "file" else winner / "inner")
        lost = {me for me in range(RACERS) if (tmp_path / f"{number}-lost-by-{me}").exists()}
        assert by == f"{number}-by-{({*range(RACERS)} - lost).pop()}"
        assert len(lost) == RACERS - 1
        # What lost is as it was.
        for me in lost:
            assert (tmp_path / f"{number}-by-{me}").exists()


@pytest.mark.parametrize("kinds", [("file", "file"), ("file", "full folder"), ("full folder",) * 2])
def test_two_have_each_others_name(tmp_path: Path, kinds: tuple[str, str]) -> None:
    for name, kind in zip("ab", kinds, strict=True):
        make(tmp_path / name, kind)
    a, b = content(tmp_path / "a"), content(tmp_path / "b")
    if not exchange(tmp_path / "a", tmp_path / "b"):
        pytest.skip("this file system exchanges no names")
    assert (content(tmp_path / "a"), content(tmp_path / "b")) == (b, a)
    with pytest.raises(FileNotFoundError):
        exchange(tmp_path / "a", tmp_path / "gone")


def test_a_system_without_the_step_is_told_from_one_that_refuses(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    make(tmp_path / "a", "file")
    make(tmp_path / "b", "file")
    be_without("links", monkeypatch.setattr)
    assert not exchange(tmp_path / "a", tmp_path / "b")
    assert content(tmp_path / "a") == "a"
