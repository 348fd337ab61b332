"""A second transport, which a page shows beside the first under the same light.

Index convention: pictures are [component, y, x, channel].
"""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from nearfar.arrays import AnyPath, Floats, Size
from nearfar.errors import InputError
from nearfar.files import kind_of_store
from nearfar.report.methods import counted
from nearfar.transport.exact_store import load_exact
from nearfar.transport.known import KnownTransport
from nearfar.transport.model import Transport
from nearfar.transport.rows import thinned_blocks
from nearfar.transport.store_format import KIND
from nearfar.viewer.interactive import DEFAULT_MEMORY_BYTES, InteractiveTransport
from nearfar.workflow.evaluate import exposure_of


class Beside(NamedTuple):
    """What is shown beside a transport.

    Attributes
    ----------
    name : str
        The file.
    remark : str
        What a reader must know of its units; often empty.
    is_apart : bool
        Whether direct, near- and far-range light are known apart.
    relight : callable
        Takes a light as channels see it. Yields None after each step of its work, and at the end
        the components of the camera pixels that are displayed, or the picture as the only one, in
        the photo units of the first transport.
    """

    name: str
    remark: str
    is_apart: bool
    relight: Callable[[Floats], Iterator[Floats | None]]


def open_beside(
    path: AnyPath,
    first: InteractiveTransport,
    *,
    memory: int = DEFAULT_MEMORY_BYTES,
    progress: Callable[[float], None] | None = None,
) -> Beside:
    """Open a transport to be shown beside another one.

    Parameters
    ----------
    path : str or Path
        Another reconstruction, or a transport that is known exactly: a file of ``nearfar render``,
        or a dense T as a .npy, .npz or Zarr array. What is known exactly is brought to the first
        transport's exposure, as ``nearfar evaluate`` does.
    first : InteractiveTransport
    memory : int
        Bytes of factors of a reconstruction that are kept in memory.
    progress : callable, optional
        Called with the share that has been read, from 0 to 1.

    Raises
    ------
    InputError
        If it is of other sizes than the first.
    MissingFileError, UnreadableFileError
        As `nearfar.load_transport` and `nearfar.load_exact`.
    """
    path = Path(path)
    if kind_of_store(path) == KIND:
        second = InteractiveTransport(path, memory=memory, progress=progress)
        stored = second.stored
        _require_sizes(first, path, stored.projector, stored.camera, stored.channels)
        return Beside(path.name, "", is_apart=True, relight=_relights_stored(second))
    known = _load_known(path, first)
    _require_sizes(first, path, known.projector, known.camera, known.channels)
    exposure = exposure_of(first.whole(), known)
    fitted = f"{path.name} times {exposure.factor:.4g}, the exposure that fits best"
    return Beside(
        path.name,
        fitted if exposure.is_fitted else "",
        known.is_apart,
        _relights_known(known, exposure.factor, first),
    )


def _load_known(path: Path, first: InteractiveTransport) -> KnownTransport:
    try:
        return load_exact(path, projector=first.projector, camera=first.stored.camera)
    except InputError as error:
        # Sizes are given here: what does not fit them is of another scene.
        found, _, cure = str(error).rpartition(": ")
        if "`projector`" in cure or "`camera`" in cure:
            raise InputError(f"{found}: view two of the same scene and sizes.") from None
        raise


def _require_sizes(
    first: InteractiveTransport, path: Path, projector: Size, camera: Size, channels: int
) -> None:
    stored = first.stored
    if (projector, camera, channels) != (stored.projector, stored.camera, stored.channels):
        raise InputError(
            f"{path} is of a projector of {projector}, a camera of {camera} and "
            f"{counted(channels, 'channel')}, {first.path} of {stored.projector}, "
            f"{stored.camera} and {stored.channels}: view two of the same scene and sizes."
        )


def _relights_stored(second: InteractiveTransport) -> Callable[[Floats], Iterator[Floats | None]]:
    def relight(light: Floats) -> Iterator[Floats | None]:
        height, stride = second.stored.camera.height, second.display_stride
        pictures = []
        for block in thinned_blocks(second.blocks(), height, stride):
            pictures.append(_components(block, light))
            yield None
        yield np.concatenate(pictures, axis=1)

    return relight


def _components(block: Transport, light: Floats) -> Floats:
    shape = (*block.camera, block.channels)
    return np.stack([part.reshape(shape) for part in block.components(light)])


def _relights_known(
    known: KnownTransport, exposure: float, first: InteractiveTransport
) -> Callable[[Floats], Iterator[Floats | None]]:
    def relight(light: Floats) -> Iterator[Floats | None]:
        pictures = known.component_pictures(light) if known.is_apart else (known @ light,)
        shape = (*known.camera, known.channels)
        yield np.stack(
            [
                np.float32(exposure) * first.at_display_stride(part.reshape(shape))
                for part in pictures
            ]
        )

    return relight
