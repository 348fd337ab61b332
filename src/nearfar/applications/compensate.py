"""The light whose photo looks like a wanted picture: radiometric compensation.

Light that reaches a camera pixel from elsewhere is counter-acted, and so are texture and shading.
The light l minimises

    |W (T l + b - s wanted)|^2 + mu |gradient of l|^2    over 0 <= l <= 1

by accelerated projected gradients, preconditioned by the diagonal of D^T W^2 D. If a photo with
ambient light is wanted, b is the photo under black; if light alone is wanted, b is 0. W is 1 where
the camera sees direct light, and 0 elsewhere and at saturated camera pixels. Where a calibration
knows how projector and camera mix colours, the mixing is part of T.

Truncated series for T^-1, such as stratified inverses (Ng et al. 2009; Bai et al. 2010), diverge
where much light is reflected on; a projected gradient does not.
"""

from dataclasses import dataclass
from math import inf
from typing import Any

import numpy as np

from nearfar.applications.compensation_problem import (
    at_q,
    camera_weights,
    compensation_problem,
    direct_alone,
    error_bar_under,
    light_by_direct,
    picture_of_camera,
    scale_of_needed,
    wanted_picture,
)
from nearfar.applications.least_squares import LeastSquares
from nearfar.applications.likeness import (
    decibels_below,
    distance_from,
    finite_or_none,
    greatest_wanted,
    out_of_reach,
    without_single_channel,
)
from nearfar.arrays import Booleans, Floats
from nearfar.callbacks import Report, as_report
from nearfar.checks import as_number, require_instance
from nearfar.errors import InputError
from nearfar.transport.model import Transport


@dataclass(frozen=True, eq=False)
class Compensation:
    """A light that compensates a scene, and what its photo is expected to look like.

    Attributes
    ----------
    light : ndarray, shape (Py, Px) or (Py, Px, channels), float32
        0 to 1; where a calibration knows how colours mix, (Py, Px, 3): red, green and blue.
    scale : float
        s: the photo is to look like `scale` times the wanted picture.
    expected : ndarray, shape (Cy, Cx) or (Cy, Cx, channels), float32
        The relit picture under `light`, photo units.
    standard_deviation : ndarray, of the same shape, or None
        Error bar of `expected`; None where the transport has none.
    out_of_reach : ndarray of bool, shape (Cy, Cx)
        Camera pixels without direct light, and those that stay further than a twentieth of the
        brightest wanted value from what is wanted.
    rmse : float
        Expected distance of the photo from what is wanted, root mean square over camera pixels
        with direct light, error bars included, photo units.
    rmse_of_direct : float
        The same for a light that is computed from direct light alone.
    peak : float
        Greatest value of `target`.
    target : ndarray, shape (Cy, Cx) or (Cy, Cx, channels), float32
        What the relit picture is to be: `scale` times the wanted picture, less the photo under
        black where it was given.

    Examples
    --------
    >>> wanted = 0.5 * (transport @ np.ones((8, 8), dtype=np.float32))
    >>> found = nearfar.compensate(transport, wanted, scale=1.0)
    >>> bool(np.abs(transport @ found.light - wanted).max() < 0.05 * wanted.max())
    True
    """

    light: Floats
    scale: float
    expected: Floats
    standard_deviation: Floats | None
    out_of_reach: Booleans
    rmse: float
    rmse_of_direct: float
    peak: float
    target: Floats

    @property
    def psnr(self) -> float:
        """`rmse` below `peak`, in dB."""
        return decibels_below(self.peak, self.rmse)

    @property
    def psnr_of_direct(self) -> float:
        """`rmse_of_direct` below `peak`, in dB."""
        return decibels_below(self.peak, self.rmse_of_direct)

    @property
    def out_of_reach_share(self) -> float:
        """Share of all camera pixels that are out of reach."""
        return float(self.out_of_reach.mean())


