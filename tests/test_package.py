"""The package as a whole."""

import subprocess
import sys

import pytest

import nearfar

TIMED = """
import sys, time
started = time.perf_counter()
import nearfar
seconds = time.perf_counter() - started
heavy = {"scipy", "zarr", "trimesh", "embreex", "imagecodecs", "OpenEXR"} & set(sys.modules)
sys.exit(f"slow: {seconds} s, {heavy}" if heavy or seconds > 0.5 else 0)
"""


def test_importing_is_quick():
    subprocess.run([sys.executable, "-c", TIMED], check=True)


@pytest.mark.parametrize("name", nearfar.__all__)
def test_every_public_name_is_there_and_documented(name):
    assert getattr(nearfar, name).__doc__


def test_a_name_that_is_not_there():
    with pytest.raises(AttributeError, match="teapot"):
        _ = nearfar.teapot
