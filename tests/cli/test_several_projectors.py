"""Further projectors by --and: relight and compensate."""

import json
from dataclasses import replace

import numpy as np
import pytest

import nearfar
from nearfar.arrays import Size
from nearfar.transport.store import save_transport
from tests.cli.conftest import check_done, check_sentence, run_nearfar
from tests.worlds import model_transport

GRID = Size(7, 9)


@pytest.fixture(scope="module")
def right(finished, tmp_path_factory):
    """A second projector, of another grid, before the camera of the job."""
    path = tmp_path_factory.mktemp("right") / "right.zarr"
    save_transport(
        model_transport(GRID, Size(8, 9), window=3, far=Size(3, 3), channels=3, seed=5), path
    )
    return path


def test_pictures_of_two_projectors_are_added(job, right):
    light, out = job.folder / "right.npy", job.folder / "both.npy"
    np.save(light, np.random.default_rng(0).random(GRID).astype(np.float32))
    ran = check_done(
        run_nearfar("relight", job.transport, job.light, out, "--and", f"{right}={light}")
    )
    assert str(out) in ran.out
    alone = []
    for transport, own in ((job.transport, job.light), (right, light)):
        path = job.folder / "alone.npy"
        check_done(run_nearfar("relight", transport, own, path, "--force"))
        alone.append(np.load(path))
    np.testing.assert_allclose(np.load(out), alone[0] + alone[1], atol=1e-6)
    black = job.folder / "black.npy"
    np.save(black, np.zeros(GRID, np.float32))
    check_done(
        run_nearfar(
            "relight", job.transport, job.light, out, "--and", f"{right}={black}", "--force"
        )
    )
    np.testing.assert_allclose(np.load(out), alone[0], atol=1e-6)


def test_lights_of_two_projectors_are_those_of_python(job, right):
    wanted, out, other = (job.folder / name for name in ("w.npy", "left.npy", "right.npy"))
    np.save(wanted, np.full((8, 9), 0.3, np.float32))
    ran = check_done(
        run_nearfar(
            "compensate", job.transport, wanted, out, "--and", f"{right}={other}", "--json",
            "--scale", 1, "--expected", job.folder / "e.npy",
        )
    )  # fmt: skip
    transports = [nearfar.load_transport(path) for path in (job.transport, right)]
    found = nearfar.compensate_together(transports, np.load(wanted), 1.0)
    np.testing.assert_array_equal(np.load(out), found.lights[0])
    np.testing.assert_array_equal(np.load(other), found.lights[1])
    np.testing.assert_array_equal(np.load(job.folder / "e.npy"), found.expected)
    numbers = json.loads(ran.out)
    assert numbers["psnr_dB"] == pytest.approx(found.psnr)
    assert numbers["psnr_alone_dB"] == pytest.approx(found.psnr_alone)


def test_what_does_not_add_up_gets_a_sentence(job, right):
    out, light = job.folder / "o.npy", job.folder / "right.npy"
    np.save(light, np.zeros(GRID, np.float32))
    elsewhere = job.folder / "elsewhere.zarr"
    save_transport(
        model_transport(GRID, Size(4, 5), window=3, far=Size(1, 1), channels=3), elsewhere
    )
    relight = ("relight", job.transport, job.light, out, "--and")
    check_sentence(run_nearfar(*relight, f"{elsewhere}={light}"), elsewhere, "4x5", "8x9")
    check_sentence(run_nearfar(*relight, f"{job.capture}={light}"), "is a capture")
    check_sentence(run_nearfar(*relight, f"{right}={job.folder / 'none.npy'}"), "none.npy")
    # The light of the one projector for the other.
    check_sentence(run_nearfar(*relight, f"{right}={job.light}"), job.light, "7x9")
    slower = job.folder / "slower.zarr"
    of_right = nearfar.load_transport(right)
    for seconds, path in ((0.01, job.folder / "faster.zarr"), (0.02, slower)):
        save_transport(replace(of_right, provenance={"rig": {"exposure": seconds}}), path)
    check_sentence(
        run_nearfar("relight", path.with_name("faster.zarr"), light, out, "--and",
                    f"{slower}={light}"),
        slower, "0.01 s", "0.02 s",
    )  # fmt: skip
    compensate = ("compensate", job.transport, job.light, out, "--and")
    check_sentence(run_nearfar(*compensate, f"{right}={out}"), out)
    for given in ("right.zarr", "right.zarr=", "=right.npy"):
        ran = run_nearfar(*relight, given)
        assert ran.status == 2
        assert "RIGHT.zarr=RIGHT_LIGHT" in ran.err
    assert not out.exists()
