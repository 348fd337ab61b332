"""Pictures come back exactly as stored, or not at all."""

import io
import struct
import subprocess
import sys
import zlib
from pathlib import Path
from typing import Any

import imagecodecs
import numpy as np
import OpenEXR  # type: ignore[import-not-found]
import pytest
import tifffile
from numpy.typing import NDArray

from nearfar.arrays import Size
from nearfar.errors import (
    ExistingOutputError,
    InputError,
    MissingFileError,
    UnreadableFileError,
)
from nearfar.files import (
    check_picture_ending,
    encode_png,
    from_srgb,
    full_scale_of,
    list_pictures,
    luminance,
    read_light,
    read_linear,
    read_picture,
    to_srgb,
    write_picture,
)

SHAPES = [(17, 23), (17, 23, 3)]
TIFF_WAYS: list[dict[str, Any]] = [
    {},
    {"rowsperstrip": 5},
    {"byteorder": ">"},
    {"bigtiff": True},
    {"tile": (16, 16)},
    {"compression": "zlib", "predictor": True, "rowsperstrip": 5},
    {"compression": "zstd", "tile": (16, 16)},
    {"compression": "lzw", "rowsperstrip": 5},
]


def random_pixels(dtype: str, shape: tuple[int, ...]) -> NDArray[Any]:
    generator = np.random.default_rng(0)
    if np.dtype(dtype).kind == "f":
        return (generator.random(shape) * 3 - 1).astype(dtype)
    return generator.integers(0, np.iinfo(dtype).max, shape, dtype=dtype, endpoint=True)


def png_bytes(depth: int, kind: int, size: Size, rows: bytes, *chunks: bytes) -> bytes:
    head = struct.pack(">IIBBBBB", size.width, size.height, depth, kind, 0, 0, 0)
    body = (b"IHDR" + head, *chunks, b"IDAT" + zlib.compress(rows), b"IEND")
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(c) - 4) + c + struct.pack(">I", zlib.crc32(c)) for c in body
    )


def bmp_bytes(
    size: tuple[int, int],
    bits: int,
    rows: bytes,
    palette: bytes = b"",
    *,
    compression: int = 0,
    masks: tuple[int, ...] = (),
    header: int = 40,
) -> bytes:
    """Return a BMP; a negative height is of rows that lie from the top."""
    (height, width), colours = size, palette + struct.pack(f"<{len(masks)}I", *masks)
    start = 14 + header + len(colours)
    number = (header, width, height, 1, bits, compression, len(rows), 0, 0, len(palette) // 4, 0)
    about = struct.pack("<IiiHHIIiiII", *number)
    return b"BM" + struct.pack("<IHHI", start + len(rows), 0, 0, start) + about + colours + rows


def tiff_bytes(pixels: NDArray[Any], **options: Any) -> bytes:
    data = io.BytesIO()
    options.setdefault("photometric", "rgb" if pixels.ndim == 3 else "minisblack")
    tifffile.imwrite(data, pixels, metadata=None, **options)
    return data.getvalue()


def exr_bytes(channels: dict[str, NDArray[Any]], **header: Any) -> bytes:
    data = io.BytesIO()
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage, **header}
    OpenEXR.File(header, channels).write(data)
    return data.getvalue()


def npy_bytes(array: NDArray[Any], *, allow_pickle: bool = False) -> bytes:
    data = io.BytesIO()
    np.save(data, array, allow_pickle=allow_pickle)
    return data.getvalue()


def write(folder: Path, name: str, data: bytes) -> Path:
    path = folder / name
    path.write_bytes(data)
    return path


def assert_same(read: NDArray[Any], expected: NDArray[Any]) -> None:
    assert read.dtype == expected.dtype
    assert read.shape == expected.shape
    assert read.dtype.isnative
    assert read.flags.c_contiguous
    np.testing.assert_array_equal(read, expected)


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("dtype", ["uint8", "uint16"])
def test_png_is_exact(tmp_path: Path, dtype: str, shape: tuple[int, ...]) -> None:
    pixels = random_pixels(dtype, shape)
    assert_same(read_picture(write(tmp_path, "a.png", encode_png(pixels))), pixels)


