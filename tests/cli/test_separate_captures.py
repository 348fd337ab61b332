"""``nearfar separate --capture``: which photos of any patterns serve, and what looks wrong."""

import json

import numpy as np
import pytest

from nearfar import snr
from nearfar.arrays import Size
from nearfar.baselines.separation_patterns import checkerboards
from nearfar.plan import paper_plan
from nearfar.scenes.cache import cached_scene
from nearfar.transport.exact_store import save_exact
from tests.cli.conftest import check_done, check_sentence, run_nearfar
from tests.shown import (
    fringes,
    gray_code,
    photograph,
    random_binary,
    single_pixels,
    white_and_black,
    with_inverses,
    write_pictures,
)

SIZE = Size(32, 32)
CAMERA = Size(32, 32)
WHITE, BLACK = white_and_black(SIZE)
BOARDS = list(checkerboards(SIZE))
FINE = [*fringes(SIZE, 0, [4], 4), *fringes(SIZE, 1, [4], 4)]
GRAY = [p for axis in (0, 1) for p in with_inverses(gray_code(SIZE, axis))]


def fainter(pictures):
    """Return pictures with levels from 0.2 to 0.8."""
    return [np.rint(51 + 0.6 * picture).astype(np.uint8) for picture in pictures]


@pytest.fixture(scope="module")
def world():
    """The corner, where global light varies little."""
    found = cached_scene("corner", SIZE, CAMERA)
    return found * (0.9 / (found @ np.ones(SIZE, dtype=np.float32)).max())


@pytest.fixture(scope="module")
def truth(world, tmp_path_factory):
    path = tmp_path_factory.mktemp("truth") / "truth.zarr"
    save_exact(world, path)
    return path


@pytest.fixture
def separate(world, tmp_path):
    """From pictures, and what becomes of their photos, to a separation."""

    def done(pictures, *options, spoil=lambda photos: photos, out="out"):
        capture, patterns = tmp_path / f"{out}.zarr", tmp_path / f"{out}-patterns"
        write_pictures(patterns, pictures)
        photos = spoil(list(photograph(world, pictures)))
        photos = write_pictures(tmp_path / f"{out}-photos", photos)
        command = ("import", "--patterns", patterns, photos, capture)
        # Saturated photos are warned of at import too.
        assert run_nearfar(*command, "--full-scale", 16383).status == 0
        return run_nearfar("separate", tmp_path / out, "--capture", capture, *options)

    return done


def numbers_of(folder):
    return json.loads((folder / "numbers.json").read_text())


@pytest.mark.parametrize(
    ("pictures", "used", "least"),
    [
        ([*BOARDS, WHITE, BLACK], 10, 36),
        ([*fainter([*BOARDS, WHITE, BLACK])], 10, 35),
        ([*FINE, BLACK], 9, 31),
        ([*GRAY, WHITE, BLACK], 6, 28),
        ([*random_binary(SIZE, 24), BLACK], 25, 30),
        ([*with_inverses(random_binary(SIZE, 10)), WHITE, BLACK], 22, 32),
    ],
    ids=["checkerboards", "fainter", "fringes", "gray code", "random", "random pairs"],
)
def test_patterns_that_serve_separate_near_the_truth(
    separate, truth, tmp_path, pictures, used, least
):
    said = check_done(separate(pictures, "--truth", truth)).out
    numbers = numbers_of(tmp_path / "out")
    assert len(numbers["used"]) == numbers["patterns"] == used
    assert numbers["snr"]["truth"]["direct"] > least
    assert numbers["snr"]["truth"]["global"] > least - 12
    assert f"{used} photos separated" in said
    assert ("left out:" in said) == (used < len(pictures))


def test_direct_and_global_sum_to_white_less_black(separate, world, tmp_path):
    check_done(separate([*BOARDS, WHITE, BLACK]))
    direct, global_ = (np.load(tmp_path / "out" / f"{name}.npy") for name in ("direct", "global"))
    white, black = (world @ np.full(SIZE, level, dtype=np.float32) for level in (1, 0))
    assert snr(white - black, direct + global_) > 40


def test_coarse_patterns_are_left_out_and_named(separate):
    said = check_done(separate([*GRAY, *FINE, *fringes(SIZE, 1, [32], 4), WHITE, BLACK])).out
    used, left = said.split("left out:")
    assert "4-step fringes of rows, period 4 pixels" in used
    assert "Gray code of rows, bit" in used
    assert "vary too slowly" in left
    assert "period 32 pixels" in left


def test_the_period_of_the_patterns_can_be_chosen(separate, tmp_path):
    pictures = [*fringes(SIZE, 0, [3, 5], 4), *fringes(SIZE, 1, [3, 5], 4), WHITE, BLACK]
    for period, out in ((3, "fine"), (5, "coarse")):
        check_done(separate(pictures, "--period", period, out=out))
        assert len(numbers_of(tmp_path / out)["used"]) == 10
    assert numbers_of(tmp_path / "fine")["used"] != numbers_of(tmp_path / "coarse")["used"]


