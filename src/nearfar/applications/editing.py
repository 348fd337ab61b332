"""Edits of a transport: its reach under surfaces, its colours, its light between two regions.

An edited transport is one as any other: it relights, is saved and is loaded. It has neither error
bars nor a verdict, as no photo is of it.

Index convention: c runs over camera pixels, i over channels, w over functions of near-range light,
m over functions of far-range light.
"""

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from nearfar.arrays import Floats, blocks
from nearfar.checks import as_number, finite_numbers, require_instance
from nearfar.errors import InputError
from nearfar.estimate.physical import PhysicalSplit, split_physically
from nearfar.estimate.physical.subsurface import near_functions_of
from nearfar.illumination.real_basis import RealBasis
from nearfar.transport.edits import with_edit
from nearfar.transport.model import Transport
from nearfar.transport.parts import PLACES, require_parts

SUBSURFACE = "subsurface"
# Light that travels farther by this is the same all over any window.
LARGEST_FACTOR = 1e6
# Bytes of patterns that are drawn at once.
PATTERN_BYTES = 2**26
# Rows of F, one for each camera pixel and channel, that are cut at once.
ROWS_AT_ONCE = 2**14


def widen_subsurface(transport: Transport, factor: float) -> Transport:
    """Let light travel farther under translucent surfaces, or less far.

    Distances from q that light travels under a surface, as the physical split finds it, are
    multiplied. Each camera pixel gets as much of it as before under white. What would reach beyond
    the window of near-range light is within it instead.

    Parameters
    ----------
    transport : Transport
    factor : float
        Above 0: 2 is twice as far.

    Returns
    -------
    Transport
        Without error bars or a verdict; its provenance has the edit.

    Raises
    ------
    InputError
        If the factor is not above 0 or above a million, or nothing in the scene is translucent.

    Examples
    --------
    >>> waxen = nearfar.widen_subsurface(transport, 2.0)
    Traceback (most recent call last):
    ...
    nearfar.errors.InputError: nothing in the scene is translucent, so that no light travels ...
    """
    if not 0 < as_number(factor, "the factor") <= LARGEST_FACTOR:
        raise InputError(
            f"the factor is {factor:g}: give one above 0 and up to {LARGEST_FACTOR:g}, 1 for no "
            f"change."
        )
    return widened(_translucent(transport), factor)


def widened(split: PhysicalSplit, factor: float) -> Transport:
    """Return the transport of a split with light that travels `factor` times as far."""
    transport = split.transport
    before, after = near_functions_of(split), near_functions_of(split, factor)
    sums = after.sum(axis=-1, keepdims=True)
    kept = before.sum(axis=-1, keepdims=True)
    after *= np.divide(kept, sums, out=np.zeros_like(sums), where=sums != 0)
    near = transport.near + (after - before).reshape(transport.near.shape)
    return _edited(transport, {"widen_subsurface": float(factor)}, near=near.astype(np.float32))


def recolour(transport: Transport, component: str, colour: ArrayLike) -> Transport:
    """Change the colour of one component.

    Parameters
    ----------
    transport : Transport
    component : {"direct", "near", "far", "free", "subsurface"}
        Of the model's split, or subsurface light as the physical split finds it, within the window
        of near-range light.
    colour : array_like, shape (channels,) or (channels, channels)
        A factor for each channel; or a matrix M, by which a grey light's picture of the component
        is multiplied: each channel becomes a sum of all, ``picture @ M.T``.

    Returns
    -------
    Transport
        Without error bars or a verdict; its provenance has the edit.

    Raises
    ------
    InputError
        If there is no such component, if the colour is of another shape or not finite, or if the
        component would leave the range of float32.

    Examples
    --------
    >>> twice = nearfar.recolour(transport, "near", [2.0])
    >>> before, after = transport.components(light), twice.components(light)
    >>> bool(np.allclose(after.near, 2 * before.near))
    True
    """
    require_instance(transport, Transport, "transport", "nearfar.load_transport")
    matrix = _matrix(colour, transport.channels)
    edit = {"recolour": component, "matrix": matrix.tolist()}
    if component == SUBSURFACE:
        return recoloured_under_surfaces(_translucent(transport), matrix)
    chosen = [part for part in transport.parts if part == component]
    if not chosen:
        raise InputError(
            f"{component!r} is no component that can be recoloured: give "
            f"{', '.join([*transport.parts, SUBSURFACE])}."
        )
    name = ("direct", "near", "far")[PLACES[chosen[0]]]
    changed = {name: _mixed(getattr(transport, name), matrix)}
    if name == "direct" and transport.second_direct is not None:
        changed["second_direct"] = _mixed(transport.second_direct, matrix)
    return _edited(transport, edit, **changed)


