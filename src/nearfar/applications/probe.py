"""Probing: the light that reaches each camera pixel from chosen projector pixels.

(Pi o T) l, entry by entry: O'Toole, Raskar and Kutulakos, "Primal-dual coding to probe light
transport", SIGGRAPH 2012, and O'Toole, Mather and Kutulakos, "3D shape and indirect appearance by
structured light transport", CVPR 2014. They mask T optically; with T in hand it is arithmetic.

Index convention: c runs over camera pixels, row by row.
"""

from dataclasses import dataclass, replace
from math import inf, isinf

import numpy as np

from nearfar.applications.by_runs import RunsOfCamera, picture_by_runs
from nearfar.applications.masks import Given, ProbingMask, SameForAll, Shape, Whole
from nearfar.applications.shapes import Band, Disc
from nearfar.applications.summed_light import SummedLight, summed_lights
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
    return probed_light(transport, light, mask, transport.camera).picture(transport, 0)


def probe_stored(stored: StoredTransport, light: Floats, mask: ProbingMask) -> Floats:
    """Probe a transport that is in a file, some rows of the camera at a time; see `probe`."""
    first, parts = 0, []
    probed: ProbedLight | None = None
    for rows in stored.blocks():
        probed = probed or probed_light(rows, light, mask, stored.camera)
        parts.append(probed.picture(rows, first))
        first += rows.camera.pixels
    return np.concatenate(parts)


@dataclass(frozen=True, eq=False)
class ProbedLight:
    """A light and a mask, prepared for one block after another of a transport's camera pixels.

    Attributes
    ----------
    light : ndarray, shape (Py, Px) or (Py, Px, channels)
    mask : ProbingMask
    camera : Size
        Of the whole transport, or of as much of it as is probed.
    sums : list of SummedLight, or None
        None if rows of T are to be drawn.
    """

    light: Floats
    mask: ProbingMask
    camera: Size
    sums: list[SummedLight] | None

    def by(self, mask: ProbingMask) -> "ProbedLight":
        """Return the same light, prepared for another mask."""
        return replace(self, mask=mask.on(Size(*self.light.shape[:2])))

    def picture(self, block: AnyTransport, first: int) -> Floats:
        """Probe a block, whose first camera pixel has the number `first` in the whole transport.

        Returns
        -------
        ndarray, shape (y, x) or (y, x, channels), float32
        """
        total = np.zeros((*block.camera, block.channels), dtype=np.float32)
        in_runs: list[tuple[int, Disc | Band]] = []
        for sign, shape in self.mask.terms:
            match shape:
                case Disc() | Band() if self.sums is not None and shape != Disc(inf):
                    in_runs.append((sign, shape))
                case _:
                    found = _by_shape(block, self.light, shape, first, self.camera)
                    total += sign * found.reshape(total.shape)
        if in_runs and self.sums is not None and isinstance(block, Transport):
            total += _by_runs(block, self.sums, in_runs, first, self.camera).reshape(total.shape)
        return np.asarray(total[..., 0] if block.channels == 1 else total)


def probed_light(
    block: AnyTransport, light: Floats, mask: ProbingMask, camera: Size
) -> ProbedLight:
    """Prepare a light and a mask for the blocks of a transport, of which `block` is any.

    Raises
    ------
    InputError
        If the light or the mask do not fit the transport.
    """
    checked = as_light(light, block.projector, block.channels)
    sums: list[SummedLight] | None = None
    if isinstance(block, Transport) and "free" not in block.parts:
        sums = summed_lights(block.lights(checked), block.factors)
    return ProbedLight(checked, mask.on(block.projector), camera, sums)


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
