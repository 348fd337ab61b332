"""Light of dual views by reciprocity.

A measured row of far-range light has a few waves, so that F^T blurs the projector's side. Columns
are as sharp as photos. Between two points of diffuse surfaces, light is transported alike in both
directions (Helmholtz reciprocity; Sen et al., "Dual photography", SIGGRAPH 2005). Let c' be a
camera pixel with q(c') = p, and p' = q(c). Then

    F[c, p] = F[c', p'] r(p) / r(p')

with one smooth function r for the vignetting of both lenses. So F^T by a picture is found in three
steps: the picture is spread over the projector at q, far-range light is relit under that, and each
projector pixel takes the mean of the camera pixels c'. Near-range light follows in the same way,
but for its functions next to q. These make up for what an error of q takes from direct light, so
they are transposed, as direct light is.

log r is a polynomial of second degree, fitted to F between cells of the projector. If the two
directions disagree at measured frequencies, as with gloss, glass or mirrors, F^T is kept.

Index convention: i and j run over cells of projector pixels, m over real responses.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import gaussian_filter, uniform_filter
from scipy.sparse import csr_array

from nearfar.arrays import Booleans, Floats, Integers, Size
from nearfar.transport.model import Transport
from nearfar.transport.stored import StoredTransport

# Cells on each axis, at most.
MOST_CELLS = 32
# Cycles across the projector of the waves by which cells are compared, and cells in a period.
MOST_CYCLES = 8.0
CELLS_PER_PERIOD = 3.0
# Standard deviation, in cells, by which both sides are blurred before their ratio is fitted.
BLUR_CELLS = 2.0
# Far-range light by reciprocity differs from F^T by less than this share at measured frequencies:
# 0.08 to 0.15 in six scenes; 0.30 to 0.56 on shelves, a hand of wax, caustics, glass and hair.
LARGEST_DISAGREEMENT = 0.2
# Of a light that both sides are compared under, as a share of the projector's sides.
DISC_RADIUS = 0.25
# A projector pixel is seen where at least this share of the usual number of camera pixels sees it,
# or its neighbours of up to so many pixels away.
LEAST_SEEN_SHARE = 0.1
LARGEST_GAP = 2

Blocks = Callable[[], Iterable[Transport]]


@dataclass(frozen=True, eq=False)
class Reciprocity:
    """How far-range light on the projector's side follows from that on the camera's.

    Attributes
    ----------
    projector : Size
    coefficients : ndarray, shape (5,)
        Of y, x, y^2, x^2 and x y in log r, from -1/2 to 1/2 across the projector.
    disagreement : float
        Root mean square difference of both sides at measured frequencies, as a share of far-range
        light.
    complete : bool
        Whether all frequencies of the projector were measured, so that there is nothing to add.

    Examples
    --------
    >>> found = nearfar.find_reciprocity(transport)
    >>> dual = nearfar.dual_view(transport, reciprocity=found)
    """

    projector: Size
    coefficients: Floats
    disagreement: float
    complete: bool

    @property
    def holds(self) -> bool:
        """Whether both sides agree at measured frequencies, and there are others."""
        return not self.complete and self.disagreement < LARGEST_DISAGREEMENT

    @property
    def ratio(self) -> Floats:
        """r, shape (Py, Px)."""
        logarithm = _powers(self.projector) @ self.coefficients
        return np.asarray(np.exp(logarithm).reshape(self.projector))


class ByReciprocity:
    """The correction of a transposed view by reciprocity, summed over blocks that are read twice.

    Parameters
    ----------
    reciprocity : Reciprocity
    channels : int
    """

    def __init__(self, reciprocity: Reciprocity, channels: int) -> None:
        self._ratio = reciprocity.ratio[..., None]
        shape = (*reciprocity.projector, channels)
        self._transposed, self._light, self._seen = (np.zeros(shape) for _ in range(3))
        self._count = np.zeros(reciprocity.projector)

    def send(self, block: Transport, picture: Floats) -> None:
        """Send the light of the camera pixels of a block, (rows, Cx, channels), back."""
        flat, factors = picture.reshape(-1, picture.shape[-1]), _away_from_q(block).factors
        for i in range(flat.shape[1]):
            if flat[:, i].any():
                self._transposed[..., i] += factors.far_back(flat[:, i], i)
                self._transposed[..., i] += factors.near_back(flat[:, i], i)
                self._light[..., i] += factors.spread_directly(flat[:, i])
        self._count += factors.spread_directly(np.ones(len(flat)))

    def see(self, block: Transport) -> None:
        """Relight the camera pixels of a block by all the light that was sent, and add them up."""
        light = (self._light / self._ratio).astype(np.float32)
        away = _away_from_q(block)
        components = away.components(light if light.shape[-1] > 1 else light[..., 0])
        seen = components.far + components.near
        flat = np.reshape(seen, (block.camera.pixels, -1))
        for i in range(flat.shape[1]):
            self._seen[..., i] += away.factors.spread_directly(flat[:, i])

    def correction(self) -> Floats:
        """Return the correction of the transposed view, shape (Py, Px, channels).

        0 at projector pixels that no camera pixel sees.
        """
        seen = _mean_seen(self._seen, self._count)
        return np.where(np.isnan(seen), 0.0, self._ratio * seen - self._transposed)


def find_reciprocity(
    transport: Transport | StoredTransport, blocks: Blocks | None = None
) -> Reciprocity:
    """Compare far-range light on the camera's side with that on the projector's.

    Parameters
    ----------
    transport : Transport or StoredTransport
    blocks : callable, optional
        Yields it in blocks of camera rows, where they are in memory already.

    Returns
    -------
    Reciprocity
        Its ``holds`` is False without far-range or direct light.

    Raises
    ------
    UnreadableFileError
        If a file is damaged.

    Examples
    --------
    >>> found = nearfar.find_reciprocity(transport)
    >>> dual = nearfar.dual_view(transport, reciprocity=found)
    >>> found.ratio.shape, dual.shape
    ((8, 8), (8, 8))
    """
    cells = Size(*np.minimum(MOST_CELLS, transport.projector).tolist())
    basis = transport.far_basis
    complete = basis.count >= transport.projector.pixels
    nothing = Reciprocity(transport.projector, np.zeros(5), np.inf, complete)
    if complete or not {"direct", "far"} <= set(transport.parts):
        return nothing
    cycles = np.abs(basis.cycles * transport.projector)[basis.index]
    most = np.minimum(MOST_CYCLES, np.array(cells) / CELLS_PER_PERIOD)
    low = np.flatnonzero((cycles <= most).all(axis=1))
    total, count = np.zeros((cells.pixels, len(low))), np.zeros(cells.pixels)
    for block in (blocks or blocks_of(transport))():
        lit = np.flatnonzero(block.lit)
        place = (block.factors.q[lit] + 0.5) / transport.projector * cells
        row, column = np.clip(place.astype(np.int64), 0, np.array(cells) - 1).T
        ones, shape = np.ones(len(lit)), (cells.pixels, len(lit))
        into = csr_array((ones, (row * cells.width + column, np.arange(len(lit)))), shape)
        total += into @ block.factors.far[lit].sum(axis=1)[:, low].astype(np.float64)
        count += into.sum(axis=1)
    if not total.any():
        return nothing
    waves = _waves_of_cells(transport, cells, low)
    between = total @ waves
    coefficients = _fitted_ratio(between, count, cells)
    disagreement = _disagreement(between, count, coefficients, waves, cells)
    return Reciprocity(transport.projector, coefficients, disagreement, complete)


def blocks_of(transport: Transport | StoredTransport) -> Blocks:
    """Return a function that yields a transport in blocks of camera rows, from the first one."""
    if isinstance(transport, StoredTransport):
        return transport.blocks
    return lambda: iter((transport,))


def _away_from_q(block: Transport) -> Transport:
    """Return a block without the functions of near-range light next to q."""
    if 0 in block.near.shape:
        return block
    away = ~block.near_basis.is_next_to_q.reshape(block.near_basis.shape)
    return replace(block, near=np.where(away, block.near, np.float32(0.0)))


def _powers(size: Size) -> Floats:
    """Return y, x, y^2, x^2 and x y at each pixel or cell, -1/2 to 1/2, shape (P, 5)."""
    y, x = ((np.arange(side) + 0.5) / side - 0.5 for side in size)
    y, x = (axis.ravel() for axis in np.meshgrid(y, x, indexing="ij"))
    return np.stack([y, x, y * y, x * x, x * y], axis=1)


def _waves_of_cells(
    transport: Transport | StoredTransport, cells: Size, chosen: Integers
) -> Floats:
    """Return rows of F whose one response is 1, at the middles of cells: (m, cells)."""
    basis = transport.far_basis
    middles = (np.arange(side) for side in cells)
    sides = zip(middles, cells, transport.projector, strict=True)
    y, x = ((middle + 0.5) / n * side - 0.5 for middle, n, side in sides)
    frequency = basis.index[chosen]
    cycles = basis.cycles[frequency]
    phase = cycles[:, 0, None, None] * y[:, None] + cycles[:, 1, None, None] * x
    wave = np.where(
        basis.is_sine[chosen][:, None, None],
        np.sin(2 * np.pi * phase),
        np.cos(2 * np.pi * phase),
    )
    once = np.array([k.is_own_negative for k in basis.frequencies])[frequency]
    scale = np.where(once, 1.0, 2.0) / transport.projector.pixels
    return np.asarray((wave * scale[:, None, None]).reshape(len(chosen), -1))


def _fitted_ratio(between: Floats, count: Floats, cells: Size) -> Floats:
    """Fit log r(j) - log r(i) to the log ratio of light from j to i and from i to j.

    Both are blurred, as one is smooth in i where the other is in j, and weighed by their geometric
    mean.
    """
    blurred = gaussian_filter(between.reshape(*cells, *cells), BLUR_CELLS, mode="nearest")
    covered = gaussian_filter(count.reshape(cells), BLUR_CELLS, mode="nearest").ravel()
    known = _is_seen(covered)
    mean = blurred.reshape(cells.pixels, -1)[np.ix_(known, known)] / covered[known][:, None]
    there, back = np.maximum(mean, 0.0), np.maximum(mean.T, 0.0)
    weight = np.sqrt(there * back)
    least = np.finfo(np.float64).tiny
    ratio = np.log(np.maximum(there, least)) - np.log(np.maximum(back, least))
    powers, weighted = _powers(cells)[known], weight * ratio
    crossed = powers.T @ weight @ powers
    normal = 2 * (powers.T * weight.sum(axis=0)) @ powers - crossed - crossed.T
    right = powers.T @ (weighted.sum(axis=0) - weighted.sum(axis=1))
    return np.asarray(np.linalg.lstsq(normal, right, rcond=None)[0])


def _disagreement(
    between: Floats, count: Floats, coefficients: Floats, waves: Floats, cells: Size
) -> float:
    """Return how much both sides differ at measured frequencies, as a share of far-range light.

    Compared under six lights at the camera: halves, a disc and what is around it.
    """
    powers, seen = _powers(cells), _is_seen(count)
    ratio = np.exp(powers @ coefficients)
    mean = between / np.maximum(count, 1.0)[:, None]
    measured, _ = np.linalg.qr(waves.T)
    y, x, disc = powers[:, 0], powers[:, 1], powers[:, 2] + powers[:, 3] < DISC_RADIUS**2
    off = whole = 0.0
    for lit in (y < 0, y > 0, x < 0, x > 0, disc, ~disc):
        light = np.where(lit, count, 0.0)
        transposed = light @ mean
        difference = np.where(seen, ratio * (mean @ (light / ratio)) - transposed, 0.0)
        off += float(np.sum((measured.T @ difference) ** 2))
        whole += float(np.sum(transposed**2))
    return float(np.sqrt(off / whole))


def _is_seen(count: Floats) -> Booleans:
    """Return where enough camera pixels see the projector's light."""
    return np.asarray(count > LEAST_SEEN_SHARE * np.median(count[count > 0]))


def _mean_seen(total: Floats, count: Floats) -> Floats:
    """Return the mean over the camera pixels that see each projector pixel, NaN where none does.

    Projector pixels between those that camera pixels see have the mean of their neighbours.
    """
    found = np.full(total.shape, np.nan)
    if not (count > 0).any():
        return found
    least = LEAST_SEEN_SHARE * float(np.median(count[count > 0]))
    for reach in range(LARGEST_GAP + 1):
        side = 2 * reach + 1
        around = uniform_filter(count, side, mode="constant")
        missing = np.isnan(found[..., 0]) & (around > least)
        mean = uniform_filter(total, (side, side, 1), mode="constant")[missing]
        found[missing] = mean / around[missing][:, None]
    return found
