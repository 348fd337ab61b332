"""A real window on a real display: every pixel, on the right monitor, and how it is stopped."""

import os
import signal
import subprocess
import sys
import time

import pytest

from tests.absent import said_without
from tests.rigs.displays import need, one_monitor, run_on, two_monitors
from tests.waiting import LONGEST_WAIT

SHOWN = """
import sys, mss, numpy as np
from nearfar.rigs.monitors import find_monitors
from nearfar.rigs.screens import Window
monitors = find_monitors()
wanted = {wanted}
generator = np.random.default_rng(0)
with Window(wanted) as window, mss.MSS() as eye:
    def seen(monitor):
        (top, left), size = monitor.place, monitor.size
        place = dict(left=left, top=top, width=size.width, height=size.height)
        return np.asarray(eye.grab(place))[..., 2::-1]
    for shape in ((*window.monitor.size, 3), tuple(window.monitor.size)):
        frame = generator.integers(0, 256, shape, dtype=np.uint8)
        window.show(frame)
        full = np.broadcast_to(frame.reshape(*shape[:2], -1), (*shape[:2], 3))
        assert (seen(window.monitor) == full).all()
        for other in monitors:
            assert other == window.monitor or not seen(other).any(), other
print(window.monitor)
"""


SEEN = """
import mss, numpy as np
from nearfar.arrays import Size
from nearfar.rigs.monitors import find_monitors
from nearfar.rigs.screens import Window
from nearfar.rigs.side_by_side import SideBySideScreen
eye = mss.MSS()
def seen(monitor):
    (top, left), size = monitor.place, monitor.size
    place = dict(left=left, top=top, width=size.width, height=size.height)
    return np.asarray(eye.grab(place))[..., 2::-1]
one, other = find_monitors()
white = np.full(one.size, 255, dtype=np.uint8)
"""
# What was on the other monitor before is covered while a window is open, and is there again after.
HELD_BLACK = (
    SEEN
    + """
with Window(1) as left_over:
    left_over.show(white)
    assert seen(other).all()
    with Window(0, dark=["DUMMY1"]) as window:
        window.show(white)
        window.wait(0.05)
        assert seen(one).all()
        assert not seen(other).any()
    left_over.show(white)
    assert seen(other).all()
"""
)
BOTH = (
    SEEN
    + """
with Window(0) as left, Window(1) as right:
    both = SideBySideScreen([left, right], Size(100, 150))
    for seed in (0, 1):
        frame = np.random.default_rng(seed).integers(1, 256, (100, 300, 3), dtype=np.uint8)
        both.show(frame)
        both.wait(0.05)
        for monitor, part in ((one, frame[:, :150]), (other, frame[:, 150:])):
            found = seen(monitor)
            assert (found[310:410, 565:715] == part).all()
            assert np.count_nonzero(found) == part.size
"""
)


@pytest.fixture(scope="module")
def display():
    with one_monitor() as name:
        yield name


def test_frames_are_shown_pixel_for_pixel(display):
    done = run_on(display, "-c", SHOWN.format(wanted=None))
    assert done.returncode == 0, done.stderr
    assert "720x1280" in done.stdout


def test_patterns_are_on_the_second_monitor_pixel_for_pixel(tmp_path):
    with two_monitors(tmp_path) as display:
        for wanted in ("None", "'DUMMY1'", "1"):
            done = run_on(display, "-c", SHOWN.format(wanted=wanted))
            assert done.returncode == 0, done.stderr
            assert done.stdout.startswith("1: DUMMY1, 720x1280")
        done = run_on(display, "-c", SHOWN.format(wanted="'DUMMY0'"))
        assert done.stdout.startswith("0: DUMMY0"), done.stderr
        done = run_on(display, "-m", "nearfar", "devices")
        assert "0: DUMMY0, 720x1280 at 60 Hz" in done.stdout
        assert "1: DUMMY1, 720x1280 at 60 Hz" in done.stdout
        done = run_on(display, "-c", HELD_BLACK)
        assert done.returncode == 0, done.stderr
        done = run_on(display, "-c", BOTH)
        assert done.returncode == 0, done.stderr
        done = run_on(display, "-c", FAULT.format(body="Window('DUMMY0', dark=[0])"))
        assert "DUMMY0 is to show patterns and to be held black" in done.stdout
        done = run_on(display, "-c", FAULT.format(body="Window('HDMI-1')"))
        assert "no monitor 'HDMI-1'" in done.stdout
        assert "1: DUMMY1" in done.stdout


FAULT = """
from nearfar.errors import NearfarError
from nearfar.rigs.monitors import find_monitors
from nearfar.rigs.screens import Window
import numpy as np
try:
    {body}
except NearfarError as error:
    print(error)
"""


def test_a_frame_of_another_size_is_refused(display):
    body = "with Window() as w: w.show(np.zeros((10, 10), np.uint8))"
    done = run_on(display, "-c", FAULT.format(body=body))
    assert "not of the monitor's 720x1280" in done.stdout


def test_without_a_display_there_is_a_sentence():
    done = run_on("", "-c", FAULT.format(body="find_monitors()"))
    assert "set DISPLAY" in done.stdout, done.stderr


def test_without_its_packages_there_is_a_sentence():
    said = said_without("glfw", "from nearfar.rigs.monitors import find_monitors\nfind_monitors()")
    assert "pip install 'nearfar[window]'" in said


WAITING = """
from nearfar.rigs.screens import Window
with Window() as window:
    print("shown", flush=True)
    window.wait(600.0)
"""


def test_escape_stops_it(display):
    need("xdotool")
    environment = {**os.environ, "DISPLAY": display}
    waiting = subprocess.Popen(
        [sys.executable, "-c", WAITING],
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert waiting.stdout is not None
    assert waiting.stdout.readline() == "shown\n"
    until = time.monotonic() + LONGEST_WAIT
    while waiting.poll() is None and time.monotonic() < until:
        subprocess.run(["xdotool", "key", "Escape"], env=environment, check=False)
        time.sleep(0.2)
    try:
        assert waiting.wait(timeout=LONGEST_WAIT) != 0
        assert "KeyboardInterrupt" in waiting.communicate()[1]
    finally:
        if waiting.poll() is None:
            waiting.send_signal(signal.SIGKILL)
        waiting.communicate()
