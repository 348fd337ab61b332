"""A transport that is looked at: at once while the light moves, exactly once it rests.

Index convention: camera pixels are [y, x]; pictures for the page are (3, y, x, colours), direct,
near and far, colours 1 or 3.
"""

import threading
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import AnyPath, Floats, Size, middles
from nearfar.errors import InputError, NearfarError
from nearfar.files import luminance
from nearfar.transport.colour import as_channels_see
from nearfar.transport.model import Transport
from nearfar.transport.rows import FACTORS, of_pixels, stacked, thinned_blocks
from nearfar.transport.store import StoredTransport, open_transport
from nearfar.viewer.messages import Light

# Bytes of the factors that are gone through while the light moves: some tens of milliseconds.
QUICK = 160 * 2**20
# Bytes of a block at rest: between two of them a light that moves on is noticed.
STEADY = 64 * 2**20
# Camera pixels that a page shows at most; of larger photos every second row and column, and so on.
SHOWN = 2**22
# Bytes that a whole transport may take in memory, unless told otherwise.
MEMORY = 2 * 10**9
GREY, COLOUR = 1, 3
# float16 ends at 65504; the larger, the fewer digits are lost in the dark.
HIGHEST = 32768.0


class GivenUpError(NearfarError):
    """What was under way when the server was told to end."""


class Shown(NamedTuple):
    """A picture for the page.

    Attributes
    ----------
    parts : ndarray of float16, shape (3, y, x, colours)
        Direct, near, far.
    scale : float
        What they are multiplied by, a power of 2.
    step : int
        Every so many rows and columns of the camera are shown.
    """

    parts: NDArray[np.float16]
    scale: float
    step: int


class ViewedTransport:
    """A transport on the disk, held as far as memory goes.

    Parameters
    ----------
    path : str or Path
    memory : int
        Bytes that its factors may take; a larger one is read again for each light at rest.
    progress : callable, optional
        Called with the share that is read.

    Raises
    ------
    MissingFileError, UnreadableFileError
        As `nearfar.load_transport`.
    """

    def __init__(
        self,
        path: AnyPath,
        *,
        memory: int = MEMORY,
        progress: Callable[[float], None] | None = None,
    ) -> None:
        self.path = Path(path)
        self.stored: StoredTransport = open_transport(path)
        told = progress or (lambda _share: None)
        size = self.stored.nbytes
        camera = self.stored.camera
        # What is moved through, and what a page shows at rest.
        self.step = int(np.ceil(np.sqrt(size / QUICK)))
        self.shown_step = int(np.ceil(np.sqrt(camera.pixels / SHOWN)))
        self.step = max(self.step, self.shown_step)
        self._given_up = threading.Event()
        self._held: list[Transport] | None = [] if size <= memory else None
        quick: list[Transport] = []
        if self._held is None:
            # Of what is not held only the rows that are gone through are read.
            alone, columns = middles(1, 1), middles(camera.width, self.step)
            for row in middles(camera.height, self.step):
                quick.append(of_pixels(self.row_of_camera(int(row)), alone, columns))
                told(row / camera.height)
        else:
            first = 0
            for part in self.stored.blocks(STEADY):
                self._held.append(part)
                first += part.camera.height
                told(first / camera.height)
            quick = list(thinned_blocks(self._held, camera.height, self.step))
        self.quick = _joined(quick)

    @property
    def projector(self) -> Size:
        """Pattern grid."""
        return self.stored.projector

    @property
    def colours(self) -> int:
        """Of the pictures that are shown: 1 or 3."""
        return COLOUR if self.stored.channels >= COLOUR else GREY

    def at_once(self, light: Light) -> Shown:
        """Relight what is gone through while the light moves."""
        return self._shown(self._parts(self.quick, light), self.step)

    @property
    def is_quick(self) -> bool:
        """Whether what is shown while the light moves is all there is to show."""
        return self.step == self.shown_step

    def at_rest(self, light: Light) -> Iterator[Shown | None]:
        """Relight every camera pixel that is shown: nothing after each block, then the picture."""
        found = []
        shown = self.blocks()
        if self.shown_step > 1:
            shown = thinned_blocks(shown, self.stored.camera.height, self.shown_step)
        for part in shown:
            if part.camera.height:
                found.append(self._parts(part, light))
            yield None
        yield self._shown(np.concatenate(found, axis=1), self.shown_step)

    def relight(self, light: Light, *, direct: float, near: float, far: float) -> Floats:
        """Relight every camera pixel, float32, as ``nearfar relight`` does."""
        seen = self._as_seen(light.whole())
        gains = {"direct": direct, "near": near, "far": far}
        parts = [part.relight(seen, **gains).astype(np.float32) for part in self.blocks()]
        return np.concatenate(parts)

    def row_of_camera(self, y: int) -> Transport:
        """Return the transport of one row of the camera."""
        return self.stored.rows(slice(y, y + 1))

    def thinned_out(self, picture: NDArray[Any]) -> NDArray[Any]:
        """Return what of a picture of the camera's size is shown at rest."""
        step = self.shown_step
        return picture[np.ix_(*(middles(side, step) for side in self.stored.camera))]

    def blocks(self) -> Iterator[Transport]:
        """Go through blocks of camera rows; GivenUpError after `give_up`."""
        for part in self._held if self._held is not None else self.stored.blocks(STEADY):
            if self._given_up.is_set():
                raise GivenUpError("the page's server ends.")
            yield part

    def give_up(self) -> None:
        """End what is under way: nobody waits for it any more."""
        self._given_up.set()

    def _as_seen(self, light: Floats) -> Floats:
        """Turn a light or a colour into one for each channel of the camera."""
        try:
            return as_channels_see(light, self.stored.channels, self.stored.provenance)
        except InputError:
            return luminance(light)

    @staticmethod
    def _shown(parts: Floats, step: int) -> Shown:
        scale, halves = in_half(parts)
        return Shown(halves, scale, step)

    def _parts(self, transport: Transport, light: Light) -> Floats:
        if light.is_grey or light.levels.ndim == 3:
            seen, tint = self._as_seen(light.whole()), np.ones(1, dtype=np.float32)
        else:
            # One light for all channels takes a third of the time of three.
            seen, tint = light.levels, np.ravel(self._as_seen(light.colour[None, None]))
        parts = transport.components(seen)
        pictures = [part.reshape(*transport.camera, -1) * tint for part in parts]
        return np.stack([self.in_colours(part) for part in pictures])

    def in_colours(self, picture: Floats) -> Floats:
        """Turn a picture (y, x, channels) into one that a page can show, (y, x, colours)."""
        if self.colours == COLOUR:
            return picture[..., :COLOUR]
        return picture if picture.shape[-1] == 1 else picture.mean(axis=-1, keepdims=True)


def in_half(values: Floats) -> tuple[float, NDArray[np.float16]]:
    """Return a power of 2, and values times it in float16, none of which it is too short for."""
    most = float(np.abs(values).max(initial=0.0))
    scale = 2.0 ** np.floor(np.log2(HIGHEST / most)) if most > 0 else 1.0
    return float(scale), (values * np.float32(scale)).astype(np.float16)


def _joined(parts: list[Transport]) -> Transport:
    """Put the quick copy together; windows and bands in float32, which is quicker to go through."""
    whole = stacked(parts)
    floats = {name: getattr(whole, name).astype(np.float32, copy=False) for name in FACTORS}
    return replace(whole, **floats)