def recoloured_under_surfaces(split: PhysicalSplit, matrix: Floats) -> Transport:
    """Return the transport of a split with subsurface light of other colours; see `recolour`."""
    transport, under = split.transport, near_functions_of(split)
    change = np.einsum("ij,cjw->ciw", matrix - np.eye(len(matrix)), under)
    near = transport.near + change.reshape(transport.near.shape)
    edit = {"recolour": SUBSURFACE, "matrix": matrix.tolist()}
    return _edited(transport, edit, near=_float32(near))


def _mixed(factor: Floats, matrix: Floats) -> Floats:
    """Return a factor (Cy, Cx, channels, ...) whose channels are sums of all, float32."""
    flat = factor.reshape(*factor.shape[:3], -1)
    return _float32(np.einsum("ij,yxjw->yxiw", matrix, flat)).reshape(factor.shape)


class Cut(NamedTuple):
    """A transport whose far-range light between two regions is cut, and how well it is cut.

    Attributes
    ----------
    transport : Transport
    error : float
        Difference from an exact cut, as a share of the light that was to be cut: of the entries of
        F between the regions, root mean square.

    Examples
    --------
    >>> everywhere = np.ones((8, 8))
    >>> cut = nearfar.cut_far(transport, everywhere, everywhere)
    >>> round(cut.error, 4)  # all of F is a sum of its own waves
    0.0
    >>> bool(np.abs(cut.transport.far).max() < 1e-6)
    True
    """

    transport: Transport
    error: float


def cut_far(transport: Transport, camera_mask: Floats, projector_mask: Floats) -> Cut:
    """Cut the far-range light between a region of the projector and one of the camera.

    F is a sum of a few waves over the projector, which has no sharp edges. So the cut is the one
    that is nearest to the exact one, by least squares, among sums of the same waves. Under lights
    that are sums of these waves, such as white, it is exact.

    Parameters
    ----------
    transport : Transport
    camera_mask : ndarray, shape (Cy, Cx)
        1 at camera pixels that are not to get the light, 0 elsewhere; shares between.
    projector_mask : ndarray, shape (Py, Px)
        1 at projector pixels whose light they are not to get, 0 elsewhere; shares between.

    Returns
    -------
    Cut
        The transport is without error bars or a verdict; its provenance has the edit.

    Raises
    ------
    InputError
        If a mask has another size or values beyond 0 to 1, or there is no far-range light.

    Examples
    --------
    >>> half = np.zeros((8, 8))
    >>> half[:, :4] = 1
    >>> cut = nearfar.cut_far(transport, half, np.ones((8, 8)))
    >>> bool(np.abs(cut.transport.components(light).far[:, :4]).max() < 1e-6)
    True
    """
    require_instance(transport, Transport, "transport", "nearfar.load_transport")
    require_parts(transport.parts, ["far"])
    of_camera = _mask(camera_mask, transport.camera, "camera")
    of_projector = _mask(projector_mask, transport.projector, "projector")
    basis = transport.far_basis
    products, masked, squared = _products(basis, of_projector.ravel())
    weights = basis.weights
    # Coefficients of the masked row, by least squares, of those of the row: w f.
    to_cut = np.linalg.lstsq(products, masked, rcond=None)[0]
    flat = transport.far.reshape(-1, basis.count)
    shares = np.repeat(of_camera.ravel(), transport.channels)[:, None]
    far, wanted, found = np.empty_like(flat), 0.0, 0.0
    for some in blocks(len(flat), ROWS_AT_ONCE):
        rows = flat[some] * weights * shares[some]
        cut = rows @ to_cut.T
        wanted += float(np.einsum("cm,cm->", rows @ squared, rows))
        found += float(np.einsum("cm,cm->", cut @ products, cut))
        far[some] = flat[some] - cut / weights
    edit = {
        "cut_far": {
            "camera_share": float(of_camera.mean()),
            "projector_share": float(of_projector.mean()),
        }
    }
    error = float(np.sqrt(max(0.0, 1.0 - found / wanted))) if wanted > 0 else 0.0
    return Cut(_edited(transport, edit, far=far.reshape(transport.far.shape)), error)


