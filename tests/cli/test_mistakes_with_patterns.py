"""Ten mistakes with somebody's patterns and photos: what a user is told, and by which command."""

import shutil

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.files import read_picture
from nearfar.scenes.cache import cached_scene
from tests.cli.conftest import check_done, check_sentence, run_nearfar
from tests.shown import (
    fringes,
    gray_code,
    photograph,
    white_and_black,
    with_inverses,
    write_pictures,
)

SIZE = Size(32, 32)
CAMERA = Size(24, 24)
COUNT = 22


@pytest.fixture(scope="module")
def pictures():
    return [
        *(p for axis in (0, 1) for p in with_inverses(gray_code(SIZE, axis))),
        *white_and_black(SIZE),
    ]


@pytest.fixture(scope="module")
def world():
    found = cached_scene("cornell", SIZE, CAMERA)
    return found * (0.9 / (found @ np.ones(SIZE, dtype=np.float32)).max())


@pytest.fixture(scope="module")
def good(pictures, world, tmp_path_factory):
    """Folders of Gray code and of photos of it."""
    folder = tmp_path_factory.mktemp("gray")
    photos = list(photograph(world, pictures))
    return write_pictures(folder / "patterns", pictures), write_pictures(folder / "photos", photos)


@pytest.fixture
def folders(good, tmp_path):
    """Copies of both, to spoil."""
    return tuple(shutil.copytree(each, tmp_path / each.name) for each in good)


def bring_in(patterns, photos, capture, *options):
    command = ("import", "--patterns", patterns, photos, capture, "--full-scale", 16383)
    return run_nearfar(*command, *options)


def told(capture, command):
    """Return the warnings of a command on a capture, or the verdict of its transport."""
    there = capture.parent
    arguments = {
        "correspond": ("correspond", capture, there / "q.npy"),
        "reconstruct": ("reconstruct", capture, there / "t.zarr"),
        "separate": ("separate", there / "out", "--capture", capture),
    }
    ran = run_nearfar(*arguments[command])
    assert ran.status == 0
    return ran.out if command == "reconstruct" else ran.err


def change(folder, how):
    """Write each picture of a folder anew."""
    for number in range(COUNT):
        path = folder / f"p{number}.png"
        write_pictures(folder, [how(read_picture(path), number)], name="new")
        (folder / "new0.png").replace(path)


def as_gamma(photo, _number):
    return np.rint(16383 * (photo / 16383) ** (1 / 2.2)).astype(np.uint16)


# What import refuses


def a_missing_one(_patterns, photos):
    (photos / "p9.png").unlink()
    return "the numbers skip from p8.png to p10.png"


def several_missing(_patterns, photos):
    for number in (3, 9, 12):
        (photos / f"p{number}.png").unlink()
    return "has 19 photos (first p0.png, last p21.png), but"


def sizes_that_differ(_patterns, photos):
    write_pictures(photos, [np.zeros((24, 20), np.uint16)], name="p1")
    (photos / "p10.png").replace(photos / "p11.png")
    shutil.copy(photos / "p9.png", photos / "p10.png")
    return "but the first photo is 24x24"


def no_photos_at_all(_patterns, photos):
    for path in photos.iterdir():
        path.rename(path.with_suffix(".txt"))
    return "the folder has 22 files that end in .txt"


def the_patterns_twice(patterns, photos):
    shutil.rmtree(photos)
    shutil.copytree(patterns, photos)
    return "is the pattern itself, and no photo of it"


def swapped_folders(patterns, photos):
    away = patterns.parent / "away"
    patterns.rename(away)
    photos.rename(patterns)
    away.rename(photos)
    return "the folders of patterns and photos seem to be swapped"


def jpegs(_patterns, photos):
    (photos / "p4.png").write_bytes(b"\xff\xd8\xff\xe0" + bytes(100))
    return "p4.png is a JPEG"


def white_first(_patterns, photos):
    """White and black of the other order."""
    away = photos / "away"
    (photos / "p20.png").rename(away)
    (photos / "p21.png").rename(photos / "p20.png")
    away.rename(photos / "p21.png")
    return "the photos seem to be out of order, or the projector was off"


