"""The photos of a capture, each with the light that it was taken under, for a page.

Index convention: lights are [y, x, colour] of the projector, photos of the camera.
"""

from dataclasses import dataclass

import numpy as np

from nearfar.capture import Capture
from nearfar.errors import InputError
from nearfar.viewer.interactive import COLOUR, InteractiveTransport, to_float16
from nearfar.viewer.messages import WHITE_LEVEL, pack

LEVELS_OF_PATTERN = 255
# What photos are for that no estimate of transport uses.
HELD_OUT_PURPOSES = ("check", "correspondence")


@dataclass(frozen=True)
class PhotoSeries:
    """The photos that a transport was reconstructed from, and those that it is checked by.

    Attributes
    ----------
    transport : InteractiveTransport
    capture : Capture
        The one that it was reconstructed from.
    """

    transport: InteractiveTransport
    capture: Capture

    def describe(self) -> list[dict[str, object]]:
        """Return, for JSON, what each photo is for and whether no estimate used it."""
        return [
            {"purpose": pattern.purpose, "is_held_out": pattern.purpose in HELD_OUT_PURPOSES}
            for pattern in self.capture.plan.patterns
        ]

    def photo(self, number: int) -> bytes:
        """Pack the light of a photo, and the photo as it was taken less black, in photo units.

        Raises
        ------
        InputError
            If there is no such photo.
        UnreadableFileError
            If it is damaged.
        """
        count = len(self.capture.plan.patterns)
        if not 0 <= number < count:
            raise InputError(f"there is no photo {number}: choose one from 0 to {count - 1}.")
        pattern = self.capture.plan.draw(number).astype(np.float32) / LEVELS_OF_PATTERN
        shape = (*self.transport.projector, COLOUR)
        light = np.broadcast_to(pattern.reshape(*pattern.shape[:2], -1), shape)
        levels = np.rint(light * np.float32(WHITE_LEVEL)).astype(np.uint16)
        (taken,) = self.capture.read([number], slice(None))
        seen = self.transport.to_colours(taken - self.transport.stored.black())
        scale, halves = to_float16(self.transport.at_display_stride(seen))
        return pack({"scale": scale}, levels, halves)
