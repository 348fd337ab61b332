"""``nearfar compensate``."""

import json
from dataclasses import replace

import numpy as np
import pytest

import nearfar
from nearfar.errors import DeviceError
from nearfar.files import read_light
from nearfar.rigs.simulated.rig import SimulatedRig
from tests.cli.conftest import check_done, check_sentence, run_nearfar


@pytest.fixture
def wanted(job):
    """A picture that some light makes."""
    transport = nearfar.load_transport(job.transport)
    path = job.folder / "wanted.npy"
    picture = transport @ nearfar.natural_picture(transport.projector, 2)
    np.save(path, np.maximum(picture, 0))
    return path


def test_the_light_and_what_it_is_expected_to_do_are_those_of_python(job, wanted):
    out, expected, reach = (job.folder / name for name in ("l.npy", "e.npy", "r.npy"))
    ran = check_done(
        run_nearfar(
            "compensate", job.transport, wanted, out, "--scale", 1, "--json",
            "--expected", expected, "--out-of-reach", reach,
        )
    )  # fmt: skip
    transport = nearfar.load_transport(job.transport)
    found = nearfar.compensate(transport, np.load(wanted), 1.0)
    np.testing.assert_array_equal(np.load(out), found.light)
    np.testing.assert_array_equal(np.load(expected), found.expected)
    np.testing.assert_array_equal(np.load(reach), found.out_of_reach)
    numbers = json.loads(ran.out)
    assert numbers["psnr_dB"] == pytest.approx(found.psnr)
    assert numbers["out_of_reach_share"] == pytest.approx(found.out_of_reach.mean())


def test_a_png_holds_the_light_as_relight_reads_it(job, wanted):
    png, npy = job.folder / "l.png", job.folder / "l.npy"
    for out in (png, npy):
        ran = check_done(run_nearfar("compensate", job.transport, wanted, out))
        assert "dB below the brightest wanted value" in ran.out
    light = np.load(npy)
    np.testing.assert_allclose(read_light(png, light.shape[:2]), light, atol=1e-5)


def test_what_does_not_fit_gets_a_sentence(job, wanted):
    out, small = job.folder / "l.npy", job.folder / "small.npy"
    np.save(small, np.ones((3, 3), np.float32))
    check_sentence(run_nearfar("compensate", job.transport, small, out), small, "3x3")
    check_sentence(run_nearfar("compensate", job.capture, wanted, out), "is a capture")
    check_sentence(run_nearfar("compensate", job.transport, wanted, wanted, "--force"), "input")
    check_sentence(run_nearfar("compensate", job.transport, wanted, out, "--scale", -1), "above 0")
    ran = run_nearfar("compensate", job.transport, wanted, out, "--expected", out)
    check_sentence(ran, out, "two outputs")
    ran = run_nearfar("compensate", job.transport, wanted, out, "--scale", "big")
    assert ran.status == 2
    assert "no scale" in ran.err
    assert not out.exists()


@pytest.fixture
def rig(job):
    """The rig of the job, with a response that its transport does not know."""
    path = job.folder / "rig.toml"
    text = '[scene]\ntransport = "truth.npy"\n[projector]\ngamma = 1.8\n[camera]\nbits = 16\n'
    path.write_text(text)
    return path


def test_photos_on_a_rig_correct_the_light(job, wanted, rig):
    plain, out = job.folder / "plain.npy", job.folder / "l.npy"
    command = ("compensate", job.transport, wanted)
    check_done(run_nearfar(*command, plain, "--scale", 1))
    ran = check_done(run_nearfar(*command, out, "--scale", 1, "--refine", 2, "--rig", rig))
    assert "dB before corrections" in ran.out
    again = job.folder / "again.npy"
    told = check_done(
        run_nearfar(*command, again, "--scale", 1, "--refine", 2, "--rig", rig, "--json")
    )
    numbers = json.loads(told.out)
    assert len(numbers["photo_rmse"]) == 3
    assert numbers["psnr_refined_dB"] > numbers["psnr_before_dB"] + 3
    np.testing.assert_array_equal(np.load(out), np.load(again))
    truth = nearfar.load_exact(job.truth)
    target = np.load(wanted)
    distances = [
        np.sqrt(np.mean((truth @ np.load(path) ** np.float32(1.8) - target) ** 2))
        for path in (plain, out)
    ]
    assert distances[1] < 0.7 * distances[0]


