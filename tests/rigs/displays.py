"""Displays to show patterns on: virtual ones, with real windows on them."""

import os
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from tests.waiting import LONGEST_WAIT

DUMMY = """
Section "Device"
  Identifier "device"
  Driver "dummy"
  VideoRam 256000
EndSection
Section "Screen"
  Identifier "screen"
  Device "device"
  DefaultDepth 24
  SubSection "Display"
    Depth 24
    Virtual 4096 2048
  EndSubSection
EndSection
Section "ServerFlags"
  Option "AutoAddDevices" "false"
EndSection
"""
MODE = "1280x720"
# cvt 1280 720
MODELINE = ["74.50", "1280", "1344", "1472", "1664", "720", "723", "728", "748"]


def need(*programs: str) -> None:
    """Skip where a program of the system is missing."""
    for program in programs:
        if shutil.which(program) is None:
            pytest.skip(f"the system part {program} is not installed")


@contextmanager
def one_monitor(mode: str = MODE) -> Iterator[str]:
    """Run a display of one monitor, WIDTHxHEIGHT; gives its name."""
    need("Xvfb")
    with _server("Xvfb", "-screen", "0", f"{mode}x24", "-nolisten", "tcp") as display:
        yield display


@contextmanager
def two_monitors(folder: Path) -> Iterator[str]:
    """Run a display of two monitors, DUMMY0 and DUMMY1 to the right of it; gives its name."""
    need("Xorg", "xrandr")
    config = folder / "xorg.conf"
    config.write_text(DUMMY)
    log = folder / "xorg.log"
    options = ("-config", str(config), "-logfile", str(log), "-noreset", "-nolisten", "tcp")
    with _server("Xorg", *options) as display:
        _xrandr(display, "--newmode", MODE, *MODELINE)
        for output in ("DUMMY0", "DUMMY1"):
            _xrandr(display, "--addmode", output, MODE)
        first = ("--output", "DUMMY0", "--mode", MODE, "--primary")
        second = ("--output", "DUMMY1", "--mode", MODE, "--right-of", "DUMMY0")
        for _ in range(20):
            _xrandr(display, *first, *second)
            if f"DUMMY1 connected {MODE}+1280+0" in _xrandr(display):
                break
            time.sleep(0.1)
        yield display


def run_on(display: str, *command: object, **variables: str) -> subprocess.CompletedProcess[str]:
    """Run Python with arguments on a display."""
    return subprocess.run(
        [sys.executable, *map(str, command)],
        env={**os.environ, "DISPLAY": display, **variables},
        capture_output=True,
        text=True,
        timeout=LONGEST_WAIT,
        check=False,
    )


@contextmanager
def _server(program: str, *options: str) -> Iterator[str]:
    """Run an X server on whatever number is free."""
    seen, told = os.pipe()
    command = [program, "-displayfd", str(told), *options]
    server = subprocess.Popen(command, pass_fds=(told,), stderr=subprocess.PIPE, text=True)
    os.close(told)
    try:
        with os.fdopen(seen) as numbers:
            number = numbers.readline().strip()
        if not number:
            server.wait(timeout=10)
            assert server.stderr is not None
            pytest.fail(f"{program} did not start: {server.stderr.read()[-500:]}")
        yield f":{number}"
    finally:
        server.terminate()
        try:
            server.wait(timeout=10)
        except subprocess.TimeoutExpired:
            server.kill()
            server.wait()
        if server.stderr is not None:
            server.stderr.close()


def _xrandr(display: str, *options: str) -> str:
    for _ in range(20):
        done = subprocess.run(
            ["xrandr", *options],
            env={**os.environ, "DISPLAY": display},
            capture_output=True,
            text=True,
            check=False,
        )
        if done.returncode == 0:
            return done.stdout
        time.sleep(0.1)
    pytest.fail(f"xrandr {' '.join(options)}: {done.stderr}")
