"""Which of Mitsuba's variants runs: the vectorised one where LLVM is found, else the scalar one."""

import os
import sys
from importlib import metadata
from typing import Any, NamedTuple

from nearfar.errors import InputError, MissingPackageError

VECTORISED = "llvm_ad_rgb"
SCALAR = "scalar_rgb"
# Older ones crash or are not taken by Mitsuba.
LEAST_LLVM = 16
LIBRARY_VARIABLE = "DRJIT_LIBLLVM_PATH"


class Variant(NamedTuple):
    """The variant that runs, and what a user should know about it."""

    name: str
    notes: tuple[str, ...]


def choose_variant() -> Variant:
    """Load Mitsuba in a variant of linear RGB; a variant set before is kept.

    LLVM is the one that ``DRJIT_LIBLLVM_PATH`` names, else the package karellen-llvm-core's, else
    the system's. Without one the scalar variant runs, which a note says.

    Raises
    ------
    MissingPackageError
        If Mitsuba is not installed.
    InputError
        If the variant set before is not one of linear RGB.
    """
    cure = _name_library()
    try:
        import drjit
        import mitsuba
    except ImportError as error:
        raise MissingPackageError(
            f"Mitsuba scenes need the package mitsuba, which cannot be loaded ({error}): install "
            f"it by pip install 'nearfar[mitsuba]'."
        ) from None
    chosen: str | None = mitsuba.variant()
    if chosen is None:
        chosen = VECTORISED if _has_llvm(drjit) else SCALAR
        mitsuba.set_variant(chosen)
    elif not chosen.endswith("_rgb"):
        raise InputError(
            f"Mitsuba runs as {chosen}, which does not render linear RGB: call "
            f"mitsuba.set_variant('{VECTORISED}') first."
        )
    if chosen != SCALAR:
        return Variant(chosen, ())
    slow = f"Mitsuba runs as {SCALAR}, photos some times and render some hundred times slower"
    return Variant(chosen, (f"{slow} than as {VECTORISED}: {cure}.",))


def _name_library() -> str:
    """Name the packaged LLVM, which must be done before Dr.Jit is loaded; say how to get one."""
    if LIBRARY_VARIABLE in os.environ:
        return (
            f"let {LIBRARY_VARIABLE} name LLVM {LEAST_LLVM} or newer, or remove it from the "
            f"environment"
        )
    library = _packaged_library()
    if library is None:
        return f"install LLVM {LEAST_LLVM} or newer, for instance by pip install karellen-llvm-core"
    if "drjit" not in sys.modules:
        os.environ[LIBRARY_VARIABLE] = library
    return f"set {LIBRARY_VARIABLE} to {library} before Mitsuba is loaded"


def _packaged_library() -> str | None:
    try:
        files = metadata.files("karellen-llvm-core") or []
    except metadata.PackageNotFoundError:
        return None
    found = (entry for entry in files if entry.name.startswith("libLLVM.so"))
    return next((os.path.realpath(entry.locate()) for entry in found), None)


def _has_llvm(drjit: Any) -> bool:
    # Dr.Jit says on stderr what it did not find; ours is the one sentence about it.
    level = drjit.log_level()
    drjit.set_log_level(drjit.LogLevel.Disable)
    try:
        found = bool(drjit.has_backend(drjit.JitBackend.LLVM))
    finally:
        drjit.set_log_level(level)
    return found and drjit.detail.llvm_version()[0] >= LEAST_LLVM
