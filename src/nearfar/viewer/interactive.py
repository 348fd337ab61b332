"""A transport that is relit interactively: coarsely while the light moves, exactly once it rests.

While it moves, it is made of blocks of projector pixels where the projector has more than a few
hundred rows, and fewer camera pixels are relit if the machine is slow.

Index convention: camera pixels are [y, x]; parts of a frame are [component, y, x, colour], the
components being direct, near and far. Frames have 1 colour or 3.
"""

import threading
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from nearfar.applications.flat_fields import flat_fields
from nearfar.applications.reciprocity import Reciprocity, find_reciprocity
from nearfar.arrays import AnyPath, Floats, Size, middles
from nearfar.errors import InputError, NearfarError
from nearfar.files import luminance
from nearfar.transport.analysed import AnalysedLight
from nearfar.transport.coarse import block_means, in_blocks, size_in_blocks
from nearfar.transport.colour import as_channels_see
from nearfar.transport.model import Transport
from nearfar.transport.rows import FACTORS, of_pixels, of_rows, stacked, thinned_blocks
from nearfar.transport.stored import StoredTransport, open_transport
from nearfar.viewer.messages import Gains, Light, Split

# Factors of the coarse copy: relighting them takes some tens of milliseconds.
MAXIMUM_COARSE_BYTES = 160 * 2**20
# Factors of one block at rest: after each block a newer light may interrupt.
BLOCK_BYTES = 64 * 2**20
# Larger photos are displayed at every second row and column, every third, and so on.
MAXIMUM_DISPLAYED_PIXELS = 2**22
DEFAULT_MEMORY_BYTES = 2 * 10**9
# Larger lights are sent and relit as means over blocks of projector pixels while they move.
MAXIMUM_MOVING_LIGHT_PIXELS = 2**17
# Copies at one camera row and column in every coarse one, every second of them and every fourth.
PACES = 3
GREY, COLOUR = 1, 3
# Values are scaled to about this for float16, which ends at 65504; small values keep more digits.
FLOAT16_PEAK = 32768.0


class StoppedError(NearfarError):
    """The server has stopped during a computation."""


class Frame(NamedTuple):
    """The relit scene, taken apart, as a page displays it.

    Attributes
    ----------
    parts : ndarray of float16, shape (3, y, x, colours)
        Direct, near and far, in photo units times `scale`.
    scale : float
        A power of 2.
    stride : int
        Every how many rows and columns of the camera are there.
    exact : bool
        Whether every camera pixel that is displayed is there, under the light itself.
    split : {"model", "physical"}
        Whose components they are.
    """

    parts: NDArray[np.float16]
    scale: float
    stride: int
    exact: bool
    split: Split = "model"


class Relighting(Protocol):
    """What relights a scene for a page, into the three components of a split."""

    def relight_coarsely(self, light: Light, level: int = 0) -> Frame:
        """Relight at a level of detail, while the light may move on; 0 is the finest."""
        ...

    def relight_exactly(self, light: Light) -> Iterator[Frame | None]:
        """Relight every camera pixel that is displayed: None after each step, then the frame."""
        ...


