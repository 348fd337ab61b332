"""Films: their pictures are large enough, and whole."""

import sys

import numpy as np
import pytest

from nearfar.errors import MissingPackageError, StorageError
from nearfar.files.video import SMALLEST_ROWS, enlarged, new_film


@pytest.mark.parametrize("shape", [(30, 42), (1, 7, 3), (481, 641, 3), (600, 800)])
def test_pixels_of_a_film_are_squares_and_sides_are_even(shape):
    picture = np.random.default_rng(0).integers(0, 256, shape, dtype=np.uint8)
    large = enlarged(picture)
    assert large.shape[0] >= SMALLEST_ROWS
    assert large.shape[2] == 3
    assert all(side % 2 == 0 for side in large.shape[:2])
    factor = large.shape[0] // shape[0]
    np.testing.assert_array_equal(
        large[: factor * shape[0] : factor, : factor * shape[1] : factor],
        np.broadcast_to(np.atleast_3d(picture), (*shape[:2], 3)),
    )


def test_a_film_says_what_it_needs(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "cv2", None)
    with (
        pytest.raises(MissingPackageError, match=r"nearfar\[film\]"),
        new_film(tmp_path / "x.mp4", 5),
    ):
        pass


def test_a_film_that_cannot_be_written_is_told(tmp_path):
    pytest.importorskip("cv2")
    picture = np.zeros((30, 42), np.uint8)
    with (
        pytest.raises(StorageError, match=r"x\.mp4"),
        new_film(tmp_path / "nowhere" / "x.mp4", 5) as add,
    ):
        add(picture)
