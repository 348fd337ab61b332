"""Comparison of a transport with photos in bands of camera rows."""

from collections.abc import Callable, Sequence

import numpy as np

from nearfar.arrays import Booleans, Floats, Size, blocks
from nearfar.transport.model import Transport
from nearfar.transport.rows import stacked
from nearfar.transport.stored import StoredTransport
from nearfar.workflow.verdict.bars import Bars, bars_of
from nearfar.workflow.verdict.held_out import HeldOutLight, joined

# Camera pixels that are compared, about, in bands of this many rows.
CAMERA_PIXELS = 2**17
ROWS_PER_BAND = 8
# The same at a pitch of several projector pixels, where all bands are compared at once.
CAMERA_PIXELS_AT_PITCH, BANDS_AT_PITCH = 2**15, 8
# Camera pixels of a slice of rows of a small camera, about.
PIXELS_PER_SLICE = 2**14


def bands(camera: Size, pitch: int = 1) -> list[slice]:
    """Return bands of rows of a camera, spread evenly, about `CAMERA_PIXELS` in all.

    Parameters
    ----------
    camera : Size
    pitch : int
        Of the transport; see `nearfar.Transport`.
    """
    if pitch > 1:
        every = list(blocks(camera.height, -(-camera.height // BANDS_AT_PITCH)))
        most = max(1, CAMERA_PIXELS_AT_PITCH // (camera.width * len(every)))
        middles = [(rows.start + rows.stop) // 2 for rows in every]
        firsts = [max(0, middle - most // 2) for middle in middles]
        return [
            slice(max(first, rows.start), min(first + most, rows.stop))
            for first, rows in zip(firsts, every, strict=True)
        ]
    # Whole rows, which files are read by. Nothing is estimated and no photo is kept, so that there
    # may be many more of them than `choose_rows` and `sampled_lines` choose.
    every = list(blocks(camera.height, ROWS_PER_BAND))
    step = max(1, round(camera.pixels / CAMERA_PIXELS))
    return every[step // 2 :: step] or every[:1]


def sampled_rows(camera: Size) -> list[slice]:
    """Return rows of a camera, all of a small one, otherwise about `CAMERA_PIXELS` spread evenly.

    For what is done to each camera pixel by itself. A photo of up to some megapixels is one chunk,
    which is decoded whole for each slice: there are few of them.
    """
    step = max(1, round(camera.pixels / CAMERA_PIXELS))
    if step > 1:
        return [slice(min(step // 2, camera.height - 1), camera.height, step)]
    return list(blocks(camera.height, max(ROWS_PER_BAND, PIXELS_PER_SLICE // camera.width)))


def usable_pixels(block: Transport) -> Booleans:
    """Return which camera pixels of a block of rows are not saturated, shape (C,)."""
    if block.quality is None:
        return np.ones(block.camera.pixels, dtype=bool)
    return ~block.quality.saturated.ravel()


def compare_in_bands(
    transport: StoredTransport,
    compare: Callable[[Transport, Bars | None, Sequence[slice]], Sequence[HeldOutLight]],
    progress: Callable[[float], None],
) -> tuple[HeldOutLight, ...]:
    """Compare a transport with photos under some lights, in the bands of its camera.

    Bands whose camera pixels are all saturated are skipped. At a pitch of several projector pixels
    lights are blurred first, so all bands are compared together.

    Parameters
    ----------
    transport : StoredTransport
        Of the camera's pixels, not a square T.
    compare : callable
        Called with the transport of one or several bands, its error bars and the rows of each band.
        Returns the comparison under each light, always in the same order.
    progress : callable
        Called with the share of the camera that is done.

    Returns
    -------
    tuple of HeldOutLight
        Of each light, over all bands; empty if every camera pixel is saturated.
    """
    found: Sequence[HeldOutLight] = ()
    every = bands(transport.camera, transport.pitch)
    for some in [every] if transport.pitch > 1 else [[rows] for rows in every]:
        read = [(rows, transport.rows(rows)) for rows in some]
        usable = [(rows, block) for rows, block in read if usable_pixels(block).any()]
        if not usable:
            continue
        block = stacked([block for _, block in usable])
        compared = compare(block, bars_of(block), [rows for rows, _ in usable])
        found = [joined(*both) for both in zip(found, compared, strict=True)] if found else compared
        progress(some[-1].stop / transport.camera.height)
    return tuple(found)


def of_bands(read: Callable[[slice], Floats], bands: Sequence[slice]) -> Floats:
    """Read each band's camera pixels, (..., C, channels), and join them band after band."""
    return np.concatenate([read(rows) for rows in bands], axis=-2)
