"""Lights, correspondence, pairs, rigs and options that cannot be: a sentence, and status 1."""

import json
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

import imagecodecs
import numpy as np
import pytest

from nearfar.cli.faults import faults_in_sentences
from tests.cli.conftest import (
    PLAN,
    PROJECTOR,
    Job,
    Untouched,
    check_done,
    check_refused,
    run_nearfar,
)


@pytest.mark.parametrize(
    ("light", "options", "word"),
    [
        (np.zeros((20, 16), dtype=np.float32), (), "20x16"),
        (np.zeros((16, 20, 2), dtype=np.float32), (), "16 x 20 x 2"),
        (np.zeros((16, 20), dtype=np.int32), (), "int32"),
        (np.full((16, 20), np.nan, dtype=np.float32), (), "NaN"),
        (np.full((16, 20), np.inf, dtype=np.float32), (), "NaN or infinite"),
        (np.zeros((16, 20), dtype=np.float32), ("--srgb",), "--srgb"),
        (np.zeros((16, 20), dtype=bool), (), "bool"),
    ],
)
def test_lights_that_cannot_be_shown(
    finished: Job, untouched: Untouched, tmp_path: Path, light: np.ndarray, options, word: str
):
    path = tmp_path / "light.npy"
    np.save(path, light)
    arguments = ("relight", finished.transport, path, tmp_path / "out.npy", *options)
    check_refused(untouched, arguments, path, word)


def test_a_fault_of_a_disk_is_not_said_to_be_of_stdout(capsys):
    # Its memory's first page is no process's to read.
    with (
        pytest.raises(SystemExit),
        faults_in_sentences(),
        Path("/proc/self/mem").open("rb") as file,
    ):
        file.read(1)
    said = capsys.readouterr().err
    assert said == (
        "nearfar: a file could not be read or written (Input/output error): check the disks.\n"
    )


# Correspondence


def test_photos_that_settle_no_place_need_a_correspondence(
    finished: Job, untouched: Untouched, tmp_path: Path
):
    plan, capture = tmp_path / "bare.json", tmp_path / "bare.zarr"
    bare = ("plan", "--projector", PROJECTOR, "--near", "1", "--far", "3x3")
    check_done(run_nearfar(*bare, "--correspondence", "none", "-o", plan))
    check_done(run_nearfar("acquire", plan, capture, "--rig", finished.truth))
    out = tmp_path / "out.zarr"
    check_refused(untouched, ("reconstruct", capture, out), capture, "--correspondence")
    check_done(run_nearfar("convert", finished.transport, tmp_path / "q.npy", "--correspondence"))
    given = ("reconstruct", capture, out, "--correspondence", tmp_path / "q.npy")
    check_done(run_nearfar(*given))


@pytest.mark.parametrize(
    ("memory", "word"),
    [
        ("lots", "2GB or 500MB"),
        ("2", "2GB or 500MB"),
        ("-1GB", "2GB or 500MB"),
        ("nanGB", "2GB or 500MB"),
        ("infGB", "2GB or 500MB"),
        ("1MB", "too little for one row"),
    ],
)
def test_a_memory_that_cannot_be(
    finished: Job, untouched: Untouched, tmp_path: Path, memory: str, word: str
):
    arguments = ("reconstruct", finished.capture, tmp_path / "out.zarr", "--memory", memory)
    check_refused(untouched, arguments, "--memory", word)


@pytest.mark.parametrize(
    ("options", "word"),
    [
        (("--transport", "{capture}"), "both capture and transport"),
        (("--transport", "{there}"), "--force"),
        (("--transport", "{out}", "--memory", "some"), "2GB or 500MB"),
        (("--transport", "{out}", "--memory", "1MB"), "too little for one row"),
        (("--transport", "{missing}"), "folder"),
    ],
)
def test_a_transport_that_cannot_be_made_while_capturing(
    finished: Job, untouched: Untouched, tmp_path: Path, options: tuple[str, ...], word: str
):
    there = tmp_path / "there.zarr"
    there.write_text("kept")
    names = {
        "capture": tmp_path / "c.zarr",
        "there": there,
        "out": tmp_path / "t.zarr",
        "missing": tmp_path / "missing" / "t.zarr",
    }
    given = [option.format_map(names) for option in options]
    arguments = ("acquire", finished.plan, tmp_path / "c.zarr", "--rig", finished.truth, *given)
    check_refused(untouched, arguments, word)


