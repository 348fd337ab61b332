"""What the estimate of a block of camera pixels needs, re-centred on q.

Index convention: arrays are (n, channels, ...), n camera pixels; r runs over real responses.
"""

from typing import NamedTuple

import numpy as np
from array_api_compat import device
from numpy.typing import NDArray

from nearfar.arrays import Booleans, Floats, Size, namespace
from nearfar.estimate.matrices import Band, corner_weights
from nearfar.illumination.frequencies import DC
from nearfar.photometry.measurements import Measurements
from nearfar.transport import near
from nearfar.transport.direct import footprint, look_up

# A camera pixel darker than this share of the brightest is treated as if it had as much light.
DARKEST = 1e-3
# Projector pixels by which q is moved to see what that changes.
STEP = 0.02
# Measurements without noise are taken to be this exact, as a share of a camera pixel's white.
EXACT = 1e-6


class Pixels(NamedTuple):
    """A block of camera pixels; each field's first axis runs over them.

    Attributes
    ----------
    centres : ndarray of int, shape (n, 2)
    lit : ndarray of bool, shape (n,)
    inside : ndarray of bool, shape (n, W^2)
        Window entries on the projector.
    responses : ndarray, shape (n, channels, R)
        Of all frequencies but DC.
    corners : ndarray, shape (n, 1 or 3, 9)
        Unit direct light over `nearfar.estimate.matrices.CORNERS`, and what moving it by a
        projector pixel down, or across, adds, which is left out where all q are whole; 0 at unlit
        camera pixels.
    of_offset : ndarray, shape (n, 0 or 1, R)
        What an error of the references adds to the responses; left out where they cannot err.
    spikes : ndarray of int, shape (n, E)
        Window entries at which direct light of other surfaces is believed.
    noise : ndarray, shape (n, channels)
        Standard deviation of an answer that was measured once.
    offset_noise : ndarray, shape (n, channels)
        Standard deviation of the references' error.
    white : ndarray, shape (n, channels)
        Light under white, the scale of all transport.
    likely : ndarray of bool, shape (n, W^2)
        Window entries where neighbours see another surface's direct light.
    """

    centres: NDArray[np.int64]
    lit: Booleans
    inside: Booleans
    responses: Floats
    corners: Floats
    of_offset: Floats
    spikes: NDArray[np.int64]
    noise: Floats
    offset_noise: Floats
    white: Floats
    likely: Booleans

    def only(self, chosen: NDArray[np.int64]) -> "Pixels":
        """Return some of the camera pixels."""
        return Pixels._make(values[chosen] for values in self)


def dc_place(measurements: Measurements) -> int:
    """Place of the answer to white among the measurements."""
    return int(measurements.places([DC])[0])


def scale_of(measurements: Measurements) -> Floats:
    """Light under white, the scale of all transport, (C, channels); never nothing."""
    white = measurements.responses[..., dc_place(measurements)]
    brightest = measurements.brightest or float(np.abs(white).max(initial=0.0))
    least = max(DARKEST * brightest, float(np.finfo(np.float32).tiny))
    return np.asarray(np.maximum(white, np.float32(least)))


def offset_noise(measurements: Measurements) -> Floats:
    """Return the deviation of what the references' error adds to responses, (C, channels)."""
    return np.hypot(measurements.white_noise, measurements.black_noise)


def responses_of_direct(correspondence: Floats, lights: Floats, projector: Size) -> Floats:
    """Responses of unit direct light to lights, and what moving it by a projector pixel adds.

    Parameters
    ----------
    correspondence : ndarray, shape (n, 2)
    lights : ndarray, shape (R, P)
    projector : Size

    Returns
    -------
    ndarray, shape (n, 3, R), float32
        Responses, and their change down and across; 0 along an axis on which q is whole, where
        direct light is all one projector pixel's.
    """

    def answered(places: Floats) -> Floats:
        return look_up(lights, footprint(places, projector)).T

    found = np.zeros((len(correspondence), 3, len(lights)), dtype=np.float32)
    found[:, 0] = answered(correspondence)
    for axis, step in enumerate(STEP * np.eye(2)):
        place = correspondence[:, axis]
        moving = np.flatnonzero(np.isfinite(place) & (place != np.rint(place)))
        some = correspondence[moving]
        found[moving, 1 + axis] = (answered(some + step) - answered(some - step)) / (2 * STEP)
    return found


class Whole(NamedTuple):
    """All camera pixels, of which `gather` takes some; each field's first axis runs over them.

    Attributes
    ----------
    responses : ndarray, shape (C, channels, R)
        Of all frequencies but DC, in the order of the band.
    correspondence : ndarray, shape (C, 2)
        q.
    centres, lit
        q rounded, and whether there is any.
    noise, offset_noise, white : ndarray, shape (C, channels)
        As in `Pixels`.
    likely : ndarray of bool, shape (C, W^2)
        As in `Pixels`.
    """

    responses: Floats
    correspondence: Floats
    centres: NDArray[np.int64]
    lit: Booleans
    noise: Floats
    offset_noise: Floats
    white: Floats
    likely: Booleans


def gather(
    whole: Whole,
    chosen: slice | NDArray[np.int64],
    band: Band,
    projector: Size,
    shown: Floats | None = None,
) -> Pixels:
    """Gather some camera pixels, re-centred.

    Parameters
    ----------
    whole : Whole
    chosen : slice or ndarray of int
    band : Band
        The measured frequencies without DC.
    projector : Size
    shown : ndarray, shape (n, channels, R), optional
        What is known of the responses already, as measured: it is taken out of them.
    """
    some = Whole._make(values[chosen] for values in whole)
    responses = some.responses if shown is None else some.responses - shown
    corners = corner_weights(some.correspondence, some.centres)
    xp = namespace(some.responses)
    if not bool(xp.any(corners[:, 1:] != 0)):
        corners = corners[:, :1]
    shape = (len(some.lit), int(bool(xp.any(some.offset_noise > 0))), band.basis.count)
    ones = xp.ones(shape, dtype=xp.float32, device=device(some.responses))
    return Pixels(
        centres=some.centres,
        lit=some.lit,
        inside=near.inside(some.centres, round(some.likely.shape[1] ** 0.5), projector),
        responses=band.recentre(responses, some.centres),
        corners=corners,
        of_offset=band.recentre(ones, some.centres),
        spikes=some.centres[:, :0],
        noise=some.noise,
        offset_noise=some.offset_noise,
        white=some.white,
        likely=some.likely,
    )
