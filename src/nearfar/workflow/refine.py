"""Lights that compensate a scene, corrected by photos of them on a rig.

A photo of the light shows what the transport does not know of a rig, such as a response that is not
linear. Where the photo is darker than wanted, the light is raised by D^-1 of what is missing. The
change of the next photo tells the slope of the projector's response at each projector pixel, by
which later corrections are divided (Broyden's method with a diagonal matrix). A correction that
makes the photo worse is taken back.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from nearfar.applications.compensate import Compensation
from nearfar.applications.compensation_problem import LEAST_DIAGONAL, camera_weights
from nearfar.applications.likeness import (
    decibels_below,
    distance_from,
    finite_or_none,
    without_single_channel,
)
from nearfar.applications.onto_projector import OntoProjector, onto_projector
from nearfar.arrays import Booleans, Floats, Size
from nearfar.callbacks import Report, as_report
from nearfar.checks import as_count, require_instance
from nearfar.errors import InputError
from nearfar.rigs.base import Rig
from nearfar.rigs.simulated.rig import SimulatedRig
from nearfar.transport.colour import mixing_of
from nearfar.transport.model import Transport
from nearfar.transport.stored import StoredTransport

MOST_CORRECTIONS = 3
# Slope of the response before any is known: between 1, of a linear projector, and 2.2, which a
# projector of gamma 2.2 has at white.
FIRST_SLOPE = 1.4
SLOPES = (0.3, 4.0)
# Slopes are averaged over about so many projector pixels. Where the light changed by less than
# `LEAST_CHANGE` they stay near the first one.
SLOPE_WIDTH = 1.5
LEAST_CHANGE = 0.01
# After a correction that made the photo worse, the next one is this share of a full step.
BACK = 0.4


def require_photos_of(transport: Transport | StoredTransport, rig: SimulatedRig) -> None:
    """Refuse a simulated rig whose photos have another shape than those of a transport.

    Raises
    ------
    InputError
    """
    dark = np.zeros((1, *transport.projector), dtype=np.float32)
    _require_shape(rig.world.pictures(dark)[0], (*transport.camera, transport.channels))


@dataclass(frozen=True, eq=False)
class Refinement:
    """A light that photos of it have corrected.

    Attributes
    ----------
    light : ndarray, shape (Py, Px) or (Py, Px, channels), float32
        The one whose photo was nearest to what is wanted, in steps of 1/255.
    photo : ndarray, shape (Cy, Cx) or (Cy, Cx, channels), float32
        Its photo, less one under black; photo units.
    errors : tuple of float
        Distance of each photo so far from what is wanted, root mean square over camera pixels with
        direct light; that of the light as it was given is the first.
    peak : float
        Greatest value of what is wanted.

    Examples
    --------
    >>> wanted = 0.5 * (transport @ np.ones((8, 8), dtype=np.float32))
    >>> found = nearfar.compensate(transport, wanted, scale=1.0)
    >>> with nearfar.open_rig("scene.npy", (8, 8)) as rig:
    ...     refined = nearfar.refine_compensation(transport, found, rig, corrections=1)
    >>> refined.rmse == min(refined.errors)
    True
    """

    light: Floats
    photo: Floats
    errors: tuple[float, ...]
    peak: float

    @property
    def rmse(self) -> float:
        """Distance of `photo` from what is wanted."""
        return min(self.errors)

    @property
    def psnr(self) -> float:
        """`rmse` below `peak`, in dB."""
        return decibels_below(self.peak, self.rmse)

    @property
    def psnr_before(self) -> float:
        """The same of the light as it was given."""
        return decibels_below(self.peak, self.errors[0])


def refine_compensation(
    transport: Transport,
    found: Compensation,
    rig: Rig,
    corrections: int = 2,
    *,
    progress: Report | None = None,
) -> Refinement:
    """Correct a light that compensates a scene by photos of it.

    Each photo of a light is taken after one of black, which is subtracted. There is one more than
    there are corrections, as the last one is confirmed too.

    Parameters
    ----------
    transport : Transport
    found : Compensation
        Of `nearfar.compensate`.
    rig : Rig
        Before the same scene, at the exposure of the transport's photos.
    corrections : int
        1 to 3.
    progress : callable, optional
        Called with "photos" and the share of them that is taken.

    Returns
    -------
    Refinement

    Raises
    ------
    InputError
        If the rig has another projector or other photos than the transport, or for another number
        of corrections.
    DeviceError
        If a photo cannot be taken.

    Examples
    --------
    >>> wanted = np.full(transport.camera, 0.2, dtype=np.float32)
    >>> found = nearfar.compensate(transport, wanted)
    >>> with nearfar.open_rig("scene.npy", (8, 8)) as rig:
    ...     refined = nearfar.refine_compensation(transport, found, rig)
    >>> len(refined.errors)
    3
    """
    report = as_report(progress)
    steps = refinements(transport, found, rig, corrections)
    best = next(steps)
    report("photos", 1 / (corrections + 1))
    for best in steps:
        report("photos", len(best.errors) / (corrections + 1))
    return best


def refinements(
    transport: Transport, found: Compensation, rig: Rig, corrections: int
) -> Iterator[Refinement]:
    """Yield the best light so far after each photo; see `refine_compensation`."""
    require_instance(transport, Transport, "transport", "nearfar.load_transport")
    require_instance(found, Compensation, "compensation", "nearfar.compensate")
    if not 1 <= as_count(corrections, "the number of corrections") <= MOST_CORRECTIONS:
        raise InputError(f"{corrections} corrections were asked for: give 1 to {MOST_CORRECTIONS}.")
    if rig.projector != transport.projector:
        raise InputError(
            f"the transport is of a projector of {transport.projector}, the rig has "
            f"{rig.projector}: give the rig that the transport was measured with."
        )
    shape = (*transport.camera, transport.channels)
    if found.target.shape not in {shape, shape[: 2 + (transport.channels > 1)]}:
        raise InputError(
            f"the compensation is of photos of {Size(*found.target.shape[:2])}, the transport of "
            f"{transport.camera} with {transport.channels} channels: give the transport that it "
            f"was computed with."
        )
    target = found.target.astype(np.float64).reshape(shape)
    correction = _correction(transport)
    counted = camera_weights(transport)[..., 0] > 0
    light = found.light.reshape(*transport.projector, -1)
    best = shown = _shown(transport, rig, light, target, counted, 0)
    errors = [shown.error]
    yield _refinement(best, errors, target, counted)
    slope, share = np.full_like(best.light, FIRST_SLOPE), 1.0
    for number in range(1, corrections + 1):
        step = share * correction.of(best.missing) / slope
        light = np.clip(best.light + step, 0.0, 1.0)
        shown = _shown(transport, rig, light, target, counted, 2 * number)
        errors.append(shown.error)
        slope = _slope(shown.light - best.light, correction.of(best.missing - shown.missing))
        if shown.error < best.error:
            best, share = shown, 1.0
        else:
            share *= BACK
        yield _refinement(best, errors, target, counted)


def describe_photos(refined: Refinement) -> dict[str, Any]:
    """Return the errors of the photos of the lights, as JSON types."""
    return {
        "photo_rmse": list(refined.errors),
        "psnr_before_dB": finite_or_none(refined.psnr_before),
        "psnr_refined_dB": finite_or_none(refined.psnr),
    }


def summarise_photos(refined: Refinement) -> str:
    """Return in a line what `describe_photos` says."""
    return (
        f"photos of the light: {refined.psnr_before:.1f} dB before corrections, "
        f"{refined.psnr:.1f} dB after"
    )


@dataclass(frozen=True, eq=False)
class _Shown:
    """A light (Py, Px, colours) that was photographed, and what its photo lacks."""

    light: Floats
    missing: Floats
    error: float


@dataclass(frozen=True, eq=False)
class _Correction:
    """D^-1, for pictures (Cy, Cx, channels) and lights (Py, Px, colours)."""

    onto: OntoProjector
    trust: Floats
    colours: Floats

    def of(self, picture: Floats) -> Floats:
        """Return the light whose direct light is a picture, less where little of it is seen."""
        return np.asarray((self.trust * self.onto(picture)) @ self.colours.T)


def _correction(transport: Transport) -> _Correction:
    channels = transport.channels
    seen = camera_weights(transport).reshape(-1, 1) > 0
    white = np.where(seen, transport.direct.reshape(-1, channels), 0.0)
    onto = onto_projector(transport.correspondence, white, transport.projector)
    lit = onto.weights[onto.weights > 0]
    least = LEAST_DIAGONAL * float(np.median(lit)) if lit.size else 1.0
    known = onto.weights > 0
    trust = np.where(known, onto.weights / (onto.weights + least), 1.0)
    mixing = mixing_of(channels, transport.provenance) if channels > 1 else None
    colours = np.eye(channels) if mixing is None else np.linalg.pinv(mixing)
    return _Correction(onto, trust, colours)


def _shown(
    transport: Transport,
    rig: Rig,
    light: Floats,
    target: Floats,
    counted: Booleans,
    first: int,
) -> _Shown:
    """Photograph black and a light, and compare them with what is wanted."""
    projected = np.clip(without_single_channel(light), 0.0, 1.0)
    pattern = np.rint(255 * projected).astype(np.uint8)
    black = np.zeros(transport.projector, dtype=np.uint8)
    photos: list[NDArray[Any]] = list(rig.shoot([black, pattern], first))
    under_black, photo = (one.astype(np.float64) / rig.full_scale for one in photos)
    _require_shape(photo, target.shape)
    seen = photo - under_black
    error = distance_from(target, counted)(seen, None)
    levels = pattern.astype(np.float64) / 255
    return _Shown(levels.reshape(*transport.projector, -1), target - seen, error)


def _require_shape(photo: NDArray[Any], wanted: tuple[int, ...]) -> None:
    if photo.shape != wanted:
        raise InputError(
            f"the rig's photos are {'x'.join(map(str, photo.shape))}, those of the transport "
            f"{'x'.join(map(str, wanted))} (height x width x channels): give the rig that the "
            f"transport was measured with."
        )


def _slope(change: Floats, seen: Floats) -> Floats:
    """Return the ratio of the change in photos to that expected by D, (Py, Px, colours)."""
    width = (SLOPE_WIDTH, SLOPE_WIDTH, 0)
    both = ndimage.gaussian_filter(seen * change, width)
    squares = ndimage.gaussian_filter(change**2, width)
    known = LEAST_CHANGE**2
    return np.clip((both + FIRST_SLOPE * known) / (squares + known), *SLOPES)


def _refinement(best: _Shown, errors: list[float], target: Floats, counted: Booleans) -> Refinement:
    return Refinement(
        light=without_single_channel(best.light).astype(np.float32),
        photo=without_single_channel(target - best.missing).astype(np.float32),
        errors=tuple(errors),
        peak=float(target[counted].max()),
    )
