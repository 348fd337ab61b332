"""Scenes of other packages: found by entry points, computed, kept, and refused where they fail."""

import sys
from pathlib import Path

import numpy as np
import pytest

import nearfar
from nearfar.arrays import Size
from nearfar.errors import ExtensionError
from nearfar.scenes import SCENES, build, sizes
from nearfar.scenes.cache import cache_folder, cached_scene
from tests.packages import forget_packages, write_package

PACKAGE = "striped"
ENTRIES = {"my/stripes": f"{PACKAGE}:STRIPES", "stubborn": f"{PACKAGE}:STUBBORN"}
MODULE = """
import numpy as np
from nearfar import ExactTransport, Size
from nearfar.scenes.description import SceneDescription

GAIN = 0.5
COMPUTED = []


def compute(projector, camera, progress):
    COMPUTED.append((projector, camera))
    progress("stripes", 1.0)
    far = np.full((1, camera.pixels, projector.pixels), GAIN / projector.pixels, np.float32)
    return ExactTransport(projector, camera, (), (), far, "stripes")


STRIPES = SceneDescription(
    summary="stripes", projector=Size(4, 6), camera_scale=2, compute=compute
)
STUBBORN = SceneDescription(
    summary="stripes of one size",
    projector=Size(4, 6),
    compute=lambda projector, camera, progress: compute(Size(4, 6), camera, progress),
)
"""


@pytest.fixture
def install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Return a function that installs one version of a package, in place of an earlier one."""
    folder = tmp_path / "site"
    monkeypatch.setenv("NEARFAR_CACHE", str(tmp_path / "cache"))
    monkeypatch.syspath_prepend(str(folder))
    # Python compares times in whole seconds, and would read what it compiled of another version.
    monkeypatch.setattr(sys, "dont_write_bytecode", True)

    def installed(version: str = "1.0", module: str = MODULE) -> None:
        forget_packages(SCENES, PACKAGE)
        write_package(folder, PACKAGE, module, "nearfar.scenes", ENTRIES, version)

    yield installed
    forget_packages(SCENES, PACKAGE)


def computed() -> list[tuple[Size, Size]]:
    """Sizes that the package's function was called with since it was loaded."""
    return list(sys.modules[PACKAGE].COMPUTED)


def test_a_scene_of_another_package_is_a_rig(install) -> None:
    install()
    assert list(SCENES)[-2:] == ["my/stripes", "stubborn"]
    assert sizes("my/stripes") == (Size(4, 6), Size(8, 12))
    rig = nearfar.open_rig("my/stripes", Size(3, 5))
    assert (rig.projector, rig.world.camera) == (Size(3, 5), Size(6, 10))
    np.testing.assert_allclose(rig.world @ np.ones((3, 5), np.float32), 0.5, rtol=1e-6)


def test_it_is_kept_until_its_package_changes(install) -> None:
    install()
    cached_scene("my/stripes")
    again = cached_scene("my/stripes")
    assert computed() == [(Size(4, 6), Size(8, 12))]
    assert again.far.max() == pytest.approx(0.5 / 24)
    for version, module in (
        ("1.1", MODULE.replace("GAIN = 0.5", "GAIN = 0.25")),
        ("1.1", MODULE.replace("GAIN = 0.5", "GAIN = 0.75")),
        ("1.2", MODULE.replace("GAIN = 0.5", "GAIN = 0.75")),
    ):
        install(version, module)
        cached_scene("my/stripes")
        assert len(computed()) == 1, "what another version computed was read"
    assert all(path.suffix == ".zarr" for path in cache_folder().iterdir())
    assert len(list(cache_folder().iterdir())) == 4


def test_a_transport_of_other_sizes_is_refused(install) -> None:
    install()
    assert build("stubborn").projector == Size(4, 6)
    with pytest.raises(ExtensionError, match=r"scene stubborn was to be computed for .* of 8x8"):
        build("stubborn", Size(8, 8))
