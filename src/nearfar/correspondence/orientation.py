"""Where correspondence is mirrored, which is a mark of light by way of another surface.

Camera and projector see the same side of a surface, so direct light maps camera to projector
without mirroring it. Light that comes by way of another surface beside a crease is mirrored: as the
camera pixel moves away from the crease on one side, the strongest projector pixel moves away from
it on the other. So where q is mirrored, what looks like direct light may well be none.
"""

import numpy as np

from nearfar.arrays import Booleans, Floats

# A neighbour whose q differs by more, in units of the camera's median difference, is on another
# surface.
LARGEST_STEP = 4.0
# Determinant of the derivative of q, over the camera's median, below which q is mirrored, or almost
# squeezed to a line, as at the crease itself.
LEAST_DETERMINANT = 0.4


def is_mirrored(correspondence: Floats) -> Booleans:
    """Return where q is mirrored, by the neighbours of each camera pixel.

    Parameters
    ----------
    correspondence : ndarray, shape (Cy, Cx, 2)
        q as (y, x); NaN where there is none.

    Returns
    -------
    ndarray of bool, shape (Cy, Cx)
        Where the derivative of q, fitted to up to 8 neighbours on the same surface, has a
        determinant well below the camera's median; False where neighbours do not determine it. The
        sign is relative to most of the camera, since the photos themselves may be mirrored.
    """
    height, width = correspondence.shape[:2]
    q = np.pad(correspondence.astype(np.float64), ((1, 1), (1, 1), (0, 0)), constant_values=np.nan)
    steps = [(y, x) for y in (-1, 0, 1) for x in (-1, 0, 1) if (y, x) != (0, 0)]
    off = np.stack([q[1 + y :, 1 + x :][:height, :width] for y, x in steps]) - q[1:-1, 1:-1]
    distance = np.abs(off).max(axis=-1) / np.abs(steps).max(axis=1)[:, None, None]
    seen = np.isfinite(distance)
    if not seen.any():
        return np.zeros((height, width), dtype=bool)
    near = seen & (distance < LARGEST_STEP * max(np.median(distance[seen]), 1e-6))
    offsets = np.array(steps, dtype=np.float64)
    # The derivative is B A^-1, of which the determinant alone is wanted.
    a = np.einsum("nyx,ni,nj->yxij", near, offsets, offsets)
    b = np.einsum("nyxc,nj->yxcj", np.where(near[..., None], off, 0.0), offsets)
    spread = np.linalg.det(a)
    determined = spread > 0.5
    area = np.linalg.det(b) / np.where(determined, spread, 1.0)
    usual = np.median(area[determined]) if determined.any() else 0.0
    return np.asarray(determined & (area * np.sign(usual) < LEAST_DETERMINANT * abs(usual)))
