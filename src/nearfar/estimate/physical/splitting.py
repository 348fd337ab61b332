"""How a transport is split into direct light, subsurface light and inter-reflection."""

import numpy as np

from nearfar.checks import require_instance
from nearfar.errors import InputError
from nearfar.estimate.error_bars import ErrorBars
from nearfar.estimate.physical.body import Body, bodies_at, with_wider_cells
from nearfar.estimate.physical.close_places import with_close_places
from nearfar.estimate.physical.colours import with_colours_of_bodies
from nearfar.estimate.physical.contacts import without_contacts
from nearfar.estimate.physical.crease_light import at_creases, with_crease_light
from nearfar.estimate.physical.creases import settled
from nearfar.estimate.physical.dark_creases import without_dark_creases
from nearfar.estimate.physical.elsewhere import at_second_places
from nearfar.estimate.physical.footprints import footprints
from nearfar.estimate.physical.guided_direct import with_guided_direct_light
from nearfar.estimate.physical.holes import without_holes
from nearfar.estimate.physical.kernels import enlarged
from nearfar.estimate.physical.least_interreflection import with_least_interreflection
from nearfar.estimate.physical.medium import (
    Media,
    is_deep,
    is_even,
    media_of,
    with_like_channels,
)
from nearfar.estimate.physical.one_side import with_light_from_one_side
from nearfar.estimate.physical.opaque_outlines import with_opaque_outlines
from nearfar.estimate.physical.outlines import LEAST_EXPLAINED, with_outlines
from nearfar.estimate.physical.responses import waves_of
from nearfar.estimate.physical.slanted_footprints import with_slanted_footprints
from nearfar.estimate.physical.smooth import with_smooth_interreflection
from nearfar.estimate.physical.smooth_bodies import with_smooth_bodies
from nearfar.estimate.physical.specks import without_specks
from nearfar.estimate.physical.split import PhysicalSplit, Translucent
from nearfar.estimate.physical.translucent import translucent
from nearfar.transport.model import Transport

# Where kernels explain a lesser share of what direct light leaves of a body, as the median over its
# camera pixels, it is not translucent.
EXPLAINED_OF_BODY = 0.7


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
    seen = translucent(transport)
    narrow, boxes = footprints(transport, seen), transport.boxes.copy()
    bodies = []
    for found in bodies_at(transport, seen, narrow, waves_of(transport)):
        body, media = _fitted(found, transport)
        if np.median(media.explained[body.inner]) < EXPLAINED_OF_BODY or is_even(media):
            continue
        media = with_light_from_one_side(body, with_like_channels(body, media))
        kept = body.inner | (media.explained >= LEAST_EXPLAINED)
        direct[body.pixels[kept]] = media.direct[kept]
        boxes[body.pixels[kept]] = narrow[body.pixels[kept]]
        of_pixels = media.slope[kept], media.amplitude[kept], media.explained[kept]
        sources = tuple(enlarged(source, body.cell_side) for source in media.sources)
        places = transport.correspondence.reshape(-1, 2)[body.pixels[kept]]
        bodies.append(Translucent(body.pixels[kept], places, body.coverage, sources, *of_pixels))
    opaque = transport.lit.copy()
    for one in bodies:
        opaque.ravel()[one.pixels] = False
    creases = settled(transport, opaque)
    direct[creases.pixels] = 0.0
    elsewhere = at_second_places(transport).and_also(creases)
    split = PhysicalSplit(
        transport,
        direct.reshape(transport.direct.shape),
        tuple(bodies),
        elsewhere,
        None if transport.footprint is None else boxes.reshape(transport.footprint.shape),
    )
    split = with_outlines(without_contacts(split))
    split = without_dark_creases(with_colours_of_bodies(split))
    split = without_holes(without_specks(with_slanted_footprints(split)))
    near_creases = at_creases(split, creases)
    split = with_close_places(with_opaque_outlines(split, near_creases))
    # Without error bars nothing says how much of inter-reflection is noise.
    if transport.posterior is not None:
        deviation = ErrorBars(transport).direct()
        split = with_guided_direct_light(with_smooth_bodies(split, deviation), deviation)
        split = with_smooth_interreflection(split, deviation, near_creases)
    return with_crease_light(with_least_interreflection(split), near_creases)


def _fitted(body: Body, transport: Transport) -> tuple[Body, Media]:
    """Fit a body's media; in wider cells where light comes from too deep for its own."""
    media = media_of(body)
    while 1 < body.cell_side < transport.pitch and is_deep(media):
        body = with_wider_cells(body, transport)
        media = media_of(body)
    return body, media
