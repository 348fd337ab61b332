"""Pinholes with lens distortion, by OpenCV's model.

The model of `cv::calibrateCamera`: a point (X, Y, Z) is at (x, y) = (X, Y) / Z on the plane at
distance 1. With r^2 = x^2 + y^2 it is distorted into

    x' = x a(r) + 2 p1 x y + p2 (r^2 + 2 x^2) + s1 r^2 + s2 r^4
    y' = y a(r) + p1 (r^2 + 2 y^2) + 2 p2 x y + s3 r^2 + s4 r^4
    a(r) = (1 + k1 r^2 + k2 r^4 + k3 r^6) / (1 + k4 r^2 + k5 r^4 + k6 r^6)

and falls on the pixel K (x', y', 1). Coefficients are in OpenCV's order: k1, k2, p1, p2, k3, k4,
k5, k6, s1, s2, s3, s4. Pixels are (x, y) here, and (0, 0) is the middle of the first one.
"""

from dataclasses import dataclass

import numpy as np

from nearfar.arrays import Floats, Size

# Numbers of coefficients that OpenCV gives, but for those of tilted sensors.
COEFFICIENT_COUNTS = (0, 4, 5, 8, 12)
MOST_COEFFICIENTS = 12
# Steps in which the distortion is taken out, and the error that is left at most, on the plane at
# distance 1.
FIXED_POINT_STEPS = 5
NEWTON_STEPS = 20
LARGEST_ERROR = 1e-9


@dataclass(frozen=True, eq=False)
class Lens:
    """A pinhole with a lens, and its pixels.

    Attributes
    ----------
    size : Size
        Pixels.
    matrix : ndarray, shape (3, 3), float64
        K, from the plane at distance 1 to pixels.
    distortion : ndarray, shape (n,), float64
        Coefficients in OpenCV's order, n of `COEFFICIENT_COUNTS`.
    """

    size: Size
    matrix: Floats
    distortion: Floats

    def project(self, points: Floats) -> tuple[Floats, Floats]:
        """Return the pixels that points fall on, and how fast these move with the points.

        Parameters
        ----------
        points : ndarray, shape (n, 3)
            In the frame of the pinhole, z forwards and not 0.

        Returns
        -------
        pixels : ndarray, shape (n, 2)
            (x, y).
        motion : ndarray, shape (n, 2, 3)
            Derivatives of the pixels by the points.
        """
        plane = points[:, :2] / points[:, 2:]
        distorted, bent = distort(plane, self.distortion)
        on_plane = np.zeros((len(points), 2, 3))
        on_plane[:, 0, 0] = on_plane[:, 1, 1] = 1 / points[:, 2]
        on_plane[:, :, 2] = -plane / points[:, 2:]
        linear = self.matrix[:2, :2]
        return distorted @ linear.T + self.matrix[:2, 2], linear @ (bent @ on_plane)

    def rays(self, pixels: Floats) -> Floats:
        """Return the points on the plane at distance 1 whose light falls on pixels.

        Parameters
        ----------
        pixels : ndarray, shape (n, 2)
            (x, y).

        Returns
        -------
        ndarray, shape (n, 3)
            (x, y, 1); NaN where the distortion cannot be taken out.
        """
        distorted = np.linalg.solve(
            self.matrix[:2, :2], (pixels - self.matrix[:2, 2]).T.astype(np.float64)
        ).T
        plane = undistort(distorted, self.distortion)
        return np.concatenate([plane, np.ones((len(plane), 1))], axis=1)


def distort(plane: Floats, coefficients: Floats) -> tuple[Floats, Floats]:
    """Apply the distortion to points on the plane at distance 1.

    Parameters
    ----------
    plane : ndarray, shape (n, 2)
    coefficients : ndarray, shape (n,)

    Returns
    -------
    distorted : ndarray, shape (n, 2)
    bent : ndarray, shape (n, 2, 2)
        Derivatives of the distorted points by the others.
    """
    k1, k2, p1, p2, k3, k4, k5, k6, s1, s2, s3, s4 = np.pad(
        coefficients, (0, MOST_COEFFICIENTS - len(coefficients))
    )
    x, y = plane.T
    square = x**2 + y**2
    above = 1 + square * (k1 + square * (k2 + square * k3))
    below = 1 + square * (k4 + square * (k5 + square * k6))
    radial = above / below
    # By the square of the radius.
    slope = (k1 + square * (2 * k2 + 3 * k3 * square)) / below
    slope -= radial * (k4 + square * (2 * k5 + 3 * k6 * square)) / below
    right = x * radial + 2 * p1 * x * y + p2 * (square + 2 * x**2) + square * (s1 + s2 * square)
    down = y * radial + p1 * (square + 2 * y**2) + 2 * p2 * x * y + square * (s3 + s4 * square)
    both = 2 * x * y * slope + 2 * p1 * x + 2 * p2 * y
    prism = s1 + 2 * s2 * square, s3 + 2 * s4 * square
    bent = np.empty((len(plane), 2, 2))
    bent[:, 0, 0] = radial + 2 * x**2 * slope + 2 * p1 * y + 6 * p2 * x + 2 * x * prism[0]
    bent[:, 0, 1] = both + 2 * y * prism[0]
    bent[:, 1, 0] = both + 2 * x * prism[1]
    bent[:, 1, 1] = radial + 2 * y**2 * slope + 6 * p1 * y + 2 * p2 * x + 2 * y * prism[1]
    return np.stack([right, down], axis=1), bent


def undistort(distorted: Floats, coefficients: Floats) -> Floats:
    """Take the distortion out of points on the plane at distance 1.

    By Newton's method, begun by fixed-point steps, which are slower but go farther.

    Parameters
    ----------
    distorted : ndarray, shape (n, 2)
    coefficients : ndarray, shape (n,)

    Returns
    -------
    ndarray, shape (n, 2)
        NaN where no point is found that is distorted into the given one.
    """
    if not np.any(coefficients):
        return np.array(distorted, dtype=np.float64)
    plane = np.array(distorted, dtype=np.float64)
    with np.errstate(all="ignore"):
        for _ in range(FIXED_POINT_STEPS):
            plane = plane + distorted - distort(plane, coefficients)[0]
        for _ in range(NEWTON_STEPS):
            found, bent = distort(plane, coefficients)
            error = distorted - found
            (a, b), (c, d) = bent.transpose(1, 2, 0)
            steps = np.stack([d * error[:, 0] - b * error[:, 1], a * error[:, 1] - c * error[:, 0]])
            plane = plane + (steps / (a * d - b * c)).T
        left = np.abs(distort(plane, coefficients)[0] - distorted).max(axis=1)
        plane[~(left <= LARGEST_ERROR)] = np.nan
    return plane