class InteractiveTransport:
    """A stored transport with coarse copies in memory, and all of it if it fits.

    Attributes
    ----------
    light_block : int
        Side, in projector pixels, of the blocks that lights are made of while they move.
    flat_fields : FlatFields
        What dual views are divided by; none unless it is set.

    Parameters
    ----------
    path : str or Path
    memory : int
        Bytes of factors that are kept in memory; a larger transport is read from the disk again
        for each light at rest.
    progress : callable, optional
        Called with the share that has been read, from 0 to 1.

    Raises
    ------
    MissingFileError, UnreadableFileError
        As `nearfar.load_transport`.
    """

    def __init__(
        self,
        path: AnyPath,
        *,
        memory: int = DEFAULT_MEMORY_BYTES,
        progress: Callable[[float], None] | None = None,
    ) -> None:
        self.path = Path(path)
        self.stored: StoredTransport = open_transport(path)
        report = progress or (lambda _share: None)
        size = self.stored.nbytes
        camera = self.stored.camera
        self.flat_fields = flat_fields(
            None, None, camera, self.stored.projector, self.stored.channels
        )
        self.display_stride = int(np.ceil(np.sqrt(camera.pixels / MAXIMUM_DISPLAYED_PIXELS)))
        stride = int(np.ceil(np.sqrt(size / MAXIMUM_COARSE_BYTES)))
        self.coarse_stride = max(stride, self.display_stride)
        self._stopped = threading.Event()
        self._blocks_in_memory: list[Transport] | None = [] if size <= memory else None
        coarse: list[Transport] = []
        if self._blocks_in_memory is None:
            # Only the rows of the coarse copy are read.
            one_row, columns = middles(1, 1), middles(camera.width, self.coarse_stride)
            for row in middles(camera.height, self.coarse_stride):
                coarse.append(of_pixels(self.camera_row(int(row)), one_row, columns))
                report(row / camera.height)
        else:
            rows = 0
            for block in self.stored.blocks(BLOCK_BYTES):
                self._blocks_in_memory.append(block)
                rows += block.camera.height
                report(rows / camera.height)
            blocks = self._blocks_in_memory
            coarse = list(thinned_blocks(blocks, camera.height, self.coarse_stride))
        self.coarse = _join(coarse)
        self.light_block = _side_of_blocks(self.coarse)
        self._moving = [in_blocks(self.coarse, self.light_block)]
        while len(self._moving) < PACES:
            finer = self._moving[-1]
            self._moving.append(of_pixels(finer, *(middles(side, 2) for side in finer.camera)))

    @property
    def projector(self) -> Size:
        """Size of the pattern grid."""
        return self.stored.projector

    @property
    def colours(self) -> int:
        """Colours of a frame: 3 if the camera has as many channels, else 1."""
        return COLOUR if self.stored.channels >= COLOUR else GREY

    @property
    def levels(self) -> int:
        """How many levels of detail there are while the light moves."""
        return len(self._moving)

    def relight_coarsely(self, light: Light, level: int = 0) -> Frame:
        """Relight at a level of detail, while the light may move on; 0 is the finest."""
        is_whole = light.block == 1
        if is_whole and self.light_block > 1:
            means = block_means(light.levels, self.light_block)
            light = light._replace(levels=means, block=self.light_block)
        transport = self._moving[level]
        parts = self._parts(transport, self._analysed(transport, light), light)
        stride = self.coarse_stride * 2**level
        exact = is_whole and self.light_block == 1 and stride == self.display_stride
        return packed_frame(parts, stride, exact=exact)

    def relight_exactly(self, light: Light) -> Iterator[Frame | None]:
        """Relight every camera pixel that is displayed, block by block.

        Yields
        ------
        Frame or None
            None after each block, so that the caller may stop, and the frame at the end.
        """
        parts = []
        blocks = self.blocks()
        if self.display_stride > 1:
            blocks = thinned_blocks(blocks, self.stored.camera.height, self.display_stride)
        analysed: AnalysedLight | None = None
        for block in blocks:
            if block.camera.height:
                analysed = analysed or self._analysed(block, light)
                parts.append(self._parts(block, analysed, light))
            yield None
        yield packed_frame(np.concatenate(parts, axis=1), self.display_stride, exact=True)

    def relight(self, light: Light, gains: Gains) -> Floats:
        """Relight every camera pixel with gains of the components, as ``nearfar relight`` does.

        Returns
        -------
        ndarray, shape (Cy, Cx) or (Cy, Cx, channels), float32
        """
        channel_light = self.for_channels(light.as_array())
        given = gains.of_parts(self.stored.parts)
        analysed: AnalysedLight | None = None
        pictures = []
        for block in self.blocks():
            analysed = analysed or block.analyse(channel_light)
            pictures.append(block.relight(analysed, **given).astype(np.float32))
        return np.concatenate(pictures)

    def camera_row(self, y: int) -> Transport:
        """Return the transport of one row of camera pixels, from memory or from the disk."""
        first = 0
        for block in self._blocks_in_memory or ():
            if y < first + block.camera.height:
                return of_rows(block, slice(y - first, y - first + 1))
            first += block.camera.height
        return self.stored.rows(slice(y, y + 1))

    def whole(self) -> Transport:
        """Return the transport of all camera pixels.

        Raises
        ------
        InputError
            If it is larger than the memory for it.
        """
        if self._blocks_in_memory is None:
            needed = -(-self.stored.nbytes // 10**9)
            raise InputError(
                f"this needs the whole transport in memory: view it again with `memory` of "
                f"{needed}GB."
            )
        return self.coarse if self.coarse_stride == 1 else _join(self._blocks_in_memory)

    def at_display_stride(self, picture: NDArray[Any]) -> NDArray[Any]:
        """Return the rows and columns of a camera picture that are displayed."""
        return picture[np.ix_(*(middles(side, self.display_stride) for side in picture.shape[:2]))]

    @cached_property
    def reciprocity(self) -> Reciprocity:
        """How far-range light on the projector's side follows from that on the camera's."""
        return find_reciprocity(self.stored, self.blocks)

    def blocks(self) -> Iterator[Transport]:
        """Iterate over blocks of camera rows, from memory or from the disk.

        Raises
        ------
        StoppedError
            After `stop`.
        """
        blocks = self._blocks_in_memory
        for block in blocks if blocks is not None else self.stored.blocks(BLOCK_BYTES):
            self.require_running()
            yield block

    def require_running(self) -> None:
        """Raise `StoppedError` after `stop`."""
        if self._stopped.is_set():
            raise StoppedError("the page's server ends.")

    def stop(self) -> None:
        """End computations that are under way, when the server stops."""
        self._stopped.set()

    def to_colours(self, picture: Floats) -> Floats:
        """Turn a picture (y, x, channels) into one of `colours` colours, (y, x, colours)."""
        if self.colours == COLOUR:
            return picture[..., :COLOUR]
        return picture if picture.shape[-1] == 1 else picture.mean(axis=-1, keepdims=True)

    def for_channels(self, light: Floats) -> Floats:
        """Return the light that each channel of the camera sees of a coloured light."""
        try:
            return as_channels_see(light, self.stored.channels, self.stored.provenance)
        except InputError:
            # Without a colour calibration the channels are not red, green and blue.
            return luminance(light)

    def untinted(self, light: Light) -> Floats:
        """Return a light without its tint, (Py, Px) or (Py, Px, channels)."""
        if self._is_tinted(light):
            # Relighting once, for all channels, takes a third of the time.
            return light.levels
        return self.for_channels(light.as_array())

    def parts_in_colours(self, components: Sequence[Floats], camera: Size, light: Light) -> Floats:
        """Give three components under a light its tint, as a frame has them, (3, y, x, colours)."""
        tint = np.ones(1, dtype=np.float32)
        if self._is_tinted(light):
            tint = np.ravel(self.for_channels(light.colour[None, None]))
        pictures = [part.reshape(*camera, -1) * tint for part in components]
        return np.stack([self.to_colours(picture) for picture in pictures])

    def _analysed(self, transport: Transport, light: Light) -> AnalysedLight:
        """Return a light, without its tint, analysed for a transport."""
        return transport.analyse(self.untinted(light))

    def _parts(self, transport: Transport, analysed: AnalysedLight, light: Light) -> Floats:
        """Return direct, near and far under a light, (3, y, x, colours)."""
        return self.parts_in_colours(transport.components(analysed), transport.camera, light)

    @staticmethod
    def _is_tinted(light: Light) -> bool:
        """Whether a light is one of all channels times a colour."""
        return light.levels.ndim == 2 and not light.is_grey


def to_float16(values: Floats) -> tuple[float, NDArray[np.float16]]:
    """Return a power of 2, and the values multiplied by it in float16, none of which overflows."""
    peak = float(np.abs(values).max(initial=0.0))
    scale = 2.0 ** np.floor(np.log2(FLOAT16_PEAK / peak)) if peak > 0 else 1.0
    return float(scale), (values * np.float32(scale)).astype(np.float16)


def packed_frame(parts: Floats, stride: int, *, exact: bool, split: Split = "model") -> Frame:
    """Return the parts of a picture, (3, y, x, colours), as a frame."""
    scale, halves = to_float16(parts)
    return Frame(halves, scale, stride, exact, split)


def _side_of_blocks(transport: Transport) -> int:
    """Return the side of the blocks of projector pixels that moving lights are made of."""
    side = 1
    while (
        2 * side < transport.pitch
        and size_in_blocks(transport.projector, side).pixels > MAXIMUM_MOVING_LIGHT_PIXELS
    ):
        side *= 2
    return side


def _join(blocks: list[Transport]) -> Transport:
    """Stack blocks of camera rows, with factors in float32, which is quicker to relight."""
    whole = stacked(blocks)
    factors = {name: getattr(whole, name).astype(np.float32, copy=False) for name in FACTORS}
    return replace(whole, **factors)
