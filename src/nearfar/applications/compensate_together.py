"""Lights of several projectors under which the scene looks like a wanted picture together.

The lights l_1, l_2 ... minimise

    |W (T_1 l_1 + T_2 l_2 + ... - s wanted)|^2 + sum of mu_i |gradient of l_i|^2,   0 <= l_i <= 1,

which is the problem of `nearfar.applications.compensate` with T = [T_1 | T_2 | ...].

Where several projectors reach a camera pixel, the picture determines only the sum of what they add.
The iteration starts from lights that fade towards the edge of their projector's reach. Gradient
steps leave what makes no difference to the picture as it was, so the solution fades there, too.
This is edge blending, with the shares of Raskar et al., "Multi-projector displays using
camera-based registration", IEEE Visualization 1999.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf
from typing import Any

import numpy as np
from scipy import ndimage

from nearfar.applications.compensation_problem import (
    camera_weights,
    compensation_problem,
    error_bar_under,
    light_by_direct,
    light_needed,
    scale_of_needed,
    wanted_picture,
)
from nearfar.applications.least_squares import LeastSquares, roughness
from nearfar.applications.likeness import (
    decibels_below,
    distance_from,
    finite_or_none,
    greatest_wanted,
    out_of_reach,
    without_single_channel,
)
from nearfar.applications.several_projectors import added_deviations, require_transports
from nearfar.arrays import Booleans, Floats
from nearfar.callbacks import Report, as_report
from nearfar.checks import as_number
from nearfar.errors import InputError
from nearfar.transport.model import Transport


@dataclass(frozen=True, eq=False)
class JointCompensation:
    """Lights of several projectors that compensate a scene, and what their photo will look like.

    Attributes
    ----------
    lights : tuple of ndarray, shape (Py, Px) or (Py, Px, channels), float32
        A light for each projector, as that of `nearfar.Compensation`.
    scale : float
        s: the photo is to look like `scale` times the wanted picture.
    expected : ndarray, shape (Cy, Cx) or (Cy, Cx, channels), float32
        The picture under all lights together, photo units.
    standard_deviation : ndarray, of the same shape, or None
        Error bar of `expected`; None where a transport has none.
    out_of_reach : ndarray of bool, shape (Cy, Cx)
        Camera pixels that no projector lights directly, and those that stay further than a
        twentieth of the brightest wanted value from what is wanted.
    rmse : float
        Expected distance of the photo from what is wanted, root mean square over camera pixels
        that a projector lights directly, error bars included, photo units.
    rmse_alone : tuple of float
        The same, over the same camera pixels, for the best light of each projector alone.
    peak : float
        Greatest value of what is wanted, `scale` times the picture's.

    Examples
    --------
    >>> wanted = transport @ np.ones((8, 8), dtype=np.float32)  # twice 0.75 would be too much
    >>> found = nearfar.compensate_together([transport, transport], 1.5 * wanted, scale=1.0)
    >>> bool(found.psnr > 30), bool(max(found.psnr_alone) < 15)
    (True, True)
    """

    lights: tuple[Floats, ...]
    scale: float
    expected: Floats
    standard_deviation: Floats | None
    out_of_reach: Booleans
    rmse: float
    rmse_alone: tuple[float, ...]
    peak: float

    @property
    def psnr(self) -> float:
        """`rmse` below `peak`, in dB."""
        return decibels_below(self.peak, self.rmse)

    @property
    def psnr_alone(self) -> tuple[float, ...]:
        """`rmse_alone` below `peak`, in dB."""
        return tuple(decibels_below(self.peak, rmse) for rmse in self.rmse_alone)

    @property
    def out_of_reach_share(self) -> float:
        """Share of all camera pixels that are out of reach."""
        return float(self.out_of_reach.mean())


@dataclass(frozen=True, eq=False)
class JointLeastSquares(LeastSquares):
    """The problems of several projectors as one; a light is all of theirs, flat, in a row.

    Attributes
    ----------
    problems : tuple of LeastSquares
        Of each projector alone, for the same pictures and weights.
    """

    problems: tuple[LeastSquares, ...]

    def information(self, light: Floats) -> Floats:
        """Return the information matrix times a light."""
        back = self.adjoint(self.weights * self.forward(light))
        smooth = [
            problem.smoothness * roughness(own)
            for problem, own in zip(self.problems, self.apart(light), strict=True)
        ]
        return np.asarray(back + _flat(smooth))

    def apart(self, light: Floats) -> list[Floats]:
        """Take the lights of the projectors apart, (Py, Px, colours) each."""
        ends = np.cumsum([problem.diagonal.size for problem in self.problems])
        parts = np.split(light, ends[:-1])
        return [
            part.reshape(problem.diagonal.shape)
            for part, problem in zip(parts, self.problems, strict=True)
        ]


def compensate_together(
    transports: Sequence[Transport],
    wanted: Floats,
    scale: float | None = None,
    *,
    progress: Report | None = None,
) -> JointCompensation:
    """Find the lights of several projectors under which the scene looks like a wanted picture.

    Parameters
    ----------
    transports : sequence of Transport
        Of the same camera at the same place and exposure; one for each projector, of any size and
        pitch.
    wanted : ndarray, shape (Cy, Cx) or (Cy, Cx, channels)
        Linear light, without ambient light, as relit pictures are. Any unit if `scale` is left out.
    scale : float, optional
        What `wanted` is multiplied by. Left out, the one at which 95 % of the camera pixels need no
        more than full white of any projector.
    progress : callable, optional
        Called with what is being done and the share done, 0 to 1.

    Returns
    -------
    JointCompensation

    Raises
    ------
    InputError
        If a transport is another object or has no direct light, if the transports are not of one
        camera, if the picture does not fit the camera, is negative or black, or if the scale is not
        above 0.

    Examples
    --------
    >>> wanted = np.full(transport.camera, 0.2, dtype=np.float32)
    >>> found = nearfar.compensate_together([transport, transport], wanted)
    >>> [light.shape for light in found.lights]
    [(8, 8), (8, 8)]
    """
    require_transports(transports)
    if scale is not None and as_number(scale, "scale") <= 0:
        raise InputError(f"scale is {scale}: give a number above 0, or leave it out.")
    for number, transport in enumerate(transports, 1):
        if "direct" not in transport.parts or not transport.lit.any():
            raise InputError(
                f"transport {number} has no direct light, so that its projector makes no picture "
                f"on the scene: leave it out, or give one that was measured with a projector."
            )
    lit = np.any([transport.lit for transport in transports], axis=0)
    first = transports[0]
    target = wanted_picture(wanted, first.camera, first.channels, lit)
    report = as_report(progress)
    weights = _joint_weights(transports)
    problem = joint_problem(transports, weights)
    start = blended_lights(transports, target, weights)
    if scale is None:
        # Without an upper limit the lights are proportional to the scale.
        start = problem.solve(target, start, inf)
        scale = _scale_within_reach(transports, problem.apart(start), target, weights)
    start = scale * start
    flat = problem.solve(scale * target, start, 1.0, report)
    lights = problem.apart(flat)
    alone = [
        each.solve(scale * target, own, 1.0)
        for each, own in zip(problem.problems, lights, strict=True)
    ]
    report("compensation", 1.0)
    return _judged(transports, problem, (lights, alone), scale, scale * target)


def joint_problem(transports: Sequence[Transport], weights: Floats) -> JointLeastSquares:
    """State the problem for lights of all projectors, flat, and pictures (Cy, Cx, channels)."""
    problems = tuple(compensation_problem(transport, weights) for transport in transports)

    def forward(light: Floats) -> Floats:
        parts = zip(problems, joint.apart(light), strict=True)
        return np.asarray(np.sum([problem.forward(own) for problem, own in parts], axis=0))

    def adjoint(picture: Floats) -> Floats:
        return _flat([problem.adjoint(picture) for problem in problems])

    joint = JointLeastSquares(
        forward,
        adjoint,
        weights,
        _flat([problem.diagonal for problem in problems]),
        smoothness=0.0,
        problems=problems,
    )
    return joint


def blended_lights(transports: Sequence[Transport], target: Floats, weights: Floats) -> Floats:
    """Return lights, flat, whose direct light makes a picture, each fading towards its edge."""
    shares = zip(transports, _shares(transports), strict=True)
    return _flat(
        [light_by_direct(one, share[..., None] * target, weights) for one, share in shares]
    )


def _shares(transports: Sequence[Transport]) -> list[Floats]:
    """Return the share of each projector in the light of camera pixels, (Cy, Cx) each.

    They are in proportion to the distances from the nearest camera pixel that each projector does
    not light directly.
    """
    inside = [_distance(transport.lit) for transport in transports]
    total = np.sum(inside, axis=0)
    return [np.divide(one, total, out=np.zeros_like(one), where=total > 0) for one in inside]


def _distance(lit: Booleans) -> Floats:
    """Return the distance from the nearest camera pixel that is not lit."""
    if lit.all():
        return np.full(lit.shape, float(max(lit.shape)))
    return np.asarray(ndimage.distance_transform_edt(lit))


def describe(found: JointCompensation) -> dict[str, Any]:
    """Return the scale and what to expect, as JSON types; null for dB of a perfect match."""
    return {
        "scale": found.scale,
        "expected_rmse": found.rmse,
        "rmse_alone": list(found.rmse_alone),
        "psnr_dB": finite_or_none(found.psnr),
        "psnr_alone_dB": [finite_or_none(value) for value in found.psnr_alone],
        "out_of_reach_share": found.out_of_reach_share,
    }


def summarise(found: JointCompensation) -> str:
    """Return in lines what `describe` says."""
    alone = ", ".join(f"{value:.1f}" for value in found.psnr_alone)
    return (
        f"scale {found.scale:.4g}\n"
        f"expected error {found.rmse:.2g} of full scale, {found.psnr:.1f} dB below the brightest "
        f"wanted value; by each projector alone {alone} dB\n"
        f"{found.out_of_reach_share:.1%} of the camera pixels are out of reach"
    )


def _joint_weights(transports: Sequence[Transport]) -> Floats:
    """Return W^2, (Cy, Cx, 1): 1 where a projector lights directly and none saturates."""
    known = [camera_weights(transport) > 0 for transport in transports]
    lit = [transport.lit[..., None] for transport in transports]
    # A camera pixel that is lit and does not count is saturated.
    saturated = [one & ~other for one, other in zip(lit, known, strict=True)]
    seen = np.any(known, axis=0) & ~np.any(saturated, axis=0)
    return np.asarray(seen, dtype=np.float64)


def _scale_within_reach(
    transports: Sequence[Transport], lights: Sequence[Floats], target: Floats, weights: Floats
) -> float:
    """Return the scale at which most camera pixels need no more than full white of any."""
    counted = (weights.ravel() > 0) & (target.reshape(weights.size, -1).max(axis=1) > 0)
    each = [
        light_needed(transport, light) for transport, light in zip(transports, lights, strict=True)
    ]
    return scale_of_needed(np.max(each, axis=0)[counted])


def _judged(
    transports: Sequence[Transport],
    problem: JointLeastSquares,
    found: tuple[Sequence[Floats], Sequence[Floats]],
    scale: float,
    target: Floats,
) -> JointCompensation:
    """Say how near to a target the photos will come.

    Parameters
    ----------
    found : tuple
        Lights of all projectors together, and the best one of each alone.
    """
    lights, alone = ([light.astype(np.float32) for light in each] for each in found)
    expected = problem.forward(_flat(lights))
    counted = problem.weights[..., 0] > 0

    distance = distance_from(target, counted)
    bars = [
        error_bar_under(transport, light)
        for transport, light in zip(transports, lights, strict=True)
    ]
    known = [bar for bar in bars if bar is not None]
    together = added_deviations(known) if len(known) == len(bars) else None
    rmse_alone = [
        distance(each.forward(light), error_bar_under(transport, light))
        for transport, each, light in zip(transports, problem.problems, alone, strict=True)
    ]
    peak = greatest_wanted(target, counted)
    lit = np.any([transport.lit for transport in transports], axis=0)
    return JointCompensation(
        lights=tuple(map(without_single_channel, lights)),
        scale=scale,
        expected=without_single_channel(expected).astype(np.float32),
        standard_deviation=together,
        out_of_reach=out_of_reach(expected, target, peak, lit),
        rmse=distance(expected, together),
        rmse_alone=tuple(rmse_alone),
        peak=peak,
    )


def _flat(lights: Sequence[Floats]) -> Floats:
    return np.concatenate([light.ravel() for light in lights])
