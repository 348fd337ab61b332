"""A user with a projector and a camera of their own, from the plan to relit pictures."""

import json
import re
import subprocess
import sys
from pathlib import Path

import imagecodecs
import numpy as np
import pytest
import tifffile

from tests.cli.conftest import BY_PAPER, PLAN, check_done, run_nearfar

# The scene and the camera, which know nothing of the project: photo = ambient + T @ pattern.
OUTSIDE = """
import sys
from pathlib import Path
import imagecodecs, numpy as np, tifffile

patterns, photos = map(Path, sys.argv[1:3])
kind, channels = sys.argv[3], int(sys.argv[4])
P, C = (16, 20), (32, 40)
rng = np.random.default_rng(3)
T = np.zeros((*C, *P, channels))
y, x = np.mgrid[:P[0], :P[1]]
for cy in range(C[0]):
    for cx in range(C[1]):
        qy, qx = np.clip((cy - 0.5) / 2, 0, P[0] - 1), np.clip((cx - 0.5) / 2, 0, P[1] - 1)
        tent = np.clip(1 - abs(y - qy), 0, 1) * np.clip(1 - abs(x - qx), 0, 1)
        glow = np.exp(-((y - qy) ** 2 + (x - qx) ** 2) / 2)
        glow *= (abs(y - qy) < 2.5) & (abs(x - qx) < 2.5)
        room = 1 + 0.3 * np.cos(2 * np.pi * y / P[0] + cy / 9) * np.cos(2 * np.pi * x / P[1])
        for i in range(channels):
            albedo = 0.35 + 0.1 * np.sin(cx / 5 + i)
            T[cy, cx, ..., i] = albedo * tent + 0.02 * glow + 0.2 * room / room.size
photos.mkdir()
for path in sorted(patterns.glob("pattern-*.png")):
    l = imagecodecs.png_decode(path.read_bytes()) / 255.0
    photo = 0.03 + np.einsum("abpqi,pq->abi", T, l)
    # Of 30 000 electrons; without noise the model's own error would look like spoilt photos.
    photo += rng.normal(scale=np.sqrt(photo / 30000))
    photo = np.rint(65535 * photo).astype(np.uint16)
    photo = photo[..., 0] if channels == 1 else photo
    name = f"img{int(path.stem.removeprefix('pattern-'))}"
    if kind == "png":
        (photos / (name + ".png")).write_bytes(imagecodecs.png_encode(photo))
    elif kind == "tiff":
        tifffile.imwrite(photos / (name + ".tiff"), photo)
    else:
        np.save(photos / (name + ".npy"), photo)
np.save(photos.with_name("T.npy"), T)
"""


def _decibels(truth: np.ndarray, found: np.ndarray) -> float:
    return float(20 * np.log10(np.linalg.norm(truth) / np.linalg.norm(truth - found)))


@pytest.mark.parametrize(("kind", "channels"), [("png", 1), ("tiff", 3), ("npy", 1)])
def test_from_a_plan_to_pictures_relit_in_photo_units(tmp_path: Path, kind: str, channels: int):
    plan, patterns, photos = tmp_path / "plan.json", tmp_path / "patterns", tmp_path / "photos"
    capture, transport = tmp_path / "capture.zarr", tmp_path / "transport.zarr"
    check_done(run_nearfar(*PLAN, "-o", plan))
    check_done(run_nearfar("export", plan, patterns))
    script = [sys.executable, "-c", OUTSIDE, patterns, photos, kind, str(channels)]
    subprocess.run(script, check=True)
    brought = check_done(run_nearfar("import", patterns / "plan.json", photos, capture))
    assert f"<- img0.{kind}" in brought.out
    check_done(run_nearfar("reconstruct", capture, transport, *BY_PAPER))

    dense = np.load(tmp_path / "T.npy")
    pictures = {}
    light = np.random.default_rng(5).uniform(size=(16, 20)).astype(np.float32)
    np.save(tmp_path / "light.npy", light)
    truth = np.einsum("abpqi,pq->abi", dense, light)
    truth = truth[..., 0] if channels == 1 else truth
    for name, gains in {
        "all": (),
        "direct": ("near=0", "far=0"),
        "near": ("direct=0", "far=0"),
        "far": ("direct=0", "near=0"),
        "boosted": ("near=3", "far=0.5"),
    }.items():
        options = [f"--gain={gain}" for gain in gains]
        out = tmp_path / f"{name}.npy"
        check_done(run_nearfar("relight", transport, tmp_path / "light.npy", out, *options))
        pictures[name] = np.load(out)
    assert pictures["all"].dtype == np.float32
    assert pictures["all"].shape == truth.shape
    assert _decibels(truth, pictures["all"]) > 30
    total = pictures["direct"] + pictures["near"] + pictures["far"]
    np.testing.assert_allclose(total, pictures["all"], atol=1e-5)
    boosted = pictures["direct"] + 3 * pictures["near"] + 0.5 * pictures["far"]
    np.testing.assert_allclose(boosted, pictures["boosted"], atol=1e-5)
    # Each component is there: this scene has all three.
    for name in ("direct", "near", "far"):
        assert np.linalg.norm(pictures[name]) > 0.02 * np.linalg.norm(truth)

    # The photos, q and the dense T tell the same story.
    check_done(run_nearfar("convert", transport, tmp_path / "dense.npy"))
    found = np.load(tmp_path / "dense.npy")
    assert found.shape == (32 * 40, 16 * 20, *((3,) if channels == 3 else ()))
    picture = np.einsum("cp...,p->c...", found, light.ravel()).reshape(truth.shape)
    np.testing.assert_allclose(picture, pictures["all"], atol=2e-5)
    check_done(run_nearfar("convert", transport, tmp_path / "q.npy", "--correspondence"))
    q = np.load(tmp_path / "q.npy")
    assert q.shape == (32, 40, 2)
    inside = q[2:-2, 2:-2]
    wanted = np.stack(np.mgrid[2:30, 2:38], axis=-1) / 2 - 0.25
    assert np.abs(inside - wanted).max() < 0.5

    again = tmp_path / "again.zarr"
    given = run_nearfar(
        "reconstruct", capture, again, *BY_PAPER, "--correspondence", tmp_path / "q.npy"
    )
    check_done(given)
    check_done(run_nearfar("relight", again, tmp_path / "light.npy", tmp_path / "again.npy"))
    np.testing.assert_allclose(np.load(tmp_path / "again.npy"), pictures["all"], atol=1e-5)

    _check_unseen_photos(tmp_path, transport, dense, light, _decibels(truth, pictures["all"]))


