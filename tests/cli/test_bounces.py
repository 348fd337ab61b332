"""``nearfar bounces``: a folder of pictures, whole or not at all."""

import json
from dataclasses import replace

import numpy as np
import pytest

from nearfar import bounces, load_transport, save_transport, split_physically
from nearfar.arrays import Size
from nearfar.files import read_picture
from nearfar.transport.exact import ExactTransport
from nearfar.transport.exact_store import save_exact
from tests.cli.conftest import check_done, check_sentence, run_nearfar
from tests.worlds import model_transport

SIZE = Size(12, 10)
FOLDER = "bounces"


@pytest.fixture
def here(tmp_path, monkeypatch):
    """A folder with a transport of three channels and a light."""
    monkeypatch.chdir(tmp_path)
    made = model_transport(SIZE, SIZE, window=5, far=Size(3, 3), channels=3, seed=4)
    save_transport(made, "t.zarr")
    np.save("light.npy", np.random.default_rng(1).random(SIZE, dtype=np.float32))
    return tmp_path


def test_pictures_are_those_of_python_and_sum_to_the_relit_one(here):
    ran = check_done(run_nearfar("bounces", "t.zarr", FOLDER, "--light", "light.npy", "--n", 3))
    transport, light = load_transport("t.zarr"), np.load("light.npy")
    found = bounces(split_physically(transport), light, 3)
    written = [np.load(f"{FOLDER}/{name}.npy") for name in ("bounce-1", "bounce-2", "bounce-3")]
    np.testing.assert_array_equal(written, found.pictures)
    later = np.load(f"{FOLDER}/later.npy")
    np.testing.assert_allclose(np.sum(written, axis=0) + later, transport @ light, atol=1e-6)
    numbers = json.loads((here / FOLDER / "numbers.json").read_text())
    assert sum(numbers["shares"]) + numbers["later_share"] == pytest.approx(1)
    assert f"bounce 2: {numbers['shares'][1]:.2%} of the light" in ran.out
    assert ran.out.endswith(f"written to {FOLDER}\n")


def test_white_and_four_bounces_if_nothing_else_is_said(here):
    check_done(run_nearfar("bounces", "t.zarr", FOLDER, "--quiet"))
    found = bounces(split_physically(load_transport("t.zarr")), np.ones(SIZE), 4)
    np.testing.assert_array_equal(np.load(f"{FOLDER}/bounce-4.npy"), found.pictures[3])
    names = [f"bounce-{number}" for number in range(1, 5)] + ["later"]
    expected = {f"{name}.{end}" for name in names for end in ("npy", "png")} | {"numbers.json"}
    assert {entry.name for entry in (here / FOLDER).iterdir()} == expected


def test_pictures_for_looking_are_bright_and_say_so(here):
    ran = check_done(run_nearfar("bounces", "t.zarr", FOLDER, "--n", 2))
    gains = json.loads((here / FOLDER / "numbers.json").read_text())["png_gains"]
    for name, gain in gains.items():
        brightest = np.quantile(np.load(f"{FOLDER}/{name}.npy"), 0.999)
        assert 0.45 < gain * brightest <= 0.9
        assert (f"the .png is {gain} × as bright" in ran.out) == (gain > 1)
        assert read_picture(here / FOLDER / f"{name}.png").max() > 170
    assert gains["bounce-2"] > 1


def test_lights_are_read_as_relight_reads_them(here):
    from nearfar.files import write_picture

    picture = np.random.default_rng(2).random((24, 20, 3)).astype(np.float32)
    write_picture(here / "light.png", picture)
    options = ("--srgb", "--resize")
    ran = check_done(
        run_nearfar("bounces", "t.zarr", FOLDER, "--light", "light.png", *options, "--n", 1)
    )
    assert "light.png of 24x20 was resized to 12x10" in ran.out
    check_done(run_nearfar("relight", "t.zarr", "light.png", "relit.npy", *options))
    whole = np.load(f"{FOLDER}/bounce-1.npy") + np.load(f"{FOLDER}/later.npy")
    np.testing.assert_allclose(whole, np.load("relit.npy"), atol=1e-6)


def test_a_folder_is_replaced_by_force_and_only_if_it_is_of_bounces(here):
    check_done(run_nearfar("bounces", "t.zarr", FOLDER))
    assert "--force" in check_sentence(run_nearfar("bounces", "t.zarr", FOLDER), FOLDER)
    check_done(run_nearfar("bounces", "t.zarr", FOLDER, "--n", 1, "--force"))
    assert not (here / FOLDER / "bounce-2.npy").exists()
    (here / FOLDER / "notes.txt").write_text("mine")
    check_sentence(run_nearfar("bounces", "t.zarr", FOLDER, "--force"), FOLDER)
    assert (here / FOLDER / "notes.txt").read_text() == "mine"


def test_what_breaks_the_assumptions_is_warned_of(here):
    transport = load_transport("t.zarr")
    q = transport.correspondence.copy()
    q[6:] = np.nan
    dark = replace(transport, correspondence=q)
    dark.direct[6:] = 0
    dark.near[6:] = 0
    save_transport(dark, "dark.zarr")
    ran = run_nearfar("bounces", "dark.zarr", FOLDER)
    assert ran.status == 0
    assert "of the projector's pixels light surfaces that the camera does not see" in ran.err
    assert json.loads((here / FOLDER / "numbers.json").read_text())["faults"]


def test_bad_input_gets_a_sentence_and_leaves_nothing(here):
    matrix = np.eye(SIZE.pixels, dtype=np.float32)[None]
    save_exact(ExactTransport(SIZE, SIZE, (), (), matrix, "exact"), "exact.zarr")
    np.save("small.npy", np.ones((3, 3), np.float32))
    check_sentence(run_nearfar("bounces", "exact.zarr", FOLDER), "exact.zarr", "reconstruct")
    check_sentence(run_nearfar("bounces", "none.zarr", FOLDER), "none.zarr")
    light = ("--light", "small.npy")
    check_sentence(run_nearfar("bounces", "t.zarr", FOLDER, *light), "small.npy", "--resize")
    check_sentence(run_nearfar("bounces", "t.zarr", "t.zarr", "--force"), "t.zarr")
    lamps = load_transport("t.zarr")
    save_transport(
        replace(lamps, parts=("free",), near=lamps.near[..., :0, :0]), here / "lamps.zarr"
    )
    check_sentence(run_nearfar("bounces", "lamps.zarr", FOLDER), "without direct light")
    for wrong in (("--n", "0"), ("--srgb",), ("--resize",)):
        ran = run_nearfar("bounces", "t.zarr", FOLDER, *wrong)
        assert ran.status == 2
        assert wrong[0] in ran.err
    assert not (here / FOLDER).exists()
