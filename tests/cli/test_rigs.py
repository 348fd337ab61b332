"""Acquire on every kind of rig, evaluate against it, and ask what the files hold."""

import json
import math
from pathlib import Path

import numpy as np
import pytest

from nearfar.capture import open_capture
from nearfar.scenes import SCENES
from tests.cli.conftest import BY_PAPER, PLAN, check_done, check_sentence, run_nearfar

CORNER = ("render", "corner", "--projector", "16x20", "--camera", "8x9")


def _numbers(found: object) -> list[float]:
    if isinstance(found, dict):
        return [number for value in found.values() for number in _numbers(value)]
    assert isinstance(found, int | float)
    return [float(found)]


def _evaluated(*arguments: object) -> dict:
    def refuse(text: str) -> None:
        raise AssertionError(f"{text} is no JSON")

    ran = check_done(run_nearfar("evaluate", *arguments, "--json"))
    return json.loads(ran.out, parse_constant=refuse)


@pytest.mark.parametrize("kind", ["npz", "npz apart", "exact", "measured", "toml"])
def test_every_stored_transport_is_a_rig(finished, tmp_path: Path, kind: str):
    dense = np.load(finished.truth)
    rig, truth = tmp_path / "rig.npz", finished.apart
    match kind:
        case "npz":
            flat = dense.reshape(72, 320, 3)
            np.savez(rig, T=flat, projector=(16, 20), camera=(8, 9))
        case "npz apart":
            half = dense.reshape(72, 320, 3) / 2
            np.savez(rig, direct=half, near=half / 2, far=half / 2, camera=(8, 9))
            truth = rig
        case "exact":
            rig = finished.apart
        case "measured":
            rig, truth = finished.transport, tmp_path / "dense.npz"
            check_done(run_nearfar("convert", rig, tmp_path / "T.npy"))
            np.savez(truth, T=np.load(tmp_path / "T.npy"), camera=(8, 9))
        case _:
            rig = tmp_path / "rig.toml"
            rig.write_text(
                'exposure = 1\nseed = 7\n[scene]\ntransport = "stored.npy"\ncamera = "8x9"\n'
                "[projector]\nblack_level = 0.01\ngamma = 1.0\n[camera]\nfull_well = 50_000\n"
                "read_noise = 2.0\nbits = 12\nblack_level = 0.05\nambient = 0.02\n"
                "shot_noise = true\n"
            )
            np.save(tmp_path / "stored.npy", dense)
    capture, transport = tmp_path / "capture.zarr", tmp_path / "transport.zarr"
    check_done(run_nearfar("acquire", finished.plan, capture, "--rig", rig))
    check_done(run_nearfar("reconstruct", capture, transport, *BY_PAPER))
    found = _evaluated(transport, "--truth", truth)
    assert all(math.isfinite(number) for number in _numbers(found))
    assert found["snr_b"]["white"] > 25
    assert found["snr"]["T"] > 3
    if kind == "toml":
        opened = open_capture(capture)
        assert opened.full_scale == 4095
        assert opened.rig["seed"] == 7
        assert opened.rig["camera"]["ambient"] == 0.02


def test_a_scene_by_name_is_a_rig(tmp_path: Path):
    plan, capture, transport = (tmp_path / name for name in ("p.json", "c.zarr", "t.zarr"))
    check_done(run_nearfar("plan", "--projector", "16x16", *PLAN[3:], "-o", plan))
    check_done(run_nearfar("acquire", plan, capture, "--rig", "corner"))
    check_done(run_nearfar("reconstruct", capture, transport, *BY_PAPER))
    truth = tmp_path / "truth.zarr"
    check_done(run_nearfar("render", "corner", truth, "--projector", "16x16"))
    found = _evaluated(transport, "--truth", truth)
    assert found["snr_b"]["white"] > 25
    assert found["ceiling"]["snr_b"]["white"] > found["snr_b"]["white"] - 3


def test_the_same_seed_gives_the_same_photos(finished, tmp_path: Path):
    photos = {}
    for seed in (1, 1, 2):
        rig = tmp_path / "rig.toml"
        rig.write_text(f'seed = {seed}\n[scene]\ntransport = "{finished.truth}"\n')
        out = tmp_path / f"{len(photos)}.zarr"
        check_done(run_nearfar("acquire", finished.plan, out, "--rig", rig, "--force"))
        photos.setdefault(seed, []).append(open_capture(out).photos[:])
    np.testing.assert_array_equal(*photos[1])
    assert (photos[1][0] != photos[2][0]).any()


