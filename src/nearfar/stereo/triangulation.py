"""Triangulation: the points at which light from projector pixels meets the rays of camera pixels.

A camera pixel's ray is known; q, the projector pixel, is measured. So a point is sought on the
camera's ray alone, at the depth z whose image in the projector, p(z), is nearest to q in deviations
of q: minimise |(q - p(z)) / s|^2. What q misses the ray's image by, its epipolar line, is one
number that no depth explains.
"""

from typing import NamedTuple

import numpy as np

from nearfar.arrays import Floats
from nearfar.stereo.calibration import StereoCalibration

GAUSS_NEWTON_STEPS = 6


class Triangulated(NamedTuple):
    """Points by camera pixel; NaN where rays do not meet in front of camera and projector.

    Attributes
    ----------
    points : ndarray, shape (n, 3)
        In the camera's frame, in the calibration's unit.
    deviation : ndarray, shape (n,)
        Standard deviation of the distance along the camera's ray, by that of q.
    miss : ndarray, shape (n,)
        Distance of q from the image of the camera's ray, in deviations of q.
    distance : ndarray, shape (n,)
        The same in projector pixels.
    """

    points: Floats
    deviation: Floats
    miss: Floats
    distance: Floats


def triangulate_pixels(
    stereo: StereoCalibration, camera: Floats, projector: Floats, deviation: Floats
) -> Triangulated:
    """Triangulate pairs of pixels.

    Parameters
    ----------
    stereo : StereoCalibration
    camera, projector : ndarray, shape (n, 2)
        Pixels (x, y), fractional, (0, 0) the middle of the first.
    deviation : ndarray, shape (n, 2)
        Standard deviations of the projector's, above 0.

    Returns
    -------
    Triangulated
    """
    rays = stereo.camera.rays(camera)
    directions = rays @ stereo.rotation.T
    with np.errstate(all="ignore"):
        depth = _first_depth(stereo, directions, stereo.projector.rays(projector))
        for _ in range(GAUSS_NEWTON_STEPS):
            left, along = _residuals(stereo, directions, depth, projector, deviation)
            depth = depth + (left * along).sum(axis=1) / (along**2).sum(axis=1)
        left, along = _residuals(stereo, directions, depth, projector, deviation)
        away = depth * directions[:, 2] + stereo.translation[2]
        meet = (depth > 0) & (away > 0) & np.isfinite(left).all(axis=1)
        depth = np.where(meet, depth, np.nan)
        spread = np.linalg.norm(rays, axis=1) / np.linalg.norm(along, axis=1)
        nowhere = np.where(meet, 0.0, np.nan)
        return Triangulated(
            points=rays * depth[:, None],
            deviation=spread + nowhere,
            miss=np.linalg.norm(left, axis=1) + nowhere,
            distance=np.linalg.norm(left * deviation, axis=1) + nowhere,
        )


def _first_depth(stereo: StereoCalibration, directions: Floats, seen: Floats) -> Floats:
    """Return the depth that solves x' (z d3 + t3) = z d1 + t1, and so for y', by least squares."""
    shift = stereo.translation
    factor = directions[:, :2] - seen[:, :2] * directions[:, 2:]
    wanted = seen[:, :2] * shift[2] - shift[:2]
    return np.asarray((factor * wanted).sum(axis=1) / (factor**2).sum(axis=1))


def _residuals(
    stereo: StereoCalibration,
    directions: Floats,
    depth: Floats,
    projector: Floats,
    deviation: Floats,
) -> tuple[Floats, Floats]:
    """Return the residual q - p(z) and the derivative of p by z, in deviations, (n, 2)."""
    pixels, motion = stereo.projector.project(depth[:, None] * directions + stereo.translation)
    along = np.einsum("nij,nj->ni", motion, directions)
    return (projector - pixels) / deviation, along / deviation
