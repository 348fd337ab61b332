"""The paper's experiments, on grids small enough for tests."""

from collections.abc import Callable, Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import NamedTuple

import pytest
from matplotlib.figure import Figure

from nearfar.arrays import Size
from nearfar.baselines.choosing import best_share
from nearfar.illumination.pictures import landscape, penguin
from nearfar.report.figures import run
from nearfar.workflow.experiments import compressive
from nearfar.workflow.experiments.acquired import Acquisition, acquire_scene
from nearfar.workflow.experiments.data import Data
from nearfar.workflow.experiments.in_theory import Theory, acquire_in_theory
from nearfar.workflow.experiments.scan_line import components_along_a_line

BOX = Acquisition("cornell", Size(16, 16), 5, Size(3, 3), penguin, 0.6)
CORNER = Acquisition("corner", Size(16, 16), 5, Size(3, 3), landscape, 0.55)
WEDGE = Theory("wedge", Size(16, 20), 5, Size(3, 4), Size(1, 1))


def _compressively(report: Callable[[str, float], None]) -> Data:
    """Acquire the wedge compressively; a few rows are enough to choose some lambda."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(compressive, "best_share", partial(best_share, rows=24))
        return compressive.acquire_compressively(WEDGE, report)


SMALL = {
    "box": partial(acquire_scene, BOX),
    "scan-line": partial(components_along_a_line, BOX),
    "corner": partial(acquire_scene, CORNER),
    "wedge": partial(acquire_in_theory, WEDGE),
    "CLT": _compressively,
}


class Measured(Mapping[str, Data]):
    """Data of the small experiments, each measured when it is first asked for."""

    def __init__(self) -> None:
        self._found: dict[str, Data] = {}

    def __getitem__(self, name: str) -> Data:
        if name not in self._found:
            self._found[name] = SMALL[name](lambda _what, _share: None)
        return self._found[name]

    def __iter__(self) -> Iterator[str]:
        return iter(SMALL)

    def __len__(self) -> int:
        return len(SMALL)


@pytest.fixture(scope="session")
def measured_once() -> Measured:
    """Data of the small experiments, measured once."""
    return Measured()


def use_small(patch: pytest.MonkeyPatch, measured_once: Measured, cache: Path) -> list[str]:
    """Draw the small experiments, from a cache of their own; lists those that were asked for."""
    asked: list[str] = []

    def give(name: str, _report: object) -> Data:
        asked.append(name)
        return measured_once[name]

    patch.setenv("NEARFAR_CACHE", str(cache))
    patch.setattr(run, "EXPERIMENTS", {name: partial(give, name) for name in SMALL})
    return asked


@pytest.fixture
def small(measured_once: Measured, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> list[str]:
    """Draw the small experiments, as `use_small`, from a cache of the test's own."""
    return use_small(monkeypatch, measured_once, tmp_path / "cache")


class Drawn(NamedTuple):
    """All figures: where they are, the cache, what was measured for it, and the figures by file."""

    folder: Path
    cache: Path
    asked: list[str]
    figures: dict[str, Figure]


@pytest.fixture(scope="session")
def drawn_once(measured_once: Measured, tmp_path_factory: pytest.TempPathFactory) -> Drawn:
    """All figures, drawn once; nobody writes here."""
    folder = tmp_path_factory.mktemp("figures")
    figures: dict[str, Figure] = {}
    save = run.save

    def remember(figure: Figure, where: Path, name: str) -> None:
        save(figure, where, name)
        figures[name] = figure

    with pytest.MonkeyPatch.context() as patch:
        asked = use_small(patch, measured_once, folder / "cache")
        patch.setattr(run, "save", remember)
        run.make_figures(folder / "out")
    return Drawn(folder / "out", folder / "cache", asked, figures)
