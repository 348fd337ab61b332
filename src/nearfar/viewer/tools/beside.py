"""The picture of a second transport under the page's light, for a page."""

from collections.abc import Iterator

import numpy as np

from nearfar.viewer.beside import Beside
from nearfar.viewer.interactive import InteractiveTransport, to_float16
from nearfar.viewer.messages import LightHeader, pack, unpack_levels


def picture_beside(
    beside: Beside, transport: InteractiveTransport, message: bytes
) -> Iterator[bytes | None]:
    """Relight a second transport, component by component where they are known apart.

    Raises
    ------
    InputError
        If the message is wrong.
    """
    _, light = unpack_levels(LightHeader, message, transport.projector)
    for parts in beside.relight(transport.for_channels(light.as_array())):
        if parts is None:
            yield None
        else:
            scale, halves = to_float16(np.stack([transport.to_colours(part) for part in parts]))
            yield pack({"scale": scale}, halves)
