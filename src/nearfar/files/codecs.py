"""Pictures as bytes: PNG, TIFF, BMP, OpenEXR and NPY, into the numbers that are stored and back.

Each decoder gives the whole picture or raises; what their libraries let pass (missing strips,
cut files, 16 bits turned into 8) is checked here.
"""

import io
import logging
import math
import re
import struct
import tokenize
from collections.abc import Iterator
from typing import Any

import imagecodecs
import numpy as np
import OpenEXR
import tifffile
from numpy.typing import NDArray

from nearfar.files.bitmaps import decode_bitmap
from nearfar.files.unsupported import UnsupportedPictureError

Pixels = NDArray[Any]

# They would print to stderr what is turned into a sentence here; imagecodecs logs for libpng.
for library in ("tifffile", "imagecodecs"):
    logging.getLogger(library).addHandler(logging.NullHandler())

# What the decoders were seen to raise when fed files cut or changed at every byte.
DAMAGE = (
    ValueError,
    RuntimeError,
    LookupError,
    TypeError,
    ArithmeticError,
    EOFError,
    MemoryError,
    SyntaxError,
    struct.error,
    tokenize.TokenError,
)


# Kinds of picture that are not read, by regular expressions of the first bytes.
OTHER_KINDS = {
    "GIF": rb"GIF8",
    "WebP": rb"RIFF....WEBP",
    "HEIC or AVIF": rb"....ftyp(hei|mif|avi|msf)",
    "JPEG 2000": rb"\0\0\0\x0cjP  |\xff\x4f\xff\x51",
    "JPEG XL": rb"\0\0\0\x0cJXL |\xff\x0a",
    "Photoshop": rb"8BPS",
    "Radiance": rb"#\?R",
    "PDF": rb"%PDF",
    "PNM": rb"P[1-7]\s",
    "PFM": rb"P[Ff]\s",
}


def other_kind(data: bytes) -> str | None:
    """Return the name of the kind that a picture is of, if it is known and not read."""
    return next((k for k, start in OTHER_KINDS.items() if re.match(start, data, re.S)), None)


def decode_png(data: bytes) -> Pixels:
    """Decode a PNG of any colour type; 1, 2 and 4 bits and palettes come as 8 bits."""
    return _without_alpha(np.asarray(imagecodecs.png_decode(_critical_chunks(data))))


def _without_alpha(pixels: Pixels) -> Pixels:
    if pixels.ndim == 3 and pixels.shape[2] in {2, 4}:
        return pixels[..., 0] if pixels.shape[2] == 2 else pixels[..., :3]
    return pixels


def _critical_chunks(data: bytes) -> bytes:
    # The rest (profiles, gamma, text) changes no stored number, and libpng warns of it on stderr.
    kept, position, kind = [data[:8]], 8, b""
    while kind != b"IEND":
        length, kind = struct.unpack_from(">I4s", data, position)
        end = position + length + 12
        if end > len(data):
            raise ValueError("its end is missing")
        if kind[:1].isupper():
            kept.append(data[position:end])
        position = end
    return b"".join(kept)


def encode_png(pixels: NDArray[np.uint8] | NDArray[np.uint16]) -> bytes:
    """Encode a PNG of 8 or 16 bits.

    Parameters
    ----------
    pixels : array
        uint8 or uint16, shape (y, x) or (y, x, 3).
    """
    return bytes(imagecodecs.png_encode(np.ascontiguousarray(pixels), level=6))


def decode_tiff(data: bytes) -> Pixels:
    """Decode a TIFF of one page, compressed or not, in any layout of strips, tiles and planes."""
    with tifffile.TiffFile(io.BytesIO(data)) as tiff:
        # A reduced page is a thumbnail.
        pages = [p for p in _pages(tiff) if isinstance(p, tifffile.TiffPage) and not p.is_reduced]
        if not pages:
            raise ValueError("it has no page")
        if len(pages) > 1:
            raise UnsupportedPictureError(f"has {len(pages)} pages: save one picture per file")
        page = pages[0]
        _check_segments(page, len(data))
        _check_tiff_kind(page)
        pixels = np.asarray(page.asarray())
        if page.photometric == tifffile.PHOTOMETRIC.MINISWHITE:
            pixels = np.iinfo(pixels.dtype).max - pixels
        if pixels.ndim == 3 and page.axes.startswith("S"):
            pixels = np.moveaxis(pixels, 0, -1)
        return _without_alpha(pixels)


def _pages(tiff: tifffile.TiffFile) -> Iterator[tifffile.TiffPage | tifffile.TiffFrame]:
    """Yield the pages, each of which names the place of the next."""
    seen: set[int] = set()
    for page in tiff.pages:
        if page.offset in seen:
            raise ValueError("its pages run in a circle")
        seen.add(page.offset)
        yield page


def _check_segments(page: tifffile.TiffPage, length: int) -> None:
    # tifffile leaves zeros where a strip or a tile is missing.
    offsets, counts = page.dataoffsets, page.databytecounts
    if not len(offsets) == len(counts) == math.prod(page.chunked) or not all(counts):
        raise ValueError("some of its strips or tiles are missing")
    if any(offset + count > length for offset, count in zip(offsets, counts, strict=True)):
        raise ValueError("its end is missing")