@pytest.mark.parametrize(
    "spoil",
    [
        a_missing_one,
        several_missing,
        sizes_that_differ,
        no_photos_at_all,
        the_patterns_twice,
        swapped_folders,
        jpegs,
        white_first,
    ],
)
def test_import_refuses(spoil, folders, tmp_path):
    words = spoil(*folders)
    assert words in check_sentence(bring_in(*folders, tmp_path / "c.zarr"))
    assert not (tmp_path / "c.zarr").exists()


# What the commands after it warn of


def another_set(patterns, _photos):
    shutil.rmtree(patterns)
    others = [p for axis in (0, 1) for p in fringes(SIZE, axis, [32, 8, 4], 4)][:COUNT]
    write_pictures(patterns, others)


def another_order(_patterns, photos):
    """Rows before columns, in place of columns before rows."""
    for number in range(10):
        one, other = photos / f"p{number}.png", photos / f"p{number + 10}.png"
        one.rename(photos / "away")
        other.rename(one)
        (photos / "away").rename(other)


def gamma(_patterns, photos):
    change(photos, as_gamma)


def moved_midway(_patterns, photos):
    change(photos, lambda photo, number: np.roll(photo, 3 * (number >= 11), axis=1)[6:18, 6:18])


def upside_down(patterns, _photos):
    change(patterns, lambda picture, _: picture[::-1])


def turned(patterns, _photos):
    change(patterns, lambda picture, _: picture[::-1, ::-1])


def mirrored(patterns, _photos):
    change(patterns, lambda picture, _: picture[:, ::-1])


@pytest.mark.parametrize(
    ("spoil", "command", "words"),
    [
        (another_set, "correspond", "the photos do not follow the patterns"),
        (another_set, "separate", "do not sum to one white"),
        (another_order, "correspond", "the photos of rows and of columns are swapped"),
        (gamma, "correspond", "projector or camera is not linear"),
        (gamma, "separate", "projector or camera is not linear"),
        (moved_midway, "reconstruct", "something moved"),
        (gamma, "reconstruct", "projector or camera is not linear"),
        (another_set, "reconstruct", "wrong: "),
        (upside_down, "correspond", "q runs against the camera's rows: the patterns stand upside"),
        (turned, "correspond", "rows and columns: the patterns are turned by 180 degrees"),
        (mirrored, "correspond", "q runs against the camera's columns: the patterns are mirrored"),
    ],
)
def test_later_commands_warn(spoil, command, words, folders, tmp_path):
    spoil(*folders)
    capture = tmp_path / "c.zarr"
    check_done(bring_in(*folders, capture))
    assert words in told(capture, command)


def test_no_inverses_and_no_white_are_told_where_they_are_needed(pictures, good, tmp_path):
    patterns = write_pictures(tmp_path / "p", pictures[:20:2])
    photos = [read_picture(good[1] / f"p{number}.png") for number in range(0, 20, 2)]
    capture = tmp_path / "c.zarr"
    check_done(bring_in(patterns, write_pictures(tmp_path / "f", photos), capture))
    assert told(capture, "correspond") == ""
    ran = run_nearfar("separate", tmp_path / "out", "--capture", capture)
    assert "2 of two levels without inverses are too few" in check_sentence(ran)


@pytest.mark.parametrize("command", ["correspond", "separate"])
def test_good_photos_are_not_warned_of(command, good, tmp_path):
    check_done(bring_in(*good, tmp_path / "c.zarr"))
    assert told(tmp_path / "c.zarr", command) == ""


def test_dark_photos_are_noisy_and_not_wrong(pictures, world, good, tmp_path):
    photos = write_pictures(tmp_path / "dark", photograph(world * 0.04, pictures))
    check_done(bring_in(good[0], photos, tmp_path / "c.zarr"))
    for command in ("correspond", "separate"):
        assert "do not sum" not in told(tmp_path / "c.zarr", command)
