"""Plans, outputs and stores that cannot be: one sentence that names it, and status 1."""

import shutil
from multiprocessing.synchronize import Barrier
from pathlib import Path

import pytest

from nearfar.files import output, resumable
from tests.cli.conftest import (
    PLAN,
    Job,
    Untouched,
    check_done,
    check_refused,
    check_sentence,
    run_nearfar,
)
from tests.processes import barrier, start

RENDER = ("render", "corner", "--projector", "16x20", "--camera", "8x9")
SEPARATE = ("separate", "--projector", "16x20")


def _version(text: str) -> str:
    return text.replace('"version": 7', '"version": 8')


@pytest.mark.parametrize(
    ("spoil", "word"),
    [
        (_version, "version 8"),
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


@pytest.mark.parametrize("command", [name for name in OUTPUTS if name != "demo"])
def test_a_name_that_somebody_takes_before_the_last_step_is_left(
    finished: Job, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, command: str
):
    out = tmp_path / f"out{ENDINGS.get(command, '.zarr')}"

    def synchronise(path: Path) -> None:
        # The last before the name is given.
        out.write_text("somebody's")
        output.synchronise_entry(path)

    monkeypatch.setattr(output, "synchronise", synchronise)
    monkeypatch.setattr(resumable, "synchronise", synchronise)
    check_sentence(run_nearfar(*OUTPUTS[command](finished, out)), out, "exists already", "--force")
    assert out.read_text() == "somebody's"
    # Photos and tiles are not lost for a name.
    kept = [f"{out.name}.unfinished"] if command in {"acquire", "reconstruct"} else []
    assert sorted(path.name for path in tmp_path.iterdir()) == [out.name, *kept]
    if kept:
        monkeypatch.undo()
        out.unlink()
        check_done(run_nearfar(*OUTPUTS[command](finished, out), "--resume"))
        assert list(tmp_path.iterdir()) == [out]


def _export(plan: Path, out: Path, said: Path, others: Barrier) -> None:
    others.wait()
    ran = run_nearfar("export", plan, out)
    said.write_text(f"{ran.status}{ran.err}")


def test_of_exports_at_once_to_one_name_one_is_done(finished: Job, tmp_path: Path):
    others = barrier(3)
    out, said = tmp_path / "out", [tmp_path / f"{number}.said" for number in range(3)]
    racers = [start(_export, finished.plan, out, each, others) for each in said]
    for racer in racers:
        racer.join()
    refused = f"1nearfar: {out} exists already: choose another name or add --force.\n"
    assert sorted(each.read_text() for each in said) == ["0", refused, refused]
    assert sorted(tmp_path.iterdir()) == sorted([out, *said])
    assert {p.name: p.read_bytes() for p in out.iterdir()} == {
        p.name: p.read_bytes() for p in finished.patterns.iterdir()
    }


SECOND_OUTPUTS = {
    "acquire --transport": lambda job, out, second: (
        *("acquire", job.plan, out, "--rig", job.truth),
        *("--transport", f"{second}.zarr"),
    ),
    "reconstruct --report": lambda job, out, second: (
        *("reconstruct", job.capture, out, "--report", f"{second}.html"),
    ),
    "check --report": lambda job, out, second: (
        *("check", job.apart, "--near", 5, "--far", "3x3", "--report", f"{second}.html"),
    ),
    "evaluate --report": lambda job, out, second: (
        *("evaluate", job.transport, "--truth", job.truth, "--report", f"{second}.html"),
    ),
    "plan -o": lambda job, out, second: (
        *("plan", "--projector", "16x20", "--photos", 60, "-o", f"{second}.json"),
    ),
}


@pytest.mark.parametrize("command", SECOND_OUTPUTS)
@pytest.mark.parametrize("where", ["a closed folder", "a name that is too long"])
def test_what_cannot_be_written_beside_is_found_before_any_work(
    finished: Job,
    untouched: Untouched,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    command: str,
    where: str,
):
    def work(*_arguments: object, **_options: object) -> None:
        pytest.fail("the work had begun")

    # What these commands do first that takes long.
    for name in (
        "nearfar.rigs.opening.open_rig",
        "nearfar.capture.open_capture",
        "nearfar.rigs.simulated.opening.load_world",
        "nearfar.transport.store.load_transport",
        "nearfar.plan.choose_plan",
    ):
        monkeypatch.setattr(name, work)
    second = Path("/proc/self/second") if where == "a closed folder" else tmp_path / ("x" * 252)
    arguments = SECOND_OUTPUTS[command](finished, tmp_path / "out.zarr", second)
    check_refused(untouched, arguments, second, "could not be written")


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
    said = f"a nearfar {kind}"
    if reader in ("relight", "evaluate"):
        # Where what to run next is known.
        said = {"capture": "is a capture, of", "exact transport": "a scene's exact transport"}[kind]
    check_refused(untouched, READERS[reader](finished, path, tmp_path / "out"), path, said)


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