def _check_unseen_photos(
    folder: Path, transport: Path, dense: np.ndarray, light: np.ndarray, decibels: float
) -> None:
    """Evaluate by photos that the transport never saw."""
    pairs = folder / "pairs"
    pairs.mkdir()
    for name, shown in {"noise": light, "black": np.zeros_like(light)}.items():
        np.save(pairs / f"{name}.light.npy", shown)
        photo = 0.03 + np.einsum("abpqi,pq->abi", dense, shown)
        photo = np.rint(65535 * (photo[..., 0] if dense.shape[-1] == 1 else photo)).astype(
            np.uint16
        )
        tifffile.imwrite(pairs / f"{name}.photo.tiff", photo)
    found = json.loads(
        check_done(run_nearfar("evaluate", transport, "--photos", pairs, "--json")).out
    )
    assert set(found["snr_b"]) == {"noise"}
    assert found["snr_b"]["noise"] == pytest.approx(decibels, abs=0.1)


def test_a_square_transport_is_the_projectors_size(tmp_path: Path, finished):
    out = tmp_path / "square.zarr"
    check_done(run_nearfar("reconstruct", finished.capture, out, "--square", *BY_PAPER))
    check_done(run_nearfar("relight", out, finished.light, tmp_path / "relit.npy"))
    assert np.load(tmp_path / "relit.npy").shape == (16, 20, 3)


@pytest.mark.parametrize("ending", [".npy", ".exr", ".tiff", ".tif", ".png"])
def test_relit_pictures_by_their_ending(tmp_path: Path, finished, ending: str):
    import OpenEXR

    out = tmp_path / f"relit{ending}"
    check_done(run_nearfar("relight", finished.transport, finished.light, out))
    check_done(run_nearfar("relight", finished.transport, finished.light, tmp_path / "x.npy", "-q"))
    wanted = np.load(tmp_path / "x.npy")
    if ending == ".png":
        shown = imagecodecs.png_decode(out.read_bytes())
        value = np.clip(wanted, 0, 1)
        curve = np.where(value <= 0.0031308, 12.92 * value, 1.055 * value ** (1 / 2.4) - 0.055)
        assert shown.dtype == np.uint8
        assert np.abs(shown - 255 * curve).max() <= 0.51
    else:
        found = {
            ".npy": np.load,
            ".exr": lambda path: OpenEXR.File(str(path)).channels()["RGB"].pixels,
        }.get(ending, tifffile.imread)(out)
        assert found.dtype == np.float32
        np.testing.assert_array_equal(found, wanted)