def _check_tiff_kind(page: tifffile.TiffPage) -> None:
    photometric = tifffile.PHOTOMETRIC
    kinds = (photometric.MINISBLACK, photometric.MINISWHITE, photometric.RGB)
    if page.photometric not in kinds:
        name = getattr(page.photometric, "name", page.photometric)
        raise UnsupportedPictureError(f"is a TIFF of kind {name}: save it as grey or RGB")
    if page.compression in {6, 7, 34892, 33007}:
        raise UnsupportedPictureError("is a TIFF with JPEG inside: save it without loss")
    if page.imagedepth > 1:
        raise UnsupportedPictureError("is a TIFF volume: save one picture per file")
    bits = page.bitspersample
    if page.sampleformat == 1 and bits not in {8, 16}:
        raise UnsupportedPictureError(f"is a TIFF of {bits} bits: save it with 8 or 16 bits")
    if page.photometric == photometric.MINISWHITE and page.sampleformat != 1:
        raise UnsupportedPictureError("is a TIFF in which 0 is white: save it with 0 as black")


def encode_tiff(image: NDArray[np.float32]) -> bytes:
    """Encode a TIFF of float32, shape (y, x) or (y, x, 3)."""
    data = io.BytesIO()
    photometric = "rgb" if image.ndim == 3 else "minisblack"
    tifffile.imwrite(data, image, photometric=photometric, metadata=None)
    return data.getvalue()


_EXR_ROWS = {0: 1, 1: 1, 2: 1, 3: 16, 4: 32, 5: 16, 6: 32, 7: 32, 8: 32, 9: 256}


def decode_exr(data: bytes) -> Pixels:
    """Decode an OpenEXR picture with the channels R, G, B or Y; alpha is dropped."""
    _check_exr_rows(data)
    file = OpenEXR.File(io.BytesIO(data), separate_channels=True)
    if not file.parts:
        raise ValueError("its pixels are damaged")
    if len(file.parts) > 1:
        raise UnsupportedPictureError(f"has {len(file.parts)} parts: save one picture per file")
    header, channels = file.header(), file.channels()
    names = sorted(set(channels) - {"A"})
    if names not in (["B", "G", "R"], ["Y"]):
        raise UnsupportedPictureError(
            f"has the channels {', '.join(sorted(channels))}: save it with R, G, B or Y only"
        )
    window, display = header["dataWindow"], header["displayWindow"]
    if any(not np.array_equal(a, b) for a, b in zip(window, display, strict=True)):
        raise UnsupportedPictureError(
            "covers only a part of its display window: save it without cropping or overscan"
        )
    planes = [np.asarray(channels[name].pixels) for name in reversed(names)]
    if any(plane.dtype.kind != "f" for plane in planes):
        raise UnsupportedPictureError("holds whole numbers: save it as half or float")
    if len({plane.shape for plane in planes}) > 1:
        raise UnsupportedPictureError("has channels of different sizes: save it as R, G, B or Y")
    return np.asarray(np.stack(planes, axis=-1) if len(planes) > 1 else planes[0])


def _check_exr_rows(data: bytes) -> None:
    # OpenEXR reads a truncated file as an empty one and prints to stderr, so check first that every
    # block of rows of a plain file is there.
    if len(data) < 9 or data[5] & 0x1A:  # tiles, deep data, several parts: OpenEXR's own checks
        return
    position, header = 8, {}
    while data[position]:
        name_end = data.index(b"\0", position)
        type_end = data.index(b"\0", name_end + 1)
        (size,) = struct.unpack_from("<i", data, type_end + 1)
        start = type_end + 5
        if size < 0 or start + size >= len(data):
            raise ValueError("its header is damaged")
        header[data[position:name_end]] = data[start : start + size]
        position = start + size
    rows = _EXR_ROWS.get(header[b"compression"][0])
    if rows is None:
        return
    _, top, _, bottom = struct.unpack("<4i", header[b"dataWindow"])
    count = -(-(bottom - top + 1) // rows)
    if count < 1 or position + 1 + 8 * count > len(data):
        raise ValueError("its end is missing")
    for offset in struct.unpack_from(f"<{count}Q", data, position + 1):
        _, size = struct.unpack_from("<2i", data, offset)
        if offset <= position or size < 0 or offset + 8 + size > len(data):
            raise ValueError("its end is missing")


def encode_exr(image: NDArray[np.float32]) -> bytes:
    """Encode an OpenEXR picture of float32: (y, x) as channel Y, (y, x, 3) as R, G, B."""
    name = "RGB" if image.ndim == 3 else "Y"
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    data = io.BytesIO()
    OpenEXR.File(header, {name: np.ascontiguousarray(image)}).write(data)
    return data.getvalue()


def decode_npy(data: bytes) -> Pixels:
    """Decode an array file; nothing is ever unpickled."""
    return np.asarray(np.lib.format.read_array(io.BytesIO(data), allow_pickle=False))


def encode_npy(image: NDArray[np.float32]) -> bytes:
    """Encode an array file."""
    data = io.BytesIO()
    np.lib.format.write_array(data, np.ascontiguousarray(image), allow_pickle=False)
    return data.getvalue()


# By the first bytes of the file.
DECODERS = {
    b"\x89PNG\r\n\x1a\n": decode_png,
    b"BM": decode_bitmap,
    b"II*\0": decode_tiff,
    b"MM\0*": decode_tiff,
    b"II+\0": decode_tiff,
    b"MM\0+": decode_tiff,
    b"\x76\x2f\x31\x01": decode_exr,
    b"\x93NUMPY": decode_npy,
}
