"""What README and CONTRIBUTING show works as it stands."""

import re
import shlex
import tomllib
from pathlib import Path

import numpy as np
import pytest

from nearfar.cli.commands import COMMANDS
from nearfar.plan import Plan
from nearfar.transport.model import Transport

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def _blocks(language: str) -> list[str]:
    fences = re.findall(r"^```(\w*)\n(.*?)^```$", README, flags=re.DOTALL | re.MULTILINE)
    return [text for named, text in fences if named == language]


@pytest.mark.slow
def test_the_quick_start_runs(tmp_path: Path, monkeypatch):
    (code,) = _blocks("python")
    assert len([line for line in code.splitlines() if line]) <= 13
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {}
    exec(compile(code, "README.md", "exec"), names)
    transport, relit = names["transport"], names["relit"]
    assert isinstance(names["plan"], Plan)
    assert isinstance(transport, Transport)
    assert relit.shape == (64, 64, 3)
    parts = names["direct"] + names["near"] + names["far"]
    np.testing.assert_allclose(parts, relit, atol=1e-5)
    assert names["one_pixel"].max() > 0.05
    assert names["operator"].shape == (4096, 4096)


def test_every_command_is_shown_and_what_it_shows_is_one():
    in_blocks = [line for block in _blocks("") for line in block.splitlines()]
    shown = {
        shlex.split(line.split("#")[0])[1] for line in in_blocks if line.startswith("nearfar ")
    }
    assert shown >= {"plan", "acquire", "reconstruct", "relight"}
    named = set(re.findall(r"`nearfar ([a-z]+)[^`]*`", README))
    assert shown | named == set(COMMANDS.own)


def test_it_fits_on_a_screen_and_a_half():
    assert len(README.splitlines()) <= 110


def test_the_files_it_links_to_are_there():
    links = re.findall(r"\]\(([^)#:]+)(?:#[^)]*)?\)", README)
    assert len(links) > 10
    for link in links:
        assert (ROOT / link).is_file(), link


def test_layers_are_those_that_are_checked():
    contributing = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    (listed,) = re.findall(r"^```\n(cli  .*?)^```$", contributing, flags=re.DOTALL | re.MULTILINE)
    rows = [re.split(r" {2,}", line)[0].split(", ") for line in listed.splitlines()]
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    contracts = settings["tool"]["importlinter"]["contracts"]
    (layers,) = [contract["layers"] for contract in contracts if contract["type"] == "layers"]
    assert rows == [layer.split(" | ") for layer in layers if layer != "__main__"]
