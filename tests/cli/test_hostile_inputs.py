"""Files and names that were made to harm: a sentence, and nothing of theirs on terminal or page."""

import builtins
import errno
import io
import os
import random
import re
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from nearfar.cli.printable import CONTROLS
from tests.cli.conftest import (
    BY_PAPER,
    PLAN,
    Job,
    check_done,
    check_refused,
    check_sentence,
    run_nearfar,
)
from tests.metadata import change_attributes, change_metadata

MODEL = ("--near", "5", "--far", "3x3")
# It would clear the screen, and set the window's title.
ESCAPES = "\x1b[2J\x1b]0;owned\x07\x9b1m\u202e"


def _link_to_itself(path: Path) -> Path:
    path.symlink_to(path)
    return path


def test_an_output_that_is_a_loop_of_links(finished: Job, untouched, tmp_path: Path):
    loop = _link_to_itself(tmp_path / "loop.zarr")
    for arguments in (
        (*PLAN, "-o", loop),
        ("export", finished.plan, loop),
        ("import", finished.plan, finished.photos, loop),
        ("acquire", finished.plan, loop, "--rig", finished.truth),
        ("reconstruct", finished.capture, loop),
    ):
        for force in ((), ("--force",)):
            check_refused(untouched, (*arguments, *force), loop)


@pytest.mark.parametrize("ending", ["", ".json", ".zarr", ".toml", ".npy", ".png"])
def test_an_input_that_is_a_loop_of_links(finished: Job, untouched, tmp_path: Path, ending: str):
    loop = _link_to_itself(tmp_path / f"loop{ending}")
    out = tmp_path / "out"
    for arguments in (
        ("info", loop),
        ("export", loop, out),
        ("import", finished.plan, loop, out),
        ("acquire", finished.plan, out, "--rig", loop),
        ("reconstruct", loop, out),
        ("relight", finished.transport, loop, f"{out}.npy"),
        ("check", loop, *MODEL, "--report", f"{out}.html"),
        ("separate", out, "--photos", loop),
        ("separate", out, "--photos", finished.photos, "--pattern", "any", "--ambient", loop),
    ):
        check_refused(untouched, arguments, loop)


@pytest.mark.parametrize(
    "text",
    [
        "x = " + "[" * 50_000,
        "seed = " + "9" * 5000,
        "[scene]\nname = 'corner'\n[camera]\nfull_well = " + "9" * 5000,
        "seed = 0x" + "f" * 5000,
        "[scene]\nname = 'corner'\nsamples = 0x" + "f" * 5000,
    ],
)
def test_toml_that_no_reader_takes(finished: Job, untouched, tmp_path: Path, text: str):
    rig = tmp_path / "rig.toml"
    rig.write_text(text)
    check_refused(untouched, ("info", rig), rig)
    check_refused(untouched, ("acquire", finished.plan, tmp_path / "c.zarr", "--rig", rig), rig)


def test_json_without_end_is_no_store(untouched, tmp_path: Path):
    path = tmp_path / "deep.zarr"
    path.mkdir()
    (path / "zarr.json").write_text("[" * 100_000)
    for arguments in (
        ("info", path),
        ("reconstruct", path, tmp_path / "t.zarr"),
        (*PLAN, "-o", path),
    ):
        check_refused(untouched, (*arguments, *(("--force",) * (arguments[0] == "plan"))), path)


# Mutated metadata


# What no reader expects: of another type, of no size, or of any.
HOSTILE: tuple[Any, ...] = (
    *(None, True, 0, -1, 7.5, 10**6, 10**30, 10**400, float("inf"), float("nan"), "", "x", "1/3"),
    *([], [1], [10**9, 10**9], [None, None], ["1/3", "1/3"], {}, {"a": 1}),
    *("float16", "complex64", "string", "gzip", "transpose", "NaN", "/"),
)


def _places(data: Any) -> Iterator[tuple[Any, Any]]:
    """Yield each value in some JSON by what it is in and its key there, but for provenance."""
    for key in data if isinstance(data, dict) else range(len(data)):
        if key not in {"provenance", "plan", "rig"}:
            yield data, key
            if isinstance(data[key], dict | list):
                yield from _places(data[key])


