"""The command as a process: entry points, terminals, signals, full disks, start-up."""

import contextlib
import json
import os
import pty
import re
import resource
import select
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from nearfar.cli.commands import COMMANDS
from nearfar.cli.stopping import STOP_SIGNALS
from nearfar.release import version
from tests.cli.conftest import PLAN, check_done, check_sentence, run_nearfar
from tests.waiting import LONGEST_WAIT

SCRIPT = Path(sys.executable).with_name("nearfar")
MODULE = (sys.executable, "-m", "nearfar")


def _run(*arguments: object, **options: object) -> subprocess.CompletedProcess[str]:
    command = [*MODULE, *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False, **options)


@pytest.mark.parametrize("entry", [[str(SCRIPT)], list(MODULE)])
def test_both_entries_tell_the_version(entry: list[str]):
    if not Path(entry[0]).exists():
        pytest.skip("nearfar is not installed as a script")
    ran = subprocess.run([*entry, "--version"], capture_output=True, text=True, check=False)
    assert (ran.returncode, ran.stdout, ran.stderr) == (0, f"nearfar {version()}\n", "")


@pytest.mark.parametrize("command", COMMANDS)
def test_help_of_every_command_has_an_example(command: str):
    ran = check_done(run_nearfar(command, "--help"))
    assert f"Example: nearfar {command}" in ran.out
    assert "--quiet" in ran.out
    assert run_nearfar(command, "-x").status == 2


def test_help_lists_every_command():
    said = check_done(run_nearfar("--help")).out
    for command in COMMANDS:
        assert f"\n  {command} " in said
    assert run_nearfar().status in {0, 2}


def test_a_fault_reaches_the_shell_as_one_sentence(tmp_path: Path):
    ran = _run("info", tmp_path / "gone.zarr")
    assert ran.returncode == 1
    assert ran.stdout == ""
    assert ran.stderr == f"nearfar: {tmp_path / 'gone.zarr'} is not there: check the name.\n"
    assert _run("plan", "--projector", "12").returncode == 2


HEAVY = (
    "zarr",
    "scipy",
    "numba",
    "trimesh",
    "embreex",
    "imagecodecs",
    "tifffile",
    "OpenEXR",
    "rich.progress",
)


@pytest.mark.parametrize("arguments", [("--help",), ("plan", "--help"), (*PLAN, "--json")])
def test_help_and_plans_start_without_heavy_libraries(arguments: tuple[str, ...]):
    script = (
        "import sys; from nearfar.cli import main; sys.argv[0] = 'nearfar'\n"
        "try: main()\nexcept SystemExit: pass\n"
        f"print('LOADED', *[name for name in {HEAVY!r} if name in sys.modules])"
    )
    command = [sys.executable, "-c", script, *arguments]
    ran = subprocess.run(command, capture_output=True, text=True, check=True)
    assert ran.stdout.splitlines()[-1].split() == ["LOADED"]


# A job of some seconds: many patterns, each on the disk before the next.


