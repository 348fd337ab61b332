"""The light under which the scene looks like a wanted picture, for a page."""

from collections.abc import Iterator

import numpy as np

from nearfar.applications.compensate import compensate, describe
from nearfar.errors import InputError
from nearfar.files import luminance
from nearfar.viewer.interactive import COLOUR, GREY, InteractiveTransport, to_float16
from nearfar.viewer.messages import WHITE_LEVEL, LightHeader, pack, unpack_levels


def compensating_light(transport: InteractiveTransport, message: bytes) -> Iterator[bytes | None]:
    """Find the light whose photo looks like a picture of the camera's size, in one step.

    Its result has the light's levels, the picture that is expected, and 1 at each camera pixel that
    is out of reach.

    Raises
    ------
    InputError
        If the message is wrong, if the transport is larger than the memory for it or its channels
        have no colours, or as `nearfar.compensate`.
    StoppedError
        If the server stops.
    """
    camera = transport.stored.camera
    _, light = unpack_levels(LightHeader, message, camera, side="camera")
    wanted = light.as_array().astype(np.float32)
    if wanted.ndim == 3 and transport.stored.channels != COLOUR:
        wanted = luminance(wanted)
    found = compensate(
        transport.whole(), wanted, progress=lambda _text, _share: transport.require_running()
    )
    levels = found.light.reshape(*transport.projector, -1)
    if levels.shape[2] not in (GREY, COLOUR):
        raise InputError(
            f"what {levels.shape[2]} channels see of red, green and blue is not known: calibrate "
            f"the rig."
        )
    levels = np.broadcast_to(levels, (*transport.projector, COLOUR))
    expected = transport.to_colours(found.expected.reshape(*camera, -1))
    scale, halves = to_float16(transport.at_display_stride(expected))
    yield pack(
        {"scale": scale, "said": describe(found)},
        np.rint(levels * np.float32(WHITE_LEVEL)).astype(np.uint16),
        halves,
        transport.at_display_stride(found.out_of_reach).astype(np.uint8),
    )