@pytest.mark.parametrize("way", TIFF_WAYS, ids=str)
@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("dtype", ["uint8", "uint16", "float32"])
def test_tiff_is_exact(
    tmp_path: Path, dtype: str, shape: tuple[int, ...], way: dict[str, Any]
) -> None:
    pixels = random_pixels(dtype, shape)
    if "predictor" in way and dtype == "float32":
        way = way | {"predictor": 3}
    assert_same(read_picture(write(tmp_path, "a.tif", tiff_bytes(pixels, **way))), pixels)


@pytest.mark.parametrize("compression", [None, "zlib"])
def test_tiff_in_planes_and_with_alpha_is_exact(tmp_path: Path, compression: str | None) -> None:
    pixels = random_pixels("uint16", (4, 17, 23))
    data = tiff_bytes(
        pixels,
        photometric="rgb",
        planarconfig="separate",
        extrasamples=["unassalpha"],
        compression=compression,
    )
    assert_same(read_picture(write(tmp_path, "a.tif", data)), np.moveaxis(pixels[:3], 0, 2).copy())
    data = tiff_bytes(np.moveaxis(pixels, 0, 2).copy(), extrasamples=["unassalpha"])
    assert_same(read_picture(write(tmp_path, "b.tif", data)), np.moveaxis(pixels[:3], 0, 2).copy())


def test_tiff_with_white_as_zero_is_turned(tmp_path: Path) -> None:
    pixels = random_pixels("uint16", (5, 7))
    data = tiff_bytes(65535 - pixels, photometric="miniswhite")
    assert_same(read_picture(write(tmp_path, "a.tif", data)), pixels)


@pytest.mark.parametrize("dtype", ["float32", "float16"])
@pytest.mark.parametrize("compression", range(6))
def test_exr_is_exact(tmp_path: Path, compression: int, dtype: str) -> None:
    pixels = random_pixels(dtype, (70, 23, 4))
    way = {"compression": OpenEXR.Compression(compression)}
    if compression == 5:  # PXR24 keeps 24 bits
        pixels = pixels.astype(np.float16).astype(dtype)
    colour, grey, alpha = (pixels[..., s].copy() for s in (slice(3), 0, slice(4)))
    for channels, expected in (
        ({"RGB": colour}, colour),
        ({"Y": grey}, grey),
        ({"RGBA": alpha}, colour),
    ):
        path = write(tmp_path, "a.exr", exr_bytes(channels, **way))
        assert_same(read_picture(path), expected.astype(np.float32))


