"""Which of Mitsuba's variants runs: the vectorised one where LLVM is found, else the scalar one."""

import os
import sys
from importlib import metadata
from typing import Any, NamedTuple

from nearfar.errors import InputError, MissingPackageError

VECTORISED = "llvm_ad_rgb"
SCALAR = "scalar_rgb"
# Older ones crash or are not taken by Mitsuba.
OLDEST_LLVM = 16
LIBRARY_VARIABLE = "DRJIT_LIBLLVM_PATH"
# Shared libraries that Mitsuba's packages do not bring, and the Debian packages that do.
DEBIAN_PACKAGES = {"libatomic.so.1": "libatomic1"}


class Variant(NamedTuple):
    """The variant that runs, and what a user should know about it."""

    name: str
    notes: tuple[str, ...]


def choose_variant() -> Variant:
    """Load Mitsuba in a variant of linear RGB; a variant set before is kept.

    LLVM is the one that ``DRJIT_LIBLLVM_PATH`` names, else the package karellen-llvm-core's, else
    the system's. Without one the scalar variant runs, and a note says so.

    Raises
    ------
    MissingPackageError
        If Mitsuba is not installed, or a shared library that it needs.
    InputError
        If the variant set before is not one of linear RGB.
    """
    cure = _name_library()
    try:
        import drjit
        import mitsuba
    except (ImportError, NameError) as error:
        # Where a library is missing, Dr.Jit's own handler of the ImportError fails by a NameError.
        reason = error.__context__ if isinstance(error, NameError) else error
        if not isinstance(reason, ImportError):
            raise
        raise MissingPackageError(_how_to_install(str(reason))) from None
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
    slow = (
        f"Mitsuba runs as {SCALAR}, in which photos take several times and render some hundred "
        f"times as long as in {VECTORISED}: {cure}."
    )
    return Variant(chosen, (slow,))


def _how_to_install(reason: str) -> str:
    """Return a sentence on what Mitsuba lacks, from the reason why it cannot be loaded."""
    library, missing, _ = reason.partition(": cannot open shared object file")
    if not missing:
        return (
            f"Mitsuba scenes need the package mitsuba, which cannot be loaded ({reason}): install "
            f"it by pip install 'nearfar[mitsuba]'."
        )
    package = DEBIAN_PACKAGES.get(library)
    cure = f"on Debian and Ubuntu by apt install {package}" if package else "as your system does"
    return f"Mitsuba needs the shared library {library}, which is missing: install it, {cure}."


def _name_library() -> str:
    """Name the packaged LLVM, if Dr.Jit is not loaded yet; return how to get LLVM otherwise."""
    if LIBRARY_VARIABLE in os.environ:
        return (
            f"let {LIBRARY_VARIABLE} name LLVM {OLDEST_LLVM} or newer, or remove it from the "
            f"environment"
        )
    library = _packaged_library()
    if library is None:
        return (
            f"install LLVM {OLDEST_LLVM} or newer, for instance by pip install karellen-llvm-core"
        )
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
    # Dr.Jit would print to stderr what it did not find; the note above says so in one sentence.
    level = drjit.log_level()
    drjit.set_log_level(drjit.LogLevel.Disable)
    try:
        found = bool(drjit.has_backend(drjit.JitBackend.LLVM))
    finally:
        drjit.set_log_level(level)
    return found and drjit.detail.llvm_version()[0] >= OLDEST_LLVM
