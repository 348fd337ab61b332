"""What a page and its server send each other: a few words in JSON, and numbers behind them.

A message is a 32-bit length, little endian, that many bytes of JSON, padded with spaces so that
what follows begins at a multiple of 8 bytes, and the arrays, one behind the other, little endian,
row by row.
"""

import json
import struct
from typing import Annotated, Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from nearfar.arrays import Floats, Size
from nearfar.errors import InputError

# Bytes of JSON that a page may send.
WORDS = 2**14
_LENGTH = struct.Struct("<I")
_ALIGNED = 8
# Full white of a light in a message.
WHITE = 65535

# How a page names the kinds of numbers.
_NAMES = {"float32": "<f4", "float16": "<f2", "uint16": "<u2", "uint8": "|u1"}


Share = Annotated[float, Field(ge=0.0, le=1.0)]


class Gains(BaseModel):
    """Gains of the components, as the page's sliders have them."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False, frozen=True)

    direct: float = Field(default=1.0, ge=0.0, le=4.0)
    near: float = Field(default=1.0, ge=0.0, le=4.0)
    far: float = Field(default=1.0, ge=0.0, le=4.0)


class Light(NamedTuple):
    """A light that a page sends: levels times a colour.

    Attributes
    ----------
    levels : ndarray, shape (Py, Px) or (Py, Px, 3), float32
    colour : ndarray, shape (3,), float32
    """

    levels: Floats
    colour: Floats

    @property
    def is_grey(self) -> bool:
        """Whether it has no colour."""
        return self.levels.ndim == 2 and bool((self.colour == self.colour[0]).all())

    def whole(self) -> Floats:
        """Return it as ``nearfar relight`` takes it, (Py, Px) or (Py, Px, 3)."""
        if self.is_grey:
            return np.asarray(self.levels * self.colour[0])
        levels: Floats = self.levels if self.levels.ndim == 3 else self.levels[..., None]
        return np.asarray(levels * self.colour)


class Lit(BaseModel):
    """What a page says of a light that it sends.

    Attributes
    ----------
    number : int
        The answer carries it, for the page to know which light it is of.
    shape : tuple of int
        Of the levels: Py, Px, and 1 or 3.
    colour : tuple of float
        Linear red, green and blue that the levels are of.
    gains : Gains
        For a picture to be saved.
    """

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False, frozen=True)

    number: int = Field(default=0, ge=0, le=2**53)
    shape: tuple[int, int, Literal[1, 3]]
    colour: tuple[Share, Share, Share] = (1.0, 1.0, 1.0)
    gains: Gains = Gains()


def pack(words: dict[str, Any], *arrays: NDArray[Any]) -> bytes:
    """Lay words and arrays out as one message.

    Parameters
    ----------
    words : dict
        For JSON; what the arrays are is added as ``arrays``.
    arrays : ndarray
        float32, float16, uint16 or uint8.
    """
    told = [{"type": array.dtype.name, "shape": list(array.shape)} for array in arrays]
    text = json.dumps({**words, "arrays": told}, allow_nan=False).encode()
    text += b" " * (-(_LENGTH.size + len(text)) % _ALIGNED)
    parts = [_LENGTH.pack(len(text)), text]
    for array in arrays:
        data = np.ascontiguousarray(array, dtype=_NAMES[array.dtype.name]).tobytes()
        parts += [data, b"\0" * (-len(data) % _ALIGNED)]
    return b"".join(parts)


def largest_light(projector: Size) -> int:
    """Return the bytes of the largest message that holds a light."""
    return WORDS + 6 * projector.pixels


def unpack_light(message: bytes, projector: Size) -> tuple[Lit, Light]:
    """Read a light that a page sends: uint16, `WHITE` for full white.

    Parameters
    ----------
    message : bytes
    projector : Size

    Returns
    -------
    words : Lit
    light : Light
        Its levels of one channel where those of three are the same.

    Raises
    ------
    InputError
        If it is no such message.
    """
    if len(message) < _LENGTH.size:
        raise InputError("the message is cut short: send a light.")
    (length,) = _LENGTH.unpack_from(message)
    data = message[_LENGTH.size + length :]
    if length > min(WORDS, len(message) - _LENGTH.size):
        raise InputError(f"the message tells of {length} bytes of words: send a light.")
    try:
        words = Lit.model_validate_json(message[_LENGTH.size : _LENGTH.size + length])
    except ValidationError as error:
        fault = error.errors(include_url=False, include_input=False)[0]
        where = ".".join(map(str, fault["loc"]))
        raise InputError(f"the message's words are wrong ({where}: {fault['msg']}).") from None
    channels = words.shape[2]
    if words.shape[:2] != projector or len(data) != 2 * channels * projector.pixels:
        raise InputError(
            f"the light is {'x'.join(map(str, words.shape))} in {len(data)} bytes, the projector "
            f"{projector}: send {projector}x1 or x3 of 2 bytes each."
        )
    levels = np.frombuffer(data, dtype="<u2").reshape(words.shape)
    first = levels[..., :1]
    one = bool((levels == first).all())
    chosen = (levels[..., 0] if one else levels).astype(np.float32) / np.float32(WHITE)
    return words, Light(chosen, np.array(words.colour, dtype=np.float32))
