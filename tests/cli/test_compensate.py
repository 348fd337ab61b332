"""``nearfar compensate``."""

import json

import numpy as np
import pytest

import nearfar
from nearfar.files import read_light
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
    ran = run_nearfar("compensate", job.transport, wanted, out, "--scale", "big")
    assert ran.status == 2
    assert "no scale" in ran.err
    assert not out.exists()
