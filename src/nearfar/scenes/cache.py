"""Scenes that were computed before are read from the disk."""

import hashlib
import os
import re
import sys
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple, TypeVar

from nearfar.arrays import Size
from nearfar.callbacks import Report
from nearfar.errors import NearfarError
from nearfar.scenes import SCENES, build, build_operator, sizes
from nearfar.scenes.description import ByRadiosity
from nearfar.transport import dipole as dipole_profiles
from nearfar.transport.exact import ExactTransport
from nearfar.transport.exact_operator import ExactOperator
from nearfar.transport.exact_store import load_matrices, save_exact
from nearfar.transport.known import KnownTransport
from nearfar.transport.operator_store import load_operator, save_operator

# Of the scenes by radiosity, the large ones: floats, red, green and blue, and at most one patch
# without light for so many projector pixels (`nearfar.scenes.patches`).
BYTES_PER_ENTRY = 4
CHANNELS = 3
PIXELS_PER_CELL = 8
# Matrices of form factors between all patches that are there at once, and what factoring them
# takes: measured.
FORM_FACTORS_AT_ONCE = 2.5
# Matrices of a scene that take more memory than this while they are computed are too large.
LARGEST_MATRICES = 16 * 10**9
# And of projectors with more pixels than this on the shorter side: the radiosity of as many patches
# takes minutes (seven for 136x150), and plans for these are for every projector pixel.
LARGEST_SIDE_OF_MATRICES = 128
# Of an operator, for each pixel of projector and camera: measured.
BYTES_PER_PIXEL = 220

Kept = TypeVar("Kept")


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
    """Estimate the memory that `cached_known` takes.

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
    if needs_operator(name, projector, camera):
        return _memory_of_operator(projector, camera)
    known = _memory_of_matrices(projector, camera)
    if _path(name, projector, camera).exists():
        return SceneMemory(known.kept, known.kept)
    return known


def _memory_of_matrices(projector: Size, camera: Size) -> SceneMemory:
    """Estimate the memory of a scene's matrices, which are still to be computed."""
    matrix = BYTES_PER_ENTRY * camera.pixels * projector.pixels
    kept = CHANNELS * matrix
    patches = projector.pixels * (1 + 1 / PIXELS_PER_CELL)
    between = FORM_FACTORS_AT_ONCE * BYTES_PER_ENTRY * patches**2
    # All but the last channel of the transport are there by then.
    return SceneMemory(max(kept, int(between + kept - matrix)), kept)


def _memory_of_operator(projector: Size, camera: Size) -> SceneMemory:
    """Estimate the memory of a scene's operator."""
    # Its module imports ray casting, which is heavy.
    from nearfar.scenes.native.sizes import patch_size

    nodes = patch_size(projector).pixels * (1 + 1 / PIXELS_PER_CELL)
    between = BYTES_PER_ENTRY * nodes**2
    kept = CHANNELS * between + BYTES_PER_PIXEL * (camera.pixels + projector.pixels)
    return SceneMemory(int(kept + FORM_FACTORS_AT_ONCE * between), int(kept))


def _path(name: str, projector: Size, camera: Size, kind: str = "") -> Path:
    # A scene of another package may have a name with characters that a file name cannot have.
    known_as = re.sub(r"[^A-Za-z0-9_-]", "_", name)
    return cache_folder() / f"{known_as}-{projector}-{camera}{kind}-{_fingerprint(name)}.zarr"


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
    return _kept(
        _path(name, projector, camera),
        load_matrices,
        lambda: build(name, projector, camera, progress=progress),
        save_exact,
    )


def cached_operator(
    name: str,
    projector: Size | None = None,
    camera: Size | None = None,
    *,
    progress: Report | None = None,
) -> ExactOperator:
    """Compute a scene's transport as an operator, or read what an earlier call kept.

    Parameters
    ----------
    name, projector, camera, progress
        As `nearfar.scenes.build_operator`.

    Raises
    ------
    InputError, ExtensionError
        As `nearfar.scenes.build_operator`.
    """
    projector, camera = sizes(name, projector, camera)
    return _kept(
        _path(name, projector, camera, kind="-operator"),
        load_operator,
        lambda: build_operator(name, projector, camera, progress=progress),
        save_operator,
    )


def cached_known(
    name: str,
    projector: Size | None = None,
    camera: Size | None = None,
    *,
    progress: Report | None = None,
) -> KnownTransport:
    """Return a scene's transport as matrices, or as an operator where these are too large.

    Parameters
    ----------
    name, projector, camera, progress
        As `nearfar.scenes.build`.

    Raises
    ------
    InputError, ExtensionError
        As `nearfar.scenes.build`.
    """
    make = cached_operator if needs_operator(name, projector, camera) else cached_scene
    return make(name, projector, camera, progress=progress)


def needs_operator(name: str, projector: Size | None = None, camera: Size | None = None) -> bool:
    """Return whether the matrices of a scene are too large, and it has an operator.

    Raises
    ------
    InputError
        If there is no scene of that name.
    """
    projector, camera = sizes(name, projector, camera)
    if not isinstance(SCENES[name].compute, ByRadiosity):
        return False
    too_many = min(projector) > LARGEST_SIDE_OF_MATRICES
    return too_many or _memory_of_matrices(projector, camera).peak > LARGEST_MATRICES


def _kept(
    path: Path,
    load: Callable[[Path], Kept],
    make: Callable[[], Kept],
    save: Callable[..., None],
) -> Kept:
    """Read what is kept at a path, or make and keep it."""
    if path.exists():
        try:
            return load(path)
        except NearfarError:
            # A damaged entry is computed again.
            pass
    made = make()
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        save(made, path, force=True)
    except (NearfarError, OSError):
        # On a full or read-only disk the scene is returned all the same.
        pass
    return made


def _fingerprint(name: str) -> str:
    """Return a name that changes with the code of a scene, so that no stale scene is read.

    Of a scene of another package, that is the package's version and the module of the scene.
    """
    digest = hashlib.sha256()
    folder = Path(__file__).parent
    profiles = Path(dipole_profiles.__file__)
    for source in (*sorted(folder.glob("*.py")), *sorted(folder.glob("native/*.py")), profiles):
        digest.update(source.read_bytes())
    entry = SCENES.entry(name)
    if entry.dist is not None:
        digest.update(f"{name}\n{entry.dist.name}\n{entry.dist.version}\n{entry.value}".encode())
        file = getattr(sys.modules.get(entry.module), "__file__", None)
        if file is not None:
            digest.update(Path(file).read_bytes())
    return digest.hexdigest()[:12]
