"""How a transport is split into direct light, subsurface light and inter-reflection."""

import numpy as np

from nearfar.checks import require_instance
from nearfar.errors import InputError
from nearfar.estimate.physical.body import bodies_at, cell_side
from nearfar.estimate.physical.creases import settled
from nearfar.estimate.physical.holes import without_holes
from nearfar.estimate.physical.kernels import enlarged
from nearfar.estimate.physical.medium import is_even, media_of
from nearfar.estimate.physical.outlines import LEAST_EXPLAINED, with_outlines
from nearfar.estimate.physical.responses import waves_of
from nearfar.estimate.physical.specks import without_specks
from nearfar.estimate.physical.split import PhysicalSplit, Translucent
from nearfar.estimate.physical.translucent import translucent
from nearfar.transport.model import Transport


def split_physically(transport: Transport) -> PhysicalSplit:
    """Split a transport into direct light, subsurface light and inter-reflection.

    The model's own split, which `Transport.components` gives, has light of creases in near-range
    light, and some subsurface light in direct light.

    Parameters
    ----------
    transport : Transport

    Returns
    -------
    PhysicalSplit

    Raises
    ------
    InputError
        If it is not a transport, or one without near-range light.

    Examples
    --------
    >>> split = nearfar.split_physically(transport)
    >>> split.bodies  # nothing in this scene is translucent
    ()
    """
    require_instance(transport, Transport, "transport", "nearfar.load_transport")
    if "near" not in transport.parts:
        raise InputError(
            "the transport cannot be split physically: it has no near-range light. Estimate it "
            "with near-range light, from patterns of a projector."
        )
    direct = transport.direct.reshape(-1, transport.channels).copy()
    bodies = []
    for body in bodies_at(transport, translucent(transport), waves_of(transport)):
        media = media_of(body)
        if np.median(media.explained[body.inner]) < LEAST_EXPLAINED or is_even(media):
            continue
        kept = body.inner | (media.explained >= LEAST_EXPLAINED)
        direct[body.pixels[kept]] = media.direct[kept]
        found = media.slope[kept], media.amplitude[kept], media.explained[kept]
        sources = tuple(enlarged(source, cell_side(transport)) for source in media.sources)
        places = transport.correspondence.reshape(-1, 2)[body.pixels[kept]]
        bodies.append(Translucent(body.pixels[kept], places, body.coverage, sources, *found))
    opaque = transport.lit.copy()
    for one in bodies:
        opaque.ravel()[one.pixels] = False
    creases = settled(transport, opaque)
    direct[creases.pixels] = 0.0
    split = PhysicalSplit(transport, direct.reshape(transport.direct.shape), tuple(bodies), creases)
    return without_holes(without_specks(with_outlines(split)))
