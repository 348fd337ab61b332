"""What all turns of the joint estimate share: the responses in order, q, and the kinds.

Index convention: arrays are (C, channels, ...); r runs over real responses, w over window entries.
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from nearfar.arrays import Floats, Integers, Size
from nearfar.devices import Device, mover
from nearfar.errors import InputError
from nearfar.estimate.joint.edges import seen_beside
from nearfar.estimate.joint.evidence import Kinds, screened
from nearfar.estimate.joint.pixels import (
    EXACT,
    Whole,
    offset_noise,
    scale_of,
)
from nearfar.estimate.joint.prior import build_prior
from nearfar.estimate.matrices import Band, band_of
from nearfar.illumination.frequencies import DC, Frequency
from nearfar.illumination.real_basis import RealBasis, real_basis
from nearfar.photometry.measurements import Measurements
from nearfar.transport import near
from nearfar.transport.kinds import LIT, UNLIT, Kind

# Direct light this close to a whole projector pixel is taken to be all that pixel's: noise moves q
# by as much, and a footprint of 10 % too much beside q cost 1.5 dB under a random light. What
# really lies beside it, kinds with spread find.
WHOLE = 0.1


class Choice(NamedTuple):
    """What kind each camera pixel is taken to be in one turn.

    Attributes
    ----------
    kind : ndarray of int, shape (C,)
        Place in LIT + UNLIT.
    strength : ndarray, shape (C,), float32
        Share of white.
    """

    kind: Integers
    strength: Floats

    def of(self, chosen: Integers, first: int) -> "Choice":
        """Return that of some camera pixels, kinds counted from `first`."""
        return Choice(self.kind[chosen] - first, self.strength[chosen])


class Rows(NamedTuple):
    """Rows of all camera pixels, photo units."""

    shared: Floats  # o, d and d times what q is off by, (C, channels, 4)
    near: Floats  # (C, channels, W^2)
    far: Floats  # (C, channels, R), as measured
    near_noise: Floats  # (C, channels)
    choices: tuple[Choice, ...]  # of each turn so far


class Model(NamedTuple):
    """Kinds for a set of measured frequencies."""

    band: Band
    multiplicity: Floats
    lit: Kinds
    unlit: Kinds | None


class Problem(NamedTuple):
    """What all turns share."""

    measurements: Measurements
    model: Model
    whole: Whole
    window: int


def build_model(
    measured: RealBasis, multiplicity: Floats, window: int, device: Device, *, unlit: bool
) -> Model:
    """Build the kinds for what is measured; the last few are kept, so that blocks share them.

    Parameters
    ----------
    measured : RealBasis
        DC among it.
    multiplicity : ndarray, shape (R,)
        How often each answer is.
    window : int
    device : {"cpu", "cuda", "torch"}
    unlit : bool
        Whether there are camera pixels without direct light.

    Raises
    ------
    InputError
        If white or everything else is missing, or the device is.
    """
    move = mover(device)
    frequencies = [k for k in measured.frequencies if k != DC]
    if len(frequencies) == len(measured.frequencies) or not frequencies:
        raise InputError(
            "these measurements lack white, or all but white: plan with --photos, or --near and "
            "--far."
        )
    # Pairs of a cosine and a sine side by side, those that answer no sine at the end.
    frequencies = sorted(frequencies, key=lambda k: k.is_own_negative)
    places = measured.places(frequencies)
    plain = band_of(real_basis(frequencies, measured.projector), near.offsets(window))
    band = Band(plain.basis, places, plain.on_window, plain.on_corners)
    shown = (tuple(frequencies), measured.projector, window, tuple(multiplicity[places].tolist()))
    return Model(
        band.put(move),
        move(multiplicity[places]),
        _kinds(LIT, *shown, device),
        _kinds(UNLIT, *shown, device) if unlit else None,
    )


def lay_out(
    measurements: Measurements, correspondence: Floats, window: int, device: Device
) -> Problem:
    """Lay out measurements for the joint estimate.

    Parameters
    ----------
    measurements : Measurements
    correspondence : ndarray, shape (Cy, Cx, 2)
    window : int
    device : {"cpu", "cuda", "torch"}
        Where all but the measurements' own arrays are put.

    Raises
    ------
    InputError
        As `build_model`.
    """
    rounded = np.rint(correspondence)
    close = np.abs(correspondence - rounded) < WHOLE
    correspondence = np.where(close, rounded, correspondence).astype(np.float64)
    lit = np.isfinite(correspondence).all(axis=-1).ravel()
    model = build_model(
        measurements.basis, measurements.multiplicity, window, device, unlit=not lit.all()
    )
    white = scale_of(measurements)
    whole = Whole(
        responses=measurements.responses[..., model.band.places],
        correspondence=correspondence.reshape(-1, 2),
        centres=near.centre(correspondence, measurements.projector),
        lit=lit,
        noise=np.maximum(measurements.noise, EXACT * white),
        offset_noise=offset_noise(measurements),
        white=white,
        likely=seen_beside(correspondence, window),
    )
    whole = Whole._make(map(mover(device), whole))
    return Problem(measurements, model, whole, window)


# Blocks of camera rows share them, those of lit and of unlit camera pixels; those for a look at
# some of the photos, and for all.
@lru_cache(maxsize=4)
def _kinds(
    kinds: tuple[Kind, ...],
    frequencies: tuple[Frequency, ...],
    projector: Size,
    window: int,
    multiplicity: tuple[float, ...],
    device: Device,
) -> Kinds:
    """Build the kinds for a set of measured frequencies and how often each was measured."""
    band = band_of(real_basis(frequencies, projector), near.offsets(window))
    measured = np.array(multiplicity, dtype=np.float32)
    priors = tuple(build_prior(kind, band, measured) for kind in kinds)
    return screened(priors, band, measured).put(mover(device))
