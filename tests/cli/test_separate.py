"""``nearfar separate``: from a rig, from photos, and patterns to project."""

import json
import re
import shutil
from dataclasses import replace
from pathlib import Path

import imagecodecs
import numpy as np
import pytest

from nearfar import Size, load_exact, load_transport, snr
from nearfar.arrays import parse_size
from nearfar.baselines.separation_patterns import checkerboards, sinusoids
from nearfar.files import read_picture
from nearfar.scenes import SCENES
from tests.cli.conftest import GRID, Job, check_done, check_refused, run_nearfar

FILES = [f"{name}{ending}" for name in ("direct", "global") for ending in (".exr", ".npy", ".png")]
WRITTEN = [*FILES, "numbers.json"]
CLEAN = """
[scene]
transport = "{truth}"
[projector]
black_level = {black_level}
[camera]
shot_noise = false
read_noise = 0.0
full_well = 1e9
bits = 16
"""


def clean_rig(finished: Job, tmp_path: Path, black_level: float = 0.0) -> Path:
    rig = tmp_path / "rig.toml"
    rig.write_text(CLEAN.format(truth=finished.truth, black_level=black_level))
    return rig


def pictures(folder: Path) -> tuple[np.ndarray, np.ndarray]:
    return np.load(folder / "direct.npy"), np.load(folder / "global.npy")


# A rig


@pytest.mark.parametrize("pattern", ["checkerboard", "sinusoid"])
@pytest.mark.parametrize("black_level", [0.0, 0.1])
def test_a_rig_is_shot_and_separated(finished, tmp_path: Path, pattern: str, black_level: float):
    out, rig = tmp_path / "out", clean_rig(finished, tmp_path, black_level)
    ran = check_done(run_nearfar("separate", out, "--rig", rig, *GRID, "--pattern", pattern))
    assert str(out) in ran.out
    assert sorted(path.name for path in out.iterdir()) == WRITTEN
    direct, global_ = pictures(out)
    assert direct.shape == (8, 9, 3)
    assert direct.dtype == np.float32
    numbers = json.loads((out / "numbers.json").read_text())
    exposure = numbers["rig"]["transport_exposure"]
    floodlit = exposure * np.load(finished.truth).sum(axis=(2, 3))
    np.testing.assert_allclose(direct + global_, floodlit, atol=2e-4)
    assert numbers["pattern"] == pattern
    assert numbers["patterns"] == 8
    assert (numbers["dark"], numbers["black_level"]) == ("black", None)
    assert numbers["direct_share"] == pytest.approx(direct.sum() / (direct + global_).sum())
    for name, picture in (("direct", direct), ("global", global_)):
        np.testing.assert_array_equal(read_picture(out / f"{name}.exr"), picture)
        assert read_picture(out / f"{name}.png").shape == picture.shape


def test_a_scene_is_separated_near_its_truth(tmp_path: Path):
    truth, out = tmp_path / "truth.zarr", tmp_path / "out"
    check_done(run_nearfar("render", "corner", truth, "--projector", "16x16"))
    command = ("separate", out, "--rig", "corner", "--projector", "16x16", "--truth", truth)
    said = check_done(run_nearfar(*command)).out
    found = json.loads((out / "numbers.json").read_text())["snr"]["truth"]
    assert found["direct"] > 30
    assert found["global"] > 20
    assert f"direct {found['direct']:.2f} dB, global {found['global']:.2f} dB" in said
    # A pattern that is coarse against the scene does worse, here and there.
    told = check_done(run_nearfar(*command, "--side", "4", "--force", "--json"))
    coarse = json.loads(told.out)
    assert coarse == json.loads((out / "numbers.json").read_text())
    assert (coarse["side"], coarse["step"]) == (4, 2)
    assert coarse["snr"]["truth"]["direct"] < found["direct"] - 3
    assert coarse["snr"]["truth"]["global"] < found["global"] - 3


def test_a_reconstruction_is_compared_with(finished, tmp_path: Path):
    out = tmp_path / "out"
    command = ("separate", out, "--rig", finished.truth, *GRID, "--json")
    known = ("--truth", finished.apart, "--transport", finished.transport)
    found = json.loads(check_done(run_nearfar(*command, *known)).out)["snr"]
    assert set(found) == {"truth", "transport"}
    light = np.ones((16, 20), dtype=np.float32)
    measured = load_transport(finished.transport).components(light)
    exact = load_exact(finished.apart).component_pictures(light)
    for name, parts in {"transport": measured, "truth": exact}.items():
        known = {"direct": parts[0], "global": parts[1] + parts[2]}
        for part, picture in zip(("direct", "global"), pictures(out), strict=True):
            assert found[name][part] == pytest.approx(snr(known[part], picture), abs=1e-3)


