"""Probing: the light that reaches each camera pixel from chosen projector pixels.

(Pi o T) l, entry by entry: O'Toole, Raskar and Kutulakos, "Primal-dual coding to probe light
transport", SIGGRAPH 2012, and O'Toole, Mather and Kutulakos, "3D shape and indirect appearance by
structured light transport", CVPR 2014. They mask T optically; with T in hand it is arithmetic.

Index convention: c runs over camera pixels, row by row.
"""

from math import inf, isinf

import numpy as np

from nearfar.applications.by_runs import (
    RunsOfCamera,
    SummedLight,
    picture_by_runs,
    summed_lights,
)
from nearfar.applications.masks import Given, ProbingMask, SameForAll, Shape, Whole
from nearfar.applications.shapes import Band, Disc
from nearfar.arrays import Floats, Size, blocks
from nearfar.checks import as_light, require_instance
from nearfar.transport.exact import ExactTransport
from nearfar.transport.exact_operator import ExactOperator
from nearfar.transport.model import Transport
from nearfar.transport.stored import StoredTransport

# Bytes of dense rows that are masked at once.
ROWS_BYTES = 2**26

AnyTransport = Transport | ExactTransport | ExactOperator


def probe(transport: AnyTransport, light: Floats, mask: ProbingMask) -> Floats:
    """Relight the scene by chosen projector pixels for each camera pixel: (Pi o T) l.

    Parameters
    ----------
    transport : Transport, ExactTransport or ExactOperator
    light : ndarray, shape (Py, Px) or (Py, Px, channels)
    mask : ProbingMask
        Which projector pixels may light each camera pixel.

    Returns
    -------
    ndarray, shape (Cy, Cx) or (Cy, Cx, channels), float32
        Photo units.

    Raises
    ------
    InputError
        If the light or the mask do not fit the transport.

    Examples
    --------
    >>> ring = nearfar.ProbingMask.ring(1, 3)
    >>> picture = nearfar.probe(transport, light, ring)
    >>> picture.shape
    (8, 8)
    """
    require_instance(mask, ProbingMask, "mask", "nearfar.ProbingMask.within")
    checked = as_light(light, transport.projector, transport.channels)
    sums = _summed(transport, checked)
    return _probed(transport, checked, sums, mask.on(transport.projector), 0, transport.camera)


def probe_stored(stored: StoredTransport, light: Floats, mask: ProbingMask) -> Floats:
    """Probe a transport that is in a file, some rows of the camera at a time; see `probe`."""
    checked = as_light(light, stored.projector, stored.channels)
    mask, first, parts = mask.on(stored.projector), 0, []
    sums: list[SummedLight] | None = None
    for rows in stored.blocks():
        sums = sums or _summed(rows, checked)
        parts.append(_probed(rows, checked, sums, mask, first, stored.camera))
        first += rows.camera.pixels
    return np.concatenate(parts)


def _summed(transport: AnyTransport, light: Floats) -> list[SummedLight] | None:
    """Return a light summed along projector rows; None if rows of T are to be drawn."""
    if not isinstance(transport, Transport) or "free" in transport.parts:
        return None
    return summed_lights(transport.lights(light), transport.far_basis)


def _probed(
    transport: AnyTransport,
    light: Floats,
    sums: list[SummedLight] | None,
    mask: ProbingMask,
    first: int,
    camera: Size,
) -> Floats:
    """Probe camera pixels from `first` on, of a whole camera."""
    total = np.zeros((*transport.camera, transport.channels), dtype=np.float32)
    in_runs: list[tuple[int, Disc | Band]] = []
    for sign, shape in mask.terms:
        match shape:
            case Disc() | Band() if sums is not None and shape != Disc(inf):
                in_runs.append((sign, shape))
            case _:
                found = _by_shape(transport, light, shape, first, camera)
                total += sign * found.reshape(total.shape)
    if in_runs and sums is not None and isinstance(transport, Transport):
        total += _by_runs(transport, sums, in_runs, first, camera).reshape(total.shape)
    return np.asarray(total[..., 0] if transport.channels == 1 else total)


def _by_shape(
    transport: AnyTransport, light: Floats, shape: Shape, first: int, camera: Size
) -> Floats:
    """Return the picture by one shape, of camera pixels from `first` on."""
    match shape:
        case Whole():
            return np.asarray(transport @ light)
        case SameForAll(weights):
            shaped = weights if light.ndim == 2 else weights[..., None]
            return np.asarray(transport @ (light * shaped))
        case Disc(radius) if isinf(radius):
            return np.asarray(transport @ light)
        case _:
            return _by_rows(transport, light, shape, first, camera)


def _by_runs(
    transport: Transport,
    sums: list[SummedLight],
    shapes: list[tuple[int, Disc | Band]],
    first: int,
    camera: Size,
) -> Floats:
    """Return the picture of runs of projector pixels, from factors."""
    q = transport.correspondence.reshape(-1, 2)
    runs = RunsOfCamera(shapes, q, first, camera, transport.projector)
    return picture_by_runs(transport.factors, sums, runs)


def _by_rows(
    transport: AnyTransport, light: Floats, shape: Given | Disc | Band, first: int, camera: Size
) -> Floats:
    """Return the picture by dense rows, masked, of any mask."""
    projector = transport.projector
    flat = light.reshape(projector.pixels, -1).T
    found = np.empty((transport.camera.pixels, transport.channels), dtype=np.float32)
    q = transport.correspondence.reshape(-1, 2) if isinstance(shape, Disc) else found
    length = ROWS_BYTES // (4 * transport.channels * projector.pixels)
    for batch in blocks(len(found), length):
        pixels = slice(first + batch.start, first + batch.stop)
        allowed = (
            shape.rows(pixels, camera, projector)
            if isinstance(shape, Given)
            else shape.runs(pixels, q[batch], camera, projector).drawn(projector)
        )
        rows = transport.rows(batch) * allowed[:, None]
        found[batch] = np.einsum("cip,ip->ci", rows, np.broadcast_to(flat, rows.shape[1:]))
    return found
