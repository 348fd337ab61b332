"""Every bad input: one sentence that names it, status 1, and the disk as it was."""

import json
import shutil
from collections.abc import Callable
from pathlib import Path

import imagecodecs
import numpy as np
import pytest

from tests.cli.conftest import (
    BY_PAPER,
    PLAN,
    PROJECTOR,
    Job,
    check_done,
    check_sentence,
    run_nearfar,
)

Untouched = Callable[[], bool]
RENDER = ("render", "corner", "--projector", "16x20", "--camera", "8x9")
SEPARATE = ("separate", "--projector", "16x20")


def check_refused(untouched: Untouched, arguments: tuple[object, ...], *names: object) -> str:
    """Assert that a command fails in a sentence that names things, and touches nothing."""
    untouched()
    sentence = check_sentence(run_nearfar(*arguments), *names)
    assert untouched(), "something was left behind or changed"
    return sentence


def photos_of(job: Job) -> list[Path]:
    """List the job's photos, to spoil them."""
    return sorted(job.photos.iterdir())


# Each spoils the photos and returns what the sentence must say.


def _too_few(photos: list[Path]) -> tuple[str, ...]:
    photos[-1].unlink()
    return (f"{len(photos) - 1} photos", f"{len(photos)} patterns")


def _too_many(photos: list[Path]) -> tuple[str, ...]:
    shutil.copy(photos[0], photos[0].with_name("z.npy"))
    return (f"{len(photos) + 1} photos", f"{len(photos)} patterns")


def _none_at_all(photos: list[Path]) -> tuple[str, ...]:
    for photo in photos:
        photo.unlink()
    return ("0 photos",)


def _raw_photos(photos: list[Path]) -> tuple[str, ...]:
    for photo in photos:
        photo.rename(photo.with_suffix(".dng"))
    return ("0 photos", ".dng")


def _another_size(photos: list[Path]) -> tuple[str, ...]:
    np.save(photos[7], np.zeros((9, 9), dtype=np.uint16))
    return (photos[7].name, "9x9", "8x9")


def _another_type(photos: list[Path]) -> tuple[str, ...]:
    np.save(photos[7], np.load(photos[7]).astype(np.uint8))
    return (photos[7].name, "uint8", "uint16")


def _other_channels(photos: list[Path]) -> tuple[str, ...]:
    np.save(photos[7], np.repeat(np.load(photos[7])[..., None], 3, axis=2))
    return (photos[7].name, "3 channels")


def _truncated(photos: list[Path]) -> tuple[str, ...]:
    photos[5].write_bytes(photos[5].read_bytes()[:-20])
    return (str(photos[5]), "cut short")