@pytest.mark.parametrize("projector", [Size(1, 32), Size(1, 1)])
def test_projectors_of_one_row_or_pixel(tmp_path, projector):
    pictures = [*fringes(projector, 1, [4], 4), *white_and_black(projector)]
    light = np.linspace(0.2, 0.9, 16, dtype=np.float32).reshape(4, 4, 1)
    photos = [float(picture[0, 5 % projector.width]) / 255 * 16383 * light for picture in pictures]
    (patterns := tmp_path / "p").mkdir()
    for number, picture in enumerate(pictures):
        np.save(patterns / f"p{number}.npy", picture / np.float32(255))
    photos = write_pictures(tmp_path / "f", [photo.astype(np.uint16) for photo in photos])
    command = ("import", "--patterns", patterns, photos, tmp_path / "c.zarr")
    assert run_nearfar(*command, "--full-scale", 16383).status == 0
    ran = run_nearfar("separate", tmp_path / "out", "--capture", tmp_path / "c.zarr")
    if projector.pixels == 1:
        assert "all are uniform" in check_sentence(ran)
        return
    # All light is direct, and one row has no other.
    assert check_done(ran).out
    np.testing.assert_allclose(np.load(tmp_path / "out" / "direct.npy"), light[..., 0], rtol=2e-3)


def test_a_capture_of_a_plan_is_separated_too(world, truth, tmp_path):
    plan = paper_plan(SIZE, 5, (5, 5))
    pictures = [plan.draw(i) for i in range(len(plan.patterns))]
    patterns = write_pictures(tmp_path / "p", pictures)
    photos = write_pictures(tmp_path / "f", photograph(world, pictures))
    command = ("import", "--patterns", patterns, photos, tmp_path / "c.zarr")
    check_done(run_nearfar(*command, "--full-scale", 16383))
    out = tmp_path / "out"
    check_done(
        run_nearfar("separate", out, "--capture", tmp_path / "c.zarr", "--truth", truth, "--json")
    )
    assert numbers_of(out)["snr"]["truth"]["direct"] > 28


def test_photos_less_ambient_light_are_told_the_black_level(separate, truth, world, tmp_path):
    black = tmp_path / "black.png"
    write_pictures(tmp_path, photograph(world, [BLACK]), name="black")
    (tmp_path / "black0.png").rename(black)
    check_done(separate(BOARDS, "--black", black, "--truth", truth, out="by-black"))
    ran = separate(BOARDS, "--ambient", black, "--black-level", 0.0, "--truth", truth)
    check_done(ran)
    found = [numbers_of(tmp_path / name) for name in ("by-black", "out")]
    assert found[0]["snr"] == found[1]["snr"]
    assert found[0]["snr"]["truth"]["direct"] > 36


# What looks wrong


def raised(photos, power=2.2):
    return [np.rint(16383 * (photo / 16383) ** (1 / power)).astype(np.uint16) for photo in photos]


def brighter(photos):
    """Double photos of all but the last two, white and black, as of another exposure."""
    doubled = [np.minimum(2.0 * p, 16000).astype(np.uint16) for p in photos[:-2]]
    return [*doubled, *photos[-2:]]


def brighter_black(photos):
    """Take the last photo, black, with a lamp on in the room."""
    return [*photos[:-1], photos[-1] + np.uint16(3000)]


def cut(photos):
    return [np.minimum(p.astype(np.float64) * 3, 16383).astype(np.uint16) for p in photos]


@pytest.mark.parametrize(
    ("pictures", "spoil", "words"),
    [
        ([*BOARDS, WHITE, BLACK], raised, "do not sum to one white"),
        ([*FINE, WHITE, BLACK], raised, "do not sum to one white"),
        ([*random_binary(SIZE, 20), WHITE, BLACK], brighter, "direct light is above white"),
        ([*random_binary(SIZE, 20), BLACK], brighter_black, "global light is below zero"),
        ([*FINE, WHITE, BLACK], cut, "saturated"),
        (FINE, None, "no photo that tells black"),
        ([*fringes(SIZE, 1, [4], 4), WHITE, BLACK], None, "other rows of the same column"),
        ([*(np.roll(BOARDS[0], k, 1) for k in (0, 4, 8, 12)), BLACK], None, "shifted further"),
    ],
    ids=["gamma", "gamma-fringes", "white", "black", "saturated", "no-black", "axis", "shifts"],
)
def test_what_looks_wrong_is_said(separate, pictures, spoil, words):
    ran = separate(pictures, spoil=spoil or (lambda photos: photos))
    assert ran.status == 0
    assert words in ran.err


def test_patterns_that_do_not_separate_are_refused(separate, tmp_path):
    said = check_sentence(separate([*fringes(SIZE, 1, [32, 16], 4), WHITE]))
    assert "8 vary too slowly" in said
    said = check_sentence(separate(single_pixels(SIZE)[:20], out="lights"))
    assert "20 light, or leave dark, too few of the pixels" in said
    assert "--rig" in said
    said = check_sentence(separate([WHITE, BLACK] * 2, out="uniform"))
    assert "all are uniform" in said
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    "options",
    [
        ("--side", 2),
        ("--pattern", "sinusoid"),
        ("--shifts", 4),
        ("--full-scale", 255),
        ("--rig", "corner"),
        ("--black-level", 0.1),
        ("--black", "a.png", "--ambient", "b.png"),
    ],
)
def test_options_of_nearfars_own_patterns_do_not_go_with_a_capture(options):
    ran = run_nearfar("separate", "out", "--capture", "capture.zarr", *options)
    assert ran.status == 2
    assert options[0] in ran.err
