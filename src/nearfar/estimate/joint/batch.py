"""Batches of camera pixels for the joint estimate: responses re-centred on q, noise, scale.

Index convention: arrays are (n, channels, ...), n camera pixels; r runs over real responses, w
over window entries.
"""

from typing import NamedTuple

import numpy as np
from array_api_compat import device
from numpy.typing import NDArray

from nearfar.arrays import Booleans, Floats, Size, namespace
from nearfar.estimate.joint.footprint import footprint_weights
from nearfar.illumination.centred_basis import CentredBasis
from nearfar.illumination.frequencies import DC
from nearfar.illumination.near_basis import NearBasis
from nearfar.photometry.measurements import Measurements
from nearfar.transport import near
from nearfar.transport.direct import footprint, look_up

# A camera pixel darker than this share of the brightest is scaled as if it had as much light.
WHITE_FLOOR = 1e-3
# Step of q, in projector pixels, of numerical derivatives by q.
DIFFERENCE_STEP = 0.02
# Least noise of measurements, as a share of a camera pixel's white.
RELATIVE_NOISE_FLOOR = 1e-6
# The same where functions of near-range light are of several projector pixels. These hold no row
# exactly. What they leave of responses that are taken to be more exact is explained by far-range
# light, which is then wrong at all frequencies that were not measured (0097).
RELATIVE_NOISE_FLOOR_AT_PITCH = 4e-3


class PixelBatch(NamedTuple):
    """A batch of camera pixels; each field's first axis runs over them.

    Attributes
    ----------
    centres : ndarray of int, shape (n, 2)
        q rounded.
    lit : ndarray of bool, shape (n,)
        Whether there is direct light.
    inside : ndarray of bool, shape (n, W^2)
        Window entries on the projector.
    responses : ndarray, shape (n, channels, R)
        To all frequencies but DC, re-centred.
    direct_weights : ndarray, shape (n, 1 or 3, 9)
        Unit direct light over `FOOTPRINT_OFFSETS`, and its derivatives by q down and across, which
        are left out where all q are whole; 0 at unlit camera pixels.
    of_offset : ndarray, shape (n, 0 or 1, R)
        Responses to a unit error of the references; left out where the references have no noise.
    spikes : ndarray of int, shape (n, E)
        Window entries at which direct light of other surfaces is estimated.
    noise : ndarray, shape (n, channels)
        Standard deviation of a response that was measured once.
    offset_noise : ndarray, shape (n, channels)
        Standard deviation of the references' error.
    white : ndarray, shape (n, channels)
        Light under white, the scale of all transport.
    spike_expected : ndarray of bool, shape (n, W^2)
        Window entries where neighbours see another surface's direct light.
    """

    centres: NDArray[np.int64]
    lit: Booleans
    inside: Booleans
    responses: Floats
    direct_weights: Floats
    of_offset: Floats
    spikes: NDArray[np.int64]
    noise: Floats
    offset_noise: Floats
    white: Floats
    spike_expected: Booleans

    def only(self, selected: NDArray[np.int64]) -> "PixelBatch":
        """Return some of the camera pixels."""
        return PixelBatch._make(values[selected] for values in self)


def dc_index(measurements: Measurements) -> int:
    """Return the index of the response to white."""
    return int(measurements.response_indices([DC])[0])


def white_scale(measurements: Measurements) -> Floats:
    """Return light under white, the scale of all transport, (C, channels); always above 0."""
    white = measurements.responses[..., dc_index(measurements)]
    brightest = measurements.brightest or float(np.abs(white).max(initial=0.0))
    least = max(WHITE_FLOOR * brightest, float(np.finfo(np.float32).tiny))
    return np.asarray(np.maximum(white, np.float32(least)))


def noise_floor(near_basis: NearBasis) -> float:
    """Return the least noise of measurements, as a share of a camera pixel's white."""
    return RELATIVE_NOISE_FLOOR if near_basis.pitch == 1 else RELATIVE_NOISE_FLOOR_AT_PITCH


