"""Photos taken elsewhere, paired with the patterns of a plan."""

from pathlib import Path

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.capture import import_photos, pair, pairing
from nearfar.errors import InputError, MissingFileError, PlanError, UnreadableFileError
from nearfar.files import encode_png, read_picture, write_picture
from nearfar.plan import paper_plan

PLAN = paper_plan(Size(4, 5), 1, Size(1, 1))
COUNT = len(PLAN.patterns)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    folder = tmp_path / "photos"
    folder.mkdir()
    for i in range(COUNT):
        photo = np.full((5, 6), 40 * PLAN.draw(i).mean(), np.uint16) + np.uint16(i)
        (folder / f"img{i + 1}.png").write_bytes(encode_png(photo))
    (folder / "readme.txt").write_text("not a photo")
    (folder / ".hidden.png").write_text("not a photo")
    return folder


def test_photos_are_imported_in_natural_order(folder: Path, tmp_path: Path) -> None:
    photos = pair(PLAN, folder)
    assert [p.name for p in photos] == [f"img{i + 1}.png" for i in range(COUNT)]
    summary = import_photos(PLAN, photos, tmp_path / "a.zarr", full_scale=16383)
    assert summary.capture.full_scale == 16383
    assert str(summary.first) == ("pattern 0 (cosine of frequency (-1/2, -1/2)) <- img1.png")
    assert str(summary.last) == f"pattern {COUNT - 1} (black column 4) <- img{COUNT}.png"
    assert "inverse" in pairing(PLAN, 1, photos[1]).pattern
    for i, photo in enumerate(photos):
        np.testing.assert_array_equal(
            np.asarray(summary.capture.photos[i])[..., 0], read_picture(photo)
        )


def test_a_list_names_the_photos(folder: Path, tmp_path: Path) -> None:
    names = [f"img{COUNT - i}.png" for i in range(COUNT)]
    listed = tmp_path / "list.txt"
    listed.write_text("# my photos\n\n" + "\n".join(f"  {name} " for name in names) + "\n\n")
    assert [p.name for p in pair(PLAN, folder, listed)] == names
    listed.write_text("\ufeff" + "\r\n".join(names), encoding="utf-8")
    assert [p.name for p in pair(PLAN, folder, listed)] == names
    listed.write_text("\n".join(names[1:]))
    with pytest.raises(InputError, match=rf"list\.txt has {COUNT - 1} photos.* {COUNT} patterns"):
        pair(PLAN, folder, listed)
    listed.write_text("\n# one\nno.png\n")
    with pytest.raises(MissingFileError, match=r"no\.png is not there, which line 3 of .*list"):
        pair(PLAN, folder, listed)
    listed.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(UnreadableFileError, match="cannot be read as a list"):
        pair(PLAN, folder, listed)
    with pytest.raises(MissingFileError, match=r"gone\.txt"):
        pair(PLAN, folder, tmp_path / "gone.txt")


def test_a_count_that_does_not_match_is_refused(folder: Path, tmp_path: Path) -> None:
    (folder / "img5.png").unlink()
    with pytest.raises(
        InputError,
        match=rf"has {COUNT - 1} photos \(first img1\.png, last img{COUNT}\.png\), but the plan "
        rf"has {COUNT} patterns",
    ):
        pair(PLAN, folder)
    other = tmp_path / "jpegs"
    other.mkdir()
    with pytest.raises(InputError, match="has 0 photos"):
        pair(PLAN, other)
    (other / "a.JPG").write_bytes(b"")
    with pytest.raises(InputError, match=r"1 files that end in \.jpg"):
        pair(PLAN, other)
    with pytest.raises(MissingFileError):
        pair(PLAN, tmp_path / "nowhere")
    with pytest.raises(PlanError, match="complex"):
        pair(paper_plan(Size(4, 5), 1, Size(1, 1), offset="none"), folder)


def test_a_photo_that_does_not_fit_is_named_and_nothing_left(folder: Path, tmp_path: Path) -> None:
    photos = pair(PLAN, folder)
    whole = photos[9].read_bytes()
    changes = [
        (whole[:-20], UnreadableFileError),
        (encode_png(np.ones((6, 6), np.uint16)), InputError),
        (encode_png(np.ones((5, 6), np.uint8)), InputError),
        (encode_png(np.full((5, 6), 20000, np.uint16)), InputError),
    ]
    for data, error in changes:
        photos[9].write_bytes(data)
        with pytest.raises(error, match=r"img10\.png"):
            import_photos(PLAN, photos, tmp_path / "a.zarr", full_scale=16383)
    photos[9].unlink()
    with pytest.raises(MissingFileError, match=r"img10\.png"):
        import_photos(PLAN, photos, tmp_path / "a.zarr")
    assert [p.name for p in tmp_path.iterdir()] == ["photos"]


def test_photos_out_of_order_are_refused(folder: Path, tmp_path: Path) -> None:
    photos = pair(PLAN, folder)
    shifted = photos[1:] + photos[:1]
    with pytest.raises(InputError, match=r"photo \d+ \(img\d+\.png\), of the white pattern, is no"):
        import_photos(PLAN, shifted, tmp_path / "a.zarr")
    with pytest.raises(InputError, match=r"\(img\d+\.png\).*out of order"):
        import_photos(PLAN, photos[::-1], tmp_path / "a.zarr")
    assert [p.name for p in tmp_path.iterdir()] == ["photos"]


def test_float_photos_keep_their_negatives(tmp_path: Path) -> None:
    folder = tmp_path / "photos"
    folder.mkdir()
    for i in range(COUNT):
        image = np.full((5, 6, 3), PLAN.draw(i).mean() / 255 - 0.01, np.float32)
        write_picture(folder / f"{i}.{('exr', 'npy', 'tiff')[i % 3]}", image)
    capture = import_photos(PLAN, pair(PLAN, folder), tmp_path / "a.zarr").capture
    assert capture.read(slice(None)).min() == np.float32(-0.01)
    assert capture.channels == 3