def test_tiled_exr_is_exact_and_cut_refused(tmp_path: Path) -> None:
    pixels = random_pixels("float32", (40, 23, 3))
    tiles = OpenEXR.TileDescription()
    tiles.xSize = tiles.ySize = 16
    data = exr_bytes({"RGB": pixels}, type=OpenEXR.tiledimage, tiles=tiles)
    assert_same(read_picture(write(tmp_path, "a.exr", data)), pixels)
    for length in range(0, len(data), len(data) // 20):
        with pytest.raises(UnreadableFileError):
            read_picture(write(tmp_path, "a.exr", data[:length]))


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("stored", ["u1", "<u2", ">u2", "<f2", "<f4", ">f4", "<f8"])
def test_npy_is_exact(tmp_path: Path, stored: str, shape: tuple[int, ...]) -> None:
    pixels = random_pixels(stored.strip("<>"), shape).astype(stored)
    expected = pixels.astype("f4" if pixels.dtype.kind == "f" else stored.strip("<>"))
    for ordered in (pixels, np.asfortranarray(pixels)):
        assert_same(read_picture(write(tmp_path, "a.npy", npy_bytes(ordered))), expected)


@pytest.mark.parametrize(
    ("depth", "kind", "width", "row", "chunks", "expected"),
    [
        (1, 0, 8, b"\xa5", (), [255, 0, 255, 0, 0, 255, 0, 255]),
        (2, 0, 4, b"\x1b", (), [0, 85, 170, 255]),
        (4, 0, 2, b"\x1f", (), [17, 255]),
        (8, 4, 2, b"\1\2\3\4", (), [1, 3]),
        (16, 4, 1, b"\1\2\3\4", (), [258]),
        (8, 6, 1, b"\1\2\3\4", (), [[1, 2, 3]]),
        (16, 6, 1, bytes(range(8)), (), [[1, 515, 1029]]),
        (8, 3, 2, b"\1\0", (b"PLTE\1\2\3\4\5\6", b"tRNS\x80"), [[4, 5, 6], [1, 2, 3]]),
        (8, 0, 2, b"\1\2", (b"gAMA" + struct.pack(">I", 45455), b"iCCPjunk"), [1, 2]),
        (8, 0, 2, b"\1\2", (b"tRNS\0\1",), [1, 2]),
    ],
)
def test_other_pngs_give_their_numbers(
    tmp_path: Path, depth: int, kind: int, width: int, row: bytes, chunks: Any, expected: Any
) -> None:
    data = png_bytes(depth, kind, Size(2, width), (b"\0" + row) * 2, *chunks)
    dtype = np.uint16 if depth == 16 else np.uint8
    assert_same(
        read_picture(write(tmp_path, "a.png", data)), np.array([expected, expected], dtype=dtype)
    )


@pytest.mark.parametrize("shape", SHAPES)
def test_bmp_is_exact(tmp_path: Path, shape: tuple[int, ...]) -> None:
    pixels = random_pixels("uint8", shape)
    path = write(tmp_path, "a.bmp", imagecodecs.bmp_encode(pixels))
    assert_same(read_picture(path), pixels)


COLOURS = bytes([10, 20, 30, 0, 40, 50, 60, 0])


@pytest.mark.parametrize(
    ("data", "expected"),
    [
        (bmp_bytes((2, 1), 24, b"\1\2\3\0\4\5\6\0"), [[[6, 5, 4]], [[3, 2, 1]]]),
        (bmp_bytes((-2, 1), 24, b"\1\2\3\0\4\5\6\0"), [[[3, 2, 1]], [[6, 5, 4]]]),
        (bmp_bytes((1, 1), 32, b"\1\2\3\4"), [[[3, 2, 1]]]),
        (
            bmp_bytes((1, 1), 32, b"\1\2\3\4", compression=3, masks=(0xFF0000, 0xFF00, 0xFF)),
            [[[3, 2, 1]]],
        ),
        (bmp_bytes((1, 2), 8, b"\1\0\0\0", COLOURS), [[[60, 50, 40], [30, 20, 10]]]),
        (bmp_bytes((1, 2), 4, b"\x10\0\0\0", COLOURS), [[[60, 50, 40], [30, 20, 10]]]),
        (bmp_bytes((1, 3), 1, b"\xa0\0\0\0", b"\7\7\7\0\5\5\5\0"), [[5, 7, 5]]),
    ],
)
def test_other_bmps_give_their_numbers(tmp_path: Path, data: bytes, expected: Any) -> None:
    found = read_picture(write(tmp_path, "a.bmp", data))
    assert_same(found, np.array(expected, dtype=np.uint8))


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
        "bmp palette": bmp_bytes((3, 4), 4, b"\x01\x10\0\0" * 3, COLOURS),
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
    "runs.bmp": (bmp_bytes((1, 2), 8, b"\2\1\0\1", COLOURS, compression=1), "save it without"),
    "sixteen.bmp": (bmp_bytes((1, 2), 16, bytes(4)), "a BMP of 16 bits"),
    "short.bmp": (bmp_bytes((5, 5), 24, bytes(4)), "is damaged or cut short"),
    "flat.bmp": (bmp_bytes((0, 5), 24, bytes(4)), "is damaged or cut short"),
    "colours.bmp": (bmp_bytes((1, 2), 8, b"\7\0\0\0", COLOURS), "is damaged or cut short"),
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


def test_linear_is_divided_by_full_scale(tmp_path: Path) -> None:
    pixels = np.array([[0, 16383]], np.uint16)
    path = write(tmp_path, "a.png", encode_png(pixels))
    np.testing.assert_allclose(read_linear(path), pixels / 65535, rtol=1e-6)
    np.testing.assert_array_equal(read_linear(path, full_scale=16383), [[0, 1]])
    assert [full_scale_of(np.dtype(t)) for t in ("u1", "u2", "f4")] == [255, 65535, 1]


def test_a_light_has_the_size_of_the_projector(tmp_path: Path) -> None:
    path = write(tmp_path, "a.png", encode_png(np.full((4, 5), 128, np.uint8)))
    assert read_light(path, Size(4, 5)).dtype == np.float32
    np.testing.assert_allclose(read_light(path, Size(4, 5), srgb=True), 0.2158605, rtol=1e-5)
    with pytest.raises(InputError, match="is 4x5 but the projector is 5x4"):
        read_light(path, Size(5, 4))
    path = write(tmp_path, "a.npy", npy_bytes(np.full((4, 5), -0.01)))
    assert read_light(path, Size(4, 5)).min() < 0
    with pytest.raises(InputError, match="leave out `srgb`"):
        read_light(path, Size(4, 5), srgb=True)


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("ending", [".npy", ".exr", ".tif", ".TIFF"])
def test_an_image_is_written_exactly(tmp_path: Path, ending: str, shape: tuple[int, ...]) -> None:
    image = random_pixels("float32", shape)
    path = tmp_path / f"out{ending}"
    write_picture(path, image)
    assert_same(read_picture(path), image)
    with pytest.raises(ExistingOutputError):
        write_picture(path, image)
    write_picture(path, image / 2, force=True)
    assert_same(read_picture(path), image / 2)
    assert len(list(tmp_path.iterdir())) == 1


@pytest.mark.parametrize("shape", SHAPES)
def test_a_png_is_for_looking(tmp_path: Path, shape: tuple[int, ...]) -> None:
    image = random_pixels("float32", shape)
    write_picture(tmp_path / "a.png", image)
    seen = read_picture(tmp_path / "a.png")
    assert_same(seen, np.rint(255 * to_srgb(image)).astype(np.uint8))
    assert seen.max() == 255
    assert seen.min() == 0


@pytest.mark.parametrize("name", ["a.jpg", "a", "a.png.txt"])
def test_an_unknown_ending_lists_the_known(tmp_path: Path, name: str) -> None:
    with pytest.raises(InputError, match=r"\.npy, \.exr, \.tiff, \.tif or \.png"):
        check_picture_ending(Path(name))
    with pytest.raises(InputError):
        write_picture(tmp_path / name, np.zeros((4, 5), np.float32))
    assert list(tmp_path.iterdir()) == []


def test_no_nan_and_no_odd_shape_is_written(tmp_path: Path) -> None:
    for image in (np.full((4, 5), np.nan), np.ones((4, 5, 2)), np.ones(4)):
        with pytest.raises(InputError):
            write_picture(tmp_path / "a.exr", image.astype(np.float32))
    with pytest.raises(InputError):
        write_picture(tmp_path / "a.npy", np.ones(4, dtype=np.float32))
    assert list(tmp_path.iterdir()) == []


def test_an_array_holds_any_number_of_channels(tmp_path: Path) -> None:
    image = np.random.default_rng(0).random((4, 5, 2), dtype=np.float32)
    write_picture(tmp_path / "a.npy", image)
    np.testing.assert_array_equal(np.load(tmp_path / "a.npy"), image)


def test_srgb_is_there_and_back() -> None:
    values = np.linspace(0, 1, 65536, dtype=np.float32)
    np.testing.assert_allclose(to_srgb(from_srgb(values)), values, atol=1e-6)
    np.testing.assert_allclose(
        from_srgb(np.array([0.04045, 0.5, 1])), [0.0031308, 0.2140411, 1], rtol=1e-4
    )
    assert np.all(np.diff(to_srgb(values)) > 0)
    np.testing.assert_allclose(luminance(np.ones((2, 3))), 1, rtol=1e-6)


def test_pictures_are_listed_in_natural_order(tmp_path: Path) -> None:
    names = ["img1.png", "img2.TIF", "img9.exr", "img10.npy", "img010b.tiff", "img100.png"]
    for name in [*reversed(names), ".hidden.png", "notes.txt", "old.jpg"]:
        (tmp_path / name).write_bytes(b"")
    (tmp_path / "folder.png").mkdir()
    assert [p.name for p in list_pictures(tmp_path)] == names
    with pytest.raises(MissingFileError):
        list_pictures(tmp_path / "no")
    with pytest.raises(UnreadableFileError):
        list_pictures(tmp_path / "notes.txt")
