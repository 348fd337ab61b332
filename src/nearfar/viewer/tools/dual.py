"""The scene as the projector sees it, lit from the camera, for a page."""

from collections.abc import Iterator

import numpy as np

from nearfar.applications.dual import sent_back_in_steps
from nearfar.arrays import Floats, Size, middles
from nearfar.files import luminance
from nearfar.viewer.interactive import (
    COLOUR,
    MAXIMUM_DISPLAYED_PIXELS,
    InteractiveTransport,
    to_float16,
)
from nearfar.viewer.messages import LightHeader, pack, unpack_levels

# Rows and columns of projector pixels that are sent while the light moves.
MAXIMUM_MOVING_PIXELS = 2**18


class DualHeader(LightHeader):
    """The header of a light on the camera's side.

    Attributes
    ----------
    coarse : bool
        Whether some projector pixels suffice.
    """

    coarse: bool = False


def seen_from_projector(transport: InteractiveTransport, message: bytes) -> Iterator[bytes | None]:
    """Make the dual view of a light at the camera, in steps of a block of camera rows.

    Components have the gains of the header. Far-range light of a light at rest is by reciprocity,
    where it holds. Flat fields of the transport are divided out.

    Raises
    ------
    InputError
        If the message is wrong.
    """
    camera = transport.stored.camera
    header, light = unpack_levels(DualHeader, message, camera, side="camera")
    channels = transport.stored.channels
    picture: Floats = light.as_array().astype(np.float32)
    if picture.ndim == 3 and channels != COLOUR:
        picture = luminance(picture)
    flats = transport.flat_fields
    picture = np.broadcast_to(picture.reshape(*camera, -1) / flats.camera, (*camera, channels))
    total = np.zeros((*transport.projector, channels), dtype=np.float32)
    gains = header.gains.of_parts(transport.stored.parts)
    reciprocity = None if header.coarse else transport.reciprocity
    yield from sent_back_in_steps(transport.blocks, picture, gains, reciprocity, total)
    total /= flats.projector
    most = MAXIMUM_MOVING_PIXELS if header.coarse else MAXIMUM_DISPLAYED_PIXELS
    scale, halves = to_float16(transport.to_colours(_at_most(total, most)))
    # A projector pixel adds up the camera pixels that see its light.
    usual = transport.projector.pixels / camera.pixels
    yield pack({"scale": scale, "coarse": header.coarse, "brightness": usual}, halves)


def _at_most(picture: Floats, pixels: int) -> Floats:
    """Return every second row and column, every third and so on, of a picture that is too large."""
    size = Size(*picture.shape[:2])
    stride = int(np.ceil(np.sqrt(size.pixels / pixels)))
    return picture[np.ix_(*(middles(side, stride) for side in size))] if stride > 1 else picture
