"""A rival method of another package is compared, drawn and listed as nearfar's own are."""

import sys
from pathlib import Path

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.report.comparison import comparison_page, draw
from nearfar.scenes import build
from nearfar.workflow.compare import compare
from nearfar.workflow.rivals import RIVALS
from tests.packages import forget_packages, write_package

PACKAGE = "guessing"
MODULE = """
import numpy as np
from nearfar import ExactTransport
from nearfar.workflow.rivals.rival import Attempt, Rival

EXPOSURES = []


def attempts(bench, budget):
    if budget.photos < 30:
        return
    projector, camera = bench.scene.projector, bench.scene.camera
    for photos in (2, 10):
        rig = bench.rig(budget.exposure(photos))
        EXPOSURES.append(rig.sensor.full_well / bench.camera.full_well)
        white = np.full((photos, *projector), 255, np.uint8)
        shot = np.stack(list(rig.shoot(iter(white)))).mean(axis=0) / rig.full_scale
        rows = shot.reshape(-1, shot.shape[-1]).T[..., None] / projector.pixels
        far = np.repeat(rows, projector.pixels, axis=2).astype(np.float32)
        far *= 0.5 if photos == 2 else 1.0
        yield Attempt(photos, ExactTransport(projector, camera, (), (), far, "guess"))


GUESS = Rival(title="a guess", line={"color": "#000000"}, attempts=attempts)
"""


@pytest.fixture
def guess(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Install a package with a rival that relights as if all light were spread evenly."""
    write_package(tmp_path, PACKAGE, MODULE, "nearfar.rivals", {"guess": f"{PACKAGE}:GUESS"})
    monkeypatch.syspath_prepend(str(tmp_path))
    forget_packages(RIVALS, PACKAGE)
    yield
    forget_packages(RIVALS, PACKAGE)


@pytest.mark.usefixtures("guess")
def test_a_rival_of_another_package_is_compared() -> None:
    assert list(RIVALS) == [*RIVALS.own, "guess"]
    scene = build("cornell", Size(6, 8))
    found = compare(scene, [24, 40], methods=["guess", "brute force"], window=3)
    mine = [trial for trial in found.equal_photos if trial.method == "guess"]
    # Of 24 photos it makes nothing; of its two attempts the first relights at half the light.
    assert [(trial.budget, trial.photos) for trial in mine] == [(40, 10)]
    assert [trial.exposure for trial in mine] == [10.0]
    longer = [trial for trial in found.equal_exposure if trial.method == "guess"]
    assert [trial.budget for trial in longer] == [24, 40, 51]
    np.testing.assert_allclose([trial.exposure for trial in longer], (24, 40, 51))
    exposures = sys.modules[PACKAGE].EXPOSURES
    np.testing.assert_allclose(exposures, (1, 1, 12, 2.4, 20, 4, 25.5, 5.1))
    text = comparison_page(found)
    assert "a guess" in text
    labels = [text.get_text() for text in draw(found).legends[0].get_texts()]
    assert labels == ["brute force", "a guess"]
