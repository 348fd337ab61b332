"""Scenes of other packages: found by entry points, computed, kept, and refused where they fail."""

import shutil
import sys
from pathlib import Path

import numpy as np
import pytest

import nearfar
from nearfar.arrays import Size
from nearfar.errors import ExtensionError
from nearfar.scenes import SCENES, build, sizes
from nearfar.scenes.cache import cache_folder, cached_scene

PACKAGE = "striped"
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
    folder.mkdir()
    monkeypatch.setenv("NEARFAR_CACHE", str(tmp_path / "cache"))
    monkeypatch.syspath_prepend(str(folder))

    def forget() -> None:
        sys.modules.pop(PACKAGE, None)
        SCENES.__dict__.pop("_added", None)
        for name in [name for name in SCENES._loaded if name not in SCENES.own]:
            del SCENES._loaded[name]

    def installed(version: str = "1.0", module: str = MODULE) -> None:
        forget()
        for old in folder.glob("*.dist-info"):
            shutil.rmtree(old)
        info = folder / f"{PACKAGE}-{version}.dist-info"
        info.mkdir()
        (folder / f"{PACKAGE}.py").write_text(module)
        # Python compares times in whole seconds, and would read what it compiled before.
        monkeypatch.setattr(sys, "dont_write_bytecode", True)
        (info / "METADATA").write_text(
            f"Metadata-Version: 2.1\nName: {PACKAGE}\nVersion: {version}\n"
        )
        (info / "entry_points.txt").write_text(
            f"[nearfar.scenes]\nmy/stripes = {PACKAGE}:STRIPES\nstubborn = {PACKAGE}:STUBBORN\n"
        )

    yield installed
    forget()


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
