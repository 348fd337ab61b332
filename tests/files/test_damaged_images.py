"""Pictures that are damaged, or of a kind that is not read, get a sentence."""

import io
import struct
import subprocess
import sys
from pathlib import Path

import imagecodecs
import numpy as np
import OpenEXR  # type: ignore[import-not-found]
import pytest
import tifffile

from nearfar.arrays import Size
from nearfar.errors import (
    InputError,
    MissingFileError,
    UnreadableFileError,
)
from nearfar.files import (
    encode_png,
    read_picture,
)
from tests.files.pictures import (
    PALETTE,
    TIFF_WAYS,
    bmp_bytes,
    exr_bytes,
    npy_bytes,
    png_bytes,
    random_pixels,
    tiff_bytes,
    write,
)


def test_a_damaged_png_says_nothing_of_its_own(tmp_path: Path) -> None:
    """What libpng has to say reaches nobody: in a process of its own, as pytest hears logs."""
    path = write(tmp_path, "a.png", png_bytes(8, 0, Size(2, 3), bytes(99)))
    script = f"""
import logging
from pathlib import Path
from nearfar.files import read_picture
from nearfar.errors import NearfarError
try: read_picture(Path({str(path)!r}))
except NearfarError as error: print(error)
"""
    ran = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert ran.stderr == ""


@pytest.mark.parametrize("back", [0, 1])
def test_a_tiff_whose_pages_run_in_a_circle_is_refused(tmp_path: Path, back: int) -> None:
    pixels = random_pixels("uint8", (2, 5, 7))
    data = bytearray(tiff_bytes(pixels, photometric="minisblack"))
    with tifffile.TiffFile(io.BytesIO(data)) as tiff:
        first, last = (page.offset for page in tiff.pages)
    (tags,) = struct.unpack_from("<H", data, last)
    struct.pack_into("<I", data, last + 2 + 12 * tags, (first, last)[back])
    with pytest.raises(UnreadableFileError, match=r"a\.tif is damaged"):
        read_picture(write(tmp_path, "a.tif", bytes(data)))


def whole_files() -> dict[str, bytes]:
    small, colour = random_pixels("uint16", (20, 30)), random_pixels("float32", (20, 30, 3))
    tiffs = {f"tiff {way}": tiff_bytes(small, **way) for way in TIFF_WAYS}
    exrs = {
        f"exr {c}": exr_bytes({"RGB": colour}, compression=OpenEXR.Compression(c)) for c in range(6)
    }
    planes = np.moveaxis(colour, 2, 0).copy()
    return {
        "png": encode_png(small),
        "png colour": encode_png(random_pixels("uint8", (20, 30, 3))),
        "npy": npy_bytes(colour),
        "bmp": imagecodecs.bmp_encode(random_pixels("uint8", (20, 30, 3))),
        "bmp palette": bmp_bytes((3, 4), 4, b"\x01\x10\0\0" * 3, PALETTE),
        "tiff planes": tiff_bytes(planes, photometric="rgb", planarconfig="separate"),
        **tiffs,
        **exrs,
    }


