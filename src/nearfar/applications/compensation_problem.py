"""The least-squares problem of compensation: T for lights and pictures of colours, and its weights.

See `nearfar.applications.compensate` for the symbols.
"""

import numpy as np

from nearfar.applications.least_squares import LeastSquares
from nearfar.applications.onto_projector import onto_projector
from nearfar.arrays import Booleans, Floats, Size
from nearfar.checks import as_image
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


def wanted_picture(wanted: Floats, camera: Size, channels: int, lit: Booleans) -> Floats:
    """Return a wanted picture as (Cy, Cx, channels), float64; `lit` is where a light makes one.

    Raises
    ------
    InputError
        If it does not fit the camera, is negative, or black where `lit`.
    """
    target = picture_of_camera(wanted, camera, channels)
    if target.min() < 0:
        raise InputError(
            "the wanted picture has negative values, and there is no negative light: set them to 0."
        )
    if not target[lit].any():
        raise InputError(
            "the wanted picture is black wherever the projector lights the scene: give another one."
        )
    return target


def picture_of_camera(given: Floats, camera: Size, channels: int) -> Floats:
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


def light_by_direct(transport: Transport, picture: Floats, weights: Floats) -> Floats:
    """Return the light whose direct light makes about a picture, (Py, Px, colours)."""
    direct = compensation_problem(direct_alone(transport), weights)
    white = direct.adjoint(weights * direct.forward(np.ones_like(direct.diagonal)))
    wanted = direct.adjoint(weights * picture)
    return np.divide(wanted, white, out=np.zeros_like(wanted), where=white > 0)


def light_needed(transport: Transport, light: Floats) -> Floats:
    """Return the light at each camera pixel's q, of the brightest colour, shape (C,)."""
    return np.asarray(at_q(transport, light).max(axis=0))


def at_q(transport: Transport, light: Floats) -> Floats:
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


def error_bar_under(transport: Transport, light: Floats) -> Floats | None:
    """Return the error bar of the picture under a light (Py, Px, colours); None without any."""
    if transport.posterior is None:
        return None
    mixing = mixing_of(transport.channels, transport.provenance)
    seen = light if mixing is None or transport.channels == 1 else light @ mixing.T
    projected = seen[..., 0] if seen.shape[2] == 1 else seen
    return ErrorBars(transport).picture(projected.astype(np.float32))
