"""Mitsuba scenes on the command line: rendered, photographed, reconstructed, judged."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from nearfar.transport.exact_store import load_exact
from tests.absent import need_mitsuba
from tests.cli.conftest import BY_PAPER, check_done, check_sentence, run_nearfar
from tests.scenes.mitsuba import descriptions as d
from tests.waiting import LONGEST_WAIT

need_mitsuba()

GRID = "16x16"


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    path = tmp_path / "scene.xml"
    path.write_text(d.scene(d.LAMP + d.ball(0.4, -0.2, 0, "")))
    return path


@pytest.mark.slow
def test_a_scene_is_photographed_reconstructed_and_judged(scene: Path, tmp_path: Path):
    plan, capture, transport, truth, other = (
        tmp_path / name for name in ("p.json", "c.zarr", "t.zarr", "truth.zarr", "other.zarr")
    )
    check_done(run_nearfar("plan", "--projector", GRID, "--near", 5, "--far", "3x3", "-o", plan))
    rig = tmp_path / "rig.toml"
    rig.write_text('[scene]\nmitsuba = "scene.xml"\nsamples = 4096\ncamera = "12x12"\n')
    for seed, out in enumerate((truth, other)):
        check_done(
            run_nearfar(
                *("render", scene, out, "--projector", GRID, "--camera", "12x12"),
                *("--samples", 8192, "--seed", seed),
            )
        )

    def judged(source: Path) -> dict:
        check_done(run_nearfar("acquire", plan, capture, "--rig", source, "--force"))
        check_done(run_nearfar("reconstruct", capture, transport, "--force", *BY_PAPER))
        ran = check_done(run_nearfar("evaluate", transport, "--truth", truth, "--json"))
        return json.loads(ran.out)

    # The judge is noisy as well: his transport and another agree to `own` (46 dB), and the method
    # itself on that other, whose pictures have no more noise, does what `stored` says (39 dB).
    white = np.ones((16, 16))
    pair = [load_exact(path) @ white for path in (truth, other)]
    own = 20 * np.log10(np.linalg.norm(pair[0]) / np.linalg.norm(pair[0] - pair[1]))
    stored, found = judged(other), judged(rig)
    remembered = check_done(run_nearfar("info", capture)).out
    for words in ('"integrator": "path"', '"samples": 4096', '"variant"'):
        assert words in remembered
    assert own > 40
    assert found["snr_b"]["white"] > own - 6
    # Photos of 4096 samples each cost 6 dB of it; correspondence starts to fail below 2048.
    assert found["snr_b_pictures"] > stored["snr_b_pictures"] - 9


def test_render_says_what_it_made(scene: Path, tmp_path: Path):
    out = tmp_path / "truth.zarr"
    command = ("render", scene, out, "--projector", GRID, "--camera", "4x4", "--samples", 4)
    said = check_done(run_nearfar(*command)).out
    assert "projector 16x16, camera 4x4" in said
    assert "components together" in check_done(run_nearfar("info", out)).out
    check_sentence(run_nearfar(*command), "--force")
    said = check_done(run_nearfar("info", scene)).out
    for word in ("Mitsuba scene", "without a picture", "camera 16x16", "3 channels", "path"):
        assert word in said


def test_a_grid_of_another_shape_is_warned_of(scene: Path, tmp_path: Path):
    ran = run_nearfar(
        *("render", scene, tmp_path / "o.zarr", "--projector", "8x16", "--samples", 1),
        *("--camera", "2x2"),
    )
    assert ran.status == 0
    assert ran.err.startswith("warning: the projector of scene.xml")
    assert ran.err.count("\n") == 1


def test_bad_input_leaves_nothing_behind(scene: Path, tmp_path: Path, folder_listing):
    plan, out = tmp_path / "p.json", tmp_path / "out.zarr"
    check_done(run_nearfar("plan", "--projector", GRID, "--near", 5, "--far", "3x3", "-o", plan))
    for name, text in (
        ("bare.xml", d.scene(projector="")),
        ("broken.xml", "<scene"),
        ("prb.xml", d.scene(method=d.integrator("prb"))),
    ):
        (tmp_path / name).write_text(text)
    for name, text in (
        ("both.toml", '[scene]\nname = "corner"\nmitsuba = "scene.xml"\n'),
        ("samples.toml", '[scene]\nname = "corner"\nsamples = 4\n'),
        ("none.toml", '[scene]\nmitsuba = "scene.xml"\nsamples = 0\n'),
        ("gone.toml", '[scene]\nmitsuba = "gone.xml"\n'),
    ):
        (tmp_path / name).write_text(text)
    before = folder_listing()
    for rig, word in (
        ("bare.xml", "no projector"),
        ("broken.xml", "cannot be loaded"),
        ("prb.xml", "use path"),
        ("gone.xml", "is no rig"),
        ("both.toml", "give either"),
        ("samples.toml", "samples"),
        ("none.toml", "samples"),
        ("gone.toml", "is not there"),
    ):
        check_sentence(run_nearfar("acquire", plan, out, "--rig", tmp_path / rig), rig[:4], word)
    for name in ("bare.xml", "broken.xml", "prb.xml", "gone.xml"):
        check_sentence(run_nearfar("render", tmp_path / name, out, "--projector", GRID), name)
    check_sentence(run_nearfar("render", scene, out), "give the projector's size")
    check_sentence(run_nearfar("info", tmp_path / "broken.xml"), "broken.xml")
    for extra in (("--samples", 4), ("--seed", 1)):
        ran = run_nearfar("render", "corner", out, *extra)
        assert ran.status == 2
        assert "without chance" in ran.err
    for extra in (("--samples", 0), ("--seed", -1)):
        assert run_nearfar("render", scene, out, *extra).status == 2
    assert folder_listing() == before


WITHOUT = """
import sys
sys.modules["mitsuba"] = None
from nearfar.cli import main
main()
"""


@pytest.mark.parametrize("command", ["render", "acquire", "info"])
def test_without_mitsuba_the_sentence_says_how_to_install_it(
    scene: Path, tmp_path: Path, command: str
):
    plan, out = tmp_path / "p.json", tmp_path / "out.zarr"
    check_done(run_nearfar("plan", "--projector", GRID, "--near", 5, "--far", "3x3", "-o", plan))
    arguments = {
        "render": ("render", scene, out, "--projector", GRID),
        "acquire": ("acquire", plan, out, "--rig", scene),
        "info": ("info", scene),
    }[command]
    ran = subprocess.run(
        [sys.executable, "-c", WITHOUT, *map(str, arguments)],
        capture_output=True,
        text=True,
        timeout=LONGEST_WAIT,
        check=False,
    )
    assert ran.returncode == 1
    assert ran.stderr.count("\n") == 1
    assert "pip install 'nearfar[mitsuba]'" in ran.stderr
    assert not out.exists()


def test_without_llvm_the_command_says_so_and_goes_on(scene: Path, tmp_path: Path):
    out = tmp_path / "out.zarr"
    ran = subprocess.run(
        [
            *(sys.executable, "-m", "nearfar", "render", str(scene), str(out)),
            *("--projector", "2x2", "--camera", "2x2", "--samples", "4"),
        ],
        env=os.environ | {"DRJIT_LIBLLVM_PATH": "/nothing/libLLVM.so"},
        capture_output=True,
        text=True,
        timeout=LONGEST_WAIT,
        check=False,
    )
    assert ran.returncode == 0
    assert ran.stderr.count("warning: Mitsuba runs as scalar_rgb") == 1
    assert load_exact(out).far.max() > 0
