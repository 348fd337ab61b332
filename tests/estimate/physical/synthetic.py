"""Synthetic transports whose direct and window light are given."""

import numpy as np

from nearfar import Size, Transport
from nearfar.illumination.frequencies import DC
from nearfar.illumination.real_basis import real_basis

PROJECTOR = Size(32, 32)
WINDOW = 13


def transport_of(near, direct, *, shift=0.0):
    """Return a transport of two channels without far-range light, q at each camera pixel."""
    y, x = np.mgrid[: PROJECTOR.height, : PROJECTOR.width].astype(np.float32)
    q = np.clip(np.stack([y + shift, x + shift], axis=-1), 0, PROJECTOR.height - 1)
    basis = real_basis([DC], PROJECTOR)
    shape = (*PROJECTOR, 2)
    return Transport(
        projector=PROJECTOR,
        correspondence=q,
        direct=direct.astype(np.float32),
        near=near.astype(np.float32),
        far=np.zeros((*shape, basis.count), np.float32),
        far_basis=basis,
        black=np.zeros(shape, np.float32),
        noise=np.full(shape, 1e-3, np.float32),
    )
