"""A region of the camera picture: its mean row, spectrum, light and noise, for a page.

Index convention: regions are camera pixels [y, x], rows of the transport projector pixels [y, x].
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from nearfar.arrays import Floats, blocks
from nearfar.errors import InputError
from nearfar.estimate.error_bars import ErrorBars
from nearfar.estimate.physical import PhysicalErrorBars
from nearfar.transport import near
from nearfar.transport.model import Transport
from nearfar.transport.rows import of_pixels, stacked
from nearfar.viewer.interactive import InteractiveTransport
from nearfar.viewer.messages import LightHeader, pack, unpack_levels
from nearfar.viewer.physical import PhysicalRelighting
from nearfar.viewer.transport_row import bands_of, in_decibels, magnitude_of

# Values of a step, camera pixels times channels: some tenths of a second.
STEP_VALUES = 2**13
# The spectrum is one of at most so many camera pixels, whose rows have so many entries in all.
SPECTRUM_PIXELS = 256
SPECTRUM_ENTRIES = 2**24
FAR_PARTS = ("far", "free")


class RegionHeader(LightHeader):
    """The header of a light under which a region is looked at.

    Attributes
    ----------
    top, left, bottom, right : int
        First row and column of the camera, and the ones after the last.
    """

    top: int
    left: int
    bottom: int
    right: int


class _Light(NamedTuple):
    """Light of camera pixels under one light, (n, channels) each.

    Attributes
    ----------
    components : dict of str to ndarray
    sigma : ndarray or None
        Standard deviation of the sum, infinite where it is unknown; None without error bars.
    """

    components: dict[str, Floats]
    sigma: Floats | None


def region_of(
    physical: PhysicalRelighting, transport: InteractiveTransport, message: bytes
) -> Iterator[bytes | None]:
    """Average a region, some of its camera pixels in each step.

    Its result has the mean row of direct and near-range light, that of far-range light, and the
    root of the rows' mean power at each spatial frequency in dB, 0 for the largest. Its header has,
    channel by channel, the mean light and that of each component, the spread of the light over the
    region, and of one camera pixel the standard deviation and a measurement's noise, as roots of
    mean squares.

    Raises
    ------
    InputError
        If the message is wrong, or there is no such region.
    """
    header, light = unpack_levels(RegionHeader, message, transport.projector)
    camera, projector = transport.stored.camera, transport.projector
    if not (
        0 <= header.top < header.bottom <= camera.height
        and 0 <= header.left < header.right <= camera.width
    ):
        raise InputError(
            f"rows {header.top} to {header.bottom} and columns {header.left} to {header.right} are "
            f"no region of the camera of {camera}: choose one within it."
        )
    levels = transport.for_channels(light.as_array())
    split = physical if header.split == "physical" and physical.is_prepared else None
    rows, spectrum = np.zeros((2, *projector)), _Spectrum(transport, header)
    parts, lights = [], []
    for first, part in _parts(transport, header):
        lights.append(_light_of(part, levels, split, (first, header.left)))
        rows += _rows(part)
        parts.append(_without_rows(part))
        yield None
        spectrum.add(first, part)
        yield None
    whole = stacked(parts)
    direct_and_near, far = (rows / whole.camera.pixels).astype(np.float32)
    q = whole.correspondence[whole.lit]
    middle = np.median(q, axis=0) if len(q) else np.full(2, np.nan)
    yield pack(
        {
            "split": "physical" if split else "model",
            **_counts(whole),
            **_means(whole, lights),
            "q": middle.tolist() if len(q) else None,
            # About the middle, all of the region's windows are in it.
            "window": _breadth(transport, q),
            "line": near.line_through(middle, projector),
            "spectrum_pixels": spectrum.pixels,
            **bands_of(part),
        },
        direct_and_near,
        far,
        in_decibels(np.sqrt(spectrum.power)),
    )


def _parts(
    transport: InteractiveTransport, header: RegionHeader
) -> Iterator[tuple[int, Transport]]:
    """Yield the transport of some rows of a region, with the camera row that is their first."""
    columns = np.arange(header.left, header.right)
    step = max(1, STEP_VALUES // (len(columns) * transport.stored.channels))
    for some in blocks(header.bottom - header.top, step):
        lines = range(header.top + some.start, header.top + some.stop)
        only = np.zeros(1, dtype=np.int64)
        yield (
            lines.start,
            stacked([of_pixels(transport.camera_row(y), only, columns) for y in lines]),
        )


def _light_of(
    part: Transport,
    levels: Floats,
    physical: PhysicalRelighting | None,
    corner: tuple[int, int],
) -> _Light:
    """Return the light of some camera pixels, the first of which is `corner`."""
    bars: ErrorBars | PhysicalErrorBars | None = None
    if physical is None:
        components = part.named(part.components(levels))
        bars = ErrorBars(part) if part.has_error_bars else None
    else:
        rows, columns = (
            np.arange(first, first + side) for first, side in zip(corner, part.camera, strict=True)
        )
        split = physical.pixels(rows, columns)
        components = split.components(levels)._asdict()
        bars = PhysicalErrorBars(split) if part.has_error_bars else None
    return _Light(
        {name: _flat(picture, part) for name, picture in components.items()},
        None if bars is None else _flat(bars.picture(levels), part),
    )


def _flat(picture: Floats, part: Transport) -> Floats:
    """Return values by camera pixel and channel, float64."""
    return picture.reshape(-1, part.channels).astype(np.float64)


def _without_rows(part: Transport) -> Transport:
    """Return a part of a transport without its rows, which are as large as the region."""
    empty = np.zeros((*part.camera, part.channels, 0), dtype=np.float32)
    return replace(
        part,
        near=empty[..., None],
        far=empty,
        posterior=None,
        footprint=None,
        second_place=None,
        second_direct=None,
    )


def _rows(part: Transport) -> Floats:
    """Return sums of rows of direct and near-range light, and of far-range light, (2, Py, Px)."""
    image = np.ones((*part.camera, part.channels), dtype=np.float32)
    found = []
    for is_far in (False, True):
        gains = {name: 0.0 for name in part.parts if (name in FAR_PARTS) != is_far}
        chosen = part.with_gains(**gains) if gains else part
        found.append(chosen.adjoint(image).reshape(*part.projector, -1).mean(axis=-1))
    return np.stack(found)


class _Spectrum:
    """The mean power of rows by spatial frequency, of camera pixels spread over a region."""

    def __init__(self, transport: InteractiveTransport, header: RegionHeader) -> None:
        self._width = header.right - header.left
        self._top = header.top
        number = (header.bottom - header.top) * self._width
        entries = transport.projector.pixels * transport.stored.channels
        most = min(number, SPECTRUM_PIXELS, max(1, SPECTRUM_ENTRIES // entries))
        # Of the middles of equal runs of camera pixels.
        self._chosen = ((np.arange(most) + 0.5) * number / most).astype(np.int64)
        self.pixels = most
        self.power = np.zeros(transport.projector)

    def add(self, first: int, part: Transport) -> None:
        """Add those of the chosen camera pixels that are in some rows of the camera."""
        before = (first - self._top) * self._width
        mine = self._chosen - before
        for c in mine[(mine >= 0) & (mine < part.camera.pixels)]:
            row = part.rows(slice(int(c), int(c) + 1))[0].mean(axis=0)
            self.power += magnitude_of(row.reshape(part.projector)) ** 2 / self.pixels


def _breadth(transport: InteractiveTransport, q: Floats) -> int:
    """Return the side of the square about the middle of a region's q that has all its windows."""
    window = transport.coarse.window * transport.coarse.pitch
    if not len(q):
        return window
    reach = float(np.abs(q - np.median(q, axis=0)).max())
    return min(window + 2 * int(np.ceil(reach)), 2 * max(transport.projector))


