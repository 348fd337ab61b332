"""``nearfar acquire --and``: several projectors, in turn and at once."""

import numpy as np
import pytest

import nearfar
from nearfar.arrays import Size
from nearfar.capture import open_capture
from nearfar.errors import DeviceError
from nearfar.rigs.simulated.camera import SimulatedCamera
from nearfar.workflow.acquire_shared import take_apart
from tests.cli.conftest import check_done, check_sentence, run_nearfar
from tests.worlds import model_transport

GRID, CAMERA = Size(8, 10), Size(6, 7)
RIG = """
exposure = {exposure}
[scene]
transport = "{name}.npy"
camera = "6x7"
[camera]
bits = 16
full_well = {full_well}
read_noise = {read_noise}
"""


@pytest.fixture
def folder(tmp_path):
    """A plan, and rigs of two projectors: quiet ones, and ones that reading makes noisy."""
    check_done(
        run_nearfar("plan", "--projector", "8x10", "--photos", 30, "-o", tmp_path / "plan.json")
    )
    for seed, name in enumerate(("left", "right")):
        world = model_transport(GRID, CAMERA, window=3, far=Size(3, 3), seed=seed)
        np.save(tmp_path / f"{name}.npy", world.dense().reshape(42, 80))
        for quality, full_well, read_noise in (("", 1e9, 4.0), ("-dim", 300.0, 30.0)):
            (tmp_path / f"{name}{quality}.toml").write_text(
                RIG.format(exposure=0.4, name=name, full_well=full_well, read_noise=read_noise)
            )
    return tmp_path


def acquire(folder, quality="", *options):
    return run_nearfar(
        "acquire", folder / "plan.json", folder / "l.zarr", "--rig",
        folder / f"left{quality}.toml", "--and",
        f"{folder / 'r.zarr'}={folder / f'right{quality}.toml'}", *options,
    )  # fmt: skip


def test_photos_in_turn_are_those_of_each_rig(folder):
    ran = check_done(acquire(folder))
    for name, side in (("l", "left"), ("r", "right")):
        assert f"{name}.zarr" in ran.out
        alone = folder / f"{side}.zarr"
        check_done(
            run_nearfar("acquire", folder / "plan.json", alone, "--rig", folder / f"{side}.toml")
        )
        found = open_capture(folder / f"{name}.zarr")
        np.testing.assert_array_equal(found.photos[:], open_capture(alone).photos[:])
    # What is whole is kept, and what is missing is taken.
    taken = open_capture(folder / "l.zarr").times
    (folder / "r.zarr").rename(folder / "elsewhere.zarr")
    ran = check_done(acquire(folder, "", "--resume"))
    assert "l.zarr is there already" in ran.out
    np.testing.assert_array_equal(open_capture(folder / "l.zarr").times, taken)
    np.testing.assert_array_equal(
        open_capture(folder / "r.zarr").photos[:], open_capture(folder / "elsewhere.zarr").photos[:]
    )
    check_sentence(acquire(folder), "l.zarr", "--force")


def test_exposures_that_differ_are_told(folder):
    """As those of real rigs may, which their captures know in seconds."""
    check_done(acquire(folder))
    paths = [folder / "l.zarr", folder / "r.zarr"]
    for path, seconds in zip(paths, (0.01, 0.02), strict=True):
        taken = open_capture(path)
        nearfar.write_capture(
            taken.plan, path, taken.read(slice(None)), full_scale=1.0, exposure=seconds, force=True
        )
    ran = acquire(folder, "", "--resume")
    assert ran.status == 0
    assert "0.01 s" in ran.err
    assert "0.02 s" in ran.err
    assert ran.err.startswith("warning: ")


def test_photos_are_shared_where_that_lowers_the_noise(folder):
    ran = check_done(acquire(folder, "-dim", "--shared", folder / "s.zarr"))
    assert "dB less noise" in ran.out
    shared = open_capture(folder / "s.zarr")
    plan = nearfar.read_plan(folder / "plan.json")
    assert len(shared.plan.patterns) == 2 * len(plan.patterns)
    for name in ("l", "r"):
        capture = open_capture(folder / f"{name}.zarr")
        assert capture.plan == plan
        assert capture.photos.dtype == np.float32
        assert capture.rig["shared_photos"] == 2
    # In shared photos alone there is nothing to estimate, and the shared photos are enough.
    check_sentence(
        run_nearfar("reconstruct", folder / "s.zarr", folder / "t.zarr"), "several projectors"
    )
    (folder / "l.zarr").rename(folder / "before.zarr")
    again = take_apart(shared, [folder / "l.zarr", folder / "r.zarr"], force=True)[0]
    np.testing.assert_array_equal(again.photos[:], open_capture(folder / "before.zarr").photos[:])