def compensate(
    transport: Transport,
    wanted: Floats,
    scale: float | None = None,
    *,
    black: Floats | None = None,
    progress: Report | None = None,
) -> Compensation:
    """Find the light under which the scene looks like a wanted picture.

    Parameters
    ----------
    transport : Transport
    wanted : ndarray, shape (Cy, Cx) or (Cy, Cx, channels)
        Linear light, without ambient light, as relit pictures are. Any unit if `scale` is left out.
    scale : float, optional
        What `wanted` is multiplied by. Left out, the one at which 95 % of the camera pixels need no
        more than full white.
    black : ndarray, shape (Cy, Cx) or (Cy, Cx, channels), optional
        The photo under black, in photo units. Given, `wanted` times the scale is what a photo is to
        look like, ambient light and black level included; ``transport.black`` is that of the
        capture.
    progress : callable, optional
        Called with what is being done and the share done, 0 to 1.

    Returns
    -------
    Compensation

    Raises
    ------
    InputError
        If the transport is another object or has no direct light, if the picture does not fit the
        camera, is negative or black, if the scale is not above 0, or if the photo under black is
        brighter than what is wanted everywhere.

    Examples
    --------
    >>> wanted = np.full(transport.camera, 0.2, dtype=np.float32)
    >>> found = nearfar.compensate(transport, wanted)
    >>> found.light.shape
    (8, 8)
    """
    require_instance(transport, Transport, "transport", "nearfar.load_transport")
    target = _target(transport, wanted)
    if scale is not None and as_number(scale, "scale") <= 0:
        raise InputError(f"scale is {scale}: give a number above 0, or leave it out.")
    report = as_report(progress)
    weights = camera_weights(transport)
    problem = compensation_problem(transport, weights)
    dark = (
        np.zeros_like(target)
        if black is None
        else picture_of_camera(black, transport.camera, transport.channels)
    )
    if scale is None:
        # Without an upper limit the light for each of both is proportional to it.
        nothing = np.zeros_like(problem.diagonal)
        free = problem.solve(target, light_by_direct(transport, target, weights), inf)
        saved = nothing if black is None else problem.solve(dark, nothing, inf)
        scale = _scale_within_reach(transport, free, saved, target, weights)
        start = scale * free - saved
    else:
        start = np.full_like(problem.diagonal, 0.5)
    goal = scale * target - dark
    peak = greatest_wanted(goal, weights[..., 0] > 0)
    light = problem.solve(goal, start, 1.0, report)
    alone = compensation_problem(direct_alone(transport), weights)
    of_direct = alone.solve(goal, light, 1.0)
    report("compensation", 1.0)
    return _judged(transport, problem, weights, (light, of_direct), scale, goal, peak)


def describe(found: Compensation) -> dict[str, Any]:
    """Return the scale and what to expect, as JSON types; null for dB of a perfect match."""
    return {
        "scale": found.scale,
        "expected_rmse": found.rmse,
        "rmse_of_direct": found.rmse_of_direct,
        "psnr_dB": finite_or_none(found.psnr),
        "psnr_of_direct_dB": finite_or_none(found.psnr_of_direct),
        "out_of_reach_share": found.out_of_reach_share,
    }


def summarise(found: Compensation) -> str:
    """Return in lines what `describe` says."""
    return (
        f"scale {found.scale:.4g}\n"
        f"expected error {found.rmse:.2g} of full scale, {found.psnr:.1f} dB below the brightest "
        f"wanted value; {found.psnr_of_direct:.1f} dB if only direct light were counted\n"
        f"{found.out_of_reach_share:.1%} of the camera pixels are out of reach"
    )


def _target(transport: Transport, wanted: Floats) -> Floats:
    """Return a wanted picture as (Cy, Cx, channels), float64."""
    if "direct" not in transport.parts or not transport.lit.any():
        raise InputError(
            "the transport has no direct light, so that no light makes a picture on the scene: "
            "give one that was measured with a projector."
        )
    return wanted_picture(wanted, transport.camera, transport.channels, transport.lit)


def _scale_within_reach(
    transport: Transport, light: Floats, saved: Floats, target: Floats, weights: Floats
) -> float:
    """Return the scale at which most camera pixels need no more than full white.

    Parameters
    ----------
    light : ndarray, shape (Py, Px, colours)
        For the target itself, without an upper limit.
    saved : ndarray, shape (Py, Px, colours)
        Light that a photo under black stands for; what a target needs is less by it.
    """
    needed, less = (at_q(transport, each) for each in (light, saved))
    counted = (weights.ravel() > 0) & (target.reshape(weights.size, -1).max(axis=1) > 0)
    return scale_of_needed((needed / (1.0 + less)).max(axis=0)[counted])


def _judged(
    transport: Transport,
    problem: LeastSquares,
    weights: Floats,
    lights: tuple[Floats, Floats],
    scale: float,
    target: Floats,
    peak: float,
) -> Compensation:
    """Say how near to a target the photos under two lights will come."""
    chosen = lights[0].astype(np.float32)
    expected, of_direct = (problem.forward(light) for light in lights)
    bars = error_bar_under(transport, chosen)
    distance = distance_from(target, weights[..., 0] > 0)
    return Compensation(
        light=without_single_channel(chosen),
        scale=scale,
        expected=without_single_channel(expected).astype(np.float32),
        standard_deviation=bars,
        out_of_reach=out_of_reach(expected, target, peak, transport.lit),
        rmse=distance(expected, bars),
        rmse_of_direct=distance(of_direct, bars),
        peak=peak,
        target=without_single_channel(target).astype(np.float32),
    )
