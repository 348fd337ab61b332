"""``nearfar probe`` and ``nearfar dual``."""

import numpy as np
import pytest

import nearfar
from tests.cli.conftest import check_done, check_sentence, run_nearfar

MASK = nearfar.ProbingMask


def test_every_mask_is_as_in_python(job):
    transport, light = nearfar.load_transport(job.transport), np.load(job.light)
    fundamental, weights = np.array([[0, 0, 0], [0, 0, -1], [0, 2, 0]]), np.eye(16, 20)
    np.save(job.folder / "F.npy", fundamental)
    np.save(job.folder / "M.npy", weights)
    cases = {
        ("--within", 3): MASK.within(3),
        ("--ring", "2:5.5"): MASK.ring(2, 5.5),
        ("--beyond", 4): MASK.beyond(4),
        ("--epipolar", f"{job.folder / 'F.npy'}:3"): MASK.epipolar(fundamental, 3),
        ("--mask", job.folder / "M.npy"): MASK.of_matrix(weights),
    }
    for number, (option, mask) in enumerate(cases.items()):
        out = job.folder / f"{number}.npy"
        check_done(run_nearfar("probe", job.transport, out, "--light", job.light, *option))
        expected = nearfar.probe(transport, light, mask)
        np.testing.assert_allclose(np.load(out), expected, atol=1e-6)


def test_the_light_is_white_by_default(job):
    transport, out = nearfar.load_transport(job.transport), job.folder / "out.npy"
    check_done(run_nearfar("probe", job.transport, out, "--within", 3))
    expected = nearfar.probe(transport, np.ones((16, 20)), MASK.within(3))
    np.testing.assert_allclose(np.load(out), expected, atol=1e-6)
    ran = check_done(run_nearfar("dual", job.transport, out, "--force"))
    found = nearfar.find_reciprocity(transport)
    assert found.holds
    assert "by reciprocity" in ran.out
    view = nearfar.dual_view(transport, reciprocity=found)
    np.testing.assert_allclose(np.load(out), view, rtol=1e-4)
    ran = check_done(run_nearfar("dual", job.transport, out, "--force", "--transpose"))
    assert "reciprocity" not in ran.out
    np.testing.assert_allclose(np.load(out), nearfar.dual_view(transport), rtol=1e-4)


def test_flat_fields_are_divided_out_of_a_dual_view(job):
    transport, out = nearfar.load_transport(job.transport), job.folder / "out.npy"
    flats, options = {}, []
    for number, (side, size) in enumerate(
        (("camera", transport.camera), ("projector", transport.projector))
    ):
        flats[f"{side}_flat"] = np.random.default_rng(number).uniform(0.5, 1, size).astype("f4")
        path = job.folder / f"{side}.npy"
        np.save(path, flats[f"{side}_flat"])
        options += [f"--{side}-flat", path]
    check_done(run_nearfar("dual", job.transport, out, *options))
    found = nearfar.find_reciprocity(transport)
    view = nearfar.dual_view(transport, **flats, reciprocity=found)
    np.testing.assert_allclose(np.load(out), view, rtol=1e-4)
    np.save(path, np.zeros(transport.projector, np.float32))
    check_sentence(run_nearfar("dual", job.transport, out, *options, "--force"), path, "black")


def test_a_dual_view_of_one_component(job):
    transport, out = nearfar.load_transport(job.transport), job.folder / "out.npy"
    picture = np.random.default_rng(1).uniform(size=(8, 9)).astype(np.float32)
    np.save(job.folder / "sent.npy", picture)
    option = ("--light", job.folder / "sent.npy", "--gain", "near=0", "--gain", "far=0")
    check_done(run_nearfar("dual", job.transport, out, *option))
    only = transport.with_gains(near=0, far=0)
    np.testing.assert_allclose(np.load(out), nearfar.dual_view(only, picture), atol=1e-5)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ((), "exactly one"),
        (("--within", 2, "--beyond", 2), "exactly one"),
        (("--ring", "3"), "R1:R2"),
        (("--ring", "a:3"), "no number"),
        (("--epipolar", "F.npy"), "F.npy:WIDTH"),
    ],
)
def test_other_than_one_mask_is_wrong_usage(job, options, words):
    ran = run_nearfar("probe", job.transport, job.folder / "out.npy", *options)
    assert ran.status == 2
    assert words in ran.err


def test_what_does_not_fit_gets_a_sentence(job):
    out, small = job.folder / "out.npy", job.folder / "small.npy"
    np.save(small, np.ones((3, 3), np.float32))
    probe = ("probe", job.transport, out)
    check_sentence(run_nearfar(*probe, "--within", -1), "the radius is -1")
    check_sentence(run_nearfar(*probe, "--mask", small), "the mask is 3x3")
    check_sentence(run_nearfar(*probe, "--mask", job.folder / "none.npy"), "none.npy is not there")
    check_sentence(run_nearfar(*probe, "--mask", job.plan), job.plan)
    check_sentence(run_nearfar(*probe, "--within", 2, "--light", small), small, "16x20")
    check_sentence(run_nearfar("dual", job.transport, out, "--light", small), small, "8x9")
    check_sentence(run_nearfar("dual", job.capture, out), "is a capture")
    assert not out.exists()


@pytest.mark.parametrize("command", [("dual",), ("probe", "--within", 2), ("bounces",)])
def test_srgb_is_of_a_light_that_is_named(job, command):
    name, *mask = command
    out = job.folder / "out.npy"
    ran = run_nearfar(name, job.transport, out, *mask, "--srgb")
    assert ran.status == 2
    assert "goes with --light only" in ran.err
    assert not out.exists()


@pytest.mark.parametrize(
    ("gain", "words"),
    [
        ("subsurface=2", "give direct, near, far or free"),
        ("foo=1", "write direct=1, near=2, far=0 or free=1, a finite number each"),
        ("near=nan", "a finite number each"),
    ],
)
def test_a_gain_that_dual_views_do_not_take_is_answered_by_those_they_do(job, gain, words):
    out = job.folder / "dual.npy"
    ran = run_nearfar("dual", job.transport, out, "--gain", gain)
    assert ran.status == 2
    said = " ".join(ran.err.replace("│", " ").split())
    assert words in said
    assert "interreflection" not in said
    assert not out.exists()


def test_far_range_light_that_is_left_out_is_not_spoken_of(job):
    out = job.folder / "dual.npy"
    assert "far-range" in run_nearfar("dual", job.transport, out).out
    assert (
        "far-range" not in run_nearfar("dual", job.transport, out, "--force", "--gain", "far=0").out
    )