def test_an_srgb_picture_is_a_light_with_srgb(tmp_path: Path, finished):
    picture = np.random.default_rng(2).integers(0, 256, size=(16, 20, 3), dtype=np.uint8)
    (tmp_path / "picture.png").write_bytes(imagecodecs.png_encode(picture))
    value = picture / 255
    linear = np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)
    for name, light, options in (
        ("encoded", None, ["--srgb"]),
        ("linear", linear, []),
        ("plain", None, []),
        ("levels", value, []),
    ):
        path = tmp_path / "picture.png"
        if light is not None:
            path = tmp_path / f"{name}-light.npy"
            np.save(path, light.astype(np.float32))
        out = tmp_path / f"{name}.npy"
        check_done(run_nearfar("relight", finished.transport, path, out, *options))
    relit = {path.stem: np.load(path) for path in tmp_path.glob("*.npy")}
    np.testing.assert_allclose(relit["encoded"], relit["linear"], atol=1e-5)
    np.testing.assert_allclose(relit["plain"], relit["levels"], atol=1e-5)
    assert np.abs(relit["plain"] - relit["linear"]).max() > 0.01


def test_colour_light_on_one_channel_is_its_luminance(tmp_path: Path, finished):
    dense = np.load(finished.truth)[..., 0]
    np.save(tmp_path / "mono.npy", dense)
    capture, transport = tmp_path / "mono.zarr", tmp_path / "t.zarr"
    check_done(run_nearfar("acquire", finished.plan, capture, "--rig", tmp_path / "mono.npy"))
    check_done(run_nearfar("reconstruct", capture, transport, *BY_PAPER))
    light = np.random.default_rng(2).uniform(size=(16, 20, 3)).astype(np.float32)
    np.save(tmp_path / "colour.npy", light)
    np.save(tmp_path / "grey.npy", light @ np.float32([0.2126, 0.7152, 0.0722]))
    for name in ("colour", "grey"):
        out = tmp_path / f"{name}-relit.npy"
        check_done(run_nearfar("relight", transport, tmp_path / f"{name}.npy", out))
    relit = np.load(tmp_path / "colour-relit.npy")
    assert relit.shape == (8, 9)
    np.testing.assert_allclose(relit, np.load(tmp_path / "grey-relit.npy"), atol=1e-6)


def test_a_colour_light_lights_channel_by_channel(tmp_path: Path, finished):
    light = np.random.default_rng(2).uniform(size=(16, 20, 3)).astype(np.float32)
    np.save(tmp_path / "colour.npy", light)
    out = tmp_path / "all.npy"
    check_done(run_nearfar("relight", finished.transport, tmp_path / "colour.npy", out))
    for i in range(3):
        np.save(tmp_path / f"{i}.npy", light[..., i])
        one = tmp_path / f"relit-{i}.npy"
        check_done(run_nearfar("relight", finished.transport, tmp_path / f"{i}.npy", one))
        np.testing.assert_allclose(np.load(out)[..., i], np.load(one)[..., i], atol=1e-6)


@pytest.mark.slow
def test_few_photos_and_nothing_for_correspondence(tmp_path: Path):
    plan, capture = tmp_path / "plan.json", tmp_path / "capture.zarr"
    transport, truth = tmp_path / "transport.zarr", tmp_path / "truth.zarr"
    check_done(run_nearfar("plan", "--projector", "32x32", "--photos", 60, "-o", plan))
    check_done(run_nearfar("render", "cornell", truth, "--projector", "32x32"))
    check_done(run_nearfar("acquire", plan, capture, "--rig", truth))
    said = check_done(run_nearfar("reconstruct", capture, transport)).out
    assert "100.0% of the camera's directly lit" in said
    ran = check_done(run_nearfar("evaluate", transport, "--truth", truth, "--json"))
    assert json.loads(ran.out)["snr_b_pictures"] > 40
    remembered = check_done(run_nearfar("info", transport)).out
    assert "joint" in remembered


@pytest.mark.parametrize("until", [(), ("--until", "30dB")])
def test_a_transport_made_while_capturing(tmp_path: Path, until: tuple[str, ...]):
    plan, capture, transport = tmp_path / "plan.json", tmp_path / "c.zarr", tmp_path / "t.zarr"
    check_done(run_nearfar("plan", "--projector", "24x24", "--photos", 100, "-o", plan))
    made = run_nearfar(
        "acquire", plan, capture, "--rig", "cornell", *until, "--transport", transport
    )
    lines = check_done(made).out.splitlines()
    assert re.fullmatch(r"\d+\.\d s after the last photo", lines[-3 if until else -2])
    assert re.match("(good|doubtful|wrong): ", lines[-2 if until else -1])
    check_done(run_nearfar("reconstruct", capture, tmp_path / "after.zarr"))
    told, dense = [], []
    for name in ("t.zarr", "after.zarr"):
        told.append(check_done(run_nearfar("info", tmp_path / name)).out.replace(name, ""))
        check_done(run_nearfar("convert", tmp_path / name, tmp_path / f"{name}.npy"))
        dense.append(np.load(tmp_path / f"{name}.npy"))
    assert told[0] == told[1]
    assert np.linalg.norm(dense[0] - dense[1]) < 0.03 * np.linalg.norm(dense[1])
