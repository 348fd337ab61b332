"""Scenes that were computed before are read from the disk."""

import hashlib
import os
import re
import sys
from pathlib import Path
from typing import NamedTuple

from nearfar.arrays import Size
from nearfar.callbacks import Report
from nearfar.errors import NearfarError
from nearfar.scenes import SCENES, build, sizes
from nearfar.transport.exact import ExactTransport
from nearfar.transport.exact_store import load_exact, save_exact

# Of the scenes by radiosity, the large ones: floats, red, green and blue, and at most one patch
# without light for so many projector pixels (`nearfar.scenes.patches`).
BYTES_PER_ENTRY = 4
CHANNELS = 3
PIXELS_PER_CELL = 8
# Matrices of form factors between all patches that are there at once, and what factoring them
# takes: measured.
FORM_FACTORS_AT_ONCE = 2.5


def cache_folder() -> Path:
    """Folder of cached scenes: $NEARFAR_CACHE, or the user's cache folder."""
    if chosen := os.environ.get("NEARFAR_CACHE"):
        return Path(chosen)
    base = os.environ.get("XDG_CACHE_HOME")
    return (Path(base) if base else Path.home() / ".cache") / "nearfar"


class SceneMemory(NamedTuple):
    """Memory of a scene's transport, in bytes.

    Attributes
    ----------
    peak : int
        While it is computed, or read where it was computed before.
    kept : int
        As long as it is used.
    """

    peak: int
    kept: int


def scene_memory(
    name: str, projector: Size | None = None, camera: Size | None = None
) -> SceneMemory:
    """Estimate the memory that `cached_scene` takes.

    Parameters
    ----------
    name, projector, camera
        As `nearfar.scenes.build`.

    Raises
    ------
    InputError
        If there is no scene of that name.
    """
    projector, camera = sizes(name, projector, camera)
    matrix = BYTES_PER_ENTRY * camera.pixels * projector.pixels
    kept = CHANNELS * matrix
    if _path(name, projector, camera).exists():
        return SceneMemory(kept, kept)
    patches = projector.pixels * (1 + 1 / PIXELS_PER_CELL)
    between = FORM_FACTORS_AT_ONCE * BYTES_PER_ENTRY * patches**2
    # All but the last channel of the transport are there by then.
    return SceneMemory(max(kept, int(between + kept - matrix)), kept)


def _path(name: str, projector: Size, camera: Size) -> Path:
    # A scene of another package may have a name with characters that a file name cannot have.
    known_as = re.sub(r"[^A-Za-z0-9_-]", "_", name)
    return cache_folder() / f"{known_as}-{projector}-{camera}-{_fingerprint(name)}.zarr"


def cached_scene(
    name: str,
    projector: Size | None = None,
    camera: Size | None = None,
    *,
    progress: Report | None = None,
) -> ExactTransport:
    """Compute a scene's transport, or read what an earlier call kept.

    Parameters
    ----------
    name, projector, camera, progress
        As `nearfar.scenes.build`.

    Returns
    -------
    ExactTransport

    Raises
    ------
    InputError, ExtensionError
        As `nearfar.scenes.build`.
    """
    projector, camera = sizes(name, projector, camera)
    path = _path(name, projector, camera)
    if path.exists():
        try:
            return load_exact(path)
        except NearfarError:
            # A damaged entry is computed again.
            pass
    transport = build(name, projector, camera, progress=progress)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        save_exact(transport, path, force=True)
    except (NearfarError, OSError):
        # On a full or read-only disk the scene is returned all the same.
        pass
    return transport


def _fingerprint(name: str) -> str:
    """Return a name that changes with the code of a scene, so that no stale scene is read.

    Of a scene of another package, that is the package's version and the module of the scene.
    """
    digest = hashlib.sha256()
    for source in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(source.read_bytes())
    entry = SCENES.entry(name)
    if entry.dist is not None:
        digest.update(f"{name}\n{entry.dist.name}\n{entry.dist.version}\n{entry.value}".encode())
        file = getattr(sys.modules.get(entry.module), "__file__", None)
        if file is not None:
            digest.update(Path(file).read_bytes())
    return digest.hexdigest()[:12]