def test_photos_are_not_shared_where_that_raises_the_noise(folder):
    for name in ("left", "right"):
        path = folder / f"{name}.toml"
        path.write_text(path.read_text().replace("exposure = 0.4", "exposure = 1.0"))
    ran = check_done(acquire(folder, "", "--shared", folder / "s.zarr"))
    assert "dB more noise" in ran.out
    assert not (folder / "s.zarr").exists()
    assert open_capture(folder / "r.zarr").photos.dtype == np.uint16


def test_a_shared_capture_is_gone_on_with(folder, monkeypatch):
    whole = check_done(acquire(folder, "-dim", "--shared", folder / "s.zarr"))
    assert "s.zarr" in whole.out
    wanted = open_capture(folder / "l.zarr").photos[:]
    for name in ("l.zarr", "r.zarr"):
        (folder / name).rename(folder / f"whole-{name}")
    # Taken whole, but not apart.
    ran = check_done(acquire(folder, "-dim", "--shared", folder / "s.zarr", "--resume"))
    assert "l.zarr" in ran.out
    np.testing.assert_array_equal(open_capture(folder / "l.zarr").photos[:], wanted)
    # The photos of one projector alone are missing.
    before = (folder / "r.zarr").stat().st_mtime_ns
    (folder / "l.zarr").rename(folder / "first-l.zarr")
    ran = check_done(acquire(folder, "-dim", "--shared", folder / "s.zarr", "--resume"))
    assert f"{folder / 'r.zarr'} is there already" in ran.out
    assert (folder / "r.zarr").stat().st_mtime_ns == before
    np.testing.assert_array_equal(open_capture(folder / "l.zarr").photos[:], wanted)
    # Stopped among the photos.
    for name in ("l.zarr", "r.zarr", "s.zarr"):
        (folder / name).rename(folder / f"again-{name}")
    stop_after(25, monkeypatch)
    ran = acquire(folder, "-dim", "--shared", folder / "s.zarr")
    assert ran.status == 1
    assert not (folder / "l.zarr").exists()
    monkeypatch.undo()
    check_done(acquire(folder, "-dim", "--shared", folder / "s.zarr", "--resume"))
    np.testing.assert_array_equal(open_capture(folder / "l.zarr").photos[:], wanted)


def stop_after(photos, monkeypatch):
    """Let the camera be gone after some photos."""
    photograph, taken = SimulatedCamera.photograph, [0]

    def failing(camera, *given):
        taken[0] += 1
        if taken[0] > photos:
            raise DeviceError("the camera is gone: connect it again.")
        return photograph(camera, *given)

    monkeypatch.setattr(SimulatedCamera, "photograph", failing)


def test_wrong_usage_and_wrong_files_get_a_sentence(folder):
    check_sentence(acquire(folder, "", "--shared", folder / "l.zarr"), "l.zarr")
    ran = acquire(folder, "", "--until", "30dB")
    assert ran.status == 2
    assert "does not go with --and" in ran.err
    ran = run_nearfar(
        "acquire", folder / "plan.json", folder / "l.zarr", "--rig", "corner",
        "--shared", folder / "s.zarr",
    )  # fmt: skip
    assert ran.status == 2
    assert "given by --and" in ran.err
    rig = folder / "right.toml"
    rig.write_text(rig.read_text().replace("bits = 16", "bits = 12"))
    check_sentence(acquire(folder, "", "--shared", folder / "s.zarr"), "right.toml", "[camera]")
    assert not (folder / "l.zarr").exists()


def test_no_photo_is_taken_before_all_rigs_and_captures_are_checked(folder):
    right = folder / "right.toml"
    right.rename(folder / "elsewhere.toml")
    check_sentence(acquire(folder), "right.toml")
    assert not (folder / "l.zarr").exists()
    (folder / "elsewhere.toml").rename(right)
    (folder / "r.zarr").mkdir()
    check_sentence(acquire(folder), "r.zarr")
    assert not (folder / "l.zarr").exists()
