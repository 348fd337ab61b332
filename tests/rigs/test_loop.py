"""The whole loop through real parts: a window, its screen read back, GigE Vision packets, and back.

What lies between is `tests.rigs.fake_camera`: a projector of gamma 2.2 before a scene of known
transport. Everything else is what a user runs.
"""

import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.capture import open_capture
from nearfar.illumination.pictures import natural_picture
from nearfar.plan import Plan, read_plan
from nearfar.scenes.cache import cached_scene
from nearfar.transport.store import load_transport
from tests.cli.conftest import check_done, run_nearfar
from tests.rigs.displays import one_monitor
from tests.rigs.loopback import alone_on_the_loopback
from tests.waiting import LONGEST_WAIT

PROJECTOR, CAMERA, PHOTOS = Size(20, 24), Size(30, 36), 40
# Blocks of 9 pixels, and a frame around them. Every frame is drawn in software, read back and
# averaged, so that most of a larger screen's time would go into its pixels.
SCREEN = "240x200"
UNIT = 1 / 60
SENSOR = {"bits": 16}
RIG = """
[projector]
settle = 1
[camera]
driver = "aravis"
device = "Aravis-Fake-{serial}"
region = "30x36"
pixel_format = "Mono16"
exposure = 0.016667
"""
SIMULATED = """
exposure = 1.0
[scene]
transport = "transport.npy"
camera = "30x36"
[camera]
bits = 16
"""

# A program that opens the camera, waits before it sets it up, takes a photo, and holds it.
HOLDING = """
import sys, time
from contextlib import suppress
from nearfar.arrays import Size
from nearfar.errors import LostPhotoError
from nearfar.rigs.cameras.aravis import AravisCamera

class Slow(AravisCamera):
    def _set_up(self, *given):
        time.sleep(float(sys.argv[2]))
        super()._set_up(*given)

camera = Slow(sys.argv[1], region=Size(30, 36), pixel_format="Mono16")
camera.set_exposure(0.016667)
# On a busy machine packets of a photo may be lost, and a rig takes it again.
for _ in range(5):
    with suppress(LostPhotoError):
        print(camera.take().shape, flush=True)
        break
time.sleep(60)
"""

pytestmark = pytest.mark.slow(minutes=3)


