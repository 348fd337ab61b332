"""Binary messages between a page and its server: a JSON header, followed by arrays.

A message is the length of the header (32 bits, little endian), the header, padded with spaces so
that the arrays begin at a multiple of 8 bytes, and the arrays one after the other, little endian,
row-major, each padded to a multiple of 8 bytes.
"""

import json
import struct
from collections.abc import Iterable
from typing import Annotated, Any, Literal, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from nearfar.arrays import Floats, Size
from nearfar.errors import InputError
from nearfar.transport.coarse import size_in_blocks

# For headers that a page sends.
MAXIMUM_HEADER_BYTES = 2**14
_LENGTH = struct.Struct("<I")
_ALIGNMENT_BYTES = 8
# The level of full white in a light.
WHITE_LEVEL = 65535

# Types of arrays by the names that headers give them.
_TYPES = {"float32": "<f4", "float16": "<f2", "uint16": "<u2", "uint8": "|u1"}


Share = Annotated[float, Field(ge=0.0, le=1.0)]


Gain = Annotated[float, Field(ge=0.0, le=4.0)]
Split = Literal["model", "physical"]


class Gains(BaseModel):
    """Gains of the components of either split, within the range of the page's sliders.

    `direct` is of the split that a light's header names; `near` and `far` are of the model's,
    `subsurface` and `interreflection` of the physical one.
    """

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False, frozen=True)

    direct: Gain = 1.0
    near: Gain = 1.0
    far: Gain = 1.0
    subsurface: Gain = 1.0
    interreflection: Gain = 1.0

    def of(self, names: Iterable[str]) -> dict[str, float]:
        """Return the gains of some components, by name."""
        return {name: getattr(self, name) for name in names}

    def of_parts(self, parts: Iterable[str]) -> dict[str, float]:
        """Return the gains of a transport's parts; free rows take the place of far-range light."""
        return {part: self.far if part == "free" else getattr(self, part) for part in parts}


class Light(NamedTuple):
    """A light that a page sends, as the product of levels and a colour.

    Attributes
    ----------
    levels : ndarray, shape (Py, Px) or (Py, Px, 3), float32
        From 0 to 1; Py and Px are those of blocks.
    colour : ndarray, shape (3,), float32
        Linear red, green and blue, from 0 to 1.
    block : int
        Side, in projector pixels, of the blocks that levels are means over.
    """

    levels: Floats
    colour: Floats
    block: int = 1

    @property
    def is_grey(self) -> bool:
        """Whether red, green and blue are equal everywhere."""
        return self.levels.ndim == 2 and bool((self.colour == self.colour[0]).all())

    def as_array(self) -> Floats:
        """Return levels times colour, (Py, Px) or (Py, Px, 3)."""
        if self.is_grey:
            return np.asarray(self.levels * self.colour[0])
        levels: Floats = self.levels if self.levels.ndim == 3 else self.levels[..., None]
        return np.asarray(levels * self.colour)


class LightHeader(BaseModel):
    """The header of a light that a page sends.

    Attributes
    ----------
    number : int
        Counts the lights of a page; a frame has the number of its light.
    shape : tuple of int
        Shape of the levels: Py, Px, and 1 or 3 channels.
    block : int
        Side, in projector pixels, of the blocks that levels are means over.
    colour : tuple of float
        Linear red, green and blue, which the levels are multiplied by.
    split : {"model", "physical"}
        Which components the picture is taken apart into.
    took : float or None
        Seconds that the page's newest frame took from its light to the screen, without the wait
        for those before it; None before there is one.
    level : int
        The level of detail that this frame had; see `nearfar.viewer.pace`.
    gains : Gains
        Used for pictures that are saved; pages apply the gains of live frames themselves.
    """

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False, frozen=True)

    number: int = Field(default=0, ge=0, le=2**53)
    shape: tuple[int, int, Literal[1, 3]]
    block: int = Field(default=1, ge=1, le=2**16)
    colour: tuple[Share, Share, Share] = (1.0, 1.0, 1.0)
    split: Split = "model"
    took: float | None = Field(default=None, ge=0, le=3600)
    level: int = Field(default=0, ge=0, le=15)
    gains: Gains = Gains()


