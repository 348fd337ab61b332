"""The preview of a simulated table rig: its statistics, its server, and what a browser sets."""

import json
import re
import subprocess
import threading
import time
import urllib.error
import urllib.request
from contextlib import contextmanager

import imagecodecs
import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.errors import InputError
from nearfar.rigs.opening import open_rig_to_preview
from nearfar.rigs.real.rig import RealRig
from nearfar.rigs.tables import read_rig_table
from nearfar.viewer.photo_statistics import (
    HISTOGRAM_BINS,
    SATURATED_COLOUR,
    encode_for_display,
    photo_statistics,
)
from nearfar.viewer.preview import run_preview
from tests.absent import said_without
from tests.rigs.displays import need
from tests.rigs.table import TableCamera, TableScreen
from tests.waiting import LONGEST_WAIT


def test_the_statistics_of_a_photo():
    photo = np.zeros((40, 60, 3), dtype=np.uint16)
    photo[:, :30] = (100, 200, 300)
    photo[:4] = 1023
    seen = photo_statistics(photo, 1023.0)
    assert [len(channel) for channel in seen.histogram] == [HISTOGRAM_BINS] * 3
    assert all(sum(channel) == 40 * 60 for channel in seen.histogram)
    assert seen.histogram[0][-1] == 4 * 60
    assert seen.saturated == pytest.approx(0.1)
    assert seen.brightest == 1.0
    assert seen.mean == pytest.approx(photo.mean() / 1023)
    shown = imagecodecs.jpeg8_decode(encode_for_display(photo, 1023.0))
    assert shown.shape == (40, 60, 3)
    assert np.abs(shown[1, 30].astype(int) - SATURATED_COLOUR).max() < 40


def test_the_sharper_picture_has_the_larger_focus():
    from scipy import ndimage

    generator = np.random.default_rng(0)
    sharp = generator.uniform(0, 4000, (80, 100, 1))
    focus = [
        photo_statistics(ndimage.gaussian_filter(sharp, (s, s, 0)), 4095.0).focus
        for s in (0, 0.5, 1, 2, 4)
    ]
    assert focus == sorted(focus, reverse=True)
    assert focus[0] > 10 * focus[-1]
    # The light's level does not matter.
    assert photo_statistics(sharp / 8, 4095.0).focus == pytest.approx(focus[0], rel=1e-4)
    assert photo_statistics(np.zeros((4, 4, 1), np.uint8), 255.0).focus == 0.0


def test_a_large_photo_is_shown_smaller():
    shown = imagecodecs.jpeg8_decode(
        encode_for_display(np.zeros((2000, 3000, 1), np.uint16), 65535.0)
    )
    assert shown.shape == (500, 750, 3)


class _Slow(TableScreen):
    """Waits as a real one does, a little."""

    def wait(self, seconds):
        super().wait(seconds)
        time.sleep(0.01)


@pytest.fixture
def served():
    """A preview that runs, its camera, and a way to ask it."""
    projector, size = Size(72, 96), Size(24, 32)
    screen = _Slow()
    transport = np.full((size.pixels, projector.pixels), 0.6 / projector.pixels)
    camera = TableCamera(screen, transport, size, projector)
    rig = RealRig(screen, camera, projector, scale=1, exposure=0.1)
    with _previewed(rig) as (ask, until):
        yield camera, ask, until


@contextmanager
def _previewed(rig):
    """Run a preview; yield a way to ask it, and one to wait until its state is some way."""
    addresses, faults = [], []

    def run():
        try:
            run_preview(rig, 0, addresses.append)
        except BaseException as error:
            faults.append(error)
            raise

    thread = threading.Thread(target=run)
    thread.start()

    def ask(path, body=None, **headers):
        data = None if body is None else json.dumps(body).encode()
        headers = {"Content-Type": "application/json", **headers}
        request = urllib.request.Request(addresses[0] + path, data=data, headers=headers)
        with urllib.request.urlopen(request, timeout=LONGEST_WAIT) as answer:
            return answer.read()

    def until(holds):
        end = time.monotonic() + LONGEST_WAIT
        while time.monotonic() < end:
            state = json.loads(ask("/state"))
            if holds(state):
                return state
            time.sleep(0.02)
        raise AssertionError(state)

    while not addresses:
        assert thread.is_alive()
        time.sleep(0.01)
    ask.address = addresses[0]
    yield ask, until
    if thread.is_alive():
        ask("/settings", {"stop": True})
        thread.join(timeout=LONGEST_WAIT)
    assert not thread.is_alive()
    assert faults == []


