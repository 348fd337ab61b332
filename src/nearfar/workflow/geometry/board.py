"""A checkerboard: its corners in a photo, and q at them.

The corners are found in the photo under white. q is measured at camera pixels, and least well at a
corner, where black and white meet; so a homography is fitted to q of the camera pixels about each
corner: Moreno and Taubin, "Simple, accurate, and robust projector-camera calibration", 3DIMPVT
2012.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from nearfar.arrays import Floats, Size
from nearfar.errors import InputError
from nearfar.files import to_srgb
from nearfar.workflow.geometry.opencv import opencv

# Inner corners along a side, at least: OpenCV finds no smaller boards.
FEWEST_ALONG = 3
# Camera pixels about a corner whose q counts, in distances to the nearest other corner: all of them
# are on the board, whose outer squares are as wide as the inner ones.
REACH = 0.9
# Camera pixels with q that a homography is fitted to, at least.
FEWEST_PIXELS = 12
# Share of the corners at which q must be known.
LEAST_KNOWN = 0.5
TINY = 1e-30
# Photos are brightened until so large a share of the camera is below white.
BELOW_WHITE = 0.98


@dataclass(frozen=True)
class Board:
    """A checkerboard.

    Attributes
    ----------
    corners : Size
        Rows and columns of inner corners, at which four squares meet.
    square : float
        Side of a square: its unit is the calibration's.
    """

    corners: Size
    square: float

    def places(self) -> Floats:
        """Return the corners on the board, row by row, (n, 3) float32, z = 0."""
        rows, columns = np.indices(self.corners)
        flat = np.stack([columns.ravel(), rows.ravel(), np.zeros(self.corners.pixels)], axis=1)
        return (self.square * flat).astype(np.float32)


def find_corners(picture: Floats, board: Board) -> Floats | None:
    """Find the inner corners of a board in a picture.

    Parameters
    ----------
    picture : ndarray, shape (Cy, Cx)
        Linear.
    board : Board

    Returns
    -------
    ndarray, shape (n, 2), float64, or None
        (x, y) of each corner in camera pixels, row by row from either end; None if the board is
        not seen whole.

    Raises
    ------
    MissingPackageError
    """
    cv2 = opencv()
    full = max(float(np.quantile(picture, BELOW_WHITE)), TINY)
    grey = np.rint(255 * to_srgb(picture / full)).astype(np.uint8)
    along = (board.corners.width, board.corners.height)
    flags = cv2.CALIB_CB_NORMALIZE_IMAGE | cv2.CALIB_CB_EXHAUSTIVE | cv2.CALIB_CB_ACCURACY
    seen, corners = cv2.findChessboardCornersSB(grey, along, flags=flags)
    if not seen:
        return None
    return np.asarray(corners, dtype=np.float64).reshape(-1, 2)


def q_at_corners(q: Floats, corners: Floats) -> Floats:
    """Return q at corners, by a homography of the camera pixels about each.

    Parameters
    ----------
    q : ndarray, shape (Cy, Cx, 2)
        (y, x); NaN where there is none.
    corners : ndarray, shape (n, 2)
        (x, y) in camera pixels.

    Returns
    -------
    ndarray, shape (n, 2)
        (x, y) in projector pixels; NaN at corners about which too few camera pixels have q.

    Raises
    ------
    MissingPackageError
    """
    cv2 = opencv()
    rows, columns = np.nonzero(np.isfinite(q).all(axis=-1))
    places = np.stack([columns, rows], axis=1).astype(np.float64)
    values = q[rows, columns, ::-1].astype(np.float64)
    apart = np.linalg.norm(corners[:, None] - corners[None], axis=-1)
    np.fill_diagonal(apart, np.inf)
    found = np.full(corners.shape, np.nan)
    for number, (corner, nearest) in enumerate(zip(corners, apart.min(axis=1), strict=True)):
        about = np.linalg.norm(places - corner, axis=1) <= REACH * nearest
        if about.sum() >= FEWEST_PIXELS:
            found[number] = _at_middle(cv2, places[about] - corner, values[about])
    return found


def _at_middle(cv2: Any, places: Floats, values: Floats) -> Floats:
    """Return the value at (0, 0) of a homography, whatever up to half of the values say."""
    matrix, _ = cv2.findHomography(places, values, cv2.LMEDS)
    if matrix is None or not matrix[2, 2]:
        return np.full(2, np.nan)
    return np.asarray(matrix[:2, 2] / matrix[2, 2])


def require_board(board: Board) -> None:
    """Refuse a board that cannot be found.

    Raises
    ------
    InputError
    """
    if min(board.corners) < FEWEST_ALONG:
        raise InputError(
            f"a board of {board.corners} inner corners is too small: print one of at least "
            f"{FEWEST_ALONG} along each side."
        )
    if not board.square > 0:
        raise InputError(f"a square of {board.square} has no side: give its length.")
