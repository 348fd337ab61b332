"""Subsurface light of a physical split, as the functions of near-range light hold it.

Index convention: c runs over camera pixels, i over channels, w over functions of near-range light.
"""

import numpy as np

from nearfar.arrays import Floats, blocks
from nearfar.estimate.physical.kernels import enlarged, kernel
from nearfar.estimate.physical.medium import SLOPES
from nearfar.estimate.physical.split import PhysicalSplit, Translucent
from nearfar.transport.dipole import Dipole
from nearfar.transport.direct import Footprint, footprint
from nearfar.transport.model import Transport

# Camera pixels of a batch.
BATCH_PIXELS = 1024


def near_functions_of(split: PhysicalSplit, factor: float = 1.0) -> Floats:
    """Return subsurface light as coefficients of near-range light, (C, channels, J), float64.

    Parameters
    ----------
    split : PhysicalSplit
    factor : float
        By which distances from q are multiplied; light beyond the window is left out.
    """
    transport = split.transport
    basis = transport.near_basis
    found = np.zeros((transport.camera.pixels, transport.channels, basis.count))
    for body in split.bodies:
        where = footprint(body.places, transport.projector)
        for channel, source in enumerate(body.sources):
            light = _densities(transport, body, enlarged(source, factor), where)
            # A function's coefficient is its light under white: a density times its area.
            hats = (light * basis.pitch**2) @ basis.from_densities.T
            found[body.pixels, channel] = body.amplitude[:, channel, None] * hats
    return found


def _densities(transport: Transport, body: Translucent, source: Dipole, where: Footprint) -> Floats:
    """Return light for unit amplitude of the projector pixels at functions' middles, (n, J)."""
    basis, projector = transport.near_basis, transport.projector
    centres = transport.factors.centres[body.pixels]
    radius = basis.reach + 2
    found = np.zeros((len(body.pixels), basis.count))
    for number in np.unique(body.slope):
        drawn = kernel(source, radius, SLOPES[number])
        mine = np.flatnonzero(body.slope == number)
        for batch in blocks(len(mine), BATCH_PIXELS):
            some = mine[batch]
            places = centres[some, None] + basis.offsets
            inside = np.all((places >= 0) & (places < projector), axis=-1)
            held = np.where(inside[..., None], places, 0)
            total = np.zeros(inside.shape)
            for corner in range(where.pixels.shape[1]):
                y, x = np.divmod(where.pixels[some, corner], projector.width)
                apart = places - np.stack([y, x], axis=-1)[:, None] + radius
                # An outline may see the body beyond the window.
                known = np.all((apart >= 0) & (apart < len(drawn)), axis=-1)
                down, across = np.moveaxis(np.where(known[..., None], apart, 0), -1, 0)
                total += where.weights[some, corner, None] * drawn[down, across] * known
            found[some] = total * body.coverage[held[..., 0], held[..., 1]] * inside
    return found