def test_a_scene_has_its_own_projector(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    # The scenes' own sizes take long to compute.
    small = replace(SCENES["corner"], projector=Size(16, 16))
    monkeypatch.setitem(SCENES._loaded, "corner", small)
    check_done(run_nearfar("separate", tmp_path / "out", "--rig", "corner", "--quiet"))
    assert np.load(tmp_path / "out" / "direct.npy").shape == (16, 16, 3)


# Patterns to project, and photos of them


def test_exported_patterns_end_in_black(tmp_path: Path):
    out = tmp_path / "patterns"
    options = ("--side", "3", "--step", "2", "--native", "50x70", "--scale", "2")
    ran = check_done(run_nearfar("separate", out, "--export", *GRID, *options))
    assert "9 patterns of 50x70, the last one black" in ran.out
    names = sorted(path.name for path in out.iterdir())
    assert names == ["numbers.json", *(f"pattern-{i:05d}.png" for i in range(9))]
    *boards, black = [
        imagecodecs.png_decode((out / name).read_bytes()) for name in names if "pattern" in name
    ]
    assert not black.any()
    for frame, pattern in zip(boards, checkerboards(Size(16, 20), 3, 2), strict=True):
        assert frame.shape == (50, 70)
        block = np.kron(pattern, np.ones((2, 2)))
        np.testing.assert_array_equal(frame[9:41, 15:55], block)
        assert frame.sum(dtype=int) == block.sum()
    numbers = json.loads((out / "numbers.json").read_text())
    assert (numbers["side"], numbers["step"], numbers["projector"]) == (3, 2, [16, 20])
    check_done(run_nearfar("separate", out, "--export", *GRID, "--pattern", "sinusoid", "--force"))
    first = imagecodecs.png_decode((out / "pattern-00000.png").read_bytes())
    np.testing.assert_array_equal(first, sinusoids(Size(16, 20))[0])


@pytest.mark.parametrize(
    "options", [(), ("--side", "4"), ("--pattern", "sinusoid", "--period", "4", "--shifts", "6")]
)
def test_photos_of_exported_patterns_give_what_a_rig_gives(finished, tmp_path: Path, shot, options):
    photos, by_rig, by_photos = shot(*options), tmp_path / "rig", tmp_path / "own"
    np.save(tmp_path / "grey.npy", np.load(finished.truth)[..., 0])
    rig = tmp_path / "rig.toml"
    rig.write_text(CLEAN.format(truth="grey.npy", black_level=0.0))
    check_done(run_nearfar("separate", by_rig, "--rig", rig, *GRID, *options))
    check_done(run_nearfar("separate", by_photos, "--photos", photos, *options))
    exposure = json.loads((by_rig / "numbers.json").read_text())["rig"]["transport_exposure"]
    for rigs, own in zip(pictures(by_rig), pictures(by_photos), strict=True):
        assert own.shape == (8, 9)
        np.testing.assert_allclose(exposure * own, rigs, atol=4e-4)


def test_ambient_light_and_black_level_are_told_in_three_ways(tmp_path: Path, shot):
    photos = shot(black_level=0.1, ambient=0.05)
    one, two, three = (tmp_path / name for name in ("one", "two", "three"))
    check_done(run_nearfar("separate", one, "--photos", photos))
    # Under black, named apart from the rest.
    black = tmp_path / "black.npy"
    shutil.move(photos / "pattern-00008.npy", black)
    check_done(run_nearfar("separate", two, "--photos", photos, "--black", black))
    # Of ambient light, lying among the others.
    ambient = photos / "ambient.npy"
    np.save(ambient, np.full((8, 9), round(0.05 * 65535), dtype=np.uint16))
    light = ("--ambient", ambient, "--black-level", 0.1)
    check_done(run_nearfar("separate", three, "--photos", photos, *light))
    for name in ("direct", "global"):
        first = np.load(one / f"{name}.npy")
        np.testing.assert_array_equal(np.load(two / f"{name}.npy"), first)
        np.testing.assert_allclose(np.load(three / f"{name}.npy"), first, atol=2e-4)
    told = [json.loads((out / "numbers.json").read_text()) for out in (one, two, three)]
    assert [numbers["dark"] for numbers in told] == ["black", "black", "ambient"]
    assert [numbers["black_level"] for numbers in told] == [None, None, 0.1]
    # Without the black level its light counts as global.
    check_done(run_nearfar("separate", one, "--photos", photos, *light[:2], "--force"))
    assert np.load(one / "global.npy").mean() > 1.1 * np.load(three / "global.npy").mean()


def test_any_patterns_are_separated_by_their_extremes(tmp_path: Path, shot):
    photos, known, unknown = shot("--side", "1"), tmp_path / "known", tmp_path / "unknown"
    check_done(run_nearfar("separate", known, "--photos", photos, "--side", "1"))
    any_pattern = ("--pattern", "any", "--black", photos / "pattern-00002.npy")
    check_done(run_nearfar("separate", unknown, "--photos", photos, *any_pattern))
    for one, other in zip(pictures(known), pictures(unknown), strict=True):
        np.testing.assert_allclose(one, other, atol=1e-6)


def test_full_scale_is_as_the_camera_says(tmp_path: Path, shot):
    photos = shot()
    check_done(run_nearfar("separate", tmp_path / "sixteen", "--photos", photos))
    for photo in photos.iterdir():
        np.save(photo, np.load(photo) >> 2)
    own = ("--full-scale", 16383)
    check_done(run_nearfar("separate", tmp_path / "fourteen", "--photos", photos, *own))
    for one, other in zip(*(pictures(tmp_path / n) for n in ("sixteen", "fourteen")), strict=True):
        np.testing.assert_allclose(one, other, atol=3e-4)


@pytest.mark.parametrize("ending", [".png", ".tiff", ".exr"])
def test_photos_of_every_kind(tmp_path: Path, shot, ending: str):
    from nearfar.files import write_picture

    photos = shot()
    check_done(run_nearfar("separate", tmp_path / "npy", "--photos", photos))
    for photo in sorted(photos.iterdir()):
        pixels = np.load(photo)
        if ending == ".png":
            photo.with_suffix(ending).write_bytes(imagecodecs.png_encode(pixels))
        else:
            write_picture(photo.with_suffix(ending), pixels.astype(np.float32) / 65535)
        photo.unlink()
    check_done(run_nearfar("separate", tmp_path / "other", "--photos", photos))
    for one, other in zip(pictures(tmp_path / "npy"), pictures(tmp_path / "other"), strict=True):
        np.testing.assert_allclose(one, other, atol=1e-6)


# Warnings


def _warnings(*arguments: object) -> str:
    ran = run_nearfar("separate", *arguments, "--quiet")
    assert ran.status == 0
    assert ran.out == ""
    assert ran.err.startswith("warning: ")
    assert ran.err.count("\n") == 1
    return ran.err


def test_saturated_photos_are_a_warning(tmp_path: Path, shot):
    photos = shot()
    for photo in photos.iterdir():
        np.save(photo, np.minimum(np.load(photo) * 3.0, 65535).astype(np.uint16))
    share = np.mean([np.load(p) == 65535 for p in sorted(photos.iterdir())[:-1]])
    black = ("--black", photos / "pattern-00008.npy", "--pattern", "any")
    assert f"{share:.2%}" in _warnings(tmp_path / "out", "--photos", photos, *black)


def test_no_photo_of_the_dark_is_a_warning(tmp_path: Path, shot):
    photos = shot()
    (photos / "pattern-00008.npy").unlink()
    assert "under black" in _warnings(tmp_path / "out", "--photos", photos)
    numbers = json.loads((tmp_path / "out" / "numbers.json").read_text())
    assert (numbers["dark"], numbers["black_level"]) == ("nothing", 0.0)


def test_photos_out_of_order_are_a_warning(tmp_path: Path, shot):
    photos = shot()
    (photos / "pattern-00003.npy").rename(photos / "pattern-00000a.npy")
    assert "out of order" in _warnings(tmp_path / "out", "--photos", photos)


# Folders that are there


def test_force_replaces_patterns_by_pictures_but_no_other_folder(
    finished, tmp_path: Path, untouched
):
    out = tmp_path / "out"
    check_done(run_nearfar("separate", out, "--export", *GRID))
    command = (out, "--rig", finished.truth, *GRID)
    check_refused(untouched, ("separate", *command), out, "--force")
    check_done(run_nearfar("separate", *command, "--force"))
    assert sorted(path.name for path in out.iterdir()) == WRITTEN
    (out / "direct.txt").write_text("mine")
    check_refused(lambda: True, ("separate", *command, "--force"), out, "remove")
    assert (out / "direct.txt").read_text() == "mine"
    # Numbers tell our folders from photos that are named as patterns.
    (photos := tmp_path / "photos").mkdir()
    (photos / "pattern-00000.png").write_bytes(b"photo")
    command = (photos, "--rig", finished.truth, *GRID, "--force")
    check_refused(lambda: True, ("separate", *command), photos, "remove")
    assert (photos / "pattern-00000.png").read_bytes() == b"photo"


def test_photos_are_kept(tmp_path: Path, shot, untouched):
    photos = shot()
    check_refused(
        untouched, ("separate", photos / ".." / "photos", "--photos", photos, "--force"), "is kept"
    )


# A dense T of any origin


@pytest.mark.parametrize("grid", ["16x20", "1x32", "32x1"])
@pytest.mark.parametrize("pattern", ["checkerboard", "sinusoid"])
def test_a_dense_transport_is_shot_and_compared_with(tmp_path: Path, grid: str, pattern: str):
    projector = parse_size(grid)
    # A mirror for the direct light, at every other projector pixel, and a grey wall for the rest.
    direct = np.zeros((4, 4, projector.pixels), dtype=np.float32)
    direct.reshape(16, -1)[np.arange(16), 2 * np.arange(16)] = 300.0
    wall = np.full_like(direct, 200.0 / projector.pixels)
    path = tmp_path / "t.npy"
    np.save(path, (direct + wall).reshape(4, 4, *projector))
    out = tmp_path / "out"
    # Each camera pixel sees one projector pixel.
    options = ("--pattern", pattern, *(("--side", 1) if pattern == "checkerboard" else ()))
    ran = run_nearfar("separate", out, "--rig", path, "--truth", path, *options)
    assert ran.status == 0, ran.err
    snr_of = json.loads((out / "numbers.json").read_text())["snr"]["truth"]
    # The grid is the file's own, and the direct light is found where rows peak.
    assert snr_of["direct"] > 25
    assert snr_of["global"] > 25


def test_a_truth_in_other_units_than_the_rig_recorded_is_told(finished: Job, tmp_path: Path):
    out, truth = tmp_path / "out", tmp_path / "truth.npy"
    np.save(truth, 4e5 * np.load(finished.truth))
    command = ("separate", out, *GRID, "--rig", finished.truth, "--force", "--truth")
    check_done(run_nearfar(*command, finished.truth))
    own = json.loads((out / "numbers.json").read_text())["snr"]["truth"]
    ran = run_nearfar(*command, truth)
    assert ran.status == 0
    (said,) = ran.err.splitlines()
    assert f"{truth} is in other units than the rig recorded" in said
    found = re.search(r"multiplied by (\S+) it would give direct (\S+) dB, global (\S+) dB", said)
    assert found is not None
    factor, direct, global_ = map(float, found.groups())
    assert factor == pytest.approx(1 / 4e5, rel=0.01)
    assert [direct, global_] == pytest.approx([own["direct"], own["global"]], abs=0.2)
    # The rig was exposed so that white fits, and a transport is not in the units of its photos.
    np.save(truth, 1e-3 * np.load(finished.truth))
    check_done(run_nearfar("separate", out, *GRID, "--rig", truth, "--force", "--truth", truth))


def test_the_exposure_of_own_photos_is_fitted_to_the_truth(finished, tmp_path: Path, shot):
    photos, grey = shot("--side", "1"), tmp_path / "grey.npy"
    for units in (1.0, 1000.0):
        np.save(grey, units * np.load(finished.truth)[..., 0])
        command = ("separate", tmp_path / f"out-{units}", "--photos", photos, "--side", "1")
        check_done(run_nearfar(*command, "--truth", grey))
    one, other = (
        json.loads((tmp_path / f"out-{units}" / "numbers.json").read_text())["snr"]["truth"]
        for units in (1.0, 1000.0)
    )
    assert other == pytest.approx(one, abs=0.01)
    assert one["global"] > 10
