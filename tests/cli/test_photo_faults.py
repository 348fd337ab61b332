"""Photos that cannot be used: one sentence that names it, and status 1."""

import shutil
from pathlib import Path

import imagecodecs
import numpy as np
import pytest

from tests.cli.conftest import (
    BY_PAPER,
    Job,
    Untouched,
    check_done,
    check_refused,
    run_nearfar,
)


def photos_of(job: Job) -> list[Path]:
    """List the job's photos, to spoil them."""
    return sorted(job.photos.iterdir())


# Each spoils the photos and returns what the sentence must say.


def _too_few(photos: list[Path]) -> tuple[str, ...]:
    photos[-1].unlink()
    return (f"{len(photos) - 1} photos", f"{len(photos)} patterns")


def _too_many(photos: list[Path]) -> tuple[str, ...]:
    shutil.copy(photos[0], photos[0].with_name("z.npy"))
    return (f"{len(photos) + 1} photos", f"{len(photos)} patterns")


def _none_at_all(photos: list[Path]) -> tuple[str, ...]:
    for photo in photos:
        photo.unlink()
    return ("0 photos",)


def _raw_photos(photos: list[Path]) -> tuple[str, ...]:
    for photo in photos:
        photo.rename(photo.with_suffix(".dng"))
    return ("pattern-00000.dng", "no camera raw file")


def _another_size(photos: list[Path]) -> tuple[str, ...]:
    np.save(photos[7], np.zeros((9, 9), dtype=np.uint16))
    return (photos[7].name, "9x9", "8x9")


def _another_type(photos: list[Path]) -> tuple[str, ...]:
    np.save(photos[7], np.load(photos[7]).astype(np.uint8))
    return (photos[7].name, "uint8", "uint16")


def _other_channels(photos: list[Path]) -> tuple[str, ...]:
    np.save(photos[7], np.repeat(np.load(photos[7])[..., None], 3, axis=2))
    return (photos[7].name, "3 channels")


def _truncated(photos: list[Path]) -> tuple[str, ...]:
    photos[5].write_bytes(photos[5].read_bytes()[:-20])
    return (str(photos[5]), "cut short")


