"""What the estimate of a block of camera pixels needs, re-centred on q.

Index convention: arrays are (n, channels, ...), n camera pixels; r runs over real answers.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Booleans, Floats, Size
from nearfar.estimate.matrices import Band
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
    answers : ndarray, shape (n, channels, R)
        Of all frequencies but DC.
    of_direct : ndarray, shape (n, R)
        Answers of unit direct light, 8 bits included; 0 at unlit camera pixels.
    of_shift : ndarray, shape (n, R, 2)
        What moving unit direct light by a projector pixel down, or across, adds to the answers;
        0 where q is whole or there is no direct light.
    of_second : ndarray, shape (n, R, E)
        Answers of unit direct light of other surfaces, at single window entries; 0: none.
    of_offset : ndarray, shape (n, R)
        What an error of the references adds to the answers.
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
    answers: Floats
    of_direct: Floats
    of_shift: Floats
    of_second: Floats
    of_offset: Floats
    noise: Floats
    offset_noise: Floats
    white: Floats
    likely: Booleans

    @property
    def extra(self) -> int:
        """Number E of single window entries."""
        return int(self.of_second.shape[-1])

    def only(self, chosen: NDArray[np.int64]) -> "Pixels":
        """Return some of the camera pixels."""
        return Pixels._make(values[chosen] for values in self)


def dc_place(measurements: Measurements) -> int:
    """Place of the answer to white among the measurements."""
    return int(measurements.places([DC])[0])


def scale_of(measurements: Measurements) -> Floats:
    """Light under white, the scale of all transport, (C, channels); never nothing."""
    white = measurements.answers[..., dc_place(measurements)]
    brightest = float(np.abs(white).max(initial=0.0))
    least = max(DARKEST * brightest, float(np.finfo(np.float32).tiny))
    return np.asarray(np.maximum(white, np.float32(least)))


def offset_noise(measurements: Measurements) -> Floats:
    """Return the deviation of what the references' error adds to answers, (C, channels)."""
    return np.hypot(measurements.white_noise, measurements.black_noise)


def answers_of_direct(correspondence: Floats, lights: Floats, projector: Size) -> Floats:
    """Answers of unit direct light to lights, and what moving it by a projector pixel adds.

    Parameters
    ----------
    correspondence : ndarray, shape (n, 2)
    lights : ndarray, shape (R, P)
    projector : Size

    Returns
    -------
    ndarray, shape (n, 3, R), float32
        Answers, and their change down and across; 0 along an axis on which q is whole, where
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


def gather(
    measurements: Measurements,
    correspondence: Floats,
    lit: Booleans,
    centres: NDArray[np.int64],
    block: slice,
    band: Band,
    window: int,
    likely: Booleans | None = None,
) -> Pixels:
    """Gather a block of camera pixels.

    Parameters
    ----------
    measurements : Measurements
    correspondence, lit, centres
        q, (C, 2), whether there is any, and what it was rounded to, of all pixels.
    block : slice
    band : Band
        The measured frequencies without DC.
    window : int
        W.
    likely : ndarray of bool, shape (C, W^2), optional
        Where neighbours see another surface; nowhere by default.
    """
    q = correspondence[block]
    centres, lit = centres[block], lit[block]
    white = scale_of(measurements)[block]
    shown = measurements.shown_error[band.places] + band.basis.patterns

    direct = answers_of_direct(q, shown, measurements.projector)
    ones = np.ones((len(lit), 1, band.basis.count), dtype=np.float32)
    answers = measurements.answers[block][..., band.places]
    return Pixels(
        centres=centres,
        lit=lit,
        inside=near.inside(centres, window, measurements.projector),
        answers=band.recentre(answers, centres),
        of_direct=band.recentre(direct[:, :1], centres)[:, 0],
        of_shift=band.recentre(direct[:, 1:], centres).transpose(0, 2, 1),
        of_second=np.zeros((len(lit), band.basis.count, 0), dtype=np.float32),
        of_offset=band.recentre(ones, centres)[:, 0],
        noise=np.maximum(measurements.noise[block], EXACT * white),
        offset_noise=offset_noise(measurements)[block],
        white=white,
        likely=np.zeros((len(lit), window**2), dtype=bool) if likely is None else likely[block],
    )
