"""Transports from photos of anybody's patterns."""

import numpy as np
import pytest

import nearfar
from nearfar import natural_picture, snr
from nearfar.arrays import Size
from nearfar.capture import import_photos, open_capture, read_shown
from nearfar.errors import InputError, PlanError
from nearfar.transport.verdict import KeptVerdict, Reason
from nearfar.workflow.from_patterns import _with_faults, reconstruct_from_patterns
from tests.cli.conftest import check_done, check_sentence, run_nearfar
from tests.shown import (
    captured,
    cornell,
    fringes,
    gray_code,
    hadamard,
    photograph,
    random_binary,
    white_and_black,
    with_inverses,
    write_pictures,
)

SIZE = Size(8, 16)
CAMERA = Size(9, 12)


@pytest.fixture(scope="module")
def world():
    return cornell(SIZE, CAMERA)


def _decibels(world, transport):
    lights = [natural_picture(SIZE, seed) for seed in range(3)]
    pictures = np.mean([snr(world @ light, transport @ light) for light in lights])
    random = np.random.default_rng(7).random(SIZE).astype(np.float32)
    return float(pictures), float(snr(world @ random, transport @ random))


SETS = {
    "random": lambda: [*random_binary(SIZE, 60), *white_and_black(SIZE)],
    "half of the Hadamard patterns": lambda: [
        *(hadamard(SIZE)[row] for row in np.random.default_rng(0).permutation(128)[:60]),
        *white_and_black(SIZE),
    ],
    "Gray code and fringes": lambda: [
        *(p for axis in (0, 1) for p in with_inverses(gray_code(SIZE, axis))),
        *(p for axis in (0, 1) for p in fringes(SIZE, axis, [16, 8, 4, 3], 4)),
        *white_and_black(SIZE),
    ],
}


@pytest.fixture(scope="module")
def capture(world, tmp_path_factory):
    """Return a capture of random patterns, where nobody writes."""
    return captured(world, SETS["random"](), tmp_path_factory.mktemp("random"))


@pytest.fixture(scope="module")
def transport(capture):
    """Return the transport of random patterns."""
    return reconstruct_from_patterns(capture)


@pytest.mark.parametrize("name", SETS)
def test_each_set_of_patterns_gives_a_transport(world, name, tmp_path, request):
    if name == "random":
        capture, transport = map(request.getfixturevalue, ("capture", "transport"))
    else:
        capture = captured(world, SETS[name](), tmp_path)
        transport = reconstruct_from_patterns(capture)
    pictures, _ = _decibels(world, transport)
    # By each camera pixel's own photos they are 40.2, 39.5 and 39.5 dB.
    assert pictures > 40.5
    assert transport.verdict is not None
    assert transport.verdict.grade == "good"
    assert transport.verdict.held_out_snr is not None
    black = capture.read([len(capture.plan.patterns) - 1])[0]
    np.testing.assert_allclose(transport.black, black, atol=0.02)


def test_several_sets_in_one_capture_are_used_together(world, tmp_path):
    code = [*gray_code(SIZE, 0), *gray_code(SIZE, 1)]
    waves = [*fringes(SIZE, 0, [8, 5], 3), *fringes(SIZE, 1, [16, 7], 3)]
    code_and_waves = [*code, *waves, *white_and_black(SIZE)]
    every = [*code, *waves, *random_binary(SIZE, 24), *white_and_black(SIZE)]
    found = []
    for name, pictures in (("some", code_and_waves), ("all", every)):
        capture = captured(world, pictures, tmp_path / name)
        found.append(_decibels(world, reconstruct_from_patterns(capture)))
    assert found[1][0] > found[0][0] + 2
    assert found[1][1] > found[0][1] + 2


def test_grey_patterns_may_be_colour_files_and_colour_patterns_are_refused(world, tmp_path):
    pictures = SETS["random"]()
    grey = [np.repeat(picture[..., None], 3, axis=2) for picture in pictures]
    capture = captured(world, grey, tmp_path / "grey")
    assert reconstruct_from_patterns(capture).verdict.grade == "good"
    grey[3][..., 1] = 0
    with pytest.raises(InputError, match=r"c\.zarr has colour patterns.*shoot grey patterns"):
        reconstruct_from_patterns(captured(world, grey, tmp_path / "colour"))


def test_python_reconstructs_as_any_capture(world, capture):
    transport, correspondence = nearfar.reconstruct(capture)
    assert _decibels(world, transport)[0] > 33
    np.testing.assert_array_equal(correspondence.q, transport.correspondence)
    with pytest.raises(PlanError, match="somebody else's pictures"):
        nearfar.reconstruct(capture, method="paper")
    with pytest.raises(PlanError, match="somebody else's pictures"):
        nearfar.measure(capture)


def test_held_out_photos_tell_how_well_such_patterns_are_relit(world, transport):
    lights = np.random.default_rng(9).random((5, *SIZE)) < 0.5
    true = [snr(world @ light, transport @ light) for light in lights.astype(np.float32)]
    assert transport.verdict.held_out_snr == pytest.approx(np.mean(true), abs=2.0)


def test_the_truth_lies_within_one_deviation_as_often_as_it_should(world, transport):
    bars = nearfar.ErrorBars(transport)
    for light in (natural_picture(SIZE, 1), np.random.default_rng(7).random(SIZE)):
        error = np.abs(world @ light.astype(np.float32) - transport @ light)
        assert 0.5 < np.mean(error < bars.picture(light)) < 0.85