@pytest.fixture(scope="session")
def long_job(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """Return a plan of many photos, and a rig for it."""
    folder = tmp_path_factory.mktemp("long")
    plan = folder / "plan.json"
    sizes = ("--projector", "48x48", "--near", "11", "--far", "3x3")
    check_done(run_nearfar("plan", *sizes, "-o", plan))
    generator = np.random.default_rng(0)
    np.save(folder / "T.npy", generator.random((3, 4, 48, 48), dtype=np.float32) / 5000)
    return plan, folder / "T.npy"


def _start(handling: str, stop: signal.Signals, command: list[str]) -> subprocess.Popen[str]:
    """Start a command that a signal reaches, or not, however the tests themselves were started.

    Under nohup, for one, what they start ignores SIGHUP.
    """
    handled = ["env", f"--{handling}-signal={stop.name.removeprefix('SIG')}", *command]
    return subprocess.Popen(handled, stdout=-1, stderr=-1, text=True)


def _wait_for_photo(process: subprocess.Popen[str], unfinished: Path, number: int) -> None:
    while not (unfinished / "photos" / f"c.{number}.0.0.0").exists():
        assert process.poll() is None, process.communicate()
        time.sleep(0.01)


# What sends a signal to stop as `sends` is deleted.
DELETED = {
    "__del__": """\
class Sends:
    def __del__(self):
        os.kill(os.getpid(), signal.SIGTERM)
sends = Sends()""",
    "a weak reference": """\
class Sends: pass
sends = Sends()
weakref.finalize(sends, os.kill, os.getpid(), signal.SIGTERM)""",
}


@pytest.mark.parametrize("how", DELETED)
def test_an_interrupt_while_something_is_deleted_is_not_lost(how: str):
    """Python ignores what is raised there."""
    script = (
        "import os, signal, time, weakref\n"
        "from nearfar.cli.faults import stopped_cleanly\n"
        f"{DELETED[how]}\n"
        "with stopped_cleanly():\n"
        "    try:\n"
        "        del sends\n"
        f"        time.sleep({LONGEST_WAIT})\n"
        "    except KeyboardInterrupt: print('stopped')\n"
    )
    ran = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert (ran.stdout, ran.stderr) == ("stopped\n", "")


@pytest.mark.parametrize("stop", STOP_SIGNALS)
def test_an_interrupted_capture_keeps_its_photos(long_job, tmp_path: Path, stop: signal.Signals):
    plan, rig = long_job
    out = tmp_path / "capture.zarr"
    unfinished = tmp_path / "capture.zarr.unfinished"
    command = [*MODULE, "acquire", str(plan), str(out), "--rig", str(rig)]
    with _start("default", stop, command) as process:
        _wait_for_photo(process, unfinished, 2)
        process.send_signal(stop)
        said, complaint = process.communicate()
    assert process.returncode == 128 + stop
    assert said == ""
    kept = re.fullmatch(
        rf"nearfar: interrupted; (\d+) of (\d+) photos are kept in {unfinished}, and "
        r"--resume goes on with them\.\n",
        complaint,
    )
    assert kept
    assert 1 < int(kept[1]) < int(kept[2])
    assert list(tmp_path.iterdir()) == [unfinished]
    check_sentence(run_nearfar(*command[len(MODULE) :]), unfinished, "--resume", "--force")
    check_done(run_nearfar(*command[len(MODULE) :], "--resume"))
    assert list(tmp_path.iterdir()) == [out]


@pytest.mark.parametrize("stop", STOP_SIGNALS)
def test_a_signal_that_is_ignored_stops_no_capture(long_job, tmp_path: Path, stop: signal.Signals):
    plan, rig = long_job
    out = tmp_path / "capture.zarr"
    command = [*MODULE, "acquire", str(plan), str(out), "--rig", str(rig)]
    with _start("ignore", stop, command) as process:
        unfinished = tmp_path / "capture.zarr.unfinished"
        _wait_for_photo(process, unfinished, 2)
        process.send_signal(stop)
        before = sum(1 for _ in (unfinished / "photos").iterdir())
        _wait_for_photo(process, unfinished, before + 20)
        process.kill()


INTERRUPTED_WHILE_LOADING = """
import os, sys
module, stop = sys.argv[1], int(sys.argv[2])
del sys.argv[1:3]
class Finder:
    def find_spec(self, name, path=None, target=None):
        if name == module:
            os.kill(os.getpid(), stop)
sys.meta_path.insert(0, Finder())
from nearfar.cli import main
main()
"""


@pytest.mark.parametrize(
    ("module", "stop"),
    [
        # Before signals are handled, before the command line is read, while it is, and in the
        # command.
        ("typing", signal.SIGINT),
        ("nearfar.cli.stopping", signal.SIGINT),
        ("contextlib", signal.SIGINT),
        ("typer", signal.SIGINT),
        ("nearfar.cli.plan", signal.SIGINT),
        ("nearfar.plan.choose", signal.SIGTERM),
    ],
)
def test_an_interrupt_while_a_command_is_loaded_is_a_sentence(module: str, stop: signal.Signals):
    program = [sys.executable, "-c", INTERRUPTED_WHILE_LOADING]
    command = [*program, module, str(int(stop)), *PLAN]
    with _start("default", stop, command) as process:
        said, complaint = process.communicate()
    assert process.returncode == 128 + stop
    assert said == ""
    assert complaint == "nearfar: interrupted: nothing half-written was left behind.\n"


IMPATIENT = (
    "from nearfar import progress\nfrom nearfar.cli import main\n"
    "progress.SECONDS_BEFORE_A_BAR = 0.05\n"
)
PATIENT = "from nearfar.cli import main\n"


def _on_a_terminal(
    arguments: list[str], *, before: str = PATIENT, patience: float = LONGEST_WAIT
) -> tuple[int, str]:
    """Run a command with stderr on a pseudo-terminal; return its status and what it wrote."""
    leader, follower = pty.openpty()
    environment = {**os.environ, "TERM": "xterm", "COLUMNS": "100"}
    command = [sys.executable, "-c", f"{before}main()", *arguments]
    with subprocess.Popen(
        command, stdout=subprocess.DEVNULL, stderr=follower, env=environment
    ) as process:
        os.close(follower)
        seen, deadline = b"", time.monotonic() + patience
        # Linux ends a terminal that nobody holds with an error.
        with contextlib.suppress(OSError):
            while time.monotonic() < deadline:
                if select.select([leader], [], [], 0.1)[0]:
                    data = os.read(leader, 65536)
                    if not data:
                        break
                    seen += data
        os.close(leader)
        return process.wait(patience), seen.decode()


def test_a_long_job_shows_a_bar_on_a_terminal_only(finished, tmp_path: Path):
    # Long for who has no patience.
    shown = ["acquire", str(finished.plan), str(tmp_path / "a.zarr"), "--rig", str(finished.truth)]
    status, seen = _on_a_terminal(shown, before=IMPATIENT)
    assert status == 0
    assert "photos" in seen
    assert "━" in seen
    assert _on_a_terminal([*shown, "--force", "-q"], before=IMPATIENT) == (0, "")
    command = [sys.executable, "-c", f"{IMPATIENT}main()", *shown, "--force"]
    ran = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (ran.returncode, ran.stderr) == (0, "")
    assert "\x1b" not in ran.stdout


def test_a_short_job_shows_no_bar(finished, tmp_path: Path):
    arguments = ["relight", finished.transport, finished.light, tmp_path / "relit.npy"]
    assert _on_a_terminal([str(argument) for argument in arguments]) == (0, "")


# A limit on the size of a file stands for a full disk.


FILLING = {
    "plan": lambda job, out: (*PLAN, "-o", f"{out}.json"),
    "export": lambda job, out: ("export", job.plan, out, "--scale", "90"),
    "import": lambda job, out: ("import", job.plan, job.photos, f"{out}.zarr"),
    "acquire": lambda job, out: ("acquire", job.plan, f"{out}.zarr", "--rig", job.truth),
    "reconstruct": lambda job, out: ("reconstruct", job.capture, f"{out}.zarr"),
    "relight": lambda job, out: ("relight", job.transport, job.light, f"{out}.npy"),
    "convert": lambda job, out: ("convert", job.transport, f"{out}.npy"),
}


@pytest.mark.parametrize("command", FILLING)
def test_a_full_disk_leaves_nothing(finished, tmp_path: Path, command: str):
    arguments = FILLING[command](finished, tmp_path / "out")

    def limit() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (200, 200))

    # Under such a limit Python keeps compiled modules that are cut short.
    env = {**os.environ, "PYTHONDONTWRITEBYTECODE": "1"}
    ran = _run(*arguments, preexec_fn=limit, env=env)
    assert ran.returncode == 1
    assert ran.stderr.count("\n") == 1
    assert str(tmp_path / "out") in ran.stderr
    assert "larger than the system allows" in ran.stderr
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("unbuffered", ["", "1"])
def test_a_stdout_that_takes_nothing(unbuffered: str):
    environment = {**os.environ, "PYTHONUNBUFFERED": unbuffered}
    with Path("/dev/full").open("w") as full:
        command = [*MODULE, *PLAN, "--json"]
        ran = subprocess.run(
            command, stdout=full, stderr=-1, text=True, check=False, env=environment
        )
    assert ran.returncode == 1
    assert ran.stderr == "nearfar: stdout could not be written (No space left on device): " + (
        "send it elsewhere.\n"
    )


