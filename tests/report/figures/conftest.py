"""The paper's experiments, on grids small enough for tests."""

from functools import partial
from pathlib import Path

import pytest

from nearfar.arrays import Size
from nearfar.illumination.pictures import landscape, penguin
from nearfar.report.figures import run
from nearfar.workflow.experiments.acquired import Acquisition, acquire_scene
from nearfar.workflow.experiments.compressive import acquire_compressively
from nearfar.workflow.experiments.in_theory import Theory, acquire_in_theory
from nearfar.workflow.experiments.scan_line import components_along_a_line

BOX = Acquisition("cornell", Size(16, 16), 5, Size(3, 3), penguin, 0.6)
CORNER = Acquisition("corner", Size(16, 16), 5, Size(3, 3), landscape, 0.55)
WEDGE = Theory("wedge", Size(16, 20), 5, Size(3, 4), Size(1, 1))

SMALL = {
    "box": partial(acquire_scene, BOX),
    "scan-line": partial(components_along_a_line, BOX),
    "corner": partial(acquire_scene, CORNER),
    "wedge": partial(acquire_in_theory, WEDGE),
    "CLT": partial(acquire_compressively, WEDGE),
}


@pytest.fixture(scope="session")
def measured_once(tmp_path_factory: pytest.TempPathFactory) -> dict[str, object]:
    """Data of the small experiments, measured once."""
    return {name: make(lambda _what, _share: None) for name, make in SMALL.items()}


@pytest.fixture
def small(
    measured_once: dict[str, object], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> list[str]:
    """Draw the small experiments, from a cache of their own; lists those that were asked for."""
    asked: list[str] = []

    def give(name: str, _report: object) -> object:
        asked.append(name)
        return measured_once[name]

    monkeypatch.setenv("NEARFAR_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(run, "EXPERIMENTS", {name: partial(give, name) for name in SMALL})
    return asked
