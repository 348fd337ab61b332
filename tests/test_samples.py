"""The sample captures: the good ones reconstruct as well as is stated, the spoilt one is told."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from nearfar.files import encode_png, read_picture
from tests.cli.conftest import check_done, run_nearfar

ROOT = Path(__file__).parents[1]
SAMPLES = ROOT / "samples"
NAMES = ("gray-and-fringes", "plan", "spoilt-by-gamma")
MOST_BYTES = 2_000_000
# Camera pixels of a sample that are reconstructed here: its middle.
SIDE = 24


def import_sample(name, capture, photos=None):
    folder = SAMPLES / name
    photos = photos or folder / "photos"
    by = (folder / "plan.json",) if name == "plan" else ("--patterns", folder / "patterns")
    scale = () if name == "spoilt-by-gamma" else ("--full-scale", 16383)
    check_done(run_nearfar("import", *by, photos, capture, *scale, "--quiet"))
    return capture


def middle_of(name, folder):
    """Write the middle of a sample's photos, and of those that were held out."""
    for source in ("photos", "held-out"):
        (folder / source).mkdir()
        for path in (SAMPLES / name / source).iterdir():
            pixels = read_picture(path)
            if ".light" not in path.name:
                top, left = ((side - SIDE) // 2 for side in pixels.shape)
                pixels = np.ascontiguousarray(pixels[top : top + SIDE, left : left + SIDE])
            (folder / source / path.name).write_bytes(encode_png(pixels))
    return folder / "photos"


def held_out_snr(transport, folder):
    command = ("evaluate", transport, "--photos", folder, "--full-scale", 16383, "--json")
    return json.loads(check_done(run_nearfar(*command)).out)["snr_b_mean"]


@pytest.mark.parametrize("name", NAMES)
def test_a_sample_is_small_and_described(name):
    files = [path for path in (SAMPLES / name).rglob("*") if path.is_file()]
    assert 0 < sum(path.stat().st_size for path in files) < MOST_BYTES
    assert f"`{name}`" in (SAMPLES / "README.md").read_text(encoding="utf-8")


def test_patterns_of_others_find_q_and_relight_what_they_did_not_show(tmp_path):
    photos = middle_of("gray-and-fringes", tmp_path)
    capture = import_sample("gray-and-fringes", tmp_path / "c.zarr", photos)
    check_done(run_nearfar("correspond", capture, tmp_path / "q.npy"))
    assert np.isfinite(np.load(tmp_path / "q.npy")).all(axis=-1).mean() > 0.98
    transport = tmp_path / "t.zarr"
    said = check_done(run_nearfar("reconstruct", capture, transport, "--json")).out
    assert json.loads(said)["verdict"] == "good"
    assert held_out_snr(transport, tmp_path / "held-out") > 36


def test_a_plans_photos_relight_what_no_photo_shows(tmp_path):
    capture = import_sample("plan", tmp_path / "c.zarr", middle_of("plan", tmp_path))
    transport = tmp_path / "t.zarr"
    said = check_done(run_nearfar("reconstruct", capture, transport, "--json")).out
    assert json.loads(said)["verdict"] == "good"
    assert held_out_snr(transport, tmp_path / "held-out") > 37


def test_the_spoilt_sample_is_told_by_name(tmp_path):
    capture = import_sample("spoilt-by-gamma", tmp_path / "c.zarr")
    told = run_nearfar("correspond", capture, tmp_path / "q.npy").err
    assert "the photos' values follow the patterns' levels to a power of about 0.69" in told
    assert "do not sum to one white at 100% of the camera pixels" in told


def test_the_patterns_are_those_that_make_draws(tmp_path):
    program = (
        "import sys; sys.path.insert(0, sys.argv[1]); import make; from pathlib import Path;"
        "make.write(Path(sys.argv[2]), make.as_bytes(make.gray_and_fringes()))"
    )
    command = [sys.executable, "-c", program, SAMPLES, tmp_path / "made"]
    subprocess.run([str(word) for word in command], check=True)
    for name in ("gray-and-fringes", "spoilt-by-gamma"):
        for path in (SAMPLES / name / "patterns").iterdir():
            assert path.read_bytes() == (tmp_path / "made" / path.name).read_bytes()
