"""Captures: what is written is read, and nothing that does not fit is written."""

import json
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from nearfar.arrays import Size
from nearfar.capture import open_capture, white_and_black, write_capture, writing
from nearfar.errors import (
    ExistingOutputError,
    InputError,
    MissingFileError,
    PlanError,
    UnreadableFileError,
)
from nearfar.files.stores import create_store
from nearfar.plan import Plan, paper_plan
from tests.metadata import change_attributes

PLAN = paper_plan(Size(4, 5), 1, Size(1, 1))
COUNT = len(PLAN.patterns)


def photos_of(plan: Plan, dtype: str = "uint16", channels: int | None = 3) -> list[NDArray[Any]]:
    generator = np.random.default_rng(0)
    top = 1.0 if dtype == "float32" else np.iinfo(dtype).max
    shape = (5, 6) if channels is None else (5, 6, channels)
    return [
        (plan.draw(i).mean() / 255 * top * generator.uniform(0.5, 0.9, shape)).astype(dtype)
        for i in range(len(plan.patterns))
    ]


@pytest.mark.parametrize("channels", [None, 1, 3])
@pytest.mark.parametrize("dtype", ["uint8", "uint16", "float32"])
def test_what_is_written_is_read(tmp_path: Path, dtype: str, channels: int | None) -> None:
    photos = photos_of(PLAN, dtype, channels)
    told: list[int] = []
    before = time.time()
    written = write_capture(
        PLAN,
        tmp_path / "a.zarr",
        iter(photos),
        rig={"camera": "simulated"},
        exposure=0.02,
        progress=lambda _what, share: told.append(round(share * len(PLAN.patterns))),
    )
    capture = open_capture(tmp_path / "a.zarr")
    assert capture.plan == written.plan == PLAN
    assert capture.camera == Size(5, 6)
    assert capture.channels == (channels or 1)
    assert capture.photos.dtype == dtype
    assert capture.photos.shape[0] == COUNT
    assert capture.rig == {"camera": "simulated"}
    assert capture.exposure == 0.02
    assert told == list(range(1, COUNT + 1))
    assert np.all(np.diff([before, *capture.times, time.time()]) >= 0)
    stack = np.stack([np.atleast_3d(p) for p in photos])
    np.testing.assert_array_equal(np.asarray(capture.photos[:]), stack)
    scaled = stack.astype(np.float32) / np.float32(capture.full_scale)
    for chosen, rows in (
        (slice(None), slice(None)),
        ([3, 0], slice(1, 3)),
        (np.array([2]), slice(4, 9)),
    ):
        read = capture.read(chosen, rows)
        assert read.dtype == np.float32
        np.testing.assert_array_equal(read, scaled[chosen, rows])
    assert [p.name for p in tmp_path.iterdir()] == ["a.zarr"]


def test_full_scale_and_saturation(tmp_path: Path) -> None:
    photos = [np.minimum(p, 16383) for p in photos_of(PLAN)]
    capture = write_capture(PLAN, tmp_path / "a.zarr", photos, full_scale=16383)
    share = [np.mean(p >= 16383) for p in photos]
    np.testing.assert_array_equal(capture.saturated, share)
    assert capture.saturated_share == pytest.approx(np.mean(share))
    assert capture.saturated_share > 0
    assert capture.read([0]).max() == photos[0].max() / np.float32(16383)


def broken(index: int, change: Any) -> list[NDArray[Any]]:
    photos = photos_of(PLAN)
    photos[index] = change(photos[index])
    return photos


BAD: dict[str, tuple[Any, str]] = {
    "too few": (photos_of(PLAN)[:-1], f"only {COUNT - 1} photos for the {COUNT} patterns"),
    "too many": ([*photos_of(PLAN), photos_of(PLAN)[0]], f"more than {COUNT} photos"),
    "none": ([], "there are no photos"),
    "size": (broken(7, lambda p: p[1:]), r"photo 7 is 4x6 with 3 channels of uint16, but the f"),
    "dtype": (broken(7, lambda p: p.astype(np.float32)), "photo 7 is 5x6 .* float32, but"),
    "channels": (broken(7, lambda p: p[..., 0]), "photo 7 is 5x6 with 1 channel of"),
    "first": (broken(0, lambda p: p.astype(int)), "photo 0 is an array of int64"),
    "nan": (
        [
            np.where(i == 5, np.nan, p).astype("f4")
            for i, p in enumerate(photos_of(PLAN, "float32"))
        ],
        "photo 5 has 90 values of 90 that are NaN",
    ),
    "black": ([np.zeros((5, 6), np.uint8)] * COUNT, "white pattern, is no brighter"),
    "order": (photos_of(PLAN)[::-1], "out of order"),
}