def test_a_device_that_cannot_be(finished: Job, untouched: Untouched, tmp_path: Path):
    arguments = ("reconstruct", finished.capture, tmp_path / "out.zarr", "--device", "cuda")
    torch = find_spec("torch") and import_module("torch")
    for method in ("joint", "paper"):
        chosen = (*arguments, "--method", method)
        if torch is None:
            check_refused(untouched, chosen, "PyTorch, which is not installed", "device cpu")
        elif not torch.cuda.is_available():
            check_refused(untouched, chosen, "no CUDA device", "device cpu")


def test_a_scheduler_that_cannot_be(finished: Job, untouched: Untouched, tmp_path: Path):
    arguments = ("reconstruct", finished.capture, tmp_path / "out.zarr", "--scheduler", "far://x")
    check_refused(untouched, arguments, "no scheduler at far://x", "dask scheduler")


@pytest.mark.parametrize(
    ("q", "word"),
    [
        (np.zeros((9, 8, 2)), "8x9"),
        (np.zeros((8, 9)), "8x9"),
        (np.zeros((8, 9, 3)), "8x9"),
        (np.zeros(()), "8x9"),
        (np.full((8, 9, 2), np.nan), "NaN"),
        (np.full((8, 9, 2), 17.0), "off the projector"),
        (np.full((8, 9, 2), -2.0), "off the projector"),
        (np.full((8, 9, 2), "a"), ""),
    ],
)
def test_a_correspondence_that_cannot_be(
    finished: Job, untouched: Untouched, tmp_path: Path, q: np.ndarray, word: str
):
    np.save(tmp_path / "q.npy", q)
    given = ("--correspondence", tmp_path / "q.npy")
    arguments = ("reconstruct", finished.capture, tmp_path / "out.zarr", *given)
    check_refused(untouched, arguments, tmp_path / "q.npy", word)


# Evaluation


def _pair(folder: Path, name: str, light: np.ndarray, photo: np.ndarray) -> None:
    folder.mkdir(exist_ok=True)
    np.save(folder / f"{name}.light.npy", light)
    np.save(folder / f"{name}.photo.npy", photo)


LIGHT, PHOTO = np.ones((16, 20), np.float32), np.full((8, 9, 3), 0.5, np.float32)


@pytest.mark.parametrize(
    ("light", "photo", "options", "word"),
    [
        (LIGHT[1:], PHOTO, (), "a.light.npy"),
        (LIGHT, PHOTO[1:], (), "a.photo.npy"),
        (LIGHT, PHOTO[..., 0], (), "a.photo.npy"),
        (LIGHT * np.nan, PHOTO, (), "a.light.npy"),
        (LIGHT, PHOTO * np.inf, (), "a.photo.npy"),
        (0 * LIGHT, PHOTO, (), "black"),
        (LIGHT, PHOTO, ("--full-scale", "0"), "full scale"),
        (LIGHT, PHOTO, ("--full-scale", "nan"), "full scale"),
        (LIGHT, PHOTO, ("--full-scale", "-3"), "full scale"),
    ],
)
def test_pairs_that_cannot_be_compared(
    finished: Job, untouched: Untouched, tmp_path: Path, light, photo, options, word: str
):
    _pair(tmp_path / "pairs", "a", light, photo)
    arguments = ("evaluate", finished.transport, "--photos", tmp_path / "pairs", "--json", *options)
    check_refused(untouched, arguments, word)


@pytest.mark.parametrize("half", ["light", "photo"])
def test_half_a_pair(finished: Job, untouched: Untouched, tmp_path: Path, half: str):
    _pair(tmp_path / "pairs", "a", LIGHT, PHOTO)
    (tmp_path / "pairs" / f"a.{half}.npy").unlink()
    arguments = ("evaluate", finished.transport, "--photos", tmp_path / "pairs")
    check_refused(untouched, arguments, tmp_path / "pairs", f"a.{half}")


def test_two_files_for_one_half_of_a_pair(finished: Job, untouched: Untouched, tmp_path: Path):
    _pair(tmp_path / "pairs", "a", LIGHT, PHOTO)
    shown = imagecodecs.png_encode(np.zeros((16, 20), np.uint8))
    (tmp_path / "pairs" / "a.light.png").write_bytes(shown)
    arguments = ("evaluate", finished.transport, "--photos", tmp_path / "pairs")
    check_refused(untouched, arguments, "a.light")