def test_more_photos_are_better_and_photos_without_noise_better_still(world, tmp_path):
    found = []
    for number, noise in ((30, True), (80, True), (80, False)):
        pictures = [*random_binary(SIZE, number), *white_and_black(SIZE)]
        capture = captured(world, pictures, tmp_path / f"{number}{noise}", noise=noise)
        found.append(_decibels(world, reconstruct_from_patterns(capture)))
    assert found[0][0] < found[1][0] < found[2][0]
    assert found[0][1] < found[1][1] < found[2][1]


def test_neither_gain_nor_offset_of_the_patterns_matters(world, tmp_path):
    pictures = SETS["random"]()
    plain = reconstruct_from_patterns(captured(world, pictures, tmp_path / "a", noise=False))
    dim = [np.rint(25.5 + 0.8 * picture).astype(np.uint8) for picture in pictures]
    found = reconstruct_from_patterns(captured(world, dim, tmp_path / "b", noise=False))
    light = natural_picture(SIZE, 1)
    assert snr(plain @ light, found @ light) > 30


def test_photos_of_other_scenes_are_wrong(world, tmp_path):
    pictures = SETS["random"]()
    shuffled = [pictures[i] for i in np.random.default_rng(0).permutation(len(pictures) - 2)]
    taken = [*shuffled, *white_and_black(SIZE)]
    transport = reconstruct_from_patterns(captured(world, taken, tmp_path, shown=pictures))
    assert transport.verdict.grade != "good"


def test_what_may_follow_from_a_fault_is_no_cause_beside_it(world, tmp_path):
    pictures = SETS["Gray code and fringes"]()
    patterns = write_pictures(tmp_path / "patterns", pictures)
    linear = [photo / 16383 for photo in photograph(world, pictures)]
    encoded = [(16383 * photo ** (1 / 2.2)).astype(np.uint16) for photo in linear]
    taken = write_pictures(tmp_path / "photos", encoded)
    paths = [taken / f"p{number}.png" for number in range(len(pictures))]
    shown = read_shown(patterns)
    import_photos(shown.plan, paths, tmp_path / "c.zarr", full_scale=16383, shown=shown)
    verdict = reconstruct_from_patterns(open_capture(tmp_path / "c.zarr")).verdict
    assert verdict.grade != "good"
    assert verdict.causes == ("not-linear",)
    assert "a power of about 0." in verdict.reasons[0].sentence


@pytest.mark.parametrize("cause", ["too-few-photos", "noise", "model", "unknown"])
def test_a_consequence_is_told_with_the_first_fault(cause):
    found = KeptVerdict("doubtful", (Reason(cause, "x."), Reason("unchecked", "y.")))
    faults = [Reason("not-linear", "the response is bent."), Reason("lamp", "it flickers.")]
    verdict = _with_faults(found, faults)
    assert verdict.causes == ("not-linear", "lamp", "unchecked")
    first, second, _ = verdict.sentences
    assert first.startswith("The response is bent. That ")
    assert first.endswith("may follow from it.")
    assert second == "It flickers."
    assert _with_faults(found, []) == found
    # Alone it is a cause.
    assert _with_faults(KeptVerdict("good"), [Reason(cause, "x.")]).causes == (cause,)


def test_what_cannot_be_estimated_is_refused(world, tmp_path):
    capture = captured(world, fringes(SIZE, 1, [16, 4], 4), tmp_path / "a")
    with pytest.raises(InputError, match="tell no rows apart"):
        reconstruct_from_patterns(capture)
    with pytest.raises(InputError, match=r"needs .* GB"):
        reconstruct_from_patterns(capture, memory=1000)


def test_the_command_line_reconstructs_and_relights(world, capture, tmp_path):
    capture, output = capture.path, tmp_path / "t.zarr"
    said = check_done(run_nearfar("reconstruct", capture, output)).out
    assert "good: Relit patterns like those shown are off by" in said
    np.save(tmp_path / "light.npy", natural_picture(SIZE, 2))
    check_done(run_nearfar("relight", output, tmp_path / "light.npy", tmp_path / "out.npy"))
    relit = np.load(tmp_path / "out.npy")
    assert snr(world @ natural_picture(SIZE, 2), relit) > 30
    deviation = tmp_path / "deviation.npy"
    check_done(run_nearfar("relight", output, tmp_path / "light.npy", deviation, "--error-bars"))
    assert (
        0.5 < np.mean(np.abs(relit - world @ natural_picture(SIZE, 2)) < np.load(deviation)) < 0.9
    )
    assert "good:" in check_done(run_nearfar("info", output)).out
    again = check_sentence(run_nearfar("info", output, "--capture", capture))
    assert "judged by held-out photos when it was reconstructed" in again
    answer = check_done(run_nearfar("reconstruct", capture, output, "--json", "--force")).out
    assert '"verdict": "good"' in answer
    other = tmp_path / "other.zarr"
    assert run_nearfar("reconstruct", capture, other, "--method", "paper").status == 2
    assert run_nearfar("reconstruct", capture, other, "--square").status == 2


@pytest.mark.parametrize(
    "option", [("--correspondence", "q.npy"), ("--report", "r.html")], ids=lambda option: option[0]
)
def test_what_an_inverted_set_has_no_use_for_is_refused(world, tmp_path, option):
    captured(world, SETS["random"](), tmp_path)
    np.save(tmp_path / "q.npy", world.correspondence)
    output = tmp_path / "T.npy"
    name, file = option
    ran = run_nearfar("reconstruct", tmp_path / "c.zarr", output, name, tmp_path / file)
    assert ran.status == 2
    assert name in ran.err
    assert ".npy" in ran.err
    assert not output.exists()
