"""Files of pictures as bytes, and comparison of what is read."""

import io
import struct
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR  # type: ignore[import-not-found]
import tifffile
from numpy.typing import NDArray

from nearfar.arrays import Size

SHAPES = [(17, 23), (17, 23, 3)]
# Two colours of a BMP, as blue, green, red and nothing.
PALETTE = bytes([10, 20, 30, 0, 40, 50, 60, 0])
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