def _float32(values: Floats) -> Floats:
    """Return values as float32, those beyond its range as infinite ones."""
    with np.errstate(over="ignore"):
        return values.astype(np.float32)


def _edited(transport: Transport, edit: dict[str, Any], **factors: Floats) -> Transport:
    """Return a transport with some other factors, and one edit more in its provenance."""
    if not all(np.isfinite(factor).all() for factor in factors.values()):
        raise InputError(
            "the edited transport would have values beyond the range of float32: edit by smaller "
            "numbers."
        )
    changed: dict[str, Any] = {**factors, "provenance": with_edit(transport.provenance, edit)}
    return replace(transport, posterior=None, verdict=None, **changed)


def _products(basis: RealBasis, mask: Floats) -> tuple[Floats, Floats, Floats]:
    """Return products of patterns with patterns, plain, masked and masked on both sides, (M, M)."""
    totals = np.zeros((3, basis.count, basis.count))
    width = basis.projector.width
    lines = PATTERN_BYTES // (8 * basis.count * width)
    for some in blocks(basis.projector.height, lines):
        drawn = basis.patterns_on(some).astype(np.float64)
        here = mask[some.start * width : some.stop * width]
        for number, weight in enumerate((np.ones_like(here), here, here**2)):
            totals[number] += (drawn * weight) @ drawn.T
    return totals[0], totals[1], totals[2]


def _translucent(transport: Transport) -> PhysicalSplit:
    """Split a transport physically; refuse one without translucent bodies."""
    split = split_physically(transport)
    if not split.bodies:
        raise InputError(
            "nothing in the scene is translucent, so that no light travels under a surface: edit "
            "near-range light instead, or give another transport."
        )
    return split


def _matrix(colour: ArrayLike, channels: int) -> Floats:
    """Return a colour as a matrix (channels, channels), float64."""
    given = finite_numbers(colour, "the colour").astype(np.float64)
    if given.shape == (channels,):
        return np.diag(given)
    if given.shape != (channels, channels):
        shape = "x".join(map(str, given.shape)) or "one number"
        raise InputError(
            f"the colour is {shape}, and the transport has {channels} channels: give {channels} "
            f"factors, or a matrix of {channels}x{channels}."
        )
    return given


def _mask(mask: Floats, size: tuple[int, int], side: str) -> Floats:
    """Return a mask as float64."""
    given = finite_numbers(mask, f"the {side} mask").astype(np.float64)
    if given.shape != size:
        shape = "x".join(map(str, given.shape)) or "one number"
        raise InputError(f"the {side} mask is {shape}: give one of the {side}'s size, {size}.")
    if given.min() < 0 or given.max() > 1:
        raise InputError(
            f"the {side} mask has values from {given.min():g} to {given.max():g}: give 0 to 1."
        )
    return given
