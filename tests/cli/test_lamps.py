"""Lamps without a neighbourhood by the command line, from their photos to relit pictures."""

import json
import shutil

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.files import read_picture
from nearfar.files.codecs import encode_png
from nearfar.transport.exact import ExactTransport
from tests.cli.conftest import check_done, check_sentence, run_nearfar
from tests.shown import random_binary, single_pixels, with_inverses, write_pictures

LAMPS, CAMERA = Size(3, 5), Size(16, 18)
FREE = ("--no-near", "--no-far")


@pytest.fixture(scope="module")
def dense():
    """Light from each lamp at each camera pixel, in no order: (C, P)."""
    return np.random.default_rng(0).uniform(0, 0.05, (CAMERA.pixels, LAMPS.pixels))


@pytest.fixture(scope="module")
def folder(dense, tmp_path_factory):
    """A capture of each of two sets, and a light."""
    folder = tmp_path_factory.mktemp("lamps")
    world = ExactTransport(LAMPS, CAMERA, (), (), dense[None].astype(np.float32), "lamps")
    dark = np.zeros(LAMPS, np.uint8)
    sets = {
        "single": [*single_pixels(LAMPS), dark],
        "random": [*with_inverses(random_binary(LAMPS, 30)), dark],
    }
    for name, pictures in sets.items():
        patterns = write_pictures(folder / f"{name}-patterns", pictures)
        lights = np.array(pictures, dtype=np.float32) / 255
        exact = (world.pictures(lights) + 0.02) * 65535
        noise = np.random.default_rng(1).normal(0, 20, exact.shape) if name == "random" else 0
        photos = np.rint(exact + noise).astype(np.uint16)
        taken = write_pictures(folder / f"{name}-photos", photos)
        check_done(run_nearfar("import", "--patterns", patterns, taken, folder / f"{name}.zarr"))
        check_done(run_nearfar("reconstruct", folder / f"{name}.zarr", _of(folder, name), *FREE))
    np.save(folder / "light.npy", np.random.default_rng(2).random(LAMPS).astype(np.float32))
    return folder


def _of(folder, name):
    return folder / f"{name}-transport.zarr"


@pytest.mark.parametrize("name", ["single", "random"])
def test_a_relit_picture_is_that_of_the_lamps(folder, dense, name):
    out = folder / f"{name}.npy"
    check_done(run_nearfar("relight", _of(folder, name), folder / "light.npy", out))
    exact = (dense @ np.load(folder / "light.npy").ravel()).reshape(CAMERA)
    np.testing.assert_allclose(np.load(out), exact, atol=1e-3)


def test_error_bars_are_those_of_the_pictures(folder, dense):
    out, bars = folder / "relit.npy", folder / "bars.npy"
    args = (_of(folder, "random"), folder / "light.npy")
    check_done(run_nearfar("relight", *args, out))
    check_done(run_nearfar("relight", *args, bars, "--error-bars"))
    exact = (dense @ np.load(folder / "light.npy").ravel()).reshape(CAMERA)
    off = (np.load(out) - exact) / np.load(bars)
    assert 0.7 < np.sqrt(np.mean(off**2)) < 1.4


def test_a_set_with_no_photo_to_spare_has_no_error_bars_and_is_not_checked(folder):
    answer = run_nearfar(
        "relight", _of(folder, "single"), folder / "light.npy", folder / "b.npy", "--error-bars"
    )
    check_sentence(answer, "do not tell their own noise")
    assert "othing was checked" in check_done(run_nearfar("info", _of(folder, "single"))).out


def test_info_says_what_it_is(folder):
    said = check_done(run_nearfar("info", _of(folder, "random"))).out
    assert said.startswith("good")
    assert "no near or far range: 15 lamps" in said
    assert "near " not in said.split("floodlit:")[1].split("\n")[0]


@pytest.mark.parametrize("gain", ["near=2", "far=0"])
def test_gains_of_absent_parts_get_a_sentence(folder, gain):
    answer = run_nearfar(
        "relight", _of(folder, "random"), folder / "light.npy", folder / "g.npy", "--gain", gain
    )
    check_sentence(answer, gain.split("=")[0], "direct and free")


def test_the_verdict_is_in_the_json(folder, tmp_path):
    ran = run_nearfar("reconstruct", folder / "random.zarr", tmp_path / "t.zarr", *FREE, "--json")
    answer = json.loads(check_done(ran).out)
    assert answer["verdict"] == "good"
    # The noise of the held-out photos hides half of the errors.
    assert answer["held_out_dB"] == pytest.approx(answer["expected_dB"], abs=4)


def test_without_a_photo_under_black_a_warning_says_so(folder, tmp_path):
    for what in ("patterns", "photos"):
        shutil.copytree(folder / f"single-{what}", tmp_path / what)
        (tmp_path / what / "p15.png").unlink()
    check_done(
        run_nearfar(
            "import", "--patterns", tmp_path / "patterns", tmp_path / "photos", tmp_path / "c.zarr"
        )
    )
    ran = run_nearfar("reconstruct", tmp_path / "c.zarr", tmp_path / "t.zarr", *FREE)
    assert ran.status == 0
    assert "no photo under black" in ran.err