@pytest.mark.parametrize("name", BAD)
def test_photos_that_do_not_fit_are_refused(tmp_path: Path, name: str) -> None:
    photos, words = BAD[name]
    old = write_capture(PLAN, tmp_path / "a.zarr", photos_of(PLAN))
    with pytest.raises(InputError, match=words):
        write_capture(PLAN, tmp_path / "a.zarr", photos, force=True)
    assert [p.name for p in tmp_path.iterdir()] == ["a.zarr"]
    np.testing.assert_array_equal(open_capture(tmp_path / "a.zarr").times, old.times)


def test_a_capture_without_white_that_is_all_the_same_is_refused(tmp_path: Path) -> None:
    stripes = tuple(p for p in PLAN.patterns if p.purpose == "correspondence")
    plan = PLAN.model_copy(update={"patterns": stripes})
    assert white_and_black(plan) is None
    assert white_and_black(PLAN) is not None
    for value, words in ((0, f"all {len(stripes)} photos are black"), (7, "are the same")):
        with pytest.raises(InputError, match=words):
            write_capture(
                plan, tmp_path / "a.zarr", [np.full((5, 6), value, np.uint8)] * len(stripes)
            )
    assert list(tmp_path.iterdir()) == []


def test_values_above_full_scale_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"photo 0 .*above the full scale of 16383"):
        write_capture(PLAN, tmp_path / "a.zarr", photos_of(PLAN), full_scale=16383)
    for bad in (0, -1, float("nan"), float("inf")):
        with pytest.raises(InputError, match="full scale"):
            write_capture(PLAN, tmp_path / "a.zarr", photos_of(PLAN), full_scale=bad)
    assert list(tmp_path.iterdir()) == []


def never() -> Iterator[NDArray[Any]]:
    pytest.fail("no photo must be asked for")
    yield np.zeros(0)


def test_what_can_be_refused_is_refused_before_any_photo(tmp_path: Path) -> None:
    theory = paper_plan(Size(4, 5), 1, Size(1, 1), offset="none")
    with pytest.raises(PlanError, match="complex"):
        write_capture(theory, tmp_path / "a.zarr", never())
    with pytest.raises(MissingFileError):
        write_capture(PLAN, tmp_path / "no" / "a.zarr", never())
    (tmp_path / "a.zarr").write_text("old")
    with pytest.raises(ExistingOutputError):
        write_capture(PLAN, tmp_path / "a.zarr", never())


def test_a_photo_is_on_the_disk_before_the_next_is_asked_for(tmp_path: Path) -> None:
    def watched() -> Iterator[NDArray[Any]]:
        for i, photo in enumerate(photos_of(PLAN)):
            found = {p.name for p in tmp_path.rglob("c.*") if "partial" not in p.name}
            assert found == {f"c.{j}.0.0.0" for j in range(i)}
            yield photo

    write_capture(PLAN, tmp_path / "a.zarr", watched())


def test_a_fault_of_the_camera_leaves_nothing(tmp_path: Path) -> None:
    def failing() -> Iterator[NDArray[Any]]:
        yield photos_of(PLAN)[0]
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_capture(PLAN, tmp_path / "a.zarr", failing())
    assert list(tmp_path.iterdir()) == []


KILLED = """
import sys, time
from pathlib import Path
import numpy as np
from nearfar.arrays import Size
from nearfar.capture import write_capture
from nearfar.plan import paper_plan
def photos():
    yield np.full((5, 6), 9, np.uint8)
    print("writing", flush=True)
    time.sleep(60)
write_capture(paper_plan(Size(4, 5), 1, Size(1, 1)), Path(sys.argv[1]), photos(), force=True)
"""


