"""Camera raw files: the sensor's own numbers, cell by cell."""

import io

import numpy as np
import pytest
import tifffile

from nearfar.arrays import Size
from nearfar.capture import import_photos
from nearfar.errors import InputError, UnreadableFileError
from nearfar.files import list_pictures, read_linear, read_picture
from nearfar.files.mosaic import CELLS, bin_mosaic
from nearfar.files.raw import decode_raw
from nearfar.plan import paper_plan
from tests.absent import said_without

WHITE = 15520
COLOURS = {"R": 0, "G": 1, "B": 2}


def dng(mosaic, cell="RGGB", white=WHITE, black=600):
    """Write a digital negative: a TIFF with a mosaic."""
    tags = [
        (33421, "H", 2, (2, 2), True),
        (33422, "B", 4, bytes(COLOURS[c] for c in cell), True),
        (50706, "B", 4, bytes([1, 4, 0, 0]), True),
        (50708, "s", 0, "Test camera", True),
        (50714, "H", 1, black, True),
        (50717, "H", 1, white, True),
        (50721, "2i", 9, (1, 1, 0, 1, 0, 1, 0, 1, 1, 1, 0, 1, 0, 1, 0, 1, 1, 1), True),
        (50778, "H", 1, 21, True),
    ]
    file = io.BytesIO()
    tifffile.imwrite(file, mosaic, photometric=32803, metadata=None, software=None, extratags=tags)
    return file.getvalue()


@pytest.fixture
def mosaic():
    return np.random.default_rng(0).integers(600, 15000, (48, 64)).astype(np.uint16)


@pytest.mark.parametrize("cell", CELLS)
def test_a_raw_file_is_the_sensors_cells(mosaic, cell, tmp_path):
    photo = decode_raw(dng(mosaic, cell), "photo.dng")
    assert photo.white == WHITE
    assert photo.levels.shape == (24, 32, 3)
    places = {c: [i for i in range(4) if cell[i] == c] for c in "RGB"}
    for number, colour in enumerate("RGB"):
        cells = [mosaic[i // 2 :: 2, i % 2 :: 2].astype(float) for i in places[colour]]
        np.testing.assert_array_equal(photo.levels[..., number], np.rint(np.mean(cells, axis=0)))
    path = tmp_path / "photo.dng"
    path.write_bytes(dng(mosaic, cell))
    np.testing.assert_array_equal(read_picture(path), photo.levels)
    np.testing.assert_allclose(read_linear(path), photo.levels / WHITE, rtol=1e-6)
    assert list_pictures(tmp_path) == [path]


def test_levels_beyond_white_are_white(mosaic):
    mosaic[:8] = 16383
    assert decode_raw(dng(mosaic), "photo.dng").levels.max() == WHITE


def test_raw_photos_are_imported_by_their_own_full_scale(mosaic, tmp_path):
    plan = paper_plan(Size(4, 4), 1, Size(1, 1))
    paths = []
    for i in range(len(plan.patterns)):
        light = plan.draw(i).mean() / 255
        paths.append(tmp_path / f"photo{i}.dng")
        paths[-1].write_bytes(dng((600 + light * (mosaic - 600)).astype(np.uint16)))
    capture = import_photos(plan, paths, tmp_path / "c.zarr").capture
    assert capture.full_scale == WHITE
    assert capture.channels == 3


def test_what_is_no_raw_file_is_a_sentence(mosaic):
    with pytest.raises(UnreadableFileError, match=r"photo\.nef is no camera raw file"):
        decode_raw(b"nothing of the kind", "photo.nef")
    whole = dng(mosaic)
    with pytest.raises(UnreadableFileError, match=r"photo\.dng is no camera raw file"):
        decode_raw(whole[: len(whole) // 2], "photo.dng")
    with pytest.raises(InputError, match="no mosaic 'RGBW'"):
        bin_mosaic(mosaic, "RGBW")


def test_without_its_package_there_is_a_sentence():
    said = said_without("rawpy", "from nearfar.files.raw import decode_raw\ndecode_raw(b'', 'x')")
    assert "pip install 'nearfar[raw]'" in said
