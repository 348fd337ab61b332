"""Logs: lines that are whole, whatever a crash tore off."""

import os
import subprocess
import sys
from dataclasses import dataclass

import pytest

from nearfar.files.logs import note, read_notes


@dataclass
class Noted:
    number: int
    name: str


def as_noted(words):
    return Noted(**words)


NOTES = [Noted(number, name) for number, name in enumerate(["a", "ö\n", "", "{}"])]


@pytest.fixture
def log(tmp_path):
    for one in NOTES:
        note(tmp_path / "log.jsonl", vars(one))
    return tmp_path / "log.jsonl"


def test_what_is_noted_is_read(log, tmp_path):
    assert read_notes(log, as_noted) == NOTES
    assert read_notes(tmp_path / "none.jsonl", as_noted) == []
    assert not (tmp_path / "none.jsonl").exists()


def test_wherever_a_crash_tears_it_the_lines_before_are_kept_and_more_can_be_noted(log):
    data = log.read_bytes()
    ends = [at + 1 for at, byte in enumerate(data) if byte == ord("\n")]
    assert len(ends) == len(NOTES)
    for length in range(len(data)):
        log.write_bytes(data[:length])
        kept = sum(end <= length for end in ends)
        assert read_notes(log, as_noted) == NOTES[:kept]
        note(log, vars(NOTES[-1]))
        assert read_notes(log, as_noted) == [*NOTES[:kept], NOTES[-1]]


@pytest.mark.parametrize("line", [b"{]\n", b"[1]\n", b"\xff\n", b'{"number": 1}\n', b"\0\0\n"])
def test_a_line_that_is_not_understood_ends_it(log, line):
    first, *rest = log.read_bytes().splitlines(keepends=True)
    log.write_bytes(first + line + b"".join(rest))
    assert read_notes(log, as_noted) == NOTES[:1]
    assert log.read_bytes() == first


def test_a_note_waits_for_the_disk(log, monkeypatch):
    waited = []
    monkeypatch.setattr(os, "fsync", lambda file: waited.append(os.fstat(file).st_size))
    note(log, vars(NOTES[0]))
    assert waited == [log.stat().st_size]


# Ends the log's file in the middle of a line, as a disk does that fills up.
FILLING = """
import resource, sys
from pathlib import Path
from nearfar.files.logs import note
log = Path(sys.argv[1])
resource.setrlimit(resource.RLIMIT_FSIZE, (log.stat().st_size + 7,) * 2)
note(log, {"number": 9, "name": "more than there is room for"})
"""


def test_a_disk_that_fills_up_within_a_line_is_not_passed_over(log):
    done = subprocess.run(
        [sys.executable, "-c", FILLING, str(log)], capture_output=True, text=True, check=False
    )
    assert done.returncode == 1
    assert "File too large" in done.stderr
    assert read_notes(log, as_noted) == NOTES
    note(log, vars(NOTES[0]))
    assert read_notes(log, as_noted) == [*NOTES, NOTES[0]]