def test_colour_patterns_get_a_sentence(folder, tmp_path):
    shutil.copytree(folder / "single-patterns", tmp_path / "patterns")
    coloured = np.zeros((*LAMPS, 3), np.uint8)
    coloured[0, 0] = 255, 0, 0
    (tmp_path / "patterns" / "p0.png").write_bytes(encode_png(coloured))
    capture = tmp_path / "c.zarr"
    patterns, photos = tmp_path / "patterns", folder / "single-photos"
    check_done(run_nearfar("import", "--patterns", patterns, photos, capture))
    ran = run_nearfar("reconstruct", capture, tmp_path / "t.zarr", *FREE)
    check_sentence(ran, capture, "colour")


@pytest.mark.parametrize("option", [("--square",), ("--method", "paper"), ("--half",)])
def test_options_of_the_model_are_refused(folder, tmp_path, option):
    ran = run_nearfar("reconstruct", folder / "random.zarr", tmp_path / "t.zarr", *FREE, *option)
    assert ran.status == 2
    assert option[0] in ran.err


@pytest.fixture(scope="module")
def planned(folder, dense, tmp_path_factory):
    """The same lamps, planned for, photographed by a simulated rig and reconstructed."""
    made = tmp_path_factory.mktemp("planned")
    np.save(made / "T.npy", 3 * dense.reshape(*CAMERA, *LAMPS).astype(np.float32))
    plan = ("plan", "--projector", LAMPS, "--photos", 40, *FREE, "-o", made / "plan.json")
    said = check_done(run_nearfar(*plan)).out
    assert "tell all of them apart" in said
    check_done(run_nearfar("acquire", made / "plan.json", made / "c.zarr", "--rig", made / "T.npy"))
    check_done(run_nearfar("reconstruct", made / "c.zarr", made / "t.zarr", *FREE))
    return made


def test_a_plan_of_lamps_goes_all_the_way(planned, folder):
    said = check_done(run_nearfar("info", planned / "t.zarr")).out
    assert said.startswith("good: Relit lights of the check photos")
    out = check_done(
        run_nearfar("evaluate", planned / "t.zarr", "--truth", planned / "T.npy", "--json")
    )
    assert json.loads(out.out)["snr"]["T"] > 25


def test_the_patterns_of_a_plan_of_lamps_are_exported_and_its_photos_imported(planned, tmp_path):
    check_done(run_nearfar("export", planned / "plan.json", tmp_path / "patterns"))
    shown = sorted((tmp_path / "patterns").glob("*.png"))
    assert len(shown) == 40
    light = [read_picture(path).mean() for path in shown]
    photos = write_pictures(
        tmp_path / "photos", [np.full((4, 4), 10 + level / 2, np.uint8) for level in light]
    )
    check_done(run_nearfar("import", planned / "plan.json", photos, tmp_path / "c.zarr"))


@pytest.mark.parametrize("command", ["reconstruct", "correspond"])
def test_the_model_of_ranges_gets_a_sentence_of_photos_of_lamps(planned, tmp_path, command):
    out = tmp_path / ("t.zarr" if command == "reconstruct" else "q.npy")
    check_sentence(run_nearfar(command, planned / "c.zarr", out), "--no-near --no-far")


@pytest.mark.parametrize("command", ["plan", "reconstruct"])
@pytest.mark.parametrize("flag", FREE)
def test_one_range_alone_is_not_left_out(planned, tmp_path, command, flag):
    arguments = {
        "plan": ("--projector", "3x5", "--photos", 40),
        "reconstruct": (planned / "c.zarr", tmp_path / "t.zarr"),
    }
    ran = run_nearfar(command, *arguments[command], flag)
    assert ran.status == 2
    assert flag in ran.err


def test_a_line_of_lamps_without_order_is_planned_for_too(tmp_path):
    ran = run_nearfar("plan", "--projector", "1x11", "--photos", 20, *FREE, "--json")
    assert json.loads(check_done(ran).out)["total_photos"] == 20


def test_against_a_scene_whose_light_is_known_apart_they_are_compared_as_a_whole(planned, tmp_path):
    scene = tmp_path / "scene.zarr"
    size = ("--projector", LAMPS, "--camera", CAMERA)
    check_done(run_nearfar("render", "cornell", scene, *size))
    check_done(run_nearfar("acquire", planned / "plan.json", tmp_path / "c.zarr", "--rig", scene))
    check_done(run_nearfar("reconstruct", tmp_path / "c.zarr", tmp_path / "t.zarr", *FREE))
    ran = run_nearfar("evaluate", tmp_path / "t.zarr", "--truth", scene, "--json")
    assert list(json.loads(check_done(ran).out)["snr"]) == ["T"]


def test_a_transport_of_lamps_is_converted_and_photographed(planned, dense, tmp_path):
    check_done(run_nearfar("convert", planned / "t.zarr", tmp_path / "T.npy"))
    exact = 3 * dense.reshape(*CAMERA, *LAMPS)
    kept = np.load(tmp_path / "T.npy").reshape(exact.shape)
    # In units of the photos, whose exposure the rig has chosen.
    exact *= (kept * exact).sum() / (exact**2).sum()
    assert np.linalg.norm(kept - exact) < 0.1 * np.linalg.norm(exact)
    rig = ("--rig", planned / "t.zarr")
    check_done(run_nearfar("acquire", planned / "plan.json", tmp_path / "c.zarr", *rig))


def test_a_plan_is_not_chosen_by_a_look_at_lamps(planned):
    look = ("--look", planned / "t.zarr")
    check_sentence(run_nearfar("plan", "--projector", "3x5", "--photos", 30, *look), "t.zarr")