class Bench:
    """A folder with a plan and rigs, a display, and a camera that looks at it."""

    def __init__(self, folder: Path, display: str, serial: str, **settings: object) -> None:
        self.folder, self.display = folder, display
        self.control = folder / f"{serial}.json"
        self.rig = folder / f"{serial}.toml"
        self.rig.write_text(RIG.format(serial=serial))
        about = folder / f"{serial}.settings"
        given = {
            "transport": str(folder / "transport.npy"), "projector": PROJECTOR, "camera": CAMERA,
            "control": str(self.control), "serial": serial, "sensor": SENSOR, "unit": UNIT,
        }  # fmt: skip
        about.write_text(json.dumps({**given, **settings}))
        self._log = (folder / f"{serial}.log").open("w")
        self.camera = subprocess.Popen(
            [sys.executable, "-m", "tests.rigs.fake_camera", str(about)],
            env=self._environment(), stdout=subprocess.PIPE, stderr=self._log, text=True,
        )  # fmt: skip
        assert self.camera.stdout is not None
        assert self.camera.stdout.readline() == "ready\n", Path(self._log.name).read_text()

    def close(self) -> None:
        if self._log.closed:
            return
        self.camera.kill()
        self.camera.communicate()
        self._log.close()

    def start(self, *arguments: object) -> "subprocess.Popen[str]":
        """Start a command of nearfar's."""
        return subprocess.Popen(
            [sys.executable, "-m", "nearfar", *map(str, arguments)], env=self._environment(),
            cwd=self.folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        )  # fmt: skip

    def run(self, *arguments: object) -> "tuple[int, str, str]":
        """Run a command of nearfar's to its end."""
        running = self.start(*arguments)
        out, err = running.communicate(timeout=LONGEST_WAIT)
        return running.returncode, out, err

    def do(self, *arguments: object) -> str:
        """Run a command that is to end well."""
        status, out, err = self.run(*arguments)
        assert status == 0, err
        return out + err

    def taken(self, name: str) -> int:
        """Photos of a capture that is under way."""
        log = self.folder / f"{name}.unfinished" / "photos.jsonl"
        return log.read_bytes().count(b"\n") if log.exists() else 0

    def wait_for(self, name: str, photos: int) -> None:
        until = time.monotonic() + LONGEST_WAIT
        while self.taken(name) < photos:
            assert time.monotonic() < until
            time.sleep(0.02)

    def _environment(self) -> dict[str, str]:
        return {**os.environ, "DISPLAY": self.display}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A plan, and a scene of one channel."""
    folder = tmp_path_factory.mktemp("loop")
    world = cached_scene("cornell", PROJECTOR, CAMERA)
    lights = np.eye(PROJECTOR.pixels, dtype=np.float32).reshape(-1, *PROJECTOR)
    transport = world.pictures(lights).mean(axis=-1).reshape(PROJECTOR.pixels, -1).T
    np.save(folder / "transport.npy", (0.7 / transport.sum(axis=1).max() * transport))
    (folder / "simulated.toml").write_text(SIMULATED)
    return folder


@pytest.fixture(scope="module")
def display():
    with alone_on_the_loopback(), one_monitor(SCREEN) as name:
        yield name


@pytest.fixture(scope="module")
def bench(folder, display):
    bench = Bench(folder, display, "NF01")
    plan, simulated = folder / "plan.json", folder / "simulated.zarr"
    check_done(run_nearfar("plan", "--projector", PROJECTOR, "--photos", PHOTOS, "-o", plan))
    check_done(run_nearfar("acquire", plan, simulated, "--rig", folder / "simulated.toml"))
    assert "Aravis-Fake-NF01" in bench.do("devices")
    yield bench
    bench.close()


@pytest.fixture(scope="module")
def uncalibrated(bench):
    return bench.do("acquire", "plan.json", "uncalibrated.zarr", "--rig", bench.rig)


@pytest.fixture(scope="module")
def calibrated(bench, uncalibrated):
    """What calibrate says; from here on the rig is calibrated."""
    return bench.do("calibrate", bench.rig)


@pytest.fixture(scope="module")
def plan(bench) -> Plan:
    return read_plan(bench.folder / "plan.json")


def _relit(bench, name):
    """SNR_b of pictures and of random light."""
    capture, transport = (bench.folder / f"{name}{end}.zarr" for end in ("", ".transport"))
    check_done(run_nearfar("reconstruct", capture, transport))
    truth = bench.folder / "transport.npy"
    told = run_nearfar("evaluate", transport, "--truth", truth, "--json")
    assert told.status == 0
    assert ("is wrong: Projector or camera is not linear" in told.err) == (name == "uncalibrated")
    numbers = json.loads(told.out)
    return numbers["snr_b_pictures"], numbers["snr_b"]["random"]


def _check(bench, name):
    """Compare a capture's photos with the simulation's: the same but for noise and projector."""
    taken, simulated = (open_capture(bench.folder / f"{n}.zarr") for n in (name, "simulated"))
    error = taken.read(slice(None)) - simulated.read(slice(None))
    assert np.sqrt(np.mean(error**2, axis=(1, 2, 3))).max() < 0.012


def test_a_calibrated_rig_relights_as_in_memory_and_another_does_not(
    bench, uncalibrated, calibrated
):
    assert "light does not add up: 127 and 128 of 255 together give 4" in uncalibrated
    assert "warning" not in calibrated
    words = bench.do("acquire", "plan.json", "calibrated.zarr", "--rig", bench.rig)
    assert "warning" not in words
    assert re.search(rf"{PHOTOS} photos at \d+\.\d+ s each", words)
    _check(bench, "calibrated")
    names = ("simulated", "calibrated", "uncalibrated")
    pictures, random = zip(*(_relit(bench, name) for name in names), strict=True)
    assert pictures[1] > pictures[0] - 1
    assert random[1] > random[0] - 1
    assert pictures[2] < pictures[1] - 10
    assert random[2] < random[1] - 10


def _true_photo(bench, light, gamma):
    """What the scene does under a light on a projector of some gamma, without noise."""
    transport = np.load(bench.folder / "transport.npy")
    levels = np.rint(255 * np.load(bench.folder / light)) / 255
    return (transport @ (levels**gamma).ravel()).reshape(CAMERA)


def test_a_light_that_compensates_is_corrected_by_photos(bench, calibrated):
    """The calibrated rig is linear; another of the same devices is not, and nobody told it."""
    if not (bench.folder / "calibrated.zarr").exists():
        bench.do("acquire", "plan.json", "calibrated.zarr", "--rig", bench.rig)
    check_done(run_nearfar(
        "reconstruct", bench.folder / "calibrated.zarr", bench.folder / "t.zarr", "--force"
    ))  # fmt: skip
    plain = bench.folder / "plain.toml"
    plain.write_text(bench.rig.read_text())
    drawn = 0.3 + 0.6 * natural_picture(PROJECTOR, 2).astype(np.float64)
    transport = np.load(bench.folder / "transport.npy")
    target = (transport @ drawn.ravel()).reshape(CAMERA)
    np.save(bench.folder / "wanted.npy", target.astype(np.float32))
    command = ("compensate", "t.zarr", "wanted.npy")
    bench.do(*command, "light.npy", "--scale", 1)
    errors = {}
    for rig, gamma in ((bench.rig, 1.0), (plain, 2.2)):
        found = f"refined-{rig.stem}.npy"
        out = bench.do(*command, found, "--scale", 1, "--refine", 3, "--rig", rig, "--json")
        numbers = json.loads(re.search(r"\{.*\}", out)[0])
        lit = np.isfinite(load_transport(bench.folder / "t.zarr").correspondence[..., 0])
        truly = [
            float(np.sqrt(np.mean((_true_photo(bench, light, gamma) - target)[lit] ** 2)))
            for light in ("light.npy", found)
        ]
        errors[rig.stem] = [*truly, numbers["psnr_before_dB"], numbers["psnr_refined_dB"]]
        assert numbers["psnr_refined_dB"] >= numbers["psnr_before_dB"]
    before, after, *_ = errors["plain"]
    assert after < 0.4 * before
    before, after, *_ = errors[bench.rig.stem]
    # The calibration's own error, and the noise of a photo.
    assert after < before + 0.0005


def test_the_calibration_is_what_the_rig_is(bench, calibrated):
    folder = bench.rig.with_suffix(".calibration")
    assert {p.name for p in folder.iterdir()} == {
        "calibration.json", "camera.pdf", "camera.png", "projector.pdf", "projector.png",
    }  # fmt: skip
    known = json.loads((folder / "calibration.json").read_text())
    response = np.array(known["response"])
    assert np.abs(response - (np.arange(256) / 255)[:, np.newaxis] ** 2.2).max() < 0.006
    levels = 65535 / 30_000
    assert known["gain"] == pytest.approx(levels, rel=0.1)
    assert known["black"] == pytest.approx(0.02 * 65535, rel=0.02)
    assert known["ambient"] == pytest.approx(0.01, rel=0.05)
    assert abs(known["superposition"]) < 0.01
    assert known["residual"] < 0.006
    status, _, err = bench.run("calibrate", bench.rig)
    assert status == 1
    assert "--force" in err


def test_a_camera_that_stops_and_a_kill_cost_no_photo(bench, calibrated):
    running = bench.start("acquire", "plan.json", "stopped.zarr", "--rig", bench.rig)
    bench.wait_for("stopped.zarr", 10)
    bench.camera.send_signal(signal.SIGSTOP)
    try:
        _, err = running.communicate(timeout=LONGEST_WAIT)
    finally:
        bench.camera.send_signal(signal.SIGCONT)
    assert running.returncode == 1
    sentence = err.strip().splitlines()[-1]
    assert sentence.startswith("nearfar: ")
    assert "check its cable" in sentence
    assert "photos are kept" in sentence
    assert "--resume goes on" in sentence
    # It takes the camera three seconds to notice that nobody holds it any more.
    time.sleep(3.5)
    again = ("acquire", "plan.json", "stopped.zarr", "--rig", bench.rig, "--resume")
    running = bench.start(*again)
    bench.wait_for("stopped.zarr", 25)
    running.kill()
    running.communicate()
    assert 25 <= bench.taken("stopped.zarr") < PHOTOS
    time.sleep(3.5)
    bench.do(*again)
    _check(bench, "stopped")


# After 3 seconds without its heartbeat the camera takes orders from nobody; for the longer time it
# does not even answer a trigger before that fails.
@pytest.mark.parametrize("seconds", [4.0, 7.0])
def test_a_camera_that_was_silent_for_long_is_opened_again(bench, calibrated, seconds):
    name = f"silent-{seconds}.zarr"
    running = bench.start("acquire", "plan.json", name, "--rig", bench.rig)
    bench.wait_for(name, 10)
    bench.control.write_text(json.dumps({"fault": "silence", "seconds": seconds}))
    _, err = running.communicate(timeout=LONGEST_WAIT)
    assert running.returncode == 0, err
    assert "was taken again" in err
    _check(bench, name.removesuffix(".zarr"))


def test_a_camera_that_a_killed_program_left_sending_sends_to_the_next(bench):
    for wait in (0.0, 0.5):
        holding = subprocess.Popen(
            [sys.executable, "-c", HOLDING, "Aravis-Fake-NF01", str(wait)],
            stdout=subprocess.PIPE, text=True,
        )  # fmt: skip
        assert holding.stdout is not None
        try:
            assert holding.stdout.readline() == "(30, 36, 1)\n"
        finally:
            holding.kill()
            holding.communicate()
        # Until the camera lets go of it.
        time.sleep(3.5)


def test_what_goes_wrong_on_the_way_is_mended_or_named(bench, calibrated, plan):
    running = bench.start("acquire", "plan.json", "wrong.zarr", "--rig", bench.rig)
    for photos, fault in ((5, "repeat"), (15, "tear")):
        bench.wait_for("wrong.zarr", photos)
        bench.control.write_text(json.dumps({"fault": fault}))
    bench.wait_for("wrong.zarr", 24)
    bench.control.write_text(json.dumps({"fault": "ambient", "light": 0.1, "once": False}))
    _, err = running.communicate(timeout=LONGEST_WAIT)
    bench.control.unlink()
    assert running.returncode == 0, err
    warnings = err.strip().splitlines()
    assert sum("was taken again" in line for line in warnings) >= 1
    named = [line for line in warnings if "ambient light changed by +" in line]
    assert len(named) == 1
    assert "--reshoot" in named[0]
    capture = open_capture(bench.folder / "wrong.zarr")
    assert len(capture.alarms) == len(warnings)
    simulated = open_capture(bench.folder / "simulated.zarr")
    error = capture.read(slice(23)) - simulated.read(slice(23))
    assert np.sqrt(np.mean(error**2, axis=(1, 2, 3))).max() < 0.012


def test_lost_packets_are_asked_for_again(folder, display, bench, calibrated):
    # Of two cameras at one address only one would be heard.
    bench.close()
    lossy = Bench(folder, display, "NF02", lost_ratio=0.04)
    try:
        calibration = bench.rig.with_suffix(".calibration")
        shutil.copytree(calibration, lossy.rig.with_suffix(".calibration"))
        words = lossy.do("acquire", "plan.json", "lossy.zarr", "--rig", lossy.rig)
    finally:
        lossy.close()
    assert "was taken again" in words
    _check(lossy, "lossy")
