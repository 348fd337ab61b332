"""The problem that all sweeps of the joint estimate share: ordered responses, q, and priors.

Index convention: arrays are (C, channels, ...); r runs over real responses, w over window entries.
"""

from dataclasses import replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from nearfar.arrays import Floats, Integers, Size, blocks, namespace
from nearfar.devices import Device, mover
from nearfar.errors import InputError
from nearfar.estimate.joint.batch import (
    AllPixels,
    noise_floor,
    offset_noise,
    white_scale,
)
from nearfar.estimate.joint.evidence import PriorSet, prior_set
from nearfar.estimate.joint.spikes import expected_spikes
from nearfar.estimate.joint.unmeasured import responses_stood_for
from nearfar.illumination.centred_basis import CentredBasis, centred_basis
from nearfar.illumination.frequencies import DC, Frequency
from nearfar.illumination.near_basis import NearBasis
from nearfar.illumination.real_basis import RealBasis, real_basis
from nearfar.parallel import side_by_side
from nearfar.photometry.measurements import Measurements
from nearfar.priors.fitted import (
    LIT_AT_PITCH,
    LIT_COMPONENTS,
    LIT_DIFFERENCES_AT_PITCH,
    UNLIT_COMPONENTS,
)
from nearfar.priors.responses import ResponsePrior, response_prior
from nearfar.transport import near

# q this close to a whole projector pixel is rounded to it. Noise moves q by as much, and a
# footprint with 10 % of its weight on the wrong pixel costs 1.5 dB under a random light. Prior
# components with spread represent direct light that really lies beside q.
WHOLE_PIXEL_DISTANCE = 0.1
# Projector pixels whose quantisation errors are transposed at once, and by one thread.
TRANSPOSED_PIXELS, PARTS_PIXELS = 512, 2**14
EVERY_COMPONENT = (*LIT_COMPONENTS, *UNLIT_COMPONENTS)


class ComponentChoice(NamedTuple):
    """The prior component and scale of each camera pixel in one sweep.

    Attributes
    ----------
    prior_component : ndarray of int, shape (C,)
        Index into LIT_COMPONENTS + UNLIT_COMPONENTS.
    prior_scale : ndarray, shape (C,), float32
        Share of white.
    """

    prior_component: Integers
    prior_scale: Floats

    def of(self, selected: slice | Integers) -> "ComponentChoice":
        """Return those of some camera pixels, as a copy."""
        xp = namespace(self.prior_scale)
        return ComponentChoice(*(xp.asarray(values[selected], copy=True) for values in self))


class Choices(NamedTuple):
    """Prior components and scales of camera pixels.

    Attributes
    ----------
    sweeps : tuple of ComponentChoice
        Of each sweep so far.
    of_error_bars : ComponentChoice, optional
        Those whose posterior the error bars are; None before the first sweep.
    """

    sweeps: tuple[ComponentChoice, ...] = ()
    of_error_bars: ComponentChoice | None = None

    def of(self, selected: slice | Integers) -> "Choices":
        """Return those of some camera pixels, as a copy."""
        bars = self.of_error_bars
        return Choices(
            tuple(choice.of(selected) for choice in self.sweeps), bars and bars.of(selected)
        )


class EstimatedRows(NamedTuple):
    """Estimated rows of all camera pixels, photo units."""

    amplitudes: Floats  # o, d and d times what q is off by, (C, channels, 4)
    near: Floats  # (C, channels, W^2)
    far: Floats  # (C, channels, R), as measured
    near_noise: Floats  # (C, channels)
    # Variance of noise in the responses, as a share of that in a camera pixel's own; (C, channels).
    noise_left: Floats
    choices: Choices


class Model(NamedTuple):
    """Priors for a set of measured frequencies.

    Attributes
    ----------
    centred : CentredBasis
    multiplicity : ndarray, shape (R,)
        How often each response was measured.
    lit, unlit : PriorSet
        Of camera pixels with and without direct light.
    lit_differences : PriorSet
        Those of `lit` that sweeps after the first choose from.
    stood_for : ndarray, shape (R,), float64
        For how many responses each measured one stands, as `responses_stood_for` returns them.
    """

    centred: CentredBasis
    multiplicity: Floats
    lit: PriorSet
    lit_differences: PriorSet
    unlit: PriorSet
    stood_for: Floats

    @property
    def numbers(self) -> tuple[int, ...]:
        """Number of each prior component, lit ones first: of LIT_COMPONENTS + UNLIT_COMPONENTS."""
        return (*self.lit.numbers, *self.unlit.numbers)

    @property
    def priors(self) -> dict[int, ResponsePrior]:
        """Each prior component by its index into LIT_COMPONENTS + UNLIT_COMPONENTS."""
        sets = (self.lit, self.unlit)
        return {n: one for each in sets for n, one in zip(each.numbers, each.priors, strict=True)}


class Problem(NamedTuple):
    """Measurements, priors and camera pixels that all sweeps share.

    Attributes
    ----------
    measurements : Measurements
    model : Model
    pixels : AllPixels
    near_basis : NearBasis
    quantisation_error : ndarray, shape (P or 0, R), float32
        That of the measurements in the order of the centred basis: a row for each projector pixel,
        so that a camera pixel reads contiguous memory. Empty where functions are of several
        projector pixels.
    """

    measurements: Measurements
    model: Model
    pixels: AllPixels
    near_basis: NearBasis
    quantisation_error: Floats

    @property
    def has_offset_noise(self) -> bool:
        """Whether the references have noise at any camera pixel."""
        return bool(np.any(self.pixels.offset_noise > 0))


