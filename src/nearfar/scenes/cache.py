"""Scenes that were computed before are read from the disk."""

import hashlib
import os
from collections.abc import Callable
from pathlib import Path

from nearfar.arrays import Size
from nearfar.errors import NearfarError
from nearfar.scenes import build, sizes
from nearfar.transport.exact import ExactTransport
from nearfar.transport.exact_store import load_exact, save_exact

Progress = Callable[[str, float], None]


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
    progress: Progress | None = None,
) -> ExactTransport:
    """Compute a built-in scene's transport, or read what an earlier call kept.

    Parameters
    ----------
    name, projector, camera, progress
        As `nearfar.scenes.build`.

    Returns
    -------
    ExactTransport

    Raises
    ------
    InputError
        If there is no scene of that name.
    """
    projector, camera = sizes(name, projector, camera)
    path = cache_folder() / f"{name}-{projector}-{camera}-{_fingerprint()}.zarr"
    if path.exists():
        try:
            return load_exact(path)
        except NearfarError:
            # A damaged entry costs its time again, no more.
            pass
    transport = build(name, projector, camera, progress=progress)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        save_exact(transport, path, force=True)
    except (NearfarError, OSError):
        # A full or read-only cache must not cost the scene that was just computed.
        pass
    return transport


def _fingerprint() -> str:
    """Return a name that changes with the code of the scenes: no stale scene is read."""
    digest = hashlib.sha256()
    for source in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(source.read_bytes())
    return digest.hexdigest()[:12]
