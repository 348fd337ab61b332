"""The best fit of the model, D with a window and a far band, to a known transport.

Its SNR is the upper bound of any estimate with the same W and far band, and its factors are the
model's true d, n and f.

Index convention: arrays are (n, channels, ...); m runs over far coefficients, w over the window.
"""

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Booleans, Floats, blocks, product
from nearfar.illumination.centred_basis import CentredBasis, centred_basis
from nearfar.illumination.near_basis import NearBasis
from nearfar.illumination.real_basis import RealBasis
from nearfar.transport import direct, near
from nearfar.transport.exact import ExactTransport
from nearfar.transport.model import Transport

# Inside the window n takes whatever f leaves, so f is fitted to what lies outside; with this small
# weight inside, a part that both could hold goes to f.
WEIGHT_INSIDE = 0.001
# Conjugate gradients end at this share of the first residual, or after this many iterations.
MAXIMUM_ITERATIONS = 60
TOLERANCE = 1e-5
# Camera pixels of a batch.
BATCH_PIXELS = 256


def fit_model(
    truth: ExactTransport, window: int, far_basis: RealBasis, correspondence: Floats | None = None
) -> Transport:
    """Fit D + N + F to a known transport by least squares.

    Parameters
    ----------
    truth : ExactTransport
        If its components are not known separately, d is the sum of the entries around q.
    window : int
        W.
    far_basis : RealBasis
    correspondence : ndarray, shape (Cy, Cx, 2), optional
        q; the truth's own by default.

    Returns
    -------
    Transport
    """
    q = truth.correspondence if correspondence is None else correspondence
    where = direct.footprint(q, truth.projector)
    centres = near.centre(q, truth.projector)
    lit = np.isfinite(q[..., 0]).ravel()
    centred = centred_basis(far_basis, NearBasis(window))
    pixels, channels = truth.camera.pixels, truth.channels
    d = np.zeros((pixels, channels), dtype=np.float32)
    n = np.zeros((pixels, channels, window**2), dtype=np.float32)
    f = np.zeros((pixels, channels, far_basis.count), dtype=np.float32)
    for batch in blocks(pixels, BATCH_PIXELS):
        rows = truth.rows(batch)
        corners = direct.Footprint(where.pixels[batch], where.weights[batch])
        d[batch] = _direct(truth, rows, batch, corners)
        number = np.arange(len(rows))[:, None]
        for i in range(channels):
            # At the border two corners may be one pixel: subtract each on its own.
            taken = corners.weights * d[batch, i, None]
            np.subtract.at(rows[:, i], (number, corners.pixels), taken)
        inside = near.inside(centres[batch], window, truth.projector) & lit[batch, None]
        entries = near.window_pixels(centres[batch], window, truth.projector)
        within = rows[number[:, :, None], np.arange(channels)[:, None], entries[:, None]]
        within = within * inside[:, None]
        f[batch] = _far(rows, within, inside, centred, centres[batch])
        seen: Floats = product(
            centred.recentre(f[batch] * far_basis.weights, centres[batch]), centred.on_window
        )
        n[batch] = (within - seen) * inside[:, None]
        # The paper's own far step: what D and N leave at the far frequencies is f's.
        responses = centred.uncentre(product(n[batch], centred.on_window.T), centres[batch])
        f[batch] = product(rows, far_basis.patterns.T) - responses
    shape = (*truth.camera, channels)
    return Transport(
        projector=truth.projector,
        correspondence=q.astype(np.float32),
        direct=d.reshape(shape),
        near=n.reshape(*shape, window, window),
        far=f.reshape(*shape, -1),
        far_basis=far_basis,
        black=np.zeros(shape, dtype=np.float32),
        noise=np.zeros(shape, dtype=np.float32),
    )


def _direct(truth: ExactTransport, rows: Floats, batch: slice, corners: direct.Footprint) -> Floats:
    """Known d, or the row's own values at q."""
    if truth.is_apart:
        return np.stack([part[batch].sum(axis=1) for part in truth.direct], axis=1)
    number = np.arange(len(rows))[:, None]
    return np.stack(
        [
            np.sum(rows[number, i, corners.pixels] * (corners.weights > 0), axis=1)
            for i in range(truth.channels)
        ],
        axis=1,
    )


def _far(
    rows: Floats,
    within: Floats,
    inside: Booleans,
    centred: CentredBasis,
    centres: NDArray[np.int64],
) -> Floats:
    """Weighted least squares for f by conjugate gradients, all rows at once."""
    weights = centred.basis.weights.astype(np.float32)
    less: Floats = np.float32(1.0 - WEIGHT_INSIDE) * inside[:, None]

    def normal(f: Floats) -> Floats:
        seen = product(centred.recentre(f * weights, centres), centred.on_window) * less
        return np.asarray(
            f * weights - weights * centred.uncentre(product(seen, centred.on_window.T), centres)
        )

    right = weights * product(rows, centred.basis.patterns.T)
    right -= weights * centred.uncentre(product(within * less, centred.on_window.T), centres)
    f = np.zeros_like(right)
    residual = right.copy()
    # Preconditioned by the diagonal without a window.
    step = residual / weights
    squares = np.sum(residual * step, axis=-1, keepdims=True)
    first = squares.max(initial=0.0)
    for _ in range(MAXIMUM_ITERATIONS):
        image = normal(step)
        along = squares / np.maximum(np.sum(step * image, axis=-1, keepdims=True), 1e-30)
        f += along * step
        residual -= along * image
        scaled = residual / weights
        new_squares = np.sum(residual * scaled, axis=-1, keepdims=True)
        if new_squares.max(initial=0.0) <= TOLERANCE**2 * first:
            break
        step = scaled + step * (new_squares / np.maximum(squares, 1e-30))
        squares = new_squares
    return f
