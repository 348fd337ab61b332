"""Depth: where the rays of camera pixels meet the light of the projector pixels q that light them.

Index convention: pixels of lenses are (x, y), q is (y, x).
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from nearfar.arrays import Booleans, Floats, Size, blocks
from nearfar.checks import as_number, require_instance
from nearfar.correspondence import Correspondence
from nearfar.correspondence.deviation import LEAST_DEVIATION, deviation_of
from nearfar.errors import InputError
from nearfar.illumination.frames import fit_frame
from nearfar.stereo import StereoCalibration, Triangulated, triangulate_pixels

# Correspondence is wrong where q misses its epipolar line by more standard deviations than this, or
# by more than this many times the typical distance: wrong q scatter, and so have large deviations.
LARGEST_MISS = 5.0
# Share of normally distributed misses that lie within one standard deviation.
ONE_DEVIATION = 0.6827
# The deviation of q is multiplied by the factor with which it explains the misses. If there are
# fewer misses than these, the factor is that of exact scenes (benchmarks/depth.py).
FEWEST_MISSES = 50
USUAL_FACTOR = 1.1
LEAST_FACTOR = 0.1
# A calibration does not fit if misses are typically above this many pattern pixels.
LARGEST_TYPICAL_MISS = 1.0
PIXELS_AT_ONCE = 2**18


@dataclass(frozen=True, eq=False)
class Depth:
    """Points on the surfaces that a camera sees and a projector lights, by camera pixel.

    Attributes
    ----------
    points : ndarray, shape (Cy, Cx, 3), float64
        (x, y, z) in the camera's frame, x to the right, y down, z forwards, in the unit of the
        calibration; NaN where there is none.
    deviation : ndarray, shape (Cy, Cx), float64
        Standard deviation of a point along the camera's ray, from the error bar of q, in the unit
        of the calibration. Errors of the calibration, which all points share, are left out.
    confidence : ndarray, shape (Cy, Cx), float32
        That of q.
    miss : ndarray, shape (Cy, Cx), float64
        Distance of q from the epipolar line of its camera pixel, in pattern pixels; NaN where the
        rays do not meet in front of camera and projector.
    factor : float
        What the deviation of q was multiplied by, so that it explains the misses.
    lit : int
        Number of camera pixels with q. Each has a point or is counted in one of the following.
    unsure, missed, behind : int
        Numbers of camera pixels that were left out: confidence is too low; the rays miss each other
        by more than chance; the rays do not meet in front of camera and projector.

    Examples
    --------
    >>> matrix = np.array([[8, 0, 3.5], [0, 8, 3.5], [0, 0, 1]])
    >>> shifted = matrix - [[0, 0, 1], [0, 0, 0], [0, 0, 0]]
    >>> stereo = nearfar.StereoCalibration.from_opencv(
    ...     (8, 8), matrix, None, (8, 8), shifted, None, np.eye(3), [0.25, 0, 0]
    ... )
    >>> found = nearfar.triangulate(correspondence, stereo, projector=(8, 8))
    >>> found.points.shape, found.lit
    ((8, 8, 3), 64)
    >>> float(np.nanmedian(found.points[..., 2]).round(1))  # a wall at a distance of 2
    2.0
    """

    points: Floats
    deviation: Floats
    confidence: Floats
    miss: Floats
    factor: float
    lit: int
    unsure: int
    missed: int
    behind: int

    @property
    def kept(self) -> int:
        """Number of points."""
        return int(np.isfinite(self.points[..., 2]).sum())

    def as_json(self) -> dict[str, Any]:
        """Return the counts and typical errors, as JSON types; null where there is no point."""
        return {
            "points": self.kept,
            "lit": self.lit,
            "unsure": self.unsure,
            "missed": self.missed,
            "behind": self.behind,
            "median_deviation": _median(self.deviation),
            "median_miss_pixels": _median(self.miss),
            "factor": self.factor,
        }

    @property
    def _cure(self) -> str:
        """What to do where no camera pixel has a point."""
        if self.unsure >= max(self.missed, self.behind):
            return "accept less confidence"
        return (
            "check that the calibration is of this rig as it stands, R and T from the camera's "
            "frame to the projector's, and that no picture is turned or mirrored"
        )

    def warnings(self) -> list[str]:
        """Return warnings, one sentence each."""
        found, typical = [], _median(self.miss)
        if not self.kept:
            found.append(f"no point was found of {self.lit} camera pixels with q: {self._cure}.")
        if typical is not None and typical > LARGEST_TYPICAL_MISS:
            found.append(
                f"q misses the epipolar lines by {typical:.1f} pattern pixels, typically, so that "
                f"depths are wrong: check that the calibration is of this rig as it stands and of "
                f"these sizes, and that no picture is turned or mirrored."
            )
        return found


def triangulate(
    correspondence: Correspondence,
    stereo: StereoCalibration,
    projector: Size | tuple[int, int],
    *,
    scale: int | None = None,
    least_confidence: float = 0.0,
) -> Depth:
    """Triangulate the rays of camera pixels and of the projector pixels q that light them.

    Parameters
    ----------
    correspondence : Correspondence
    stereo : StereoCalibration
    projector : Size or (height, width)
        Pattern grid that q counts in, shown in the middle of the calibration's projector.
    scale : int, optional
        Side of a pattern pixel in the projector's; the largest that fits if left out.
    least_confidence : float
        Camera pixels of less are left out.

    Returns
    -------
    Depth

    Raises
    ------
    InputError
        If the sizes do not fit the calibration, or no camera pixel has q.

    Examples
    --------
    A camera and a projector side by side, before a wall at a distance of 2:

    >>> matrix = np.array([[8, 0, 3.5], [0, 8, 3.5], [0, 0, 1]])
    >>> stereo = nearfar.StereoCalibration.from_opencv(
    ...     (8, 8), matrix, None, (8, 8), matrix, None, np.eye(3), [0.25, 0, 0]
    ... )
    >>> y, x = np.indices((8, 8))
    >>> q = np.stack([y, x + 8 * 0.25 / 2], axis=-1)
    >>> seen = nearfar.Correspondence(q, np.ones((8, 8)))
    >>> wall = nearfar.triangulate(seen, stereo, projector=(8, 8))
    >>> bool(np.allclose(wall.points[..., 2], 2))
    True
    """
    require_instance(correspondence, Correspondence, "correspondence", "nearfar.correspond")
    require_instance(stereo, StereoCalibration, "stereo", "nearfar.read_stereo_calibration")
    grid = Size(*projector)
    _require_camera(Size(*correspondence.q.shape[:2]), stereo)
    side, corner = blocks_on(grid, stereo.projector.size, scale)
    least = as_number(least_confidence, "the least confidence")
    q, confidence = correspondence.q, correspondence.confidence
    lit: Booleans = np.asarray(np.isfinite(q).all(axis=-1))
    if not lit.any():
        raise InputError(
            "no camera pixel has a q on both axes, so there is nothing to triangulate: check that "
            "the camera sees the projector's light and that patterns tell rows and columns apart."
        )
    sure = lit & (confidence >= least)
    on_screen = side * (q + 0.5) - 0.5 + corner
    # A q that is far off its epipolar line would spoil the error bars of its neighbours.
    first = _by_camera_pixel(stereo, sure, on_screen, np.ones(q.shape))
    typical = max(_within_one(first.distance), side * LEAST_FACTOR * LEAST_DEVIATION)
    near = first.distance <= LARGEST_MISS * typical
    spread = side * deviation_of(np.where(near[..., None], q, np.nan))
    found = _by_camera_pixel(stereo, near, on_screen, spread)
    factor = _factor(found.miss)
    keep = found.miss <= LARGEST_MISS * factor
    meet = np.isfinite(first.distance)
    return Depth(
        points=np.where(keep[..., None], found.points, np.nan),
        deviation=np.where(keep, factor * found.deviation, np.nan),
        confidence=confidence,
        miss=first.distance / side,
        factor=factor,
        lit=int(lit.sum()),
        unsure=int((lit & ~sure).sum()),
        missed=int((meet & ~keep).sum()),
        behind=int((sure & ~meet).sum()),
    )


def blocks_on(grid: Size, native: Size, scale: int | None) -> tuple[int, Floats]:
    """Return the side of a pattern pixel on the projector, and where the first one begins.

    Parameters
    ----------
    grid : Size
        Pattern grid.
    native : Size
        The projector's own pixels.
    scale : int or None
        The side, if it is known.

    Returns
    -------
    side : int
    corner : ndarray, shape (2,)
        (y, x) of the projector pixel at the top left of the pattern.

    Raises
    ------
    InputError
        If the pattern does not fit on the projector.
    """
    try:
        side = fit_frame(grid, scale, native).scale
    except InputError:
        raise InputError(
            f"a pattern grid of {grid} with {scale or 1}x{scale or 1} projector pixels for each of "
            f"its own does not fit the calibration's projector of {native}: calibrate the "
            f"projector that showed it, or give another `scale`."
        ) from None
    corner = [(outer - side * inner) // 2 for outer, inner in zip(native, grid, strict=True)]
    return side, np.array(corner, dtype=np.float64)


def _require_camera(camera: Size, stereo: StereoCalibration) -> None:
    if camera != stereo.camera.size:
        raise InputError(
            f"the photos are {camera}, the calibration is of a camera of {stereo.camera.size}: "
            f"calibrate with photos of this size."
        )


def _by_camera_pixel(
    stereo: StereoCalibration, chosen: Booleans, projector: Floats, deviation: Floats
) -> Triangulated:
    """Triangulate chosen camera pixels; arrays of the camera's shape, NaN at the others."""
    shape = chosen.shape
    found = Triangulated(np.full((*shape, 3), np.nan), *(np.full(shape, np.nan) for _ in range(3)))
    rows, columns = np.nonzero(chosen)
    for some in blocks(len(rows), PIXELS_AT_ONCE):
        y, x = rows[some], columns[some]
        camera = np.stack([x, y], axis=1).astype(np.float64)
        part = triangulate_pixels(stereo, camera, projector[y, x, ::-1], deviation[y, x, ::-1])
        for whole, values in zip(found, part, strict=True):
            whole[y, x] = values
    return found


def _factor(miss: Floats) -> float:
    """Return the factor for the deviations of q by which they explain the epipolar distances."""
    if np.isfinite(miss).sum() < FEWEST_MISSES:
        return USUAL_FACTOR
    return max(LEAST_FACTOR, _within_one(miss))


def _within_one(values: Floats) -> float:
    """Return the quantile of `ONE_DEVIATION`; infinity if there are no values."""
    known = values[np.isfinite(values)]
    return float(np.quantile(known, ONE_DEVIATION)) if len(known) else np.inf


def _median(values: Floats) -> float | None:
    known = values[np.isfinite(values)]
    return float(np.median(known)) if len(known) else None