def _counts(region: Transport) -> dict[str, int]:
    """Count camera pixels: all of a region, those without direct light, those saturated."""
    without = int((~region.lit).sum()) if "direct" in region.parts else 0
    saturated = 0 if region.quality is None else int(region.quality.saturated.sum())
    return {
        "pixels": region.camera.pixels,
        "without_direct": without,
        "saturated": saturated,
    }


def _means(region: Transport, lights: Sequence[_Light]) -> dict[str, Any]:
    """Return means over a region, channel by channel, and roots of mean squares."""
    components = {
        name: np.concatenate([each.components[name] for each in lights])
        for name in lights[0].components
    }
    whole = np.sum(list(components.values()), axis=0)
    sigma = None
    if all(each.sigma is not None for each in lights):
        found = np.concatenate([each.sigma for each in lights if each.sigma is not None])
        known = found[np.isfinite(found).all(axis=1)]
        sigma = _root_mean_square(known).tolist() if len(known) else None
    return {
        "light": whole.mean(axis=0).tolist(),
        "components": {name: each.mean(axis=0).tolist() for name, each in components.items()},
        "spread": whole.std(axis=0).tolist(),
        "noise": _root_mean_square(_flat(region.noise, region)).tolist(),
        "sigma": sigma,
    }


def _root_mean_square(values: Floats) -> Floats:
    return np.asarray(np.sqrt((values**2).mean(axis=0)))
