"""BMP pictures as bytes, without compression: of cameras and programs that save nothing else."""

import struct

import numpy as np
from numpy.typing import NDArray

from nearfar.files.unsupported import UnsupportedPictureError

# Of the file, before the header of the picture.
FILE_HEADER_BYTES = 14
# Older headers are of OS/2.
LEAST_HEADER_BYTES = 40
# Channels of 8 bits as they lie in 32.
USUAL_MASKS = (0xFF0000, 0xFF00, 0xFF)
UNCOMPRESSED, MASKED = 0, 3
# Bits of a pixel, and how they lie.
KINDS = {*((bits, UNCOMPRESSED) for bits in (1, 4, 8, 24, 32)), (32, MASKED)}


def decode_bitmap(data: bytes) -> NDArray[np.uint8]:
    """Decode a BMP, uint8, (y, x) where its palette is of greys, else (y, x, 3).

    Raises
    ------
    UnsupportedPictureError
        If it is compressed, or has 16 bits.
    ValueError, struct.error
        If it is damaged or cut short.
    """
    (start, header_bytes) = struct.unpack_from("<II", data, 10)
    if header_bytes < LEAST_HEADER_BYTES:
        raise UnsupportedPictureError("is a BMP of OS/2: save it as PNG")
    width, height, _, bits, compression = struct.unpack_from("<iiHHI", data, 18)
    if (bits, compression) not in KINDS:
        raise UnsupportedPictureError(
            f"is a BMP of {bits} bits, compression {compression}: save it without compression, "
            f"with 8 bits a channel"
        )
    masks = struct.unpack_from("<III", data, 54) if compression == MASKED else USUAL_MASKS
    if masks != USUAL_MASKS:
        raise UnsupportedPictureError("is a BMP of unusual masks: save it with 8 bits a channel")
    if width < 1 or height == 0:
        raise ValueError("it has no pixels")
    # Rows are filled up to 32 bits.
    row_bytes = (width * bits + 31) // 32 * 4
    if start + row_bytes * abs(height) > len(data):
        raise ValueError("its end is missing")
    rows = np.frombuffer(data, np.uint8, row_bytes * abs(height), start).reshape(-1, row_bytes)
    # The last row comes first, unless the height is negative.
    rows = rows[::-1] if height > 0 else rows
    if bits > 8:
        channels = bits // 8
        blue_first = rows[:, : width * channels].reshape(len(rows), width, channels)
        return np.ascontiguousarray(blue_first[..., 2::-1])
    numbers = _numbers(rows, bits)[:, :width]
    palette = _palette(data, FILE_HEADER_BYTES + header_bytes, bits, start)
    if numbers.max() >= len(palette):
        raise ValueError("it has more colours than its palette")
    is_grey = bool((palette == palette[:, :1]).all())
    return np.ascontiguousarray((palette[:, 0] if is_grey else palette)[numbers])


def _numbers(rows: NDArray[np.uint8], bits: int) -> NDArray[np.uint8]:
    """Return the colour numbers of 1, 4 or 8 bits, the first in the highest bits of a byte."""
    shifts = np.arange(8 - bits, -1, -bits, dtype=np.uint8)
    numbers = (rows[..., None] >> shifts) & np.uint8(2**bits - 1)
    return numbers.reshape(len(rows), -1)


def _palette(data: bytes, place: int, bits: int, start: int) -> NDArray[np.uint8]:
    """Return the palette, (colours, 3), red first."""
    (stated,) = struct.unpack_from("<I", data, 46)
    count = stated or 2**bits
    if count > 2**bits or place + 4 * count > min(start, len(data)):
        raise ValueError("its palette is damaged")
    return np.frombuffer(data, np.uint8, 4 * count, place).reshape(count, 4)[:, 2::-1]