def test_a_killed_capture_leaves_the_old(tmp_path: Path) -> None:
    write_capture(PLAN, tmp_path / "a.zarr", photos_of(PLAN))
    command = [sys.executable, "-c", KILLED, str(tmp_path / "a.zarr")]
    with subprocess.Popen(command, stdout=subprocess.PIPE) as running:
        assert running.stdout is not None
        running.stdout.readline()
        running.send_signal(signal.SIGKILL)
    assert open_capture(tmp_path / "a.zarr").read(slice(None)).shape == (COUNT, 5, 6, 3)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"version": 2}, "is a nearfar capture of version 2, this nearfar reads version 1"),
        ({"format": "nearfar transport"}, "is not a nearfar capture but a nearfar transport"),
        ({"plan": None}, r"the plan in .*a\.zarr is not a nearfar plan"),
        ({"plan": {"format": "nearfar plan", "version": 9}}, "is a plan of version 9"),
        (
            {
                "plan": json.loads(
                    paper_plan(Size(4, 5), 1, Size(1, 1), correspondence="none").to_json()
                )
            },
            rf"a\.zarr is damaged: it has {COUNT} photos for the 4 patterns",
        ),
        ({"full_scale": "x"}, "does not describe photos"),
        ({"full_scale": 0}, "does not describe photos"),
        ({"rig": 3}, "does not describe photos"),
        ({"exposure": -1}, "does not describe photos"),
        ({"alarms": "one"}, "does not describe photos"),
        ({"conditions": [1]}, "does not describe photos"),
        ({"conditions": {"heat": [1.0]}}, "does not describe photos"),
        ({"conditions": {"heat": ["1"] * COUNT}}, "does not describe photos"),
    ],
)
def test_a_capture_that_does_not_fit_gets_a_sentence(
    tmp_path: Path, changes: dict[str, Any], words: str
) -> None:
    write_capture(PLAN, tmp_path / "a.zarr", photos_of(PLAN))
    change_attributes(tmp_path / "a.zarr", **changes)
    with pytest.raises(UnreadableFileError, match=words):
        open_capture(tmp_path / "a.zarr")


def test_a_damaged_photo_gets_a_sentence(tmp_path: Path) -> None:
    path = tmp_path / "a.zarr"
    capture = write_capture(PLAN, path, photos_of(PLAN))
    chunk = path / "photos" / "c.4.0.0.0"
    data = bytearray(chunk.read_bytes())
    data[len(data) // 2] ^= 1
    chunk.write_bytes(data)
    with pytest.raises(UnreadableFileError, match=r"a\.zarr is damaged: array photos"):
        capture.read(slice(None), slice(0, 1))
    chunk.unlink()
    with pytest.raises(UnreadableFileError, match=r"photos/c\.4\.0\.0\.0 is missing"):
        capture.read([4])
    with pytest.raises(InputError, match="no such part"):
        capture.read([COUNT])
    for name in ("saturated", "time", "photos"):
        (path / name / "zarr.json").unlink()
        with pytest.raises(UnreadableFileError, match=rf"array {name}"):
            open_capture(path)


def test_rows_of_large_photos_are_read_without_the_rest(tmp_path: Path, monkeypatch) -> None:
    photos = list(photos_of(PLAN))
    height, row = photos[0].shape[0], photos[0][0].nbytes
    assert height % 3
    monkeypatch.setattr(writing, "CHUNK_BYTES", 3 * row + 1)
    path = tmp_path / "a.zarr"
    capture = write_capture(PLAN, path, photos)
    assert (path / "photos" / "c.0.1.0.0").exists()
    np.testing.assert_array_equal(
        capture.read(slice(None)) * capture.full_scale, np.stack([np.atleast_3d(p) for p in photos])
    )
    rows = capture.read([4], slice(3, 5))
    (path / "photos" / "c.4.0.0.0").unlink()
    np.testing.assert_array_equal(capture.read([4], slice(3, 5)), rows)
    with pytest.raises(UnreadableFileError, match=r"photos/c\.4\.0\.0\.0 is missing"):
        capture.read([4], slice(2, 5))


def test_other_things_are_no_captures(tmp_path: Path) -> None:
    with pytest.raises(MissingFileError):
        open_capture(tmp_path / "no.zarr")
    create_store(tmp_path / "t.zarr", "nearfar transport", 1)
    with pytest.raises(UnreadableFileError, match="but a nearfar transport"):
        open_capture(tmp_path / "t.zarr")
