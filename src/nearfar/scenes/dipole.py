"""Light under a translucent surface: the dipole of Jensen, Marschner, Levoy and Hanrahan (2001).

"A Practical Model for Subsurface Light Transport", SIGGRAPH 2001, section 2.2, used as a
patch-to-patch matrix over straight distances. All lengths in metres.
"""

import numpy as np

from nearfar.arrays import Floats, blocks
from nearfar.parallel import side_by_side
from nearfar.scenes.geometry import Medium
from nearfar.scenes.patches import Patches
from nearfar.transport.dipole import (
    Dipole,
    boundary_mismatch,
    diffuse_profile,
    diffuse_reflectance,
)

ROWS_AT_ONCE = 16


def dipole(medium: Medium, channel: int) -> Dipole:
    """Place the two sources of a medium in one channel."""
    scattering, absorption = medium.scattering[channel], medium.absorption[channel]
    extinction = scattering + absorption
    mismatch = boundary_mismatch(medium.index)
    return Dipole(
        reduced_albedo=scattering / extinction,
        attenuation=float(np.sqrt(3 * absorption * extinction)),
        real=1 / extinction,
        virtual=(1 + 4 * mismatch / 3) / extinction,
    )


def subsurface(patches: Patches, source: Dipole) -> Floats:
    """Mean of R_d between the samples of all pairs of patches.

    Parameters
    ----------
    patches : Patches
        The n patches of one translucent body.
    source : Dipole

    Returns
    -------
    ndarray, shape (n, n), float64
        Symmetric, per square metre; times the area of j, it takes irradiance at j to exitance
        at i. A sample meets itself as a disc of its own area, where R_d is integrated.
    """
    # Relative to the body's middle, so that float32 will do for the distances.
    position = patches.positions.reshape(-1, 3) - patches.centre.mean(axis=0)
    area = patches.areas.ravel()
    true = area > 0
    owner = np.repeat(np.arange(len(patches)), patches.areas.shape[1])[true]
    position, area = position[true], area[true]
    weight = (area / patches.area[owner]).astype(np.float32)
    starts = np.flatnonzero(np.diff(owner, prepend=-1))
    bounds = np.append(starts, len(owner))
    own = diffuse_reflectance(source, np.sqrt(area / np.pi)) / area
    result = np.zeros((len(patches), len(patches)))

    def fill(rows: slice) -> None:
        # Only pairs j >= the block's first row; the rest by symmetry.
        begin, end = bounds[rows.start], bounds[rows.stop]
        square = np.zeros((end - begin, len(owner) - begin), dtype=np.float32)
        for axis in position.T.astype(np.float32):
            square += (axis[begin:end, None] - axis[begin:]) ** 2
        kernel = diffuse_profile(source, square)
        here = np.arange(end - begin)
        kernel[here, here] = own[begin:end]
        kernel *= weight[begin:]
        kernel = np.add.reduceat(kernel, starts[rows.start :] - begin, axis=1)
        kernel *= weight[begin:end, None]
        result[rows, rows.start :] = np.add.reduceat(kernel, starts[rows] - begin, axis=0)

    side_by_side(fill, blocks(len(patches), ROWS_AT_ONCE))
    # R_d is positive definite, so by Cauchy and Schwarz no mean between two patches is above the
    # geometric mean of those within them; samples of a very coarse grid may say otherwise.
    within = np.sqrt(np.diag(result))
    limit = np.outer(within, within)
    np.fill_diagonal(limit, np.inf)
    np.minimum(result, limit, out=result)
    return np.triu(result) + np.triu(result, 1).T
