"""Small splits of one channel whose inter-reflection is given, far-range and even in its light."""

from dataclasses import replace

import numpy as np

from nearfar import Size, Transport
from nearfar.estimate.physical.elsewhere import nowhere
from nearfar.estimate.physical.kernels import source_at
from nearfar.estimate.physical.split import PhysicalSplit, Translucent
from nearfar.illumination.frequencies import DC
from nearfar.illumination.real_basis import real_basis

CAMERA = Size(13, 13)
PROJECTOR = Size(19, 48)
WINDOW = 7
WHITE = np.ones(PROJECTOR, np.float32)
EVERYWHERE = np.ones(CAMERA, bool)


def places(*, gap=0, from_column=13):
    """Return q, a projector pixel for each camera pixel, with a gap at a column of the camera."""
    y, x = np.mgrid[: CAMERA.height, : CAMERA.width].astype(np.float32)
    return np.stack([y + 3, x + 3 + gap * (x >= from_column)], axis=-1)


def transport_of(direct, interreflection, q, near=None):
    """Return a transport of one channel whose far-range light is even."""
    basis = real_basis([DC], PROJECTOR)
    shape = (*CAMERA, 1)
    if near is None:
        near = np.zeros((*shape, WINDOW, WINDOW))
    blank = Transport(
        projector=PROJECTOR,
        correspondence=q.astype(np.float32),
        direct=direct[..., None].astype(np.float32),
        near=near.astype(np.float32),
        far=np.ones((*shape, 1), np.float32),
        far_basis=basis,
        black=np.zeros(shape, np.float32),
        noise=np.full(shape, 1e-3, np.float32),
    )
    unit = blank.components(WHITE).far.reshape(CAMERA)
    return replace(blank, far=blank.far * (interreflection / unit)[..., None, None])


def body_of(seen, q, light, explained=1.0):
    """Return a body of one channel with subsurface light under white where it is seen.

    Parameters
    ----------
    seen : ndarray of bool, shape (Cy, Cx)
    q : ndarray, shape (Cy, Cx, 2)
    light, explained : ndarray or float
        Of all camera pixels, (Cy, Cx), or the same for all.
    """
    pixels = np.flatnonzero(seen)
    light, explained = (
        np.broadcast_to(each, CAMERA).ravel()[pixels] for each in (light, explained)
    )
    number = len(pixels)
    body = Translucent(
        pixels,
        q.reshape(-1, 2)[pixels],
        WHITE,
        (source_at(0.5, 2.5),),
        np.zeros(number, int),
        np.ones((number, 1)),
        explained,
    )
    return body._replace(amplitude=light[:, None] / body.under(WHITE.reshape(1, -1), PROJECTOR))


def of_both_channels(one, other):
    """Return a transport of two channels, each that of a transport of one."""
    joined = {
        name: np.concatenate([getattr(each, name) for each in (one, other)], axis=2)
        for name in ("direct", "near", "far", "black", "noise")
    }
    return replace(one, **joined)


def split_of(transport, *bodies):
    return PhysicalSplit(
        transport, transport.direct, bodies, nowhere(transport.channels), transport.footprint
    )


def wax(direct, under, rest, *, explained, seen=EVERYWHERE):
    """Return a split of a body, where it is seen, with components under white, each (Cy, Cx)."""
    direct, under, rest = (np.broadcast_to(part, CAMERA) for part in (direct, under, rest))
    q = places()
    transport = transport_of(direct, np.where(seen, under, 0.0) + rest, q)
    return split_of(transport, body_of(seen, q, under, explained))