def build_model(
    measured: RealBasis, multiplicity: Floats, near_basis: NearBasis, device: Device
) -> Model:
    """Build the priors for the measured frequencies; the last few are cached for other tiles.

    Parameters
    ----------
    measured : RealBasis
        DC among it.
    multiplicity : ndarray, shape (R,)
        How often each response is measured.
    near_basis : NearBasis
    device : {"cpu", "cuda", "torch"}

    Raises
    ------
    InputError
        If white or everything else is missing, or the device is.
    """
    move = mover(device)
    frequencies = [k for k in measured.frequencies if k != DC]
    if len(frequencies) == len(measured.frequencies) or not frequencies:
        raise InputError(
            "these measurements lack white, or all but white: plan with `photos`, or `window` and "
            "`far`."
        )
    # Pairs of a cosine and a sine side by side, those without a sine at the end.
    frequencies = sorted(frequencies, key=lambda k: k.is_own_negative)
    indices = measured.response_indices(frequencies)
    centred = replace(
        _centred(tuple(frequencies), measured.projector, near_basis), response_indices=indices
    )
    key = (
        tuple(frequencies),
        measured.projector,
        near_basis,
        tuple(multiplicity[indices].tolist()),
    )
    every = tuple(range(len(LIT_COMPONENTS)))
    is_fine = near_basis.pitch == 1
    lit = _prior_set(every if is_fine else LIT_AT_PITCH, *key, device)
    return Model(
        centred.put(move),
        move(multiplicity[indices]),
        lit,
        lit if is_fine else lit.only(LIT_DIFFERENCES_AT_PITCH),
        _prior_set(tuple(range(len(every), len(EVERY_COMPONENT))), *key, device),
        responses_stood_for(centred.basis),
    )


def lay_out(
    measurements: Measurements,
    correspondence: Floats,
    near_basis: NearBasis,
    device: Device,
    footprint: Floats | None = None,
) -> Problem:
    """Prepare measurements for the joint estimate.

    Parameters
    ----------
    measurements : Measurements
    correspondence : ndarray, shape (Cy, Cx, 2)
    near_basis : NearBasis
    device : {"cpu", "cuda", "torch"}
        Device of all arrays but those of `measurements`.
    footprint : ndarray, shape (C, 4), optional
        Footprints, as `footprint_boxes` gives them.

    Raises
    ------
    InputError
        As `build_model`.
    """
    correspondence = correspondence.astype(np.float64)
    if near_basis.pitch == 1:
        rounded = np.rint(correspondence)
        close = np.abs(correspondence - rounded) < WHOLE_PIXEL_DISTANCE
        correspondence = np.where(close, rounded, correspondence)
    lit = np.isfinite(correspondence).all(axis=-1).ravel()
    model = build_model(measurements.basis, measurements.multiplicity, near_basis, device)
    white = white_scale(measurements)
    pixels = AllPixels(
        responses=_in_order(measurements.responses, model.centred.response_indices, near_basis),
        correspondence=correspondence.reshape(-1, 2),
        centres=near.centre(correspondence, measurements.projector),
        lit=lit,
        noise=np.maximum(measurements.noise, np.float32(noise_floor(near_basis)) * white),
        offset_noise=offset_noise(measurements),
        white=white,
        spike_expected=expected_spikes(correspondence, near_basis),
        footprint=np.zeros((len(lit), 4), dtype=np.float32) if footprint is None else footprint,
        is_even=(np.indices(measurements.camera).sum(axis=0) % 2 == 0).ravel(),
    )
    move = mover(device)
    pixels = AllPixels._make(map(move, pixels))
    errors = measurements.quantisation_error[:, : None if near_basis.pitch == 1 else 0]
    errors = _a_row_each(errors, model.centred.response_indices)
    return Problem(measurements, model, pixels, near_basis, move(errors))


def _in_order(responses: Floats, indices: Integers, near_basis: NearBasis) -> Floats:
    """Return responses in the order of the centred basis.

    Where functions are of several projector pixels, loops read a camera pixel's, which are side by
    side; NumPy's indexing leaves those of all camera pixels to a frequency side by side.
    """
    if near_basis.pitch == 1:
        return responses[..., indices]
    return np.take(responses, indices, axis=-1)


def _a_row_each(errors: Floats, indices: Integers) -> Floats:
    """Return chosen responses' quantisation errors (R, P) as rows for projector pixels."""
    found = np.empty((errors.shape[1], len(indices)), dtype=errors.dtype)

    def work(part: slice) -> None:
        for within in blocks(part.stop - part.start, TRANSPOSED_PIXELS):
            batch = slice(part.start + within.start, part.start + within.stop)
            found[batch] = errors[indices, batch].T

    side_by_side(work, blocks(len(found), PARTS_PIXELS))
    return found


# Tiles of camera rows share it, and the phases that it computes once.
@lru_cache(maxsize=4)
def _centred(
    frequencies: tuple[Frequency, ...], projector: Size, near_basis: NearBasis
) -> CentredBasis:
    return centred_basis(real_basis(frequencies, projector), near_basis)


# Tiles of camera rows share them: those of lit and of unlit camera pixels, for the first photos of
# a capture that goes on and for all of them.
@lru_cache(maxsize=4)
def _prior_set(
    numbers: tuple[int, ...],
    frequencies: tuple[Frequency, ...],
    projector: Size,
    near_basis: NearBasis,
    multiplicity: tuple[float, ...],
    device: Device,
) -> PriorSet:
    """Build some priors for a set of measured frequencies and how often each was measured."""
    centred = _centred(frequencies, projector, near_basis)
    measured = np.array(multiplicity, dtype=np.float32)
    priors = tuple(response_prior(EVERY_COMPONENT[n], centred, measured) for n in numbers)
    return prior_set(priors, centred, measured, numbers).put(mover(device))
