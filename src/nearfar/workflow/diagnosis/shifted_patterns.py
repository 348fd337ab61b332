"""A projector that moved by a quarter of a projector pixel or more while photos were taken.

`nearfar.workflow.diagnosis.whole_capture` follows smaller shifts by derivatives of relit pictures.
A shift by a projector pixel turns the phase of fine patterns by up to half a cycle. Photos then
look like those of other patterns, and an estimate from all photos fits none of them. So the
transport is estimated from one half of the capture, and the photos of the other half are compared
with what it foretells of shifted patterns.

Index convention: misfits are (photos, shifts); the photos are those of cosines and sines.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Floats, Integers
from nearfar.faults.of_photos import Moved
from nearfar.plan import Sinusoid
from nearfar.workflow.diagnosis.left_out import estimate_without
from nearfar.workflow.diagnosis.misfit import (
    PhotoFits,
    fit_photos,
    is_white_or_black,
    partners,
)

# Shifts along each axis, in projector pixels, that are tried, and how far they are apart.
FARTHEST, STEP = 8.0, 0.25
# Smaller ones are followed by derivatives.
LEAST_SHIFT = 0.25
# Fewer photos on one side of the moment tell of no shift.
FEWEST_PHOTOS = 6
# Misfit that is left of the photos after the moment if their patterns are shifted, as a share of
# what it is if they are not: at most.
MOST_LEFT = 0.6
# Of the photos whose misfit changes by a larger share: the share of those after the moment that
# fits better if shifted, and of those before it that fits better if not, at least.
LEAST_CHANGE, LEAST_SHARE = 0.1, 0.8


class _Step(NamedTuple):
    """The moment and the shift that explain most.

    Attributes
    ----------
    gain : float
        Misfit that they explain.
    place : int
        Of the first photo after it.
    shift : ndarray, shape (2,)
        Down and across, in projector pixels.
    is_sure : bool
    """

    gain: float
    place: int
    shift: NDArray[np.float64]
    is_sure: bool


def find_shifted_patterns(fits: PhotoFits, known: Floats) -> list[Moved]:
    """Find whether the projector moved far between two photos.

    Parameters
    ----------
    fits, known
        As `nearfar.workflow.diagnosis.single_photos.find_spoilt_photos` takes them.

    Returns
    -------
    list of Moved
        Empty for plans without cosines and sines of the same frequency.
    """
    partner_of = partners(fits.plan)
    photos = np.array(sorted(partner_of), dtype=np.int64)
    if len(photos) < 2 * FEWEST_PHOTOS:
        return []
    middle = int(photos[len(photos) // 2])
    numbers = np.arange(len(fits.plan.patterns))
    measuring, good = ~is_white_or_black(fits.plan), np.ones(len(numbers), dtype=bool)
    best: _Step | None = None
    for is_later in (False, True):
        others = np.flatnonzero(measuring & ((numbers < middle) == is_later))
        half = estimate_without(fits, good, others.tolist(), known)
        if half is None:
            continue
        foretold = fit_photos(fits.without_drift, half)
        misfits = _misfits(foretold, photos, np.array([partner_of[n] for n in photos]))
        found = _best_step(misfits, is_later=is_later)
        if best is None or found.gain > best.gain:
            best = found
    if best is None or not best.is_sure:
        return []
    return [Moved("projector", int(photos[best.place]), float(np.hypot(*best.shift)))]


def _shifts() -> NDArray[np.float64]:
    """Return the shifts that are tried, (S, 2); the first is none."""
    along = np.arange(-FARTHEST, FARTHEST + STEP / 2, STEP)
    shifts = np.stack(np.meshgrid(along, along, indexing="ij"), axis=-1).reshape(-1, 2)
    far = np.hypot(*shifts.T) >= LEAST_SHIFT
    return np.concatenate([np.zeros((1, 2)), shifts[far]])


def _misfits(fits: PhotoFits, photos: Integers, others: Integers) -> NDArray[np.float64]:
    """Return the misfit of each photo with each shift of its pattern, (photos, S).

    A cosine that is shifted is a mixture of cosine and sine, whose pictures are both foretold.
    """
    shifts, found = _shifts(), []
    for number, other in zip(photos.tolist(), others.tolist(), strict=True):
        pattern = fits.plan.patterns[number]
        assert isinstance(pattern, Sinusoid)
        sign = 1.0 if pattern.kind == "cosine" else -1.0
        level = fits.black + fits.white / 2
        root = 1 / np.sqrt(fits.variance[number])
        taken, own, turned = (
            (part * root).ravel().astype(np.float64)
            for part in (
                fits.photos[number] - level,
                fits.relit[number] - level,
                sign * (fits.relit[other] - level),
            )
        )
        phase = 2 * np.pi * shifts @ np.array([float(part) for part in pattern.frequency])
        cosine, sine = np.cos(phase), np.sin(phase)
        left = taken @ taken - 2 * (cosine * (taken @ own) + sine * (taken @ turned))
        left += cosine**2 * (own @ own) + sine**2 * (turned @ turned)
        left += 2 * cosine * sine * (own @ turned)
        found.append(left / taken.size)
    return np.array(found)


def _best_step(misfits: NDArray[np.float64], *, is_later: bool) -> _Step:
    """Return the step that explains most; foretold are photos of the later or the earlier half."""
    if is_later:
        # The last photo comes first, and those before the moment are shifted.
        misfits = misfits[::-1]
    gains = misfits[:, :1] - misfits
    after = np.cumsum(gains[::-1], axis=0)[::-1]
    after[:FEWEST_PHOTOS] = after[-FEWEST_PHOTOS + 1 :] = -np.inf
    place, shift = np.unravel_index(np.argmax(after), after.shape)
    own, shifted = misfits[:, 0], misfits[:, shift]
    left = shifted[place:].sum() / max(float(own[place:].sum()), np.finfo(float).tiny)
    # Patterns that are even along the shift stay the same.
    tells = np.abs(shifted - own) > LEAST_CHANGE * own
    is_after = np.arange(len(own)) >= place
    of_after, of_before = (
        np.sum((shifted < own) == is_after, where=tells & side) / max(1, np.sum(tells & side))
        for side in (is_after, ~is_after)
    )
    is_sure = left < MOST_LEFT and min(of_after, of_before) > LEAST_SHARE
    first = len(misfits) - int(place) if is_later else int(place)
    return _Step(float(after[place, shift]), first, _shifts()[shift], bool(is_sure and shift))
