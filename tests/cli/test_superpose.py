"""``nearfar superpose``."""

import json

import numpy as np

import nearfar
from tests.cli.conftest import check_done, check_sentence, run_nearfar


def _white(job):
    np.save(job.folder / "white.npy", np.ones((16, 20), dtype=np.float32))
    return job.folder / "white.npy"


def test_a_light_is_superposed_as_in_python(job):
    out = job.folder / "out.npy"
    ran = check_done(run_nearfar("superpose", job.capture, _white(job), out))
    found = nearfar.superpose(nearfar.open_capture(job.capture), np.ones((16, 20)))
    np.testing.assert_allclose(np.load(out), found.picture, atol=1e-6)
    assert "picture of 8x9 from" in ran.out
    assert "make up the light but for" in ran.out
    bars = ("--error-bars", "--force")
    check_done(run_nearfar("superpose", job.capture, _white(job), out, *bars))
    np.testing.assert_allclose(np.load(out), found.sigma, rtol=1e-5)


def test_what_is_missing_is_told_in_decibels(job):
    out = job.folder / "out.npy"
    ran = run_nearfar("superpose", job.capture, job.light, out, "--json")
    assert ran.status == 0
    told = json.loads(ran.out)
    assert 0.01 < told["missing_share"] < 1
    decibels = 20 * np.log10(told["missing_share"])
    np.testing.assert_allclose(told["missing_dB"], decibels)
    assert told["noise_known"]
    assert ran.err.startswith(f"warning: {job.light} is not a sum of the patterns of {job.capture}")
    assert f"{told['missing_share']:.2g} of its norm, {decibels:.0f} dB" in ran.err
    assert out.exists()


def test_a_light_of_another_size_is_resized_if_asked(job):
    small, out = job.folder / "small.npy", job.folder / "out.npy"
    np.save(small, np.ones((8, 10), dtype=np.float32))
    check_sentence(run_nearfar("superpose", job.capture, small, out), small, "16x20", "--resize")
    assert not out.exists()
    ran = check_done(run_nearfar("superpose", job.capture, small, out, "--resize"))
    assert "was resized to 16x20" in ran.out


def test_bad_input_is_a_sentence(job):
    out, light = job.folder / "out.npy", _white(job)
    for arguments, names in (
        ((job.folder / "nowhere.zarr", light, out), ("nowhere.zarr",)),
        ((job.transport, light, out), ("transport.zarr",)),
        ((job.capture, job.folder / "nowhere.png", out), ("nowhere.png",)),
        ((job.capture, light, light), ("is an input",)),
        ((job.capture, light, job.folder / "out.gif"), ("out.gif",)),
    ):
        check_sentence(run_nearfar("superpose", *arguments), *names)
        assert not out.exists()
    check_done(run_nearfar("superpose", job.capture, light, out))
    check_sentence(run_nearfar("superpose", job.capture, light, out), out, "--force")
