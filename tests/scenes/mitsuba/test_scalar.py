"""Without LLVM: Mitsuba's scalar variant, in a process of its own."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.scenes.mitsuba.loading import load_scene
from nearfar.scenes.mitsuba.transport import render_transport
from tests.scenes.mitsuba import descriptions as d
from tests.waiting import LONGEST_WAIT

SCALAR = """
import json, sys
import numpy as np
from nearfar.arrays import Size
from nearfar.scenes.mitsuba.loading import load_scene
from nearfar.scenes.mitsuba.photos import RenderedWorld
from nearfar.scenes.mitsuba.transport import render_transport

loaded = load_scene(sys.argv[1], Size(2, 2), Size(3, 3))
sums = [float(render_transport(loaded, 128, seed).far.sum()) for seed in range(4)]
photo = RenderedWorld(loaded, 512).pictures(np.ones((1, 2, 2))).sum()
print(json.dumps({"notes": loaded.notes, "sums": sums, "photo": float(photo)}))
"""


def _run(program: str, *arguments: object, library: str = "/nothing/libLLVM.so") -> str:
    ran = subprocess.run(
        [sys.executable, "-W", "error", "-c", program, *map(str, arguments)],
        env=os.environ | {"DRJIT_LIBLLVM_PATH": library},
        capture_output=True,
        text=True,
        timeout=LONGEST_WAIT,
        check=True,
    )
    return ran.stdout


@pytest.mark.slow
@pytest.mark.parametrize(
    "text",
    [
        d.scene(d.GLOSSY + d.panel(d.MASK)),
        d.scene(d.LAMP + d.EVEN + d.panel(d.MASK), method=d.integrator("volpath", 5)),
        d.scene(d.GRID, method=d.integrator("volpath", 5)),
    ],
    ids=["surfaces", "even medium", "uneven medium"],
)
def test_without_llvm_the_same_transport_comes_slower(write, text: str):
    path = write(text)
    found = json.loads(_run(SCALAR, path))
    (note,) = found["notes"]
    assert "scalar_rgb" in note
    assert "DRJIT_LIBLLVM_PATH" in note
    loaded = load_scene(path, Size(2, 2), Size(3, 3))
    fast = float(render_transport(loaded, 20000).far.sum())
    noise = np.std(found["sums"], ddof=1) / 2
    assert abs(np.mean(found["sums"]) - fast) < 5 * noise < 0.4 * fast
    if d.LAMP not in text:
        assert found["photo"] == pytest.approx(fast, rel=0.15)


def test_a_variant_that_is_set_is_kept(tmp_path: Path, write):
    path = write(d.scene())
    program = (
        "import sys, mitsuba; mitsuba.set_variant(sys.argv[2])\n"
        "from nearfar.scenes.mitsuba.loading import load_scene\n"
        "from nearfar.arrays import Size\n"
        "from nearfar.errors import InputError\n"
        "try:\n    load_scene(sys.argv[1], Size(2, 2))\n"
        "except InputError as error:\n    print(error)\n"
        "print(mitsuba.variant())"
    )
    assert _run(program, path, "scalar_rgb").splitlines() == ["scalar_rgb"]
    sentence, kept = _run(program, path, "scalar_spectral").splitlines()
    assert kept == "scalar_spectral"
    assert "scalar_spectral" in sentence
    assert "mitsuba.set_variant('llvm_ad_rgb') first." in sentence


def test_nothing_loads_mitsuba_before_it_is_needed():
    program = (
        "import sys, nearfar, nearfar.cli, nearfar.rigs.opening, nearfar.scenes.mitsuba.photos\n"
        "print('mitsuba' in sys.modules, 'drjit' in sys.modules)"
    )
    assert _run(program).split() == ["False", "False"]