@pytest.mark.parametrize("kind", ["capture", "transport", "apart"])
def test_mutated_metadata_give_an_answer_or_a_sentence(job: Job, tmp_path: Path, kind: str):
    """As files have it that were written before metadata had checksums."""
    generator = random.Random(1)
    store, out = getattr(job, kind), tmp_path / "out.npy"
    commands: list[tuple[object, ...]] = {
        "capture": [("info", store)],
        "transport": [("info", store), ("relight", store, job.light, out, "--force")],
        "apart": [("info", store), ("check", store, *MODEL)],
    }[kind]
    files = sorted(store.rglob("zarr.json"))
    refused = 0
    for number in range(50):
        file = generator.choice(files)
        whole = file.read_bytes()

        def change(metadata: dict[str, Any]) -> None:
            inside, key = generator.choice(list(_places(metadata)))
            inside[key] = generator.choice(HOSTILE)

        change_metadata(file, change)
        ran = run_nearfar(*commands[number % len(commands)])
        file.write_bytes(whole)
        if ran.status:
            assert len(check_sentence(ran)) < 900
            refused += 1
        else:
            assert ran.err == ""
    assert refused > 20


# Control characters


def _is_clean(text: str) -> bool:
    return CONTROLS.search(text.replace("\n", "")) is None


def test_control_characters_of_names_are_escaped(finished: Job, tmp_path: Path):
    folder = tmp_path / f"a{ESCAPES}"
    shutil.copytree(finished.folder, folder)
    capture, out = folder / "capture.zarr", folder / "t.zarr"
    said = [
        run_nearfar("info", folder / "none"),
        run_nearfar("info", folder / "photos"),
        run_nearfar("reconstruct", capture, out, *BY_PAPER),
        run_nearfar("reconstruct", capture, out),
        run_nearfar("import", folder / "plan.json", folder / "photos", folder / "i.zarr"),
        run_nearfar("relight", out, folder / "none.png", folder / "x.npy"),
    ]
    assert [ran.status for ran in said] == [1, 0, 0, 1, 0, 1]
    for ran in said:
        assert _is_clean(ran.out), ran
        assert _is_clean(ran.err), ran
    assert "\\x1b[2J" in said[0].err


def test_a_name_of_several_lines_makes_one_sentence(tmp_path: Path):
    sentence = check_sentence(run_nearfar("info", tmp_path / "a\nnearfar: all is well"))
    assert "a\\nnearfar" in sentence


def test_a_name_that_is_no_text_is_printed(finished: Job, tmp_path: Path):
    path = Path(os.fsdecode(os.fsencode(tmp_path) + b"/b\xff.zarr"))
    shutil.copytree(finished.capture, path)
    ran = check_done(run_nearfar("reconstruct", path, tmp_path / "t\udcfe.zarr", *BY_PAPER))
    assert "t\\udcfe.zarr" in ran.out


def test_control_characters_of_metadata_are_escaped(job: Job):
    change_attributes(job.capture, rig={"a": 1}, alarms=[f"a{ESCAPES}"], exposure=1.0)
    change_metadata(
        job.transport / "zarr.json",
        lambda metadata: metadata["attributes"].update(format=f"nearfar {ESCAPES}"),
    )
    change_metadata(
        job.apart / "zarr.json", lambda metadata: metadata["attributes"].update(name=ESCAPES)
    )
    for ran in (
        check_done(run_nearfar("info", job.capture)),
        check_done(run_nearfar("info", job.apart)),
        run_nearfar("relight", job.transport, job.light, job.folder / "x.npy"),
    ):
        assert "\\x1b" in ran.out + ran.err
        assert _is_clean(ran.out + ran.err), ran


# Pages


