"""The light whose photo looks like a wanted picture: radiometric compensation.

Light that reaches a camera pixel from elsewhere is counter-acted, and so are texture and shading.
The light l minimises

    |W (T l + b - s wanted)|^2 + mu |gradient of l|^2    over 0 <= l <= 1

by accelerated projected gradients, each step divided by the diagonal of D^T W^2 D. b is the photo
under black where what is wanted is a photo, with ambient light, and 0 where it is light alone. W is
1 where the camera sees direct light, and 0 elsewhere and where it is saturated. Colours that the
projector and the camera mix are part of T where a calibration knows them.

Truncated series for T^-1, such as stratified inverses (Ng et al. 2009; Bai et al. 2010), diverge
where much light is reflected on; a projected gradient does not.
"""

from dataclasses import dataclass
from math import inf, isfinite, log10, sqrt
from typing import Any

import numpy as np

from nearfar.applications.least_squares import LeastSquares
from nearfar.applications.onto_projector import onto_projector
from nearfar.arrays import Booleans, Floats, Size
from nearfar.callbacks import Report, as_report
from nearfar.checks import as_image, as_number, require_instance
from nearfar.errors import InputError
from nearfar.estimate.error_bars import ErrorBars
from nearfar.transport.colour import mixing_of
from nearfar.transport.direct import footprint, look_up
from nearfar.transport.model import Transport

# A scale is chosen so that this share of the camera pixels needs no more than full white.
REACHABLE = 0.95
# mu, as a share of the usual diagonal of D^T W^2 D.
SMOOTHNESS = 1e-4
# Diagonal of projector pixels that hardly light the camera directly, as a share of the usual.
LEAST_DIAGONAL = 0.03
# Camera pixels further from what is wanted, as a share of its greatest value, are out of reach.
OUT_OF_REACH = 0.05


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
        return _decibels(self.peak, self.rmse)

    @property
    def psnr_of_direct(self) -> float:
        """`rmse_of_direct` below `peak`, in dB."""
        return _decibels(self.peak, self.rmse_of_direct)

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
        camera, is negative or black, or if the scale is not above 0.

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
        else _picture(black, transport.camera, transport.channels)
    )
    if scale is None:
        # Without an upper limit the light for each of both is proportional to it.
        nothing = np.zeros_like(problem.diagonal)
        free = problem.solve(target, nothing, inf)
        saved = nothing if black is None else problem.solve(dark, nothing, inf)
        scale = _scale_within_reach(transport, free, saved, target, weights)
        start = scale * free - saved
    else:
        start = np.full_like(problem.diagonal, 0.5)
    goal = scale * target - dark
    light = problem.solve(goal, start, 1.0, report)
    alone = compensation_problem(direct_alone(transport), weights)
    of_direct = alone.solve(goal, light, 1.0)
    report("compensation", 1.0)
    return _judged(transport, problem, weights, (light, of_direct), scale, goal)