@pytest.mark.parametrize(("name", "data"), whole_files().items(), ids=whole_files().keys())
def test_a_file_cut_anywhere_is_refused(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], name: str, data: bytes
) -> None:
    lengths = [*range(0, len(data), max(1, len(data) // 60)), *range(len(data) - 9, len(data))]
    for length in lengths:
        path = write(tmp_path, "cut.bin", data[:length])
        with pytest.raises(UnreadableFileError, match=r"cut\.bin") as caught:
            read_picture(path)
        assert "\n" not in str(caught.value)
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize(("name", "data"), whole_files().items(), ids=whole_files().keys())
def test_a_changed_byte_gives_a_picture_or_a_sentence(
    tmp_path: Path, name: str, data: bytes
) -> None:
    for position in range(0, len(data), max(1, len(data) // 60)):
        for bit in (1, 128):
            changed = bytearray(data)
            changed[position] ^= bit
            path = write(tmp_path, "a.bin", bytes(changed))
            try:
                read_picture(path)
            except (UnreadableFileError, InputError) as error:
                assert str(path) in str(error)


def test_missing_strips_and_rows_are_never_zeros(tmp_path: Path) -> None:
    pixels = random_pixels("uint16", (20, 30)) | 1
    data = bytearray(tiff_bytes(pixels, rowsperstrip=5, compression="zlib"))
    with tifffile.TiffFile(io.BytesIO(data)) as tiff:
        tag = tiff.pages.first.tags["StripByteCounts"]
    for i in range(4):
        changed = data[:]
        size = tag.valuebytecount // 4
        changed[tag.valueoffset + i * size : tag.valueoffset + (i + 1) * size] = bytes(size)
        with pytest.raises(UnreadableFileError):
            read_picture(write(tmp_path, "a.tif", bytes(changed)))


BAD_FILES: dict[str, tuple[bytes, str]] = {
    "empty.png": (b"", "is empty"),
    "text.png": (b"not a picture", "is no picture"),
    "old.jpg": (b"\xff\xd8\xff\xe0" + bytes(99), "is a JPEG, which has 8 bits and is not linear"),
    "still.gif": (
        b"GIF89a" + bytes(99),
        "of the kind GIF, which is not read: give a PNG",
    ),
    "web.webp": (b"RIFF\7\0\0\0WEBPVP8 " + bytes(99), "of the kind WebP"),
    "phone.heic": (b"\0\0\0\x18ftypheic" + bytes(99), "of the kind HEIC or AVIF"),
    "old.bmp": (bmp_bytes((1, 1), 24, bytes(4), header=12), "a BMP of OS/2"),
    "runs.bmp": (bmp_bytes((1, 2), 8, b"\2\1\0\1", PALETTE, compression=1), "save it without"),
    "sixteen.bmp": (bmp_bytes((1, 2), 16, bytes(4)), "a BMP of 16 bits"),
    "short.bmp": (bmp_bytes((5, 5), 24, bytes(4)), "is damaged or cut short"),
    "flat.bmp": (bmp_bytes((0, 5), 24, bytes(4)), "is damaged or cut short"),
    "colours.bmp": (bmp_bytes((1, 2), 8, b"\7\0\0\0", PALETTE), "is damaged or cut short"),
    "photo.NEF": (b"MM\0*" + bytes(99), "camera raw"),
    "pages.tif": (
        tiff_bytes(np.ones((2, 5, 7), np.uint8), photometric="minisblack"),
        "has 2 pages: save one picture per file",
    ),
    "palette.tif": (
        tiff_bytes(
            np.ones((5, 7), np.uint8), photometric="palette", colormap=np.zeros((3, 256), "u2")
        ),
        "kind PALETTE",
    ),
    "bits.tif": (tiff_bytes(np.ones((8, 8), bool)), "of 1 bits"),
    "jpeg.tif": (tiff_bytes(np.ones((16, 16), np.uint8), compression="jpeg"), "JPEG inside"),
    "depth.exr": (exr_bytes({"Z": np.ones((5, 7), np.float32)}), "has the channels Z"),
    "layers.exr": (
        exr_bytes({n: np.ones((5, 7), np.float32) for n in ("Y", "glow.Y")}),
        r"has the channels Y, glow\.Y",
    ),
    "whole.exr": (exr_bytes({"Y": np.ones((5, 7), np.uint32)}), "whole numbers"),
    "pickle.npy": (npy_bytes(np.array([{}], dtype=object), allow_pickle=True), "damaged"),
}
BAD_VALUES: dict[str, tuple[bytes, str]] = {
    "nan.npy": (npy_bytes(np.array([[0, np.nan, np.inf]])), "has 2 values of 3"),
    "huge.npy": (npy_bytes(np.array([[0, 1e300]])), "has 1 values of 2"),
    "nan.tif": (tiff_bytes(np.full((4, 5), np.nan, np.float32)), "has 20 values"),
    "nan.exr": (exr_bytes({"Y": np.full((4, 5), np.nan, np.float32)}), "has 20 values"),
    "int.npy": (npy_bytes(np.ones((4, 5), np.int64)), "holds int64 numbers"),
    "bool.npy": (npy_bytes(np.ones((4, 5), bool)), "holds bool numbers"),
    "complex.npy": (npy_bytes(np.ones((4, 5), complex)), "holds complex128 numbers"),
    "int.tif": (tiff_bytes(np.ones((4, 5), np.int16)), "holds int16 numbers"),
    "line.npy": (npy_bytes(np.ones(4, np.float32)), "has the shape 4"),
    "five.npy": (npy_bytes(np.ones((4, 5, 5), np.float32)), "has the shape 4 x 5 x 5"),
    "four.npy": (npy_bytes(np.ones((4, 5, 4), np.float32)), "has the shape 4 x 5 x 4"),
    "none.npy": (npy_bytes(np.ones((0, 5), np.float32)), "has the shape 0 x 5"),
}


@pytest.mark.parametrize("name", BAD_FILES)
def test_a_file_that_is_not_read_gets_a_sentence(tmp_path: Path, name: str) -> None:
    data, words = BAD_FILES[name]
    path = write(tmp_path, name, data)
    with pytest.raises(UnreadableFileError, match=words) as caught:
        read_picture(path)
    assert str(path) in str(caught.value)
    assert str(caught.value).endswith(".")


@pytest.mark.parametrize("name", BAD_VALUES)
def test_values_that_are_not_read_get_a_sentence(tmp_path: Path, name: str) -> None:
    data, words = BAD_VALUES[name]
    with pytest.raises(InputError, match=words):
        read_picture(write(tmp_path, name, data))


def test_a_missing_file_and_a_folder_get_a_sentence(tmp_path: Path) -> None:
    with pytest.raises(MissingFileError, match=r"no\.png is not there"):
        read_picture(tmp_path / "no.png")
    with pytest.raises(UnreadableFileError, match="cannot be read"):
        read_picture(tmp_path)


def test_a_cropped_exr_is_refused(tmp_path: Path) -> None:
    window = (np.array([0, 0], np.int32), np.array([9, 9], np.int32))
    data = exr_bytes({"Y": np.ones((5, 7), np.float32)}, displayWindow=window)
    with pytest.raises(UnreadableFileError, match="display window"):
        read_picture(write(tmp_path, "a.exr", data))
