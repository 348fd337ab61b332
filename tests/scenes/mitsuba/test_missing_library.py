"""Mitsuba on a system that lacks a shared library."""

import os
import shutil
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

# Twice, for Python may import again what failed before.
PROGRAM = """
from nearfar.errors import MissingPackageError
from nearfar.scenes.mitsuba.variant import choose_variant

for _ in range(2):
    try:
        choose_variant()
    except MissingPackageError as error:
        print(error)
"""
STUB = """
try:
    raise ImportError("libatomic.so.1: cannot open shared object file: No such file or directory")
except ImportError:
    print(_drjit_ext.__file__)
"""


def sentences(folder: Path, program: str) -> list[str]:
    """Run a program that finds Dr.Jit in a folder; return the lines that it prints."""
    path = os.pathsep.join(filter(None, [str(folder), os.environ.get("PYTHONPATH")]))
    done = subprocess.run(
        [sys.executable, "-c", program],
        check=True,
        capture_output=True,
        text=True,
        env={**os.environ, "PYTHONPATH": path},
    )
    return done.stdout.splitlines()


def test_dr_jit_itself_without_a_library(tmp_path: Path) -> None:
    """A copy of Dr.Jit that asks for a library of another name, which no system has."""
    spec = find_spec("drjit")
    assert spec is not None
    assert spec.submodule_search_locations
    original = Path(spec.submodule_search_locations[0])
    shutil.copytree(original, tmp_path / "drjit", ignore=shutil.ignore_patterns("include", "cmake"))
    changed = 0
    for file in (tmp_path / "drjit").glob("*.so*"):
        code = file.read_bytes()
        file.write_bytes(code.replace(b"libatomic.so.1\0", b"libabsent.so.1\0"))
        changed += code.count(b"libatomic.so.1\0")
    if not changed:
        pytest.skip("this Dr.Jit needs no libatomic")
    found = sentences(tmp_path, PROGRAM)
    assert len(found) == 2
    assert found[0] == found[1]
    assert "shared library libabsent.so.1, which is missing" in found[0]


def test_debians_package_of_libatomic_is_named(tmp_path: Path) -> None:
    (tmp_path / "drjit").mkdir()
    (tmp_path / "drjit" / "__init__.py").write_text(STUB)
    sentence = (
        "Mitsuba needs the shared library libatomic.so.1, which is missing: install it, on Debian "
        "and Ubuntu by apt install libatomic1."
    )
    assert sentences(tmp_path, PROGRAM) == [sentence, sentence]


def test_another_name_error_keeps_its_own_words(tmp_path: Path) -> None:
    (tmp_path / "drjit").mkdir()
    (tmp_path / "drjit" / "__init__.py").write_text("undefined_name\n")
    with pytest.raises(subprocess.CalledProcessError) as caught:
        sentences(tmp_path, PROGRAM)
    assert "NameError: name 'undefined_name'" in caught.value.stderr
