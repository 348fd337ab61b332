"""``nearfar edit``."""

import numpy as np
import pytest

import nearfar
from tests.cli.conftest import check_done, check_sentence, run_nearfar


def test_recoloured_is_as_in_python_and_goes_on_as_a_transport(job):
    out = job.folder / "edited.zarr"
    check_done(run_nearfar("edit", job.transport, out, "--recolour", "far=1,0.5,0.25"))
    before = nearfar.load_transport(job.transport)
    expected = nearfar.recolour(before, "far", [1, 0.5, 0.25])
    light = np.load(job.light)
    np.testing.assert_array_equal(nearfar.load_transport(out) @ light, expected @ light)
    told = check_done(run_nearfar("info", out))
    assert "not judged: it was edited" in told.out
    refused = run_nearfar("relight", out, job.light, job.folder / "p.npy", "--error-bars")
    check_sentence(refused, "changed after it was reconstructed")
    check_done(run_nearfar("relight", out, job.light, job.folder / "p.npy"))


def test_far_light_is_cut_between_masks(job):
    before = nearfar.load_transport(job.transport)
    camera, projector = job.folder / "c.npy", job.folder / "p.npy"
    of_camera, of_projector = np.zeros(before.camera), np.zeros(before.projector)
    of_camera[:, :4], of_projector[:, 10:] = 1, 1
    np.save(camera, of_camera.astype(np.float32))
    np.save(projector, of_projector.astype(np.float32))
    out = job.folder / "edited.zarr"
    ran = check_done(run_nearfar("edit", job.transport, out, "--cut-far", f"{camera}:{projector}"))
    assert "off an exact cut" in ran.out
    expected = nearfar.cut_far(before, of_camera, of_projector).transport
    np.testing.assert_array_equal(nearfar.load_transport(out).far, expected.far)
    swapped = f"{projector}:{camera}"
    ran = run_nearfar("edit", job.transport, job.folder / "no.zarr", "--cut-far", swapped)
    check_sentence(ran, projector, "give a picture of 8x9")
    for spoilt in (camera, projector):
        ran = run_nearfar(
            "edit", job.transport, spoilt, "--cut-far", f"{camera}:{projector}", "--force"
        )
        check_sentence(ran, "input")


@pytest.mark.parametrize(
    "options",
    [
        (),
        ("--widen", 2, "--recolour", "near=2"),
        ("--widen", "far"),
        ("--recolour", "near"),
        ("--recolour", "near=red"),
        ("--recolour", "near=1,nan,1"),
        ("--cut-far", "mask.png"),
    ],
)
def test_wrong_usage(job, options):
    out = job.folder / "edited.zarr"
    assert run_nearfar("edit", job.transport, out, *options).status == 2
    assert not out.exists()


def test_what_does_not_fit_gets_a_sentence(job):
    out = job.folder / "edited.zarr"
    command = ("edit", job.transport, out)
    check_sentence(run_nearfar(*command, "--widen", 2), "translucent")
    check_sentence(run_nearfar(*command, "--recolour", "near=1,2"), "3 channels")
    check_sentence(run_nearfar("edit", job.capture, out, "--recolour", "near=2"), "is a capture")
    check_done(run_nearfar(*command, "--recolour", "near=2"))
    check_sentence(run_nearfar(*command, "--recolour", "near=2"), "--force")
