"""What the model can hold of any transport at best, and how it splits one that is not apart.

A T that was measured, or computed elsewhere, comes as one matrix. Its q is where a row peaks, and
its direct, near- and far-range parts are those of the least-squares fit of the model: a footprint
at q, a window about it, and the rest.

Index convention: rows are (n, channels, Py, Px), n camera pixels in a block.
"""

from dataclasses import dataclass

import numpy as np

from nearfar.arrays import Floats, Size, blocks
from nearfar.errors import InputError
from nearfar.estimate.fit import BATCH_PIXELS, fit_model
from nearfar.illumination.frequencies import far_frequencies, representatives
from nearfar.illumination.real_basis import RealBasis, real_basis
from nearfar.transport.exact import ExactTransport

# Direct light is a peak: over what lies this many projector pixels from it, ...
PEAK_RADIUS = 3
# ... it stands out by this factor or more.
PEAK_OVER_SURROUNDINGS = 2.0


def far_basis_of(far: Size, projector: Size) -> RealBasis:
    """Return the cosines and sines of a far band."""
    return real_basis(representatives(far_frequencies(far, projector)), projector)


def held_by_model(
    rows: Floats, correspondence: Floats, window: int, basis: RealBasis
) -> tuple[Floats, Floats, Floats]:
    """Fit D, N and F to rows by least squares, and return those of the fit.

    Parameters
    ----------
    rows : ndarray, shape (n, channels, Py, Px)
    correspondence : ndarray, shape (n, 2)
        q; NaN without direct light.
    window : int
        W.
    basis : RealBasis
        Of the far band.

    Returns
    -------
    tuple of three ndarrays, each of the shape of `rows`
    """
    count, channels = rows.shape[:2]
    flat = np.moveaxis(rows.reshape(count, channels, -1), 1, 0)
    block = ExactTransport(basis.projector, Size(1, count), (), (), np.ascontiguousarray(flat))
    fitted = fit_model(block, window, basis, correspondence.reshape(1, count, 2))
    d, n, f = fitted.component_rows(slice(None))
    return d.reshape(rows.shape), n.reshape(rows.shape), f.reshape(rows.shape)


def find_direct_light(rows: Floats) -> Floats:
    """Find q by the peak of each row, all channels together.

    Parameters
    ----------
    rows : ndarray, shape (n, channels, Py, Px)

    Returns
    -------
    ndarray, shape (n, 2)
        Centroid of the 3 x 3 about the peak, less what surrounds them; NaN where no peak stands
        out.
    """
    together = rows.sum(axis=1, dtype=np.float64)
    count, height, width = together.shape
    y, x = np.divmod(together.reshape(count, -1).argmax(axis=1), width)
    side = np.arange(-PEAK_RADIUS, PEAK_RADIUS + 1)
    dy, dx = (part.ravel() for part in np.meshgrid(side, side, indexing="ij"))
    at_y, at_x = y[:, None] + dy, x[:, None] + dx
    inside = (at_y >= 0) & (at_y < height) & (at_x >= 0) & (at_x < width)
    values = together[
        np.arange(count)[:, None], np.clip(at_y, 0, height - 1), np.clip(at_x, 0, width - 1)
    ]
    distance = np.maximum(np.abs(dy), np.abs(dx))
    ring = inside & (distance == distance.max())
    # A projector too small for a ring has no surroundings to stand out from.
    level = np.sum(values * ring, axis=1) / np.maximum(ring.sum(axis=1), 1)
    level = np.maximum(level, 0.0)
    peak = together[np.arange(count), y, x]
    weights = np.maximum(values - level[:, None], 0.0) * (inside & (distance <= 1))
    total = np.maximum(weights.sum(axis=1), 1e-300)
    q = np.stack([y + (weights @ dy) / total, x + (weights @ dx) / total], axis=1)
    q[~((peak > 0) & (peak >= PEAK_OVER_SURROUNDINGS * level))] = np.nan
    return q


@dataclass(frozen=True, eq=False)
class ModelSplit:
    """A transport in one matrix, split as the model splits it; see `split_by_model`.

    Attributes
    ----------
    whole : ExactTransport
    window : int
        W.
    basis : RealBasis
        Of the far band.
    correspondence : ndarray, shape (Cy, Cx, 2)
        q; NaN without direct light.
    """

    whole: ExactTransport
    window: int
    basis: RealBasis
    correspondence: Floats

    @property
    def projector(self) -> Size:
        """Pattern grid."""
        return self.whole.projector

    @property
    def camera(self) -> Size:
        """Height and width of the photos."""
        return self.whole.camera

    def component_rows(self, pixels: slice) -> tuple[Floats, Floats, Floats]:
        """Return dense rows of D, N and F; F is all that the other two leave."""
        rows = self.whole.rows(pixels)
        d, n, _ = held_by_model(
            rows.reshape(*rows.shape[:2], *self.projector),
            self.correspondence.reshape(-1, 2)[pixels],
            self.window,
            self.basis,
        )
        d, n = d.reshape(rows.shape), n.reshape(rows.shape)
        return d, n, rows - d - n

    def floodlit(self) -> tuple[Floats, Floats]:
        """Return the direct picture under white, and the rest of it, each (Cy, Cx, channels)."""
        shape = (self.camera.pixels, self.whole.channels)
        direct, rest = np.empty(shape, np.float32), np.empty(shape, np.float32)
        for block in blocks(self.camera.pixels, BATCH_PIXELS):
            d, n, f = self.component_rows(block)
            direct[block], rest[block] = d.sum(axis=-1), (n + f).sum(axis=-1)
        grid = (*self.camera, self.whole.channels)
        return direct.reshape(grid), rest.reshape(grid)


def split_by_model(whole: ExactTransport, window: int, far: Size) -> ModelSplit:
    """Split a transport whose components are not known apart.

    Raises
    ------
    InputError
        If no row holds light.
    """
    q = np.empty((whole.camera.pixels, 2))
    holds_light = False
    for block in blocks(whole.camera.pixels, BATCH_PIXELS):
        rows = whole.rows(block)
        holds_light |= bool(rows.any())
        q[block] = find_direct_light(rows.reshape(*rows.shape[:2], *whole.projector))
    if not holds_light:
        raise InputError(f"{whole.name} holds no light at all: name a transport with light in it.")
    basis = far_basis_of(far, whole.projector)
    return ModelSplit(whole, window, basis, q.reshape(*whole.camera, 2))
