"""The package as a whole."""

import importlib
import pkgutil
import re
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

import pytest

import nearfar

TIMED = """
import sys, time
started = time.process_time()
import nearfar
seconds = time.process_time() - started
heavy = {"scipy", "numba", "zarr", "trimesh", "embreex", "imagecodecs", "OpenEXR"}
heavy &= set(sys.modules)
sys.exit(f"slow: {seconds} s, {heavy}" if heavy or seconds > 0.5 else 0)
"""


def test_importing_is_quick():
    subprocess.run([sys.executable, "-c", TIMED], check=True)


@pytest.mark.parametrize("name", nearfar.__all__)
def test_every_public_name_is_there_and_documented(name):
    assert getattr(nearfar, name).__doc__


def test_help_lists_every_public_name_in_the_order_of_the_flow():
    listed = re.findall(r"^    (\w+) {2,}\w", nearfar.__doc__, re.M)
    assert listed == list(nearfar._HOMES) == nearfar.__all__


def test_the_reference_lists_every_public_name_in_the_order_of_the_flow():
    page = Path(__file__).parents[1] / "docs" / "reference" / "python.md"
    listed = re.findall(r"^   (\w+)$", page.read_text(), re.M)
    assert listed == nearfar.__all__


def test_no_public_name_is_hidden_by_a_module():
    modules = {module.name for module in pkgutil.iter_modules(nearfar.__path__)}
    assert not modules & {*nearfar.__all__, *nearfar._OLD}


def test_the_version_is_the_installed_one():
    assert nearfar.__version__ == version("nearfar")


@pytest.mark.parametrize("name", nearfar._OLD)
def test_an_old_name_still_works_and_warns(name):
    home, instead = nearfar._OLD[name]
    with pytest.warns(DeprecationWarning, match=re.escape(instead)) as seen:
        found = getattr(nearfar, name)
    assert found is getattr(importlib.import_module(home), name)
    assert seen[0].filename == __file__
    assert name not in nearfar.__all__


def test_a_name_that_is_not_there():
    with pytest.raises(AttributeError, match="teapot"):
        _ = nearfar.teapot
