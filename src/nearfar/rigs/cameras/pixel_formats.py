"""GenICam's names of the pixel formats that can be read: one value after another, not packed."""

import re
from typing import NamedTuple

_UNPACKED = re.compile(r"(Mono|Bayer(?P<cell>RG|GR|GB|BG))(?P<bits>8|10|12|14|16)$")
_CELLS = {"RG": "RGGB", "GR": "GRBG", "GB": "GBRG", "BG": "BGGR"}


class PixelFormat(NamedTuple):
    """A pixel format.

    Attributes
    ----------
    bits : int
        Bits per value.
    cell : str or None
        Colours of a cell of the Bayer mosaic, row by row, such as RGGB; None if there is none.
    """

    bits: int
    cell: str | None


def parse_pixel_format(name: str) -> PixelFormat | None:
    """Read a name such as Mono12 or BayerRG8; None if the format is packed or processed."""
    match = _UNPACKED.match(name)
    if match is None:
        return None
    return PixelFormat(int(match["bits"]), _CELLS[match["cell"]] if match["cell"] else None)
