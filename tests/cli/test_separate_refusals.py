"""``nearfar separate``: photos, numbers, patterns and options that it refuses."""

import shutil
from pathlib import Path

import numpy as np
import pytest

from tests.cli.conftest import GRID, check_done, check_refused, check_sentence, run_nearfar


def _too_few(photos: list[Path]) -> tuple[str, ...]:
    photos[-1].unlink()
    photos[-2].unlink()
    return ("7 photos", "8 patterns", "under black")


def _too_many(photos: list[Path]) -> tuple[str, ...]:
    shutil.copy(photos[0], photos[0].with_name("z.npy"))
    return ("10 photos", "8 patterns")


def _none_at_all(photos: list[Path]) -> tuple[str, ...]:
    for photo in photos:
        photo.unlink()
    return ("0 photos",)


def _another_size(photos: list[Path]) -> tuple[str, ...]:
    np.save(photos[7], np.zeros((9, 9), dtype=np.uint16))
    return (photos[7].name, "9x9", "8x9")


def _another_type(photos: list[Path]) -> tuple[str, ...]:
    np.save(photos[7], np.load(photos[7]).astype(np.uint8))
    return (photos[7].name, "uint8")


def _truncated(photos: list[Path]) -> tuple[str, ...]:
    photos[5].write_bytes(photos[5].read_bytes()[:-20])
    return (str(photos[5]), "cut short")


def _not_a_number(photos: list[Path]) -> tuple[str, ...]:
    for photo in photos:
        np.save(photo, np.load(photo).astype(np.float32) / 65535)
    spoilt = np.load(photos[3])
    spoilt[0, :2] = np.nan, np.inf
    np.save(photos[3], spoilt)
    return (str(photos[3]), "2 values")


def _all_black(photos: list[Path]) -> tuple[str, ...]:
    for photo in photos:
        np.save(photo, np.zeros((8, 9), dtype=np.uint16))
    return ("black", photos[0].parent)


def _lens_cap_on(photos: list[Path]) -> tuple[str, ...]:
    for photo in photos:
        np.save(photo, np.full((8, 9), 700, dtype=np.uint16))
    return ("the same", photos[0].parent)


def _black_first(photos: list[Path]) -> tuple[str, ...]:
    photos[-1].rename(photos[-1].with_name("a.npy"))
    return ("no brighter", photos[-2].name)


@pytest.mark.parametrize(
    "spoil",
    [
        _too_few,
        _too_many,
        _none_at_all,
        _another_size,
        _another_type,
        _truncated,
        _not_a_number,
        _all_black,
        _lens_cap_on,
        _black_first,
    ],
)
def test_photos_that_cannot_be_used(tmp_path: Path, shot, untouched, spoil):
    photos = shot()
    words = spoil(sorted(photos.iterdir()))
    check_refused(untouched, ("separate", tmp_path / "out", "--photos", photos), *words)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--black-level", "1"), "black level"),
        (("--black-level", "-0.1"), "black level"),
        (("--black-level", "nan"), "black level"),
        (("--black-level", "0.1"), "leave out --black-level"),
        (("--full-scale", "0"), "full scale"),
        (("--full-scale", "100"), "full scale of 100"),
        (("--side", "0"), "squares of 0"),
        (("--side", "3", "--step", "4"), "--step 4"),
        (("--side", "3", "--step", "1"), "18 patterns"),
        (("--pattern", "sinusoid", "--shifts", "2"), "--shifts 2"),
        (("--pattern", "sinusoid", "--shifts", "5"), "10 patterns"),
        (("--pattern", "any", "--ambient", "gone.npy"), "gone.npy"),
    ],
)
def test_numbers_that_do_not_fit_the_photos(tmp_path: Path, shot, untouched, options, words):
    check_refused(untouched, ("separate", tmp_path / "out", "--photos", shot(), *options), words)


def test_only_one_dark_photo(tmp_path: Path, shot, untouched):
    photos = shot()
    both = ("--ambient", photos / "pattern-00007.npy", "--black", photos / "pattern-00008.npy")
    check_refused(untouched, ("separate", tmp_path / "out", "--photos", photos, *both), "only one")
    # With a dark photo apart, the one under black is a photo too many.
    np.save(tmp_path / "dark.npy", np.zeros((8, 9), dtype=np.uint16))
    apart = (tmp_path / "out", "--photos", photos, "--ambient", tmp_path / "dark.npy")
    check_refused(lambda: True, ("separate", *apart), "9 photos", "8 patterns")
    for photo in sorted(photos.iterdir())[1:]:
        photo.unlink()
    one = (tmp_path / "out", "--photos", photos, "--pattern", "any")
    check_refused(lambda: True, ("separate", *one), photos, "1 photo:")


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--side", "9"), "--side 9"),
        (("--pattern", "sinusoid", "--period", "17"), "--period 17"),
        (("--native", "15x20"), "--native"),
    ],
)
def test_patterns_that_do_not_fit(tmp_path: Path, untouched, options, words):
    check_refused(untouched, ("separate", tmp_path / "out", "--export", *GRID, *options), words)


def test_a_truth_that_does_not_fit(finished, tmp_path: Path):
    command = (tmp_path / "out", "--rig", finished.truth, *GRID)
    other = tmp_path / "other.zarr"
    check_done(run_nearfar("render", "corner", other, "--projector", "16x16"))
    check_refused(lambda: True, ("separate", *command, "--truth", other), "16x16", "8x9")
    check_refused(lambda: True, ("separate", "x", "--rig", other, *GRID), "16x20", "16x16")


@pytest.mark.parametrize(
    "arguments",
    [
        ("out",),
        ("out", "--rig", "corner", "--export", *GRID),
        ("out", "--rig", "corner", "--photos", "dir"),
        ("out", "--export"),
        ("out", "--rig", "stored.npy"),
        ("out", "--rig", "corner", "--pattern", "any"),
        ("out", "--rig", "corner", "--period", "4"),
        ("out", "--rig", "corner", "--pattern", "sinusoid", "--side", "4"),
        ("out", "--rig", "corner", "--black-level", "0.1"),
        ("out", "--rig", "corner", "--ambient", "a.npy"),
        ("out", "--rig", "corner", "--native", "50x70"),
        ("out", "--export", *GRID, "--truth", "t.zarr"),
        ("out", "--export", *GRID, "--json"),
        ("out", "--photos", "dir", "--scale", "2"),
    ],
)
def test_wrong_usage(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, arguments):
    monkeypatch.chdir(tmp_path)
    ran = run_nearfar("separate", *arguments)
    assert ran.status == 2
    assert ran.err
    assert "Traceback" not in ran.err
    assert not list(tmp_path.iterdir())


def test_one_pixel_shows_no_pattern(tmp_path: Path):
    path = tmp_path / "t.npy"
    np.save(path, np.ones((3, 3, 1, 1), dtype=np.float32))
    for pattern in ("checkerboard", "sinusoid"):
        ran = run_nearfar("separate", tmp_path / "out", "--rig", path, "--pattern", pattern)
        check_sentence(ran, "1x1 shows no pattern")