def offset_noise(measurements: Measurements) -> Floats:
    """Return the standard deviation of what the references add to responses, (C, channels)."""
    return np.hypot(measurements.white_noise, measurements.black_noise)


def responses_of_direct(correspondence: Floats, lights: Floats, projector: Size) -> Floats:
    """Return responses of unit direct light to lights, and their derivatives by q.

    Parameters
    ----------
    correspondence : ndarray, shape (n, 2)
    lights : ndarray, shape (R, P)
    projector : Size

    Returns
    -------
    ndarray, shape (n, 3, R), float32
        Responses, and their derivatives by q down and across; 0 along an axis on which q is whole,
        where direct light is all one projector pixel's.
    """

    def responses_at(q: Floats) -> Floats:
        return look_up(lights, footprint(q, projector)).T

    found = np.zeros((len(correspondence), 3, len(lights)), dtype=np.float32)
    found[:, 0] = responses_at(correspondence)
    for axis, step in enumerate(DIFFERENCE_STEP * np.eye(2)):
        along = correspondence[:, axis]
        fractional = np.flatnonzero(np.isfinite(along) & (along != np.rint(along)))
        some = correspondence[fractional]
        difference = responses_at(some + step) - responses_at(some - step)
        found[fractional, 1 + axis] = difference / (2 * DIFFERENCE_STEP)
    return found


class AllPixels(NamedTuple):
    """All camera pixels, from which `gather` makes batches; each field's first axis runs over them.

    Attributes
    ----------
    responses : ndarray, shape (C, channels, R)
        To all frequencies but DC, in the order of the centred basis, as measured.
    correspondence : ndarray, shape (C, 2)
        q.
    centres, lit
        q rounded, and whether there is any.
    noise, offset_noise, white : ndarray, shape (C, channels)
        As in `PixelBatch`.
    spike_expected : ndarray of bool, shape (C, W^2)
        As in `PixelBatch`.
    footprint : ndarray, shape (C, 4), float32
        Direct light's footprint, as `nearfar.transport.boxes` describes it, where the functions of
        near-range light are of several projector pixels.
    is_even : ndarray of bool, shape (C,)
        Whether the camera pixel is of a chessboard's even fields: its row and column add up to an
        even number.
    """

    responses: Floats
    correspondence: Floats
    centres: NDArray[np.int64]
    lit: Booleans
    noise: Floats
    offset_noise: Floats
    white: Floats
    spike_expected: Booleans
    footprint: Floats
    is_even: Booleans


def gather(
    pixels: AllPixels,
    selected: slice | NDArray[np.int64],
    centred: CentredBasis,
    projector: Size,
    known: Floats | None = None,
) -> PixelBatch:
    """Gather a batch of camera pixels, re-centred.

    Parameters
    ----------
    pixels : AllPixels
    selected : slice or ndarray of int
    centred : CentredBasis
        The measured frequencies without DC.
    projector : Size
    known : ndarray, shape (n, channels, R), optional
        Part of the measured responses to subtract before re-centring.
    """
    some = AllPixels._make(values[selected] for values in pixels)
    responses = some.responses if known is None else some.responses - known
    weights = footprint_weights(some.correspondence, some.centres, some.footprint, centred)
    xp = namespace(some.responses)
    if not bool(xp.any(weights[:, 1:] != 0)):
        weights = weights[:, :1]
    shape = (len(some.lit), int(bool(xp.any(some.offset_noise > 0))), centred.basis.count)
    ones = xp.ones(shape, dtype=xp.float32, device=device(some.responses))
    return PixelBatch(
        centres=some.centres,
        lit=some.lit,
        inside=near.inside_basis(some.centres, centred.near_basis, projector),
        responses=centred.recentre(responses, some.centres),
        direct_weights=weights,
        of_offset=centred.recentre(ones, some.centres),
        spikes=some.centres[:, :0],
        noise=some.noise,
        offset_noise=some.offset_noise,
        white=some.white,
        spike_expected=some.spike_expected,
    )