def test_a_browser_gets_photos_and_sends_settings(served):
    _, ask, until = served
    page = ask("/").decode()
    assert "<h1>Preview</h1>" in page
    # Nothing is fetched from elsewhere.
    assert "http://" not in page
    assert "https://" not in page
    white = until(lambda state: state.get("pattern") == "white")
    assert white["saturated"] == 0
    black = [ask("/settings", {"pattern": "black"}), until(lambda s: s["pattern"] == "black")][1]
    assert black["mean"] < white["mean"] / 5
    number = black["number"]
    until(lambda state: state["number"] > number + 3)
    assert imagecodecs.jpeg8_decode(ask("/photo.jpg")).shape == (24, 32, 3)
    ask("/settings", {"pattern": "white", "exposure": 0.5})
    bright = until(lambda state: state["exposure"] == 0.5 and state["saturated"] > 0.9)
    assert bright["brightest"] == 1.0
    ask("/settings", {"automatic": True})
    until(lambda state: 0.5 < state["brightest"] < 0.95 and state["saturated"] == 0)


@pytest.mark.slow
def test_a_real_browser_shows_it(served, tmp_path):
    need("chromium")
    _, ask, until = served
    until(lambda state: state["number"] > 0)
    command = [
        "chromium", "--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={tmp_path}",
        "--virtual-time-budget=3000", "--dump-dom", ask.address,
    ]  # fmt: skip
    done = subprocess.run(command, capture_output=True, text=True, timeout=LONGEST_WAIT, check=True)
    texts = dict(re.findall(r'id="(\w+)"[^>]*>([^<]*)<', done.stdout))
    assert texts["about"].startswith("table camera, 24x32, 1 channel; projector 0: table")
    assert texts["exposure"] == "100 ms"
    assert texts["saturated"] == "0.0 %"
    assert texts["fault"] == ""
    assert float(texts["focus"]) >= 0
    assert re.search(r'src="photo.jpg\?\d+"', done.stdout)
    assert re.search(r'data-pattern="white"[^>]*aria-pressed="true"', done.stdout)


def test_faults_are_displayed_and_the_preview_goes_on(served):
    camera, ask, until = served
    ask("/settings", {"exposure": 100.0})
    refused = until(lambda state: "cannot expose 100 s" in state["fault"])
    # It stays readable while photos go on, until something is changed.
    later = until(lambda state: state["number"] > refused["number"] + 3)
    assert "cannot expose 100 s" in later["fault"]
    ask("/settings", {"exposure": 0.2})
    until(lambda state: state["fault"] == "" and state["exposure"] == 0.2)
    camera.from_now_on = "lost"
    until(lambda state: "the photo was lost" in state["fault"])
    camera.from_now_on = None
    until(lambda state: state["fault"] == "")


@pytest.mark.parametrize(
    ("body", "headers", "status"),
    [
        ({"pattern": "tartan"}, {}, 422),
        ({"exposure": -1}, {}, 422),
        ({"explode": True}, {}, 422),
        ({"stop": True}, {"Host": "evil.example"}, 403),
        ({"stop": True}, {"Origin": "http://evil.example"}, 403),
        ({"stop": True}, {"Content-Type": "text/plain"}, 422),
    ],
)
def test_wrong_settings_are_refused(served, body, headers, status):
    _, ask, until = served
    with pytest.raises(urllib.error.HTTPError) as refused:
        ask("/settings", body, **headers)
    assert refused.value.code == status
    refused.value.close()
    number = until(lambda state: True)["number"]
    until(lambda state: state["number"] > number + 1)


def test_a_port_that_is_taken_is_named():
    import socket

    screen = TableScreen()
    projector, size = Size(72, 96), Size(4, 4)
    transport = np.full((size.pixels, projector.pixels), 0.6 / projector.pixels)
    rig = RealRig(
        screen, TableCamera(screen, transport, size, projector), projector, scale=1, exposure=0.1
    )
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        with pytest.raises(InputError, match=r"port \d+ at 127.0.0.1 cannot be served on"):
            run_preview(rig, taken.getsockname()[1])


def test_without_its_packages_there_is_a_sentence():
    program = (
        "from nearfar.viewer.preview import _application, _Exchange\n_application(_Exchange())"
    )
    assert "pip install 'nearfar[viewer]'" in said_without("fastapi", program)
    program = (
        "from nearfar.viewer.server import ListeningAddress, serve\n"
        "with serve(None, ListeningAddress('127.0.0.1', 0)):\n    pass"
    )
    assert "pip install 'nearfar[viewer]'" in said_without("uvicorn", program)


def test_a_simulated_rig_is_shown(tmp_path):
    np.save(tmp_path / "T.npy", np.full((6, 7, 8, 9), 0.01, np.float32))
    path = tmp_path / "rig.toml"
    path.write_text('[scene]\ntransport = "T.npy"\n[camera]\nambient = 0.0\n')
    with _previewed(open_rig_to_preview(path, read_rig_table(path))) as (ask, until):
        white = until(lambda state: state.get("pattern") == "white")
        assert white["camera"] == "the simulated camera of T.npy"
        assert white["monitor"].startswith("0: simulated, 8x9")
        assert white["size"] == "6x7"
        assert 0.5 < white["brightest"] < 1
        ask("/settings", {"pattern": "black"})
        black = until(lambda state: state["pattern"] == "black")
        assert black["mean"] < white["mean"] / 5
        ask("/settings", {"pattern": "white", "exposure": 1.5})
        until(lambda state: state["exposure"] == 1.5 and state["brightest"] == 1.0)
