"""Small splits of one channel whose inter-reflection is given, far-range and even in its light."""

from dataclasses import replace

import numpy as np

from nearfar import Size, Transport
from nearfar.estimate.physical.elsewhere import nowhere
from nearfar.estimate.physical.split import PhysicalSplit
from nearfar.illumination.frequencies import DC
from nearfar.illumination.real_basis import real_basis

CAMERA = Size(13, 13)
PROJECTOR = Size(19, 48)
WINDOW = 7
WHITE = np.ones(PROJECTOR, np.float32)


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


def split_of(transport, *bodies):
    return PhysicalSplit(transport, transport.direct, bodies, nowhere(1), transport.footprint)
