"""Scenes that were computed before are read from the disk."""

import hashlib
import os
import re
import sys
from pathlib import Path

from nearfar.arrays import Size
from nearfar.callbacks import Report
from nearfar.errors import NearfarError
from nearfar.scenes import SCENES, build, sizes
from nearfar.transport.exact import ExactTransport
from nearfar.transport.exact_store import load_exact, save_exact


def cache_folder() -> Path:
    """Folder of cached scenes: $NEARFAR_CACHE, or the user's cache folder."""
    if chosen := os.environ.get("NEARFAR_CACHE"):
        return Path(chosen)
    base = os.environ.get("XDG_CACHE_HOME")
    return (Path(base) if base else Path.home() / ".cache") / "nearfar"


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
    # A scene of another package may have a name with characters that a file name cannot have.
    known_as = re.sub(r"[^A-Za-z0-9_-]", "_", name)
    path = cache_folder() / f"{known_as}-{projector}-{camera}-{_fingerprint(name)}.zarr"
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
