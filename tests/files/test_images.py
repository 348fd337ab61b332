"""Pictures come back exactly as stored."""

import struct
from pathlib import Path
from typing import Any

import imagecodecs
import numpy as np
import OpenEXR  # type: ignore[import-not-found]
import pytest

from nearfar.arrays import Size
from nearfar.errors import (
    ExistingOutputError,
    InputError,
    MissingFileError,
    UnreadableFileError,
)
from nearfar.files import (
    check_picture_ending,
    developed,
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
from tests.files.pictures import (
    PALETTE,
    SHAPES,
    TIFF_WAYS,
    assert_same,
    bmp_bytes,
    exr_bytes,
    npy_bytes,
    png_bytes,
    random_pixels,
    tiff_bytes,
    write,
)


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
        (bmp_bytes((1, 2), 8, b"\1\0\0\0", PALETTE), [[[60, 50, 40], [30, 20, 10]]]),
        (bmp_bytes((1, 2), 4, b"\x10\0\0\0", PALETTE), [[[60, 50, 40], [30, 20, 10]]]),
        (bmp_bytes((1, 3), 1, b"\xa0\0\0\0", b"\7\7\7\0\5\5\5\0"), [[5, 7, 5]]),
    ],
)
def test_other_bmps_give_their_numbers(tmp_path: Path, data: bytes, expected: Any) -> None:
    found = read_picture(write(tmp_path, "a.bmp", data))
    assert_same(found, np.array(expected, dtype=np.uint8))


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


@pytest.mark.parametrize("channels", [1, 3])
def test_a_jpeg_is_an_ordinary_picture_as_a_light_and_nothing_else(
    tmp_path: Path, channels: int
) -> None:
    levels = np.full((8, 16, channels), 128, np.uint8)
    path = tmp_path / "light.jpg"
    path.write_bytes(imagecodecs.jpeg8_encode(levels.squeeze(), level=99))
    light = read_light(path, Size(8, 16), srgb=True)
    assert light.shape == levels.squeeze().shape
    np.testing.assert_allclose(light, from_srgb(np.array(128 / 255)), rtol=0.02)
    with pytest.raises(InputError, match="an ordinary sRGB picture and not linear: say so by"):
        read_light(path, Size(8, 16))
    # Photos are linear.
    with pytest.raises(UnreadableFileError, match="is a JPEG"):
        read_picture(path)
    path.write_bytes(path.read_bytes()[:60])
    with pytest.raises(UnreadableFileError, match="is a damaged JPEG"):
        read_light(path, Size(8, 16), srgb=True)


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


def test_a_picture_is_developed_as_it_is_to_look():
    picture = np.random.default_rng(0).uniform(0, 2, (5, 7, 3)).astype(np.float32)
    np.testing.assert_array_equal(developed(picture), picture)
    np.testing.assert_allclose(developed(picture, exposure=-1.5), picture * 2**-1.5, rtol=1e-6)
    # A gamma acts on what the screen gets.
    shown = to_srgb(developed(picture, exposure=-1, gamma=2))
    np.testing.assert_allclose(shown, to_srgb(picture / 2) ** 0.5, atol=1e-5)
    np.testing.assert_array_equal(developed(picture, channel=1), picture[..., 1])
    grey = picture[..., 0]
    np.testing.assert_array_equal(developed(grey, channel=2), grey)
    np.testing.assert_array_equal(developed(grey[..., None], channel=2), grey)