def test_a_truth_of_another_scene(finished: Job, untouched: Untouched, tmp_path: Path):
    np.save(tmp_path / "other.npy", np.ones((8 * 9, 16 * 20), dtype=np.float32))
    arguments = ("evaluate", finished.transport, "--truth", tmp_path / "other.npy")
    check_refused(untouched, arguments, "channel")
    np.save(tmp_path / "other.npy", np.ones((8, 9, 16, 21, 3), dtype=np.float32))
    check_refused(lambda: True, arguments, "16x21")
    np.save(tmp_path / "other.npy", np.full((8, 9, 16, 20, 3), np.nan, dtype=np.float32))
    check_refused(lambda: True, arguments, "NaN", tmp_path / "other.npy")


# Rigs


RIGS = {
    "unknown table": '[scene]\nname = "cornell"\n[lamp]\npower = 3\n',
    "unknown key": '[scene]\nname = "cornell"\n[camera]\nlens = 50\n',
    "wrong type": '[scene]\nname = "cornell"\n[camera]\nbits = "many"\n',
    "both": '[scene]\nname = "cornell"\ntransport = "truth.npy"\n',
    "neither": "[scene]\n",
    "no scene": "seed = 3\n",
    "empty": "",
    "no TOML": "[scene\nname = cornell\n",
    "unknown scene": '[scene]\nname = "teapot"\n',
    "bad size": '[scene]\nname = "cornell"\ncamera = "16"\n',
    "no such exposure": '[scene]\nname = "cornell"\nexposure = 3\n',
    "exposure 0": 'exposure = 0\n[scene]\nname = "cornell"\n',
    "exposure nan": 'exposure = nan\n[scene]\nname = "cornell"\n',
    "exposure word": 'exposure = "bright"\n[scene]\nname = "cornell"\n',
    "bits 0": '[scene]\nname = "cornell"\n[camera]\nbits = 0\n',
    "infinite well": '[scene]\nname = "cornell"\n[camera]\nfull_well = inf\n',
    "black white": '[scene]\nname = "cornell"\n[projector]\nblack_level = 1.0\n',
    "negative seed": 'seed = -1\n[scene]\nname = "cornell"\n',
    "seed of none": 'seed = "x"\n[scene]\nname = "cornell"\n',
}


@pytest.mark.parametrize("name", RIGS)
def test_rigs_that_cannot_be(finished: Job, untouched: Untouched, tmp_path: Path, name: str):
    rig = tmp_path / "rig.toml"
    rig.write_text(RIGS[name])
    out = tmp_path / "out.zarr"
    check_refused(untouched, ("acquire", finished.plan, out, "--rig", rig), rig)
    check_refused(untouched, ("info", rig), rig)


def test_rigs_whose_transport_does_not_fit(finished: Job, untouched: Untouched, tmp_path: Path):
    def refuse(*words: object) -> None:
        rig, out = tmp_path / "rig.toml", tmp_path / "out.zarr"
        check_refused(lambda: True, ("acquire", finished.plan, out, "--rig", rig), *words)
        assert not out.exists()

    def write(transport: object, *more: str) -> None:
        lines = ["[scene]", f'transport = "{transport}"', *more]
        (tmp_path / "rig.toml").write_text("\n".join(lines))

    write("gone.npy")
    refuse("gone.npy")
    write(finished.transport, 'camera = "9x8"')
    refuse(finished.transport.name, "8x9", "9x8")
    np.save(tmp_path / "dense.npy", np.ones((72, 16 * 20), dtype=np.float32))
    write("dense.npy")
    refuse("dense.npy", "72 rows")
    np.save(tmp_path / "dense.npy", np.ones((72, 16 * 16), dtype=np.float32))
    write("dense.npy", 'camera = "8x9"')
    refuse("dense.npy", "256 columns")
    np.save(tmp_path / "dense.npy", np.zeros((8, 9, 16, 20), dtype=np.float32))
    write("dense.npy")
    refuse("dense.npy", "black")
    np.save(tmp_path / "dense.npy", np.ones((8, 9, 20, 16), dtype=np.float32))
    refuse("dense.npy", "--projector 20x16")
    np.savez(tmp_path / "dense.npz", direct=np.ones((72, 320)), other=np.ones(3))
    write("dense.npz")
    refuse("dense.npz", "no T")