Header = TypeVar("Header", bound=LightHeader)


def pack(header: dict[str, Any], *arrays: NDArray[Any]) -> bytes:
    """Return a message of a header and arrays.

    Parameters
    ----------
    header : dict
        Values that JSON has; the arrays' types and shapes are added as ``arrays``.
    arrays : ndarray
        float32, float16, uint16 or uint8.
    """
    descriptions = [{"type": array.dtype.name, "shape": list(array.shape)} for array in arrays]
    text = json.dumps({**header, "arrays": descriptions}, allow_nan=False).encode()
    text += b" " * (-(_LENGTH.size + len(text)) % _ALIGNMENT_BYTES)
    parts = [_LENGTH.pack(len(text)), text]
    for array in arrays:
        data = np.ascontiguousarray(array, dtype=_TYPES[array.dtype.name]).tobytes()
        parts += [data, b"\0" * (-len(data) % _ALIGNMENT_BYTES)]
    return b"".join(parts)


def maximum_light_bytes(projector: Size) -> int:
    """Return the size of the largest message that a light can take."""
    return MAXIMUM_HEADER_BYTES + 6 * projector.pixels


def unpack_light(message: bytes, projector: Size, block: int = 1) -> tuple[LightHeader, Light]:
    """Read the message of a projector's light; see `unpack_levels`."""
    return unpack_levels(LightHeader, message, projector, block=block)


def unpack_levels(
    header_type: type[Header],
    message: bytes,
    size: Size,
    *,
    block: int = 1,
    side: str = "projector",
) -> tuple[Header, Light]:
    """Read the message of a light: uint16 levels, `WHITE_LEVEL` for full white.

    Parameters
    ----------
    header_type : type
        `LightHeader`, or what extends it.
    message : bytes
    size : Size
        Of whatever sends the light.
    block : int, optional
        Side of the blocks of pixels that the light may be made of as well.
    side : {"projector", "camera"}
        What sends the light, for error messages.

    Returns
    -------
    header : LightHeader
    light : Light
        With levels of one channel if the three channels of the message are equal.

    Raises
    ------
    InputError
        If the message has another form, or the light another size.
    """
    if len(message) < _LENGTH.size:
        raise InputError("the message is cut short: send a light.")
    (length,) = _LENGTH.unpack_from(message)
    data = message[_LENGTH.size + length :]
    if length > min(MAXIMUM_HEADER_BYTES, len(message) - _LENGTH.size):
        raise InputError(f"the message claims a header of {length} bytes: send a light.")
    try:
        header = header_type.model_validate_json(message[_LENGTH.size : _LENGTH.size + length])
    except ValidationError as error:
        fault = error.errors(include_url=False, include_input=False)[0]
        where = ".".join(map(str, fault["loc"]))
        raise InputError(f"the message's header is wrong ({where}: {fault['msg']}).") from None
    channels = header.shape[2]
    if header.block not in (1, block):
        raise InputError(f"the light is of blocks of {header.block} pixels: send it whole.")
    sent = size_in_blocks(size, header.block)
    if header.shape[:2] != sent or len(data) != 2 * channels * sent.pixels:
        raise InputError(
            f"the light is {'x'.join(map(str, header.shape))} in {len(data)} bytes, the {side} "
            f"{size}: send {sent}x1 or x3 of 2 bytes each."
        )
    levels = np.frombuffer(data, dtype="<u2").reshape(header.shape)
    first = levels[..., :1]
    distinct = levels[..., 0] if bool((levels == first).all()) else levels
    shares = distinct.astype(np.float32) / np.float32(WHITE_LEVEL)
    return header, Light(shares, np.array(header.colour, dtype=np.float32), header.block)