@pytest.mark.parametrize("unbuffered", ["", "1"])
def test_a_reader_that_has_gone(unbuffered: str):
    environment = {**os.environ, "PYTHONUNBUFFERED": unbuffered}
    reader, writer = os.pipe()
    os.close(reader)
    ran = subprocess.run(
        [*MODULE, *PLAN], stdout=writer, stderr=-1, text=True, check=False, env=environment
    )
    os.close(writer)
    assert (ran.returncode, ran.stderr) == (1, "")


def test_a_folder_that_nobody_may_write(finished, tmp_path: Path):
    closed = tmp_path / "closed"
    closed.mkdir(mode=0o500)
    if os.access(closed, os.W_OK):
        closed = Path("/proc/self")
        if not closed.is_dir():
            pytest.skip("this user may write anywhere")
    for arguments in ((*PLAN, "-o", closed / "x.json"), ("export", finished.plan, closed / "x")):
        ran = run_nearfar(*arguments)
        assert ran.status == 1
        assert str(closed / "x") in ran.err
        assert ran.err.count("\n") == 1
        assert "fault of its own" not in ran.err


def test_the_json_of_a_process_stands_alone(finished):
    ran = _run("evaluate", finished.transport, "--truth", finished.apart, "--json")
    assert (ran.returncode, ran.stderr) == (0, "")
    assert json.loads(ran.stdout)["snr_b"]
