"""Where correspondence turns round: the mark of light that came by way of another surface.

Direct light maps a surface from the camera to the projector without turning it over, for both see
the same side of it. Light from a bright surface beside a crease is a mirror's image of it: its
strongest place moves away from the crease as the camera pixel does, to the other side. So where q
turns round, what looks like direct light may well be none.
"""

import numpy as np

from nearfar.arrays import Booleans, Floats

# Neighbours whose q lies further than this many of the camera's usual steps are of another surface.
SAME_SURFACE = 4.0
# Turned round, or squeezed nearly to a line, as at the crease itself: less than this share of the
# area that a step of the camera usually covers.
LEAST_AREA = 0.4


def turned_round(correspondence: Floats) -> Booleans:
    """Tell where the neighbours of a camera pixel see q turn round.

    Parameters
    ----------
    correspondence : ndarray, shape (Cy, Cx, 2)
        q as (y, x); NaN where there is none.

    Returns
    -------
    ndarray of bool, shape (Cy, Cx)
        Where the derivative of q, fitted to up to 8 neighbours on the same surface, has a
        determinant well below the camera's median; False where neighbours do not tell. Which way
        round most of the camera is does not matter: photos may be mirrored.
    """
    height, width = correspondence.shape[:2]
    q = np.pad(correspondence.astype(np.float64), ((1, 1), (1, 1), (0, 0)), constant_values=np.nan)
    steps = [(y, x) for y in (-1, 0, 1) for x in (-1, 0, 1) if (y, x) != (0, 0)]
    off = np.stack([q[1 + y :, 1 + x :][:height, :width] for y, x in steps]) - q[1:-1, 1:-1]
    distance = np.abs(off).max(axis=-1) / np.abs(steps).max(axis=1)[:, None, None]
    seen = np.isfinite(distance)
    if not seen.any():
        return np.zeros((height, width), dtype=bool)
    near = seen & (distance < SAME_SURFACE * max(np.median(distance[seen]), 1e-6))
    offsets = np.array(steps, dtype=np.float64)
    # The derivative is B A^-1, of which the determinant alone is wanted.
    a = np.einsum("nyx,ni,nj->yxij", near, offsets, offsets)
    b = np.einsum("nyxc,nj->yxcj", np.where(near[..., None], off, 0.0), offsets)
    spread = np.linalg.det(a)
    told = spread > 0.5
    area = np.linalg.det(b) / np.where(told, spread, 1.0)
    usual = np.median(area[told]) if told.any() else 0.0
    return np.asarray(told & (area * np.sign(usual) < LEAST_AREA * abs(usual)))