def test_a_rig_of_another_projector(finished: Job, untouched: Untouched, tmp_path: Path):
    plan = tmp_path / "other.json"
    check_done(run_nearfar("plan", "--projector", "18x20", *PLAN[3:], "-o", plan))
    for rig in (finished.truth, finished.transport):
        arguments = ("acquire", plan, tmp_path / "out.zarr", "--rig", rig)
        check_refused(untouched, arguments, rig.name, "--projector 16x20")


# Wrong usage


@pytest.mark.parametrize("text", ["12", "0x5", "3x", "x3", "axb", "3x4x5", "-1x5", "", "1.5x2"])
@pytest.mark.parametrize("option", ["--projector", "--far", "--drop"])
def test_sizes_that_are_none(untouched: Untouched, option: str, text: str):
    values = {"--projector": "16x16", "--near": "5", "--far": "3x3", option: text}
    options = [item for pair in values.items() for item in pair]
    _check_usage(untouched, ("plan", *options), option, repr(text))


@pytest.mark.parametrize(
    "gain", ["near", "near=", "near=two", "far=nan", "far=inf", "middle=1", "=1", ""]
)
def test_gains_that_are_none(finished: Job, untouched: Untouched, tmp_path: Path, gain: str):
    arguments = (
        "relight",
        finished.transport,
        finished.light,
        tmp_path / "out.npy",
        "--gain",
        gain,
    )
    _check_usage(untouched, arguments, "--gain", repr(gain))


def test_usage_that_is_wrong(finished: Job, untouched: Untouched, tmp_path: Path):
    both = ("--truth", finished.truth, "--photos", finished.patterns)
    twice = ("--gain", "near=1", "--gain", "near=2")
    for arguments, word in (
        (("evaluate", finished.transport), "--truth"),
        (("evaluate", finished.transport, *both), "--photos"),
        (("relight", finished.transport, finished.light, tmp_path / "o.npy", *twice), "twice"),
        (("acquire", finished.plan, tmp_path / "out.zarr"), "--rig"),
        (("plan", "--projector", "16x16"), "--near"),
        (("plan", *PLAN[1:-4], "--near", "0", *PLAN[-2:]), "--near"),
        (("plan", *PLAN[1:], "--offset", "white"), "--offset"),
        (("plan", *PLAN[1:], "--correspondence", "dots"), "--correspondence"),
        (("export", finished.plan, tmp_path / "out", "--scale", "0"), "--scale"),
        (("reconstruct", finished.capture, tmp_path / "o.zarr", "--method", "guess"), "--method"),
        (
            ("import", finished.plan, finished.patterns, tmp_path / "o.zarr", "--full-scale", "x"),
            "--full-scale",
        ),
        (("fly",), "fly"),
        (("info",), "FILE"),
        (("info", finished.plan, finished.light), str(finished.light)),
        (("info", "--faster"), "--faster"),
    ):
        _check_usage(untouched, arguments, word)


def _check_usage(untouched: Untouched, arguments: tuple[object, ...], *words: str) -> None:
    untouched()
    ran = run_nearfar(*arguments)
    assert ran.status == 2
    assert ran.out == ""
    assert "Traceback" not in ran.err
    for word in words:
        assert word in ran.err
    assert untouched()


def test_a_fault_of_our_own_is_a_sentence(monkeypatch, tmp_path: Path):
    def broken(*_: object, **__: object) -> None:
        raise ZeroDivisionError("two\nlines")

    monkeypatch.setattr("nearfar.plan.paper_plan", broken)
    ran = run_nearfar(*PLAN)
    assert ran.status == 1
    assert ran.err.count("\n") == 1
    assert "ZeroDivisionError: two lines" in ran.err
    monkeypatch.setenv("NEARFAR_TRACEBACK", "1")
    with pytest.raises(ZeroDivisionError):
        run_nearfar(*PLAN)


def test_the_cache_may_be_unusable(monkeypatch, tmp_path: Path):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("NEARFAR_CACHE", str(tmp_path / "file" / "cache"))
    out = tmp_path / "truth.zarr"
    check_done(run_nearfar("render", "corner", out, "--projector", "8x8"))
    assert json.loads((out / "zarr.json").read_text())["attributes"]["name"]