def _truncated_png(photos: list[Path]) -> tuple[str, ...]:
    whole = imagecodecs.png_encode(np.load(photos[5]))
    photos[5].unlink()
    cut = photos[5].with_suffix(".png")
    cut.write_bytes(whole[: len(whole) // 2])
    return (str(cut), "cut short")


def _no_picture(photos: list[Path]) -> tuple[str, ...]:
    photos[5].write_text("hello")
    return (str(photos[5]), "no picture")


def _empty_file(photos: list[Path]) -> tuple[str, ...]:
    photos[5].write_bytes(b"")
    return (str(photos[5]), "empty")


def _pickled(photos: list[Path]) -> tuple[str, ...]:
    np.save(photos[5], np.array([{"a": 1}], dtype=object), allow_pickle=True)
    return (str(photos[5]),)


def _dangling_link(photos: list[Path]) -> tuple[str, ...]:
    photos[5].unlink()
    photos[5].symlink_to("nowhere.npy")
    return (str(photos[5]),)


def _not_a_number(photos: list[Path]) -> tuple[str, ...]:
    for photo in photos:
        np.save(photo, np.load(photo).astype(np.float32) / 65535)
    spoilt = np.load(photos[3])
    spoilt[0, :2] = np.nan, np.inf
    np.save(photos[3], spoilt)
    return (str(photos[3]), "2 values")


def _all_black(photos: list[Path]) -> tuple[str, ...]:
    for photo in photos:
        np.save(photo, np.zeros((8, 9), dtype=np.uint16))
    return ("black",)


def _lens_cap_on(photos: list[Path]) -> tuple[str, ...]:
    for photo in photos:
        np.save(photo, np.full((8, 9), 700, dtype=np.uint16))
    return (photos[0].name.split("-")[0],)


def _out_of_order(photos: list[Path]) -> tuple[str, ...]:
    for number, photo in enumerate(photos[::-1]):
        photo.rename(photo.with_name(f"a{number}.npy"))
    return ("out of order",)


@pytest.mark.parametrize(
    "spoil",
    [
        _too_few,
        _too_many,
        _none_at_all,
        _raw_photos,
        _another_size,
        _another_type,
        _other_channels,
        _truncated,
        _truncated_png,
        _no_picture,
        _empty_file,
        _pickled,
        _dangling_link,
        _not_a_number,
        _all_black,
        _lens_cap_on,
        _out_of_order,
    ],
)
def test_photos_that_cannot_be_used(job: Job, untouched: Untouched, tmp_path: Path, spoil):
    words = spoil(photos_of(job))
    check_refused(untouched, ("import", job.plan, job.photos, tmp_path / "c.zarr"), *words)


def test_a_list_names_the_photos(job: Job, untouched: Untouched, tmp_path: Path):
    photos = photos_of(job)
    listed = tmp_path / "list.txt"
    command = ("import", job.plan, job.photos, tmp_path / "c.zarr", "--list", listed)
    check_refused(untouched, command, listed, "not there")
    listed.write_text("\n".join(photo.name for photo in photos[:-1]))
    check_refused(lambda: True, command, listed, f"{len(photos)} patterns")
    listed.write_text("\n".join(["# order", *(p.name for p in photos[:-1]), "gone.npy"]))
    check_refused(lambda: True, command, "gone.npy", f"line {len(photos) + 1}")
    listed.write_text("\n".join(photo.name for photo in photos))
    check_done(run_nearfar(*command))


def test_saturated_photos_are_a_warning(job: Job, tmp_path: Path):
    for photo in photos_of(job):
        np.save(photo, np.minimum(np.load(photo).astype(float) * 2.5, 65535).astype(np.uint16))
    ran = run_nearfar("import", job.plan, job.photos, tmp_path / "c.zarr", "--quiet")
    assert ran.status == 0
    assert ran.out == ""
    assert ran.err.startswith("warning: ")
    share = np.mean([np.load(photo) == 65535 for photo in job.photos.iterdir()])
    assert f"{share:.2%}" in ran.err
    assert ran.err.count("\n") == 1


@pytest.mark.parametrize("scale", ["0", "-5", "nan", "inf", "100"])
def test_a_full_scale_that_cannot_be(
    finished: Job, untouched: Untouched, tmp_path: Path, scale: str
):
    out = tmp_path / "c.zarr"
    check_refused(
        untouched,
        ("import", finished.plan, finished.photos, out, "--full-scale", scale),
        "full scale",
    )


def test_full_scale_of_fourteen_bits(job: Job, tmp_path: Path):
    for photo in photos_of(job):
        np.save(photo, np.load(photo) >> 2)
    for name, options in {"low": (), "right": ("--full-scale", 16383)}.items():
        capture, transport = tmp_path / f"{name}.zarr", tmp_path / f"{name}-t.zarr"
        check_done(run_nearfar("import", job.plan, job.photos, capture, *options))
        check_done(run_nearfar("reconstruct", capture, transport, *BY_PAPER))
        check_done(run_nearfar("relight", transport, job.light, tmp_path / f"{name}.npy"))
    low, right = np.load(tmp_path / "low.npy"), np.load(tmp_path / "right.npy")
    np.testing.assert_allclose(right, low * 65535 / 16383, atol=1e-4)


# Plans


def _version(text: str) -> str:
    return text.replace('"version": 2', '"version": 7')


@pytest.mark.parametrize(
    ("spoil", "word"),
    [
        (_version, "version 7"),
        (lambda text: text[:-30], "JSON"),
        (lambda _: "", "JSON"),
        (lambda _: "[]", "not a nearfar plan"),
        (lambda text: text.replace('"window": 5', '"window": "five"'), "window"),
        (lambda text: text.replace('"window": 5', '"window": 5, "colour": 1'), "colour"),
        (lambda text: text.replace('"black row", "index": 3', '"black row", "index": 99'), "99"),
    ],
)
@pytest.mark.parametrize("command", ["export", "import", "acquire", "info"])
def test_a_plan_that_cannot_be_read(
    job: Job, untouched: Untouched, tmp_path: Path, spoil, word: str, command: str
):
    job.plan.write_text(spoil(job.plan.read_text()))
    check_refused(untouched, _using_plan(command, job, tmp_path), job.plan, word)


def _using_plan(command: str, job: Job, tmp_path: Path) -> tuple[object, ...]:
    return {
        "export": ("export", job.plan, tmp_path / "out"),
        "import": ("import", job.plan, job.patterns, tmp_path / "out.zarr"),
        "acquire": ("acquire", job.plan, tmp_path / "out.zarr", "--rig", job.truth),
        "info": ("info", job.plan),
    }[command]


@pytest.mark.parametrize("command", ["export", "import", "acquire"])
def test_complex_patterns_cannot_be_shown(
    job: Job, untouched: Untouched, tmp_path: Path, command: str
):
    check_done(run_nearfar(*PLAN, "--offset", "none", "-o", job.plan, "--force"))
    check_refused(untouched, _using_plan(command, job, tmp_path), "--offset inverse")


@pytest.mark.parametrize(
    ("options", "word"),
    [
        (("--projector", "16x16", "--near", "17", "--far", "3x3"), "--near between 1 and 16"),
        (("--projector", "16x16", "--near", "5", "--far", "17x3"), "--far at most 16x16"),
        (("--projector", "16x16", "--near", "5", "--far", "3x3", "--drop", "2x2"), "--drop"),
        (("--projector", "16x16", "--near", "5", "--far", "3x3", "--drop", "7x7"), "--drop"),
    ],
)
def test_a_plan_that_cannot_be_made(untouched: Untouched, tmp_path: Path, options, word: str):
    check_refused(untouched, ("plan", *options, "-o", tmp_path / "plan.json", "--json"), word)


def test_a_frame_that_is_too_small(finished: Job, untouched: Untouched, tmp_path: Path):
    for options in (("--native", "15x20"), ("--native", "64x64", "--scale", "5")):
        check_refused(untouched, ("export", finished.plan, tmp_path / "out", *options), "--native")


# Outputs


OUTPUTS = {
    "plan": lambda finished, out: (*PLAN, "-o", out),
    "export": lambda finished, out: ("export", finished.plan, out),
    "import": lambda finished, out: ("import", finished.plan, finished.photos, out),
    "acquire": lambda finished, out: ("acquire", finished.plan, out, "--rig", finished.truth),
    "reconstruct": lambda finished, out: ("reconstruct", finished.capture, out),
    "relight": lambda finished, out: ("relight", finished.transport, finished.light, out),
    "convert": lambda finished, out: ("convert", finished.transport, out),
    "render": lambda finished, out: (*RENDER, out),
    "demo": lambda finished, out: ("demo", out),
    "separate": lambda finished, out: (*SEPARATE, out, "--rig", finished.truth),
}
ENDINGS = {
    "plan": ".json",
    "relight": ".npy",
    "convert": ".npy",
    "export": "",
    "demo": "",
    "separate": "",
}


@pytest.mark.parametrize("command", OUTPUTS)
@pytest.mark.parametrize("there", ["file", "folder"])
def test_nothing_is_overwritten(
    finished: Job, untouched: Untouched, tmp_path: Path, command: str, there: str
):
    out = tmp_path / f"mine{ENDINGS.get(command, '.zarr')}"
    if there == "file":
        out.write_text("mine")
    else:
        out.mkdir()
        (out / "precious.txt").write_text("mine")
    check_refused(untouched, OUTPUTS[command](finished, out), out, "--force")
    if there == "folder":
        # --force is no licence to remove a folder of somebody's.
        check_refused(untouched, (*OUTPUTS[command](finished, out), "--force"), out, "remove")


@pytest.mark.parametrize("command", [name for name in OUTPUTS if name not in {"demo", "render"}])
def test_force_replaces_what_the_command_made(finished: Job, tmp_path: Path, command: str):
    out = tmp_path / f"mine{ENDINGS.get(command, '.zarr')}"
    arguments = OUTPUTS[command](finished, out)
    check_done(run_nearfar(*arguments))
    before = sorted(str(path.relative_to(tmp_path)) for path in tmp_path.rglob("*"))
    check_sentence(run_nearfar(*arguments), out, "--force")
    check_done(run_nearfar(*arguments, "--force"))
    assert sorted(str(path.relative_to(tmp_path)) for path in tmp_path.rglob("*")) == before


@pytest.mark.parametrize("command", OUTPUTS)
def test_the_folder_of_an_output_must_be_there(
    finished: Job, untouched: Untouched, tmp_path: Path, command: str
):
    out = tmp_path / "nowhere" / f"out{ENDINGS.get(command, '.zarr')}"
    check_refused(untouched, OUTPUTS[command](finished, out), out, "no folder")


@pytest.mark.parametrize("command", ["relight", "convert"])
@pytest.mark.parametrize("name", ["out", "out.jpg", "out.npz", ".npy"])
def test_endings_that_are_not_written(
    finished: Job, untouched: Untouched, tmp_path: Path, command: str, name: str
):
    out = tmp_path / name
    check_refused(untouched, OUTPUTS[command](finished, out), out, ".npy")


def test_a_scene_that_is_not_there(untouched: Untouched, tmp_path: Path):
    check_refused(untouched, ("render", "teapot", tmp_path / "out.zarr"), "teapot", "cornell")


@pytest.mark.parametrize(
    ("command", "name"),
    [
        ("reconstruct", "capture"),
        ("relight", "light"),
        ("acquire", "plan"),
        ("acquire", "truth"),
        ("import", "photos"),
        ("import", "plan"),
        ("separate", "truth"),
    ],
)
def test_force_costs_no_input(
    job: Job, untouched: Untouched, tmp_path: Path, command: str, name: str
):
    # By another way to the same place.
    source = getattr(job, name)
    out = source.parent / "." / ".." / source.parent.name / source.name
    check_refused(untouched, (*OUTPUTS[command](job, out), "--force"), out, "another name")


# Inputs that are missing, or files for folders and folders for files


READERS = {
    "export": lambda job, path, out: ("export", path, out),
    "import a plan": lambda job, path, out: ("import", path, job.patterns, out),
    "import photos": lambda job, path, out: ("import", job.plan, path, out),
    "acquire a plan": lambda job, path, out: ("acquire", path, out, "--rig", job.truth),
    "acquire a rig": lambda job, path, out: ("acquire", job.plan, out, "--rig", path),
    "reconstruct": lambda job, path, out: ("reconstruct", path, out),
    "reconstruct q": lambda job, path, out: (
        "reconstruct",
        job.capture,
        out,
        "--correspondence",
        path,
    ),
    "relight": lambda job, path, out: ("relight", path, job.light, f"{out}.npy"),
    "relight a light": lambda job, path, out: ("relight", job.transport, path, f"{out}.npy"),
    "evaluate": lambda job, path, out: ("evaluate", path, "--truth", job.truth),
    "evaluate truth": lambda job, path, out: ("evaluate", job.transport, "--truth", path),
    "evaluate photos": lambda job, path, out: ("evaluate", job.transport, "--photos", path),
    "convert": lambda job, path, out: ("convert", path, f"{out}.npy"),
    "info": lambda job, path, out: ("info", path),
    "separate a rig": lambda job, path, out: (*SEPARATE, out, "--rig", path),
    "separate photos": lambda job, path, out: ("separate", out, "--photos", path),
    "separate a dark photo": lambda job, path, out: (
        *("separate", out, "--photos", job.photos, "--pattern", "any", "--ambient", path),
    ),
    "separate truth": lambda job, path, out: (
        *(*SEPARATE, out, "--rig", job.truth, "--truth", path),
    ),
    "separate transport": lambda job, path, out: (
        *(*SEPARATE, out, "--rig", job.truth, "--transport", path),
    ),
}


@pytest.mark.parametrize("reader", READERS)
def test_inputs_that_are_not_there(
    finished: Job, untouched: Untouched, tmp_path: Path, reader: str
):
    for ending in ("", ".npy", ".zarr", ".json", ".toml", ".npz"):
        path = tmp_path / f"gone{ending}"
        check_refused(untouched, READERS[reader](finished, path, tmp_path / "out"), path)


@pytest.mark.parametrize("reader", READERS)
@pytest.mark.parametrize("what", ["folder", "text", "empty", "bytes", "zarr"])
def test_inputs_of_another_kind(finished: Job, tmp_path: Path, reader: str, what: str):
    for ending in ("", ".npy", ".zarr", ".json", ".toml", ".npz", ".png"):
        path = tmp_path / f"other{ending}"
        if what in {"folder", "zarr"}:
            path.mkdir()
            if what == "zarr":
                (path / "zarr.json").write_text('{"zarr_format": 3, "node_type": "group"}')
        else:
            path.write_bytes({"text": b"hello\n", "empty": b"", "bytes": bytes(range(256))}[what])
        arguments = READERS[reader](finished, path, tmp_path / "out")
        check_sentence(run_nearfar(*arguments), path)
        assert sorted(tmp_path.iterdir()) == [path]
        shutil.rmtree(path) if path.is_dir() else path.unlink()


@pytest.mark.parametrize(
    ("reader", "kind"),
    [
        ("reconstruct", "transport"),
        ("reconstruct", "exact transport"),
        *((reader, "capture") for reader in ("relight", "evaluate", "convert", "evaluate truth")),
        *((reader, "exact transport") for reader in ("relight", "evaluate", "convert")),
        ("evaluate truth", "transport"),
        ("acquire a rig", "capture"),
    ],
)
def test_a_zarr_of_another_kind(
    finished: Job, untouched: Untouched, tmp_path: Path, reader: str, kind: str
):
    path = {
        "capture": finished.capture,
        "transport": finished.transport,
        "exact transport": finished.apart,
    }[kind]
    words = (path, f"a nearfar {kind}")
    check_refused(untouched, READERS[reader](finished, path, tmp_path / "out"), *words)


def _damage(store: Path, number: int) -> None:
    files = sorted(path for path in store.rglob("*") if path.is_file())
    victim = files[number % len(files)]
    data = bytearray(victim.read_bytes())
    match number % 3:
        case 0:
            victim.write_bytes(data[: len(data) // 2])
        case 1:
            data[len(data) // 2] ^= 0x55
            victim.write_bytes(data)
        case _:
            victim.unlink()


@pytest.mark.parametrize("number", range(15))
@pytest.mark.parametrize("kind", ["capture", "transport", "truth"])
def test_a_damaged_zarr_is_never_read_as_whole(
    job: Job, untouched: Untouched, tmp_path: Path, kind: str, number: int
):
    path = {"capture": job.capture, "transport": job.transport, "truth": job.apart}[kind]
    _damage(path, number)
    arguments = {
        "capture": ("reconstruct", path, tmp_path / "out.zarr"),
        "transport": ("relight", path, job.light, tmp_path / "out.npy"),
        "truth": ("evaluate", job.transport, "--truth", path, "--json"),
    }[kind]
    check_refused(untouched, arguments, path)


# Lights


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
        ("1MB", "too few for one row"),
    ],
)
def test_a_memory_that_cannot_be(
    finished: Job, untouched: Untouched, tmp_path: Path, memory: str, word: str
):
    arguments = ("reconstruct", finished.capture, tmp_path / "out.zarr", "--memory", memory)
    check_refused(untouched, arguments, "--memory", word)


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
    np.savez(tmp_path / "dense.npz", direct=np.ones((72, 320)))
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
