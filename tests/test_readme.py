"""What the README shows works as it stands."""

import re
import shlex
import tomllib
from pathlib import Path

import numpy as np
import pytest

from nearfar.cli.commands import COMMANDS
from nearfar.plan import Plan, paper_plan
from nearfar.rigs.tables import RealTable, SimulatedTable
from nearfar.transport.model import Transport

README = (Path(__file__).parents[1] / "README.md").read_text(encoding="utf-8")


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


def test_every_command_it_shows_is_one():
    known = set(COMMANDS)
    shown = [
        shlex.split(line.split("#")[0])
        for block in _blocks("")
        for line in block.splitlines()
        if line.startswith("nearfar ")
    ]
    assert {words[1] for words in shown} >= {
        "plan", "export", "import", "reconstruct", "relight", "evaluate", "acquire", "render",
        "info", "convert", "figures", "check", "separate",
    }  # fmt: skip
    assert {words[1] for words in shown} <= known


def test_the_rig_files_it_shows_are_read():
    text, real = _blocks("toml")
    assert RealTable.model_validate(tomllib.loads(real)).camera.driver == "aravis"
    table = SimulatedTable.model_validate(tomllib.loads(text))
    assert table.camera.bits == 14
    # Uncommented lines too.
    SimulatedTable.model_validate(tomllib.loads(text.replace("# exposure", "exposure")))


def test_the_counts_it_states():
    rows = re.findall(r"\| (\d+)x(\d+) \| (\d+) \| (\d+)x(\d+) \| (\d+) \| ([\d.]+) times", README)
    assert len(rows) == 3
    for height, width, window, far_height, far_width, photos, times in rows:
        theory = photos == "423"
        plan = paper_plan(
            *_sizes((height, width)),
            int(window),
            *_sizes((far_height, far_width)),
            dropped=_sizes((3, 3))[0] if theory else None,
            offset="none" if theory else "inverse",
        )
        assert plan.transport_photos == int(photos)
        assert f"{plan.savings:.2f}" == times


def _sizes(*pairs):
    from nearfar.arrays import Size

    return [Size(int(height), int(width)) for height, width in pairs]
