"""Light by how far from q it comes: probing, for a page.

Index convention: pictures are [y, x, colour].
"""

from collections.abc import Generator, Iterable, Iterator
from typing import Annotated

import numpy as np
from pydantic import Field

from nearfar.applications.masks import ProbingMask
from nearfar.applications.probe import ProbedLight, probed_light
from nearfar.arrays import Floats, blocks
from nearfar.errors import InputError
from nearfar.transport.model import Transport
from nearfar.transport.rows import of_rows, thinned_blocks
from nearfar.viewer.interactive import InteractiveTransport, to_float16
from nearfar.viewer.messages import LightHeader, pack, unpack_levels
from nearfar.viewer.tools.few_pixels import few_pixels

# Entries of the transport that are masked in one step: some tenths of a second.
STEP_ENTRIES = 2**24
# The same of a whole picture while the light or the reach moves; it has no fewer camera pixels
# than these.
COARSE_ENTRIES = 2**23
LEAST_PIXELS = 1024
# Entries that a camera pixel counts as in a step where rows of the transport are not drawn.
ENTRIES_BY_RUNS = 2**9
MAXIMUM_EDGES = 12

# In projector pixels.
Distance = Annotated[float, Field(ge=0.0, le=1e6)]


class ReachHeader(LightHeader):
    """The header of a light whose reach is chosen.

    Attributes
    ----------
    inner, outer : float
        Light from at least `inner` and less than `outer` projector pixels from q; from any distance
        where `outer` is None.
    coarse : bool
        Whether a few camera pixels suffice.
    """

    inner: Distance = 0.0
    outer: Distance | None = None
    coarse: bool = False


class DistancesHeader(LightHeader):
    """The header of a light that is taken apart by distance.

    Attributes
    ----------
    edges : tuple of float
        Where one ring ends and the next begins, in projector pixels, ascending, above 0.
    """

    edges: Annotated[tuple[Distance, ...], Field(min_length=1, max_length=MAXIMUM_EDGES)]


def by_reach(transport: InteractiveTransport, message: bytes) -> Iterator[bytes | None]:
    """Make the picture by light from some distances.

    Raises
    ------
    InputError
        If the message is wrong, or the transport has no q.
    """
    header, light = unpack_levels(ReachHeader, message, transport.projector)
    _require_places(transport)
    levels, mask = transport.for_channels(light.as_array()), _mask(header.inner, header.outer)
    camera = transport.stored.camera
    if header.coarse:
        parts: Iterable[Transport] = [coarse := _coarse(transport)]
        camera = coarse.camera
    else:
        stride = transport.display_stride
        parts = thinned_blocks(transport.blocks(), transport.stored.camera.height, stride)
    pictures: list[Floats] = []
    probed: ProbedLight | None = None
    for part in parts:
        probed = probed or probed_light(part, levels, mask, camera)
        first = sum(picture.shape[0] * picture.shape[1] for picture in pictures)
        pictures.append((yield from _probed(part, probed, first)))
    picture = np.concatenate(pictures)
    scale, halves = to_float16(transport.to_colours(picture))
    yield pack({"scale": scale, "coarse": header.coarse}, halves)


def by_distance(transport: InteractiveTransport, message: bytes) -> Iterator[bytes | None]:
    """Make small pictures by light from each of some rings, and from beyond the last.

    Raises
    ------
    InputError
        If the message is wrong, or the transport has no q.
    """
    header, light = unpack_levels(DistancesHeader, message, transport.projector)
    _require_places(transport)
    levels, coarse = transport.for_channels(light.as_array()), _coarse(transport)
    # Rings are differences of discs, each of which is probed once.
    discs = [np.zeros((*coarse.camera, coarse.channels), dtype=np.float32)]
    probed = probed_light(coarse, levels, ProbingMask.beyond(1), coarse.camera)
    for edge in header.edges:
        disc = yield from _probed(coarse, probed.by(ProbingMask.within(edge)))
        discs.append(disc)
    discs.append((coarse @ levels).reshape(discs[0].shape))
    rings = np.diff(np.stack(discs), axis=0)
    total = float(discs[-1].sum())
    shares = [float(ring.sum()) / total if total > 0 else 0.0 for ring in rings]
    scale, halves = to_float16(np.stack([transport.to_colours(ring) for ring in rings]))
    yield pack({"scale": scale, "shares": shares}, halves)


def _mask(inner: float, outer: float | None) -> ProbingMask:
    if outer is None:
        return ProbingMask.beyond(inner)
    return ProbingMask.ring(inner, outer) if inner else ProbingMask.within(outer)


def _require_places(transport: InteractiveTransport) -> None:
    if "direct" not in transport.stored.parts:
        raise InputError(
            "light has no distance here: this transport is of lamps, and has no correspondence."
        )


def _coarse(transport: InteractiveTransport) -> Transport:
    """Return so few camera pixels that they are probed at once."""
    entries = transport.projector.pixels * transport.stored.channels
    return few_pixels(transport, max(COARSE_ENTRIES // entries, LEAST_PIXELS))


def _probed(part: Transport, probed: ProbedLight, first: int = 0) -> Generator[None, None, Floats]:
    """Probe a part of a camera, some rows in each step; return the picture, (y, x, channels).

    Its first camera pixel has the number `first`.
    """
    picture = np.empty((*part.camera, part.channels), dtype=np.float32)
    entries = ENTRIES_BY_RUNS if probed.sums else part.projector.pixels
    of_row = part.camera.width * part.channels * entries
    for rows in blocks(part.camera.height, max(1, STEP_ENTRIES // of_row)):
        found = probed.picture(of_rows(part, rows), first + rows.start * part.camera.width)
        picture[rows] = found.reshape(picture[rows].shape)
        yield
    return picture