def test_names_are_escaped_in_pages(finished: Job, tmp_path: Path):
    """A file's name is no part of a page."""
    evil = "<img src=x onerror=alert(1)>&\"'"
    folder = tmp_path / evil
    shutil.copytree(finished.folder, folder)
    shutil.move(folder / "apart.zarr", folder / f"{evil}.zarr")
    shutil.move(folder / "capture.zarr", folder / f"c{evil}.zarr")
    pages = {
        "check": (f"{evil}.zarr", *MODEL, "--report"),
        "reconstruct": (f"c{evil}.zarr", f"t{evil}.zarr", *BY_PAPER, "--report"),
        "evaluate": (f"t{evil}.zarr", "--truth", f"{evil}.zarr", "--report"),
    }
    for command, (*arguments, option) in pages.items():
        page = folder / f"{command}{evil}.html"
        paths = [folder / a if a.endswith(".zarr") else a for a in arguments]
        check_done(run_nearfar(command, *paths, option, page))
        _check_escaped(page.read_text(encoding="utf-8"), evil)


def _check_escaped(text: str, evil: str) -> None:
    assert evil not in text
    assert "<img src=x" not in text
    assert "&lt;img src=x onerror=alert(1)&gt;&amp;&quot;&#x27;" in text
    assert re.findall(r"<(?:img|a) [^>]*(?:src|href)=[^\"]", text) == []


# Permissions


@pytest.mark.parametrize("kind", ["plan", "capture", "light"])
def test_a_file_that_may_not_be_read_gets_a_sentence(
    job: Job, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kind: str
):
    path = getattr(job, kind)
    path.chmod(0)
    if os.access(path, os.R_OK):
        # The superuser may read anything; Typer asks here.
        monkeypatch.setattr(os, "access", lambda *_, **__: False)
    ran = run_nearfar(
        *{
            "plan": ("info", path),
            "capture": ("reconstruct", path, tmp_path / "t.zarr", *BY_PAPER),
            "light": ("relight", job.transport, path, tmp_path / "x.npy"),
        }[kind]
    )
    path.chmod(0o700)
    assert "Usage" not in ran.err
    assert ran.status in ({0} if os.geteuid() == 0 else {1})


def _forbid(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let a file be read by nobody: not even by the superuser, who may read anything."""
    path.chmod(0)
    opened = io.open

    def refuse(file: Any, *options: Any, **named: Any) -> Any:
        if not isinstance(file, int) and Path(file) == path:
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(path))
        return opened(file, *options, **named)

    for module in (io, builtins):
        monkeypatch.setattr(module, "open", refuse)


@pytest.mark.parametrize("ending", [".npy", ".npz"])
@pytest.mark.parametrize("command", ["acquire", "check", "compare", "evaluate", "info", "separate"])
def test_arrays_that_may_not_be_read_are_not_called_damaged(
    job: Job, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, ending: str, command: str
):
    path, out = job.truth.with_suffix(ending), tmp_path / "out"
    if ending == ".npz":
        np.savez(path, T=np.load(job.truth))
    _forbid(path, monkeypatch)
    ran = run_nearfar(
        *{
            "acquire": ("acquire", job.plan, out, "--rig", path),
            "check": ("check", path, *MODEL),
            "compare": ("compare", path, out, "--photos", "60"),
            "evaluate": ("evaluate", job.transport, "--truth", path),
            "info": ("info", path),
            "separate": ("separate", out, "--rig", path),
        }[command]
    )
    sentence = check_sentence(ran, path, "Permission denied", "may read")
    assert "save it again" not in sentence


def test_a_matrix_that_may_not_be_mapped_is_not_called_damaged(
    job: Job, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    path = tmp_path / "mask.npy"
    np.save(path, np.ones((72, 320)))
    _forbid(path, monkeypatch)
    ran = run_nearfar("probe", job.transport, tmp_path / "p.npy", "--mask", path)
    check_sentence(ran, path, "Permission denied")


@pytest.mark.parametrize("command", ["info", "reconstruct", "evaluate"])
def test_a_store_that_may_not_be_read_is_not_called_anothers(
    job: Job, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, command: str
):
    _forbid(job.capture / "zarr.json", monkeypatch)
    ran = run_nearfar(
        *{
            "info": ("info", job.capture),
            "reconstruct": ("reconstruct", job.capture, tmp_path / "t.zarr"),
            "evaluate": ("evaluate", job.transport, "--truth", job.capture),
        }[command]
    )
    check_sentence(ran, job.capture, "Permission denied", "permissions")
