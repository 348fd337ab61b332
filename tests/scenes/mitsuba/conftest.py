"""Mitsuba itself, in the variant that nearfar chooses."""

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from nearfar.scenes.mitsuba.variant import choose_variant
from tests.absent import need_mitsuba


@pytest.fixture(autouse=True)
def _variant() -> Iterator[None]:
    """Skip by name without Mitsuba; put back the variant that a test changes."""
    need_mitsuba()
    chosen = choose_variant()
    yield
    import mitsuba

    mitsuba.set_variant(chosen.name)


@pytest.fixture
def write(tmp_path: Path) -> Callable[[str], Path]:
    """Write a scene, and beside it the smoke that some scenes name."""

    def put(text: str) -> Path:
        import mitsuba as mi

        smoke = np.random.default_rng(0).uniform(size=(6, 6, 6, 1)).astype(np.float32)
        mi.VolumeGrid(smoke).write(str(tmp_path / "smoke.vol"))
        path = tmp_path / "scene.xml"
        path.write_text(text)
        return path

    return put