def _truncated_png(photos: list[Path]) -> tuple[str, ...]:
    whole = imagecodecs.png_encode(np.load(photos[5]))
    photos[5].unlink()
    cut = photos[5].with_suffix(".png")
    cut.write_bytes(whole[: len(whole) // 2])
    return (str(cut), "cut short")


def _no_picture(photos: list[Path]) -> tuple[str, ...]:
    photos[5].write_text("hello")
    return (str(photos[5]), "no picture")


def _empty_file(photos: list[Path]) -> tuple[str, ...]:
    photos[5].write_bytes(b"")
    return (str(photos[5]), "empty")


def _pickled(photos: list[Path]) -> tuple[str, ...]:
    np.save(photos[5], np.array([{"a": 1}], dtype=object), allow_pickle=True)
    return (str(photos[5]),)


def _dangling_link(photos: list[Path]) -> tuple[str, ...]:
    photos[5].unlink()
    photos[5].symlink_to("nowhere.npy")
    return (str(photos[5]),)


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
    return ("black",)


def _lens_cap_on(photos: list[Path]) -> tuple[str, ...]:
    for photo in photos:
        np.save(photo, np.full((8, 9), 700, dtype=np.uint16))
    return (photos[0].name.split("-")[0],)


def _out_of_order(photos: list[Path]) -> tuple[str, ...]:
    for number, photo in enumerate(photos[::-1]):
        photo.rename(photo.with_name(f"a{number}.npy"))
    return ("out of order",)


@pytest.mark.parametrize(
    "spoil",
    [
        _too_few,
        _too_many,
        _none_at_all,
        _raw_photos,
        _another_size,
        _another_type,
        _other_channels,
        _truncated,
        _truncated_png,
        _no_picture,
        _empty_file,
        _pickled,
        _dangling_link,
        _not_a_number,
        _all_black,
        _lens_cap_on,
        _out_of_order,
    ],
)
def test_photos_that_cannot_be_used(job: Job, untouched: Untouched, tmp_path: Path, spoil):
    words = spoil(photos_of(job))
    check_refused(untouched, ("import", job.plan, job.photos, tmp_path / "c.zarr"), *words)


def test_a_list_names_the_photos(job: Job, untouched: Untouched, tmp_path: Path):
    photos = photos_of(job)
    listed = tmp_path / "list.txt"
    command = ("import", job.plan, job.photos, tmp_path / "c.zarr", "--list", listed)
    check_refused(untouched, command, listed, "not there")
    listed.write_text("\n".join(photo.name for photo in photos[:-1]))
    check_refused(lambda: True, command, listed, f"{len(photos)} patterns")
    listed.write_text("\n".join(["# order", *(p.name for p in photos[:-1]), "gone.npy"]))
    check_refused(lambda: True, command, "gone.npy", f"line {len(photos) + 1}")
    listed.write_text("\n".join(photo.name for photo in photos))
    check_done(run_nearfar(*command))


def test_saturated_photos_are_a_warning(job: Job, tmp_path: Path):
    for photo in photos_of(job):
        np.save(photo, np.minimum(np.load(photo).astype(float) * 2.5, 65535).astype(np.uint16))
    ran = run_nearfar("import", job.plan, job.photos, tmp_path / "c.zarr", "--quiet")
    assert ran.status == 0
    assert ran.out == ""
    assert ran.err.startswith("warning: ")
    share = np.mean([np.load(photo) == 65535 for photo in job.photos.iterdir()])
    assert f"{share:.2%}" in ran.err
    assert ran.err.count("\n") == 1


@pytest.mark.parametrize("scale", [1e30, 1e-20])
def test_floats_of_any_unit_need_their_full_scale(
    job: Job, untouched: Untouched, tmp_path: Path, scale: float
):
    for photo in photos_of(job):
        np.save(photo, (np.load(photo) / 65535 * scale).astype(np.float32))
    capture, transport = tmp_path / "c.zarr", tmp_path / "t.zarr"
    arguments = ("import", job.plan, job.photos, capture)
    check_refused(untouched, arguments, "pattern-", "of a full scale of 1", "true full scale")
    check_done(run_nearfar(*arguments, "--full-scale", scale))
    check_done(run_nearfar("reconstruct", capture, transport, *BY_PAPER))
    check_done(run_nearfar("relight", transport, job.light, tmp_path / "x.npy"))
    known = np.load(job.truth)[..., 0].reshape(8, 9, -1) @ np.load(job.light).ravel()
    np.testing.assert_allclose(np.load(tmp_path / "x.npy"), known, atol=0.01 * known.max())


def test_whole_numbers_that_are_next_to_nothing_of_full_scale(
    finished: Job, untouched: Untouched, tmp_path: Path
):
    arguments = ("import", finished.plan, finished.photos, tmp_path / "c.zarr")
    check_refused(untouched, (*arguments, "--full-scale", 1e30), "of the white pattern", "expose")


@pytest.mark.parametrize("scale", ["0", "-5", "nan", "inf", "100"])
def test_a_full_scale_that_cannot_be(
    finished: Job, untouched: Untouched, tmp_path: Path, scale: str
):
    out = tmp_path / "c.zarr"
    check_refused(
        untouched,
        ("import", finished.plan, finished.photos, out, "--full-scale", scale),
        "full scale",
    )


def test_full_scale_of_fourteen_bits(job: Job, tmp_path: Path):
    for photo in photos_of(job):
        np.save(photo, np.load(photo) >> 2)
    for name, options in {"low": (), "right": ("--full-scale", 16383)}.items():
        capture, transport = tmp_path / f"{name}.zarr", tmp_path / f"{name}-t.zarr"
        check_done(run_nearfar("import", job.plan, job.photos, capture, *options))
        check_done(run_nearfar("reconstruct", capture, transport, *BY_PAPER))
        check_done(run_nearfar("relight", transport, job.light, tmp_path / f"{name}.npy"))
    low, right = np.load(tmp_path / "low.npy"), np.load(tmp_path / "right.npy")
    np.testing.assert_allclose(right, low * 65535 / 16383, atol=1e-4)


# Plans
