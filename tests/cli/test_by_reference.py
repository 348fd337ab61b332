"""A plan by reference on the command line: counts, repeats on the disk, drift told."""

import json
import re
from pathlib import Path

import imagecodecs
import numpy as np
import pytest

from nearfar.capture import open_capture
from nearfar.plan import read_plan
from nearfar.transport.store import load_transport
from nearfar.transport.stored import StoredTransport
from tests.cli.conftest import (
    BY_PAPER,
    PLAN,
    Job,
    check_done,
    check_sentence,
    photograph,
    run_nearfar,
)

BY_REFERENCE = (*PLAN, "--offset", "reference")


@pytest.fixture(scope="module")
def plan(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("plan") / "plan.json"
    check_done(run_nearfar(*BY_REFERENCE, "-o", path))
    return path


@pytest.mark.parametrize(("by", "photos"), [("stripes", 36), ("phase", 0), ("none", 0)])
def test_counts(by: str, photos: int):
    ran = check_done(run_nearfar(*BY_REFERENCE, "--correspondence", by, "--json"))
    found = json.loads(ran.out)
    assert found["transport_photos"] == 34
    assert found["savings"] == 320 / 34
    assert found["photos"]["correspondence"] == photos
    assert found["total_photos"] == 34 + photos + found["photos"]["reference"]


def test_the_defaults_are_the_papers():
    plain = check_done(run_nearfar(*PLAN, "--json"))
    named = run_nearfar(*PLAN, "--offset", "inverse", "--correspondence", "stripes", "--json")
    assert plain.out == check_done(named).out


def test_from_plan_to_transport_through_pictures(finished: Job, plan: Path, tmp_path: Path):
    patterns, photos = tmp_path / "patterns", tmp_path / "photos"
    check_done(run_nearfar("export", plan, patterns))
    made = read_plan(patterns / "plan.json")
    pictures = sorted(patterns.glob("pattern-*.png"))
    # A picture for each photo, repeats and all.
    assert len(pictures) == len(made.patterns) == made.summary()["total_photos"]
    shown = [imagecodecs.png_decode(path.read_bytes()) for path in pictures]
    whites = [i for i, picture in enumerate(shown) if picture.min() == 255]
    blacks = [i for i, picture in enumerate(shown) if picture.max() == 0]
    assert len(whites) == len(blacks) >= 3
    assert {blacks[0], blacks[-1]} == {0, len(shown) - 1}
    photograph(patterns, photos, np.load(finished.truth))
    capture, transport = tmp_path / "capture.zarr", tmp_path / "transport.zarr"
    ran = check_done(run_nearfar("import", plan, photos, capture))
    assert f"{len(shown)} photos" in ran.out
    assert open_capture(capture).plan == made
    said = check_done(run_nearfar("reconstruct", capture, transport, *BY_PAPER)).out
    assert "directly lit" in said
    one, other = (load_transport(path) for path in (transport, finished.transport))
    light = np.load(finished.light)
    np.testing.assert_allclose(one @ light, other @ light, atol=0.01)
    # One photo too few is told.
    next(photos.glob("*00007.npy")).unlink()
    check_sentence(run_nearfar("import", plan, photos, tmp_path / "c.zarr"), str(len(shown)))


@pytest.mark.parametrize(("drift", "warned"), [(0.0, False), (-0.2, True)])
def test_a_drift_over_five_per_cent_is_told(
    finished: Job, plan: Path, tmp_path: Path, drift: float, warned: bool
):
    (tmp_path / "rig.toml").write_text(
        f'[scene]\ntransport = "{finished.truth}"\n'
        f"[projector]\nlamp_drift = {{ per_100_photos = {drift} }}\n"
    )
    capture, transport = tmp_path / "capture.zarr", tmp_path / "transport.zarr"
    check_done(run_nearfar("acquire", plan, capture, "--rig", tmp_path / "rig.toml"))
    ran = run_nearfar("reconstruct", capture, transport, *BY_PAPER)
    assert ran.status == 0
    told = load_transport(transport).provenance["drift"]
    if not warned:
        assert ran.err == ""
        assert max(told.values()) < 0.02
        return
    assert ran.err.startswith("warning: ")
    assert ran.err.count("\n") == 1
    for word in (str(capture), f"{told['lamp']:.1%}", "lamp", "ambient"):
        assert word in ran.err


def test_a_plan_with_one_white_is_refused(finished: Job, plan: Path, tmp_path: Path):
    data = json.loads(plan.read_text())
    seen: set[str] = set()
    kept = []
    for pattern in data["patterns"]:
        text = json.dumps({**pattern, "purpose": ""})
        if text not in seen:
            kept.append(pattern)
        seen.add(text)
    # As version 1 planned it.
    once = tmp_path / "plan.json"
    once.write_text(json.dumps({**data, "version": 1, "patterns": kept}))
    capture = tmp_path / "capture.zarr"
    check_done(run_nearfar("acquire", once, capture, "--rig", finished.truth))
    out = tmp_path / "transport.zarr"
    check_sentence(run_nearfar("reconstruct", capture, out), "white 1", "--offset reference")
    assert not out.exists()


def test_a_joint_estimate_tells_its_errors(
    finished: Job, plan: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    capture, transport = tmp_path / "capture.zarr", tmp_path / "transport.zarr"
    check_done(run_nearfar("acquire", plan, capture, "--rig", finished.truth))
    q = tmp_path / "q.npy"
    check_done(run_nearfar("convert", finished.transport, q, "--correspondence"))
    check_done(run_nearfar("reconstruct", capture, transport, "--correspondence", q))
    picture, bars = tmp_path / "picture.npy", tmp_path / "bars.npy"
    check_done(run_nearfar("relight", transport, finished.light, picture))
    ran = check_done(run_nearfar("relight", transport, finished.light, bars, "--error-bars"))
    assert "standard deviation" in ran.out
    deviation = np.load(bars)
    assert deviation.shape == np.load(picture).shape
    assert (deviation > 0).all()
    # Rows read a few at a time make the same pictures.
    monkeypatch.setattr(StoredTransport.blocks, "__defaults__", (1,))
    for out, options in ((picture, ()), (bars, ("--error-bars",))):
        again = tmp_path / f"again-{out.name}"
        check_done(run_nearfar("relight", transport, finished.light, again, *options))
        np.testing.assert_allclose(np.load(again), np.load(out), rtol=1e-5)
    # Gains scale it.
    twice = tmp_path / "twice.npy"
    gains = [f"--gain={name}=2" for name in ("direct", "near", "far")]
    check_done(run_nearfar("relight", transport, finished.light, twice, "--error-bars", *gains))
    np.testing.assert_allclose(np.load(twice), 2 * deviation, rtol=1e-4)
    # The paper's estimate has none.
    ran = run_nearfar(
        "relight", finished.transport, finished.light, tmp_path / "b.npy", "--error-bars"
    )
    check_sentence(ran, "no error bars", "--method joint")


def test_a_capture_until_it_is_good_enough(finished: Job, tmp_path: Path):
    plan, capture = tmp_path / "chosen.json", tmp_path / "capture.zarr"
    check_done(run_nearfar("plan", "--projector", "16x20", "--photos", 90, "-o", plan))
    shoot = ("acquire", plan, capture, "--rig", finished.truth)
    said = check_done(run_nearfar(*shoot, "--until", "12dB")).out
    *_, reached = said.splitlines()
    assert re.fullmatch(
        r"12 dB is reached after \d+ photos: .* dB under pictures to check by, .* dB expected, "
        r"planned for \d+ to \d+ dB under pictures with all 94 photos, noise alone allows .* dB",
        reached,
    )
    assert len(open_capture(capture).plan.patterns) < 96
    check_done(run_nearfar("reconstruct", capture, tmp_path / "transport.zarr"))
    ran = run_nearfar(*shoot, "--until", "90", "--force")
    assert ran.status == 0
    assert re.search(
        r"90 dB is not reached: all 94 photos relight pictures at .* dB, .* dB expected, planned "
        r"for \d+ to \d+ dB under pictures, noise alone allows .* dB\. ",
        ran.err,
    )
    assert "plan" in ran.err
    assert len(open_capture(capture).plan.patterns) == 94


@pytest.mark.parametrize("text", ["much", "-3dB", "0", "nandB", "500dB"])
def test_what_is_no_snr_to_reach_is_wrong_usage(finished: Job, plan: Path, tmp_path: Path, text):
    capture = tmp_path / "capture.zarr"
    ran = run_nearfar("acquire", plan, capture, "--rig", finished.truth, "--until", text)
    assert ran.status == 2
    assert "35dB" in ran.err
    assert not capture.exists()


def test_a_plan_that_cannot_be_checked_on_the_way_is_refused(finished: Job, tmp_path: Path):
    capture = tmp_path / "capture.zarr"
    shoot = ("acquire", finished.plan, capture, "--rig", finished.truth)
    check_sentence(run_nearfar(*shoot, "--until", "30dB"), "--photos")
    assert not capture.exists()


def test_half_precision_is_half_the_size_and_says_when_it_shows(
    finished: Job, plan: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    capture = tmp_path / "capture.zarr"
    check_done(run_nearfar("acquire", plan, capture, "--rig", finished.truth))
    whole, half = tmp_path / "whole.zarr", tmp_path / "half.zarr"
    check_done(run_nearfar("reconstruct", capture, whole))
    check_done(run_nearfar("reconstruct", capture, half, "--half"))
    for name in ("near", "far"):
        sizes = [
            sum(path.stat().st_size for path in (folder / name).glob("c*"))
            for folder in (whole, half)
        ]
        assert sizes[1] < 0.6 * sizes[0]
    pictures = []
    for folder in (whole, half):
        out = tmp_path / f"{folder.stem}.npy"
        check_done(run_nearfar("relight", folder, finished.light, out))
        pictures.append(np.load(out))
    np.testing.assert_allclose(*pictures, atol=2e-3 * pictures[0].max())
    # Where there is hardly any noise, it is told.
    monkeypatch.setattr("nearfar.faults.of_capture.ROUNDING_SHARE_OF_NOISE", 1e-5)
    ran = run_nearfar("reconstruct", capture, half, "--half", "--force")
    assert ran.status == 0
    assert ran.err.startswith("warning: float16 strays from the windows and bands by 0.0")