def describe(found: Compensation) -> dict[str, Any]:
    """Return the scale and what to expect, as JSON types; null for dB of a perfect match."""
    decibels = {"psnr_dB": found.psnr, "psnr_of_direct_dB": found.psnr_of_direct}
    return {
        "scale": found.scale,
        "expected_rmse": found.rmse,
        "rmse_of_direct": found.rmse_of_direct,
        **{name: value if isfinite(value) else None for name, value in decibels.items()},
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


def wanted_picture(wanted: Floats, camera: Size, channels: int, lit: Booleans) -> Floats:
    """Return a wanted picture as (Cy, Cx, channels), float64; `lit` is where a light makes one.

    Raises
    ------
    InputError
        If it does not fit the camera, is negative, or black where `lit`.
    """
    target = _picture(wanted, camera, channels)
    if target.min() < 0:
        raise InputError(
            "the wanted picture has negative values, and there is no negative light: set them to 0."
        )
    if not target[lit].any():
        raise InputError(
            "the wanted picture is black wherever the projector lights the scene: give another one."
        )
    return target


def _picture(given: Floats, camera: Size, channels: int) -> Floats:
    """Return a picture of the camera as (Cy, Cx, channels), float64."""
    picture = np.asarray(given)
    if picture.ndim == 2 and channels > 1:
        picture = np.repeat(picture[..., None], channels, axis=2)
    flat = as_image(picture, camera, channels)
    return np.asarray(flat, dtype=np.float64).reshape(*camera, channels)


def camera_weights(transport: Transport) -> Floats:
    """Return W^2, shape (Cy, Cx, 1)."""
    seen = transport.lit
    if transport.posterior is not None:
        black = np.zeros(transport.projector, dtype=np.float32)
        bars = np.reshape(ErrorBars(transport).picture(black), (*transport.camera, -1))
        seen = seen & np.isfinite(bars).all(axis=-1)
    return np.asarray(seen[..., None], dtype=np.float64)


def direct_alone(transport: Transport) -> Transport:
    """Return a transport of the same direct light and nothing else."""
    absent = {part: 0.0 for part in transport.parts if part != "direct"}
    return transport.with_gains(**absent)


def compensation_problem(transport: Transport, weights: Floats) -> LeastSquares:
    """State the problem for lights (Py, Px, colours) and pictures (Cy, Cx, channels)."""
    camera, projector, channels = transport.camera, transport.projector, transport.channels
    mixing = mixing_of(channels, transport.provenance) if channels > 1 else None
    shares = np.eye(channels) if mixing is None else mixing

    def forward(light: Floats) -> Floats:
        seen = (light @ shares.T).astype(np.float32)
        return (transport @ seen).reshape(*camera, channels).astype(np.float64)

    def adjoint(picture: Floats) -> Floats:
        image = picture.astype(np.float32).reshape(camera if channels == 1 else (*camera, channels))
        back = transport.adjoint(image).reshape(*projector, channels)
        return np.asarray(back @ shares, dtype=np.float64)

    white = np.where(weights.reshape(-1, 1) > 0, transport.direct.reshape(-1, channels), 0.0)
    found = onto_projector(transport.correspondence, white, projector).weights
    diagonal = found @ shares**2
    lighting = diagonal[diagonal > 0]
    if not lighting.size:
        raise InputError(
            "the transport has no direct light above black, so that no light makes a picture on "
            "the scene: photograph the scene with more light."
        )
    usual = float(np.median(lighting))
    diagonal = np.maximum(diagonal, LEAST_DIAGONAL * usual)
    return LeastSquares(forward, adjoint, weights, diagonal, SMOOTHNESS * usual)


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
    needed, less = (_at_q(transport, each) for each in (light, saved))
    counted = (weights.ravel() > 0) & (target.reshape(weights.size, -1).max(axis=1) > 0)
    return scale_of_needed((needed / (1.0 + less)).max(axis=0)[counted])


def light_needed(transport: Transport, light: Floats) -> Floats:
    """Return the light at each camera pixel's q, of the brightest colour, shape (C,)."""
    return np.asarray(_at_q(transport, light).max(axis=0))


def _at_q(transport: Transport, light: Floats) -> Floats:
    """Return a light (Py, Px, colours) at each camera pixel's q, shape (colours, C)."""
    where = footprint(transport.correspondence, transport.projector)
    return np.stack([look_up(one.ravel(), where) for one in np.moveaxis(light, -1, 0)])


def scale_of_needed(needed: Floats) -> float:
    """Return the scale at which most camera pixels need no more than full white.

    Parameters
    ----------
    needed : ndarray, shape (n,)
        Light that camera pixels need for a scale of 1.

    Raises
    ------
    InputError
        If they need none.
    """
    most = np.quantile(needed, REACHABLE) if needed.size else 0.0
    if most <= 0:
        raise InputError(
            "no light makes anything of the wanted picture on this scene: give a picture that is "
            "bright where the projector lights the scene."
        )
    return float(1.0 / most)


def _judged(
    transport: Transport,
    problem: LeastSquares,
    weights: Floats,
    lights: tuple[Floats, Floats],
    scale: float,
    target: Floats,
) -> Compensation:
    """Say how near to a target the photos under two lights will come."""
    chosen = lights[0].astype(np.float32)
    expected, of_direct = (problem.forward(light) for light in lights)
    bars = error_bar_under(transport, chosen)
    counted = weights[..., 0] > 0
    noise = 0.0 if bars is None else np.reshape(bars, target.shape)[counted] ** 2

    def distance(picture: Floats) -> float:
        return sqrt(float(np.mean((picture - target)[counted] ** 2 + noise)))

    peak = float(target[counted].max())
    far = np.abs(expected - target).max(axis=2) > OUT_OF_REACH * peak
    shape = transport.camera if transport.channels == 1 else target.shape
    return Compensation(
        light=chosen[..., 0] if chosen.shape[2] == 1 else chosen,
        scale=scale,
        expected=expected.reshape(shape).astype(np.float32),
        standard_deviation=bars,
        out_of_reach=far | ~transport.lit,
        rmse=distance(expected),
        rmse_of_direct=distance(of_direct),
        peak=peak,
        target=target.reshape(shape).astype(np.float32),
    )


def error_bar_under(transport: Transport, light: Floats) -> Floats | None:
    """Return the error bar of the picture under a light (Py, Px, colours); None without any."""
    if transport.posterior is None:
        return None
    mixing = mixing_of(transport.channels, transport.provenance)
    seen = light if mixing is None or transport.channels == 1 else light @ mixing.T
    projected = seen[..., 0] if seen.shape[2] == 1 else seen
    return ErrorBars(transport).picture(projected.astype(np.float32))


def _decibels(peak: float, rmse: float) -> float:
    return 20 * log10(peak / rmse) if rmse > 0 else inf