@pytest.mark.parametrize("stop", [DeviceError("the camera is gone."), KeyboardInterrupt()])
def test_a_rig_that_stops_leaves_the_best_light_so_far(job, wanted, rig, monkeypatch, stop):
    shoot, calls = SimulatedRig.shoot, []

    def stopping(self, patterns, first=0):
        calls.append(first)
        if len(calls) > 2:
            raise stop
        return shoot(self, patterns, first)

    monkeypatch.setattr(SimulatedRig, "shoot", stopping)
    out = job.folder / "l.npy"
    ran = run_nearfar("compensate", job.transport, wanted, out, "--refine", 3, "--rig", rig)
    assert ran.status == (1 if isinstance(stop, DeviceError) else 130)
    assert f"the best light of 2 photos is kept in {out}" in ran.err
    assert np.load(out).shape[:2] == (16, 20)


def test_refine_and_rig_go_together(job, wanted, rig):
    out = job.folder / "l.npy"
    for alone in (("--refine", 1), ("--rig", rig), ("--refine", 7, "--rig", rig)):
        assert run_nearfar("compensate", job.transport, wanted, out, *alone).status == 2
    for missing, words in (("nowhere", "is no rig"), (job.folder / "none.toml", "none.toml")):
        ran = run_nearfar("compensate", job.transport, wanted, out, "--refine", 1, "--rig", missing)
        check_sentence(ran, words)
    assert not out.exists()


def test_nothing_is_left_of_a_command_whose_rig_does_not_fit(job, wanted):
    out, expected = job.folder / "l.npy", job.folder / "e.npy"
    np.save(job.folder / "other.npy", np.eye(6, dtype=np.float32))
    ran = run_nearfar(
        "compensate", job.transport, wanted, out, "--expected", expected,
        "--refine", 1, "--rig", job.folder / "other.npy", "--quiet",
    )  # fmt: skip
    check_sentence(ran, "other.npy")
    assert not out.exists()
    assert not expected.exists()


def test_photos_of_another_size_are_refused_before_a_light_is_computed(job, wanted, monkeypatch):
    def computed(*_arguments, **_options):
        raise AssertionError("a light was computed")

    monkeypatch.setattr("nearfar.applications.compensate.compensate", computed)
    # Built-in scenes have a camera as fine as the projector, and three channels.
    ran = run_nearfar(
        "compensate", job.transport, wanted, job.folder / "l.npy", "--refine", 1, "--rig", "wedge"
    )
    check_sentence(ran, "the rig's photos are 16x20x3", "8x9")


def test_a_photo_may_be_wanted(job):
    transport = nearfar.load_transport(job.transport)
    photo = job.folder / "photo.npy"
    light = nearfar.natural_picture(transport.projector, 2)
    np.save(photo, np.maximum(transport @ light + transport.black, 0))
    out, expected = job.folder / "l.npy", job.folder / "e.npy"
    command = ("compensate", job.transport, photo, out, "--scale", 1, "--expected", expected)
    check_done(run_nearfar(*command, "--as-photo"))
    error = np.load(expected) + transport.black - np.load(photo)
    assert np.abs(error).mean() < 0.02 * np.load(photo).max()
    assert transport.black.mean() > 0.02


def test_black_of_shared_photos_is_not_taken_for_ambient_light(job, tmp_path):
    transport = nearfar.load_transport(job.transport)
    rig = {**transport.provenance["rig"], "shared_photos": 2}
    shared = replace(transport, provenance={**transport.provenance, "rig": rig})
    nearfar.save_transport(shared, tmp_path / "shared.zarr")
    wanted, out = tmp_path / "wanted.npy", tmp_path / "light.npy"
    np.save(wanted, np.full(transport.camera, 0.2, dtype=np.float32))
    ran = run_nearfar("compensate", tmp_path / "shared.zarr", wanted, out, "--as-photo")
    check_sentence(ran, "leave out --as-photo")
    assert not out.exists()