def test_a_transport_a_little_below_zero_is_a_rig(finished, tmp_path: Path):
    dense = np.load(finished.truth)
    dense[3, 4] = -0.05
    np.save(tmp_path / "T.npy", dense)
    rig = tmp_path / "rig.toml"
    rig.write_text('[scene]\ntransport = "T.npy"\n[camera]\nambient = 0.0\n')
    check_done(run_nearfar("acquire", finished.plan, tmp_path / "c.zarr", "--rig", rig))


def test_evaluation_has_these_keys(finished):
    found = _evaluated(finished.transport, "--truth", finished.apart)
    assert {"snr_b", "snr_b_pictures", "snr_b_frequency", "snr_t", "snr", "ceiling"} <= set(found)
    assert set(found["snr"]["physical"]) == set(found["snr"]["model"]) == set("DNF")
    assert {"mean", "p5", "p50", "p95"} <= set(found["snr_t"])
    # A dense T without its components says nothing about them.
    together = _evaluated(finished.transport, "--truth", finished.truth)
    assert set(together["snr"]) == {"T"}
    assert together["snr_b"] == pytest.approx(found["snr_b"], abs=0.01)
    said = check_done(run_nearfar("evaluate", finished.transport, "--truth", finished.apart))
    assert f"{found['snr']['T']:.2f} dB" in said.out
    quiet = run_nearfar("evaluate", finished.transport, "--truth", finished.apart, "-q")
    assert check_done(quiet).out == ""


def test_json_is_json_where_nothing_can_be_measured(finished, tmp_path: Path):
    # Black rows, rows that are exact, and a photo that shows nothing.
    dense = np.load(finished.truth)
    dense[:4] = 0
    np.save(tmp_path / "holes.npy", dense)
    found = _evaluated(finished.transport, "--truth", tmp_path / "holes.npy")
    assert all(math.isfinite(number) for number in _numbers(found))
    pairs = tmp_path / "pairs"
    pairs.mkdir()
    for name, level in {"white": 1.0, "black": 0.0}.items():
        np.save(pairs / f"{name}.light.npy", np.full((16, 20), level, np.float32))
        np.save(pairs / f"{name}.photo.npy", np.zeros((8, 9, 3), np.float32))
    found = _evaluated(finished.transport, "--photos", pairs)
    assert all(math.isfinite(number) for number in _numbers(found))


def test_info_tells_what_each_file_is(finished, tmp_path: Path):
    check_done(run_nearfar("convert", finished.transport, tmp_path / "T.npy"))
    check_done(run_nearfar("convert", finished.transport, tmp_path / "q.npy", "--correspondence"))
    check_done(run_nearfar("relight", finished.transport, finished.light, tmp_path / "relit.png"))
    check_done(run_nearfar(*PLAN, "--offset", "none", "-o", tmp_path / "theory.json"))
    np.savez(tmp_path / "apart.npz", direct=np.zeros((4, 9)), far=np.ones((4, 9)))
    (tmp_path / "rig.toml").write_text('[scene]\nname = "wedge"\n')
    for path, *words in (
        (
            finished.plan,
            "nearfar plan",
            "projector 16x20",
            "W = 5",
            "counting the 68 of transport alone",
        ),
        (tmp_path / "theory.json", "offset none"),
        (finished.capture, "nearfar capture", "8x9", "3 channels", "uint16"),
        (finished.transport, "nearfar transport", "projector 16x20", "camera 8x9", "direct"),
        (finished.apart, "nearfar exact transport", "components apart"),
        (finished.truth, "8 x 9 x 16 x 20 x 3"),
        (tmp_path / "T.npy", "72 x 320 x 3 float32"),
        (tmp_path / "q.npy", "8 x 9 x 2 float32"),
        (tmp_path / "apart.npz", "direct, 4 x 9", "far, 4 x 9"),
        (tmp_path / "rig.toml", "wedge"),
        (tmp_path / "relit.png", "picture, 8 x 9 x 3 uint8"),
        (finished.patterns, "pictures", "pattern-00000.png"),
    ):
        said = check_done(run_nearfar("info", path)).out
        for word in words:
            assert word in said


def test_help_names_every_scene():
    for command in ("acquire", "render", "separate"):
        said = " ".join(run_nearfar(command, "--help").out.split())
        for name in SCENES:
            assert name in said


def test_a_rendered_scene_keeps_the_sizes_asked_for(tmp_path: Path):
    check_done(run_nearfar(*CORNER, tmp_path / "corner.zarr"))
    said = check_done(run_nearfar("info", tmp_path / "corner.zarr")).out
    assert "projector 16x20" in said
    assert "camera 8x9" in said
    check_sentence(run_nearfar(*CORNER, tmp_path / "corner.zarr"), "--force")
