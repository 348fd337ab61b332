"""The physical split of a transport, relit interactively once it has been made.

A split takes seconds or, for large scenes, minutes. It is made when the first page asks for it.
"""

from collections.abc import Iterator

import numpy as np

from nearfar.arrays import Floats, Integers, middles
from nearfar.errors import InputError
from nearfar.estimate.physical.elsewhere import Elsewhere
from nearfar.estimate.physical.split import PhysicalComponents, PhysicalSplit, Translucent
from nearfar.estimate.physical.splitting import split_physically
from nearfar.transport.rows import of_pixels
from nearfar.viewer.interactive import Frame, InteractiveTransport, packed_frame
from nearfar.viewer.messages import Gains, Light


class PhysicalRelighting:
    """A transport's direct, subsurface and inter-reflected light, for pages.

    Parameters
    ----------
    transport : InteractiveTransport
    """

    def __init__(self, transport: InteractiveTransport) -> None:
        self._transport = transport
        self._whole: PhysicalSplit | None = None
        # Of the camera pixels that are displayed, and of fewer and fewer while the light moves.
        self._displayed: PhysicalSplit | None = None
        self._moving: list[PhysicalSplit] = []
        self._fault: InputError | None = None

    @property
    def is_prepared(self) -> bool:
        """Whether the split has been made."""
        return bool(self._moving)

    def prepare(self) -> int:
        """Split the transport, unless that is done; return how many translucent bodies it has.

        Raises
        ------
        InputError
            If it cannot be split physically, or is larger than the memory for it.
        """
        if self._fault is not None:
            raise self._fault
        if self._whole is None:
            try:
                self._whole = split_physically(self._transport.whole())
            except InputError as fault:
                self._fault = fault
                raise
            displayed = self._transport.display_stride
            self._displayed = _every(self._whole, displayed)
            strides = [
                self._transport.coarse_stride * 2**level for level in range(self._transport.levels)
            ]
            # All of them at once: what relights looks whether there are any.
            self._moving = [
                self._displayed if stride == displayed else _every(self._whole, stride)
                for stride in strides
            ]
        return len(self._whole.bodies)

    def relight_coarsely(self, light: Light, level: int = 0) -> Frame:
        """Relight at a level of detail, while the light may move on; 0 is the finest."""
        parts = self._parts(self._moving[level], light)
        stride = self._transport.coarse_stride * 2**level
        exact = light.block == 1 and stride == self._transport.display_stride
        return packed_frame(parts, stride, exact=exact, split="physical")

    def relight_exactly(self, light: Light) -> Iterator[Frame | None]:
        """Relight every camera pixel that is displayed, in one step."""
        parts, stride = self._parts(self.displayed, light), self._transport.display_stride
        yield packed_frame(parts, stride, exact=True, split="physical")

    @property
    def displayed(self) -> PhysicalSplit:
        """The split of the camera pixels that are displayed."""
        assert self._displayed is not None
        return self._displayed

    def pixels(self, rows: Integers, columns: Integers) -> PhysicalSplit:
        """Return the split of the camera pixels in some rows and columns."""
        assert self._whole is not None
        return _of_pixels(self._whole, rows, columns)

    def relight(self, light: Light, gains: Gains) -> Floats:
        """Relight every camera pixel with gains, as ``nearfar relight`` does."""
        assert self._whole is not None
        channel_light = self._transport.for_channels(light.as_array())
        given = gains.of(PhysicalComponents._fields)
        return self._whole.relight(channel_light, **given).astype(np.float32)

    def _parts(self, split: PhysicalSplit, light: Light) -> Floats:
        """Return direct, subsurface and inter-reflected light, (3, y, x, colours)."""
        levels = self._transport.untinted(light)
        if light.block > 1:
            # Light under a surface spreads over projector pixels, not over blocks of them.
            height, width = self._transport.projector
            levels = levels.repeat(light.block, 0).repeat(light.block, 1)[:height, :width]
        parts = split.components(levels)
        return self._transport.parts_in_colours(parts, split.transport.camera, light)


def _every(split: PhysicalSplit, stride: int) -> PhysicalSplit:
    """Return the split of one camera row and column in every few."""
    if stride == 1:
        return split
    return _of_pixels(split, *(middles(side, stride) for side in split.transport.camera))


def _of_pixels(split: PhysicalSplit, rows: Integers, columns: Integers) -> PhysicalSplit:
    """Return the split of the camera pixels in some rows and columns."""
    places = np.full(split.transport.camera, -1)
    places[np.ix_(rows, columns)] = np.arange(len(rows) * len(columns)).reshape(len(rows), -1)
    return PhysicalSplit(
        of_pixels(split.transport, rows, columns),
        split.direct[np.ix_(rows, columns)],
        tuple(_body_of(body, places.ravel()) for body in split.bodies),
        _elsewhere_of(split.elsewhere, places.ravel()),
        None if split.footprint is None else split.footprint[np.ix_(rows, columns)],
        None if split.own_share is None else split.own_share[np.ix_(rows, columns)],
    )


def _body_of(body: Translucent, places: Integers) -> Translucent:
    """Return a body of the camera pixels that have a place, 0 or more."""
    kept = places[body.pixels] >= 0
    return body._replace(
        pixels=places[body.pixels[kept]],
        places=body.places[kept],
        slope=body.slope[kept],
        amplitude=body.amplitude[kept],
        explained=body.explained[kept],
    )


def _elsewhere_of(elsewhere: Elsewhere, places: Integers) -> Elsewhere:
    kept = elsewhere.of(places[elsewhere.pixels] >= 0)
    return kept._replace(pixels=places[kept.pixels])
