"""A transport split as physics does: direct light, subsurface light and inter-reflection.

The model's near-range light is all that lies about q: light under a surface, and light of creases
and contacts. Here light under a surface has the shape of a dipole that the camera pixels of a body
share, what it adds at q is taken from direct light, and all the rest is inter-reflection. The sum
is the transport as it was.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy import ndimage, signal

from nearfar.arrays import Floats, Integers
from nearfar.checks import require_instance
from nearfar.errors import InputError
from nearfar.estimate.physical.body import KERNEL_RADIUS, Body, body_at
from nearfar.estimate.physical.kernels import kernel
from nearfar.estimate.physical.medium import SLOPES, Medium, medium_of
from nearfar.estimate.physical.translucent import SQUARE, translucent
from nearfar.transport.dipole import Dipole
from nearfar.transport.direct import Footprint, footprint, look_up
from nearfar.transport.model import Transport

# A body whose light about q the kernels explain to a lesser share is not translucent.
LEAST_EXPLAINED = 0.7
# Kernels end where the light is down by exp(-FADED), or at the size of the projector.
FADED = 7.0


class PhysicalComponents(NamedTuple):
    """Pictures under one light, each (Cy, Cx) or (Cy, Cx, channels)."""

    direct: Floats
    subsurface: Floats
    interreflection: Floats


class Translucent(NamedTuple):
    """A translucent body of a transport.

    Attributes
    ----------
    pixels : ndarray of int, shape (n,)
        Its camera pixels, flattened row by row.
    coverage : ndarray, shape (Py, Px)
        Share of each projector pixel that lights it.
    media : tuple of Medium
        One for each channel.
    """

    pixels: Integers
    coverage: Floats
    media: tuple[Medium, ...]


@dataclass(frozen=True, eq=False)
class PhysicalSplit:
    """A transport split into direct light, subsurface light and inter-reflection.

    Attributes
    ----------
    transport : Transport
    direct : ndarray, shape (Cy, Cx, channels), float32
        Direct light under white, less what subsurface light adds at q.
    bodies : tuple of Translucent
        Empty where nothing is translucent.
    """

    transport: Transport
    direct: Floats
    bodies: tuple[Translucent, ...]

    def components(self, light: Floats) -> PhysicalComponents:
        """Relight each component by itself.

        Parameters
        ----------
        light : ndarray, shape (Py, Px) or (Py, Px, channels)

        Returns
        -------
        PhysicalComponents
            Photo units. They sum to ``transport @ light`` to rounding.

        Raises
        ------
        InputError
            As `Transport.components`.
        """
        transport = self.transport
        model = transport.components(light)
        flat = np.asarray(transport.lights(light), dtype=np.float64)
        subsurface = np.zeros((transport.camera.pixels, transport.channels))
        for body in self.bodies:
            where = footprint(
                transport.correspondence.reshape(-1, 2)[body.pixels], transport.projector
            )
            for channel, medium in enumerate(body.media):
                picture = flat[min(channel, len(flat) - 1)].reshape(transport.projector)
                lit = picture * body.coverage
                subsurface[body.pixels, channel] = _under(medium, lit, where)
        # A part of D is moved, of the same footprint.
        with np.errstate(divide="ignore", invalid="ignore"):
            kept = np.where(transport.direct != 0, self.direct / transport.direct, 0.0)
        direct = model.direct * transport.picture(kept)
        under = transport.picture(subsurface)
        rest = model.direct + model.near + model.far - direct - under
        return PhysicalComponents(direct, under, rest)


def _under(medium: Medium, lit: Floats, where: Footprint) -> Floats:
    """Return one channel of subsurface light at a body's camera pixels, shape (n,)."""
    found = np.zeros(len(medium.amplitude))
    radius = _radius(medium.source, max(lit.shape))
    for number in np.unique(medium.slope):
        seen = medium.slope == number
        spread = signal.fftconvolve(lit, kernel(medium.source, radius, SLOPES[number]), mode="same")
        chosen = Footprint(where.pixels[seen], where.weights[seen])
        found[seen] = look_up(spread.ravel(), chosen)
    return found * medium.amplitude


def _radius(source: Dipole, longest: int) -> int:
    """Return the projector pixels after which a kernel ends."""
    return int(min(longest, np.ceil(source.virtual + FADED / source.attenuation)))


def split_physically(transport: Transport) -> PhysicalSplit:
    """Split a transport into direct light, subsurface light and inter-reflection.

    Parameters
    ----------
    transport : Transport

    Returns
    -------
    PhysicalSplit

    Raises
    ------
    InputError
        If it is not a transport, or one whose near-range light is not of single projector pixels.
    """
    require_instance(transport, Transport, "transport", "nearfar.load_transport")
    if transport.pitch > 1 or "near" not in transport.parts:
        raise InputError(
            "the transport cannot be split physically: its near-range light is not of single "
            "projector pixels. Plan a smaller pattern grid, of 64x64 say."
        )
    labels, count = ndimage.label(translucent(transport), SQUARE)
    direct = transport.direct.reshape(-1, transport.channels).copy()
    bodies = []
    for number in range(1, count + 1):
        body = body_at(transport, labels == number)
        media = tuple(medium_of(body, channel) for channel in range(transport.channels))
        if np.mean([medium.explained for medium in media]) < LEAST_EXPLAINED:
            continue
        direct[body.pixels] = np.stack(
            [_direct_beside(body, medium, i) for i, medium in enumerate(media)], axis=1
        )
        bodies.append(Translucent(body.pixels, body.coverage, media))
    return PhysicalSplit(transport, direct.reshape(transport.direct.shape), tuple(bodies))


def _direct_beside(body: Body, medium: Medium, channel: int) -> Floats:
    """Return the light of the footprint's projector pixels, less subsurface light there."""
    there = body.footprint
    total = np.where(there, body.entries[:, channel], 0.0).sum(axis=1)
    under = np.zeros(len(total))
    for number in np.unique(medium.slope):
        seen = medium.slope == number
        shape = body.meet(kernel(medium.source, KERNEL_RADIUS, SLOPES[number]))[seen]
        under[seen] = np.where(there[seen], shape, 0.0).sum(axis=1)
    return np.asarray(total - medium.amplitude * under)
