"""Where a camera and a projector stand to each other, and their lenses."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from nearfar.arrays import AnySize, Floats, Size, as_size
from nearfar.checks import finite_numbers
from nearfar.errors import InputError
from nearfar.stereo.lens import COEFFICIENT_COUNTS, MOST_COEFFICIENTS, Lens

# A rotation times its transpose differs from the identity by at most this.
ROTATION_TOLERANCE = 1e-3


@dataclass(frozen=True, eq=False)
class StereoCalibration:
    """The geometry of a camera and a projector, as OpenCV's `stereoCalibrate` finds it.

    A point X in the camera's frame is R X + t in the projector's. In either frame x points to the
    right, y down and z forwards.

    Attributes
    ----------
    camera, projector : Lens
    rotation : ndarray, shape (3, 3), float64
        R.
    translation : ndarray, shape (3,), float64
        t, in the unit of the calibration, which is that of depths.
    error : float or None
        Root mean square reprojection error in pixels, where the calibration tells it.

    Examples
    --------
    Of a camera and a projector side by side, whose sensors are shifted so that they see the same:

    >>> matrix = np.array([[8, 0, 3.5], [0, 8, 3.5], [0, 0, 1]])
    >>> shifted = matrix - [[0, 0, 1], [0, 0, 0], [0, 0, 0]]
    >>> stereo = nearfar.StereoCalibration.from_opencv(
    ...     (8, 8), matrix, None, (8, 8), shifted, None, np.eye(3), [0.25, 0, 0]
    ... )
    >>> stereo.camera.size, stereo.baseline
    (Size(height=8, width=8), 0.25)
    """

    camera: Lens
    projector: Lens
    rotation: Floats
    translation: Floats
    error: float | None = None

    @classmethod
    def from_opencv(
        cls,
        camera: AnySize,
        camera_matrix: ArrayLike,
        camera_distortion: ArrayLike | None,
        projector: AnySize,
        projector_matrix: ArrayLike,
        projector_distortion: ArrayLike | None,
        rotation: ArrayLike,
        translation: ArrayLike,
        error: float | None = None,
        *,
        source: str = "the calibration",
    ) -> "StereoCalibration":
        """Take what OpenCV's `stereoCalibrate` returns, the camera being the first.

        Parameters
        ----------
        camera, projector : Size or (height, width)
            Pixels.
        camera_matrix, projector_matrix : array_like, shape (3, 3)
        camera_distortion, projector_distortion : array_like or None
            4, 5, 8 or 12 coefficients in OpenCV's order; None without distortion.
        rotation, translation : array_like
            R and T.
        error : float, optional
            Reprojection error in pixels.
        source : str
            What they come from, for messages.

        Raises
        ------
        InputError
            If a matrix has another shape or is none of its kind, or camera and projector share a
            pinhole.
        """
        lenses = (
            lens_of(as_size(camera, "camera"), camera_matrix, camera_distortion, 1, source),
            lens_of(
                as_size(projector, "projector"), projector_matrix, projector_distortion, 2, source
            ),
        )
        return cls(*lenses, _rotation(rotation, source), _translation(translation, source), error)

    @property
    def baseline(self) -> float:
        """Distance of the two pinholes."""
        return float(np.linalg.norm(self.translation))


def lens_of(
    size: Size, matrix: ArrayLike, distortion: ArrayLike | None, number: int, source: str
) -> Lens:
    """Check and return a lens, number 1 or 2 of a calibration from `source`.

    Raises
    ------
    InputError
    """
    found = _array(matrix, (3, 3), f"M{number}", source)
    if found[0, 0] <= 0 or found[1, 1] <= 0 or not np.allclose(found[2], [0, 0, 1]):
        raise InputError(
            f"M{number} of {source} is no camera matrix: give focal lengths above 0, and 0, 0, 1 "
            f"in the last row."
        )
    if distortion is None:
        return Lens(size, found, np.zeros(0))
    coefficients = finite_numbers(distortion, f"D{number} of {source}").astype(np.float64).ravel()
    if not coefficients[MOST_COEFFICIENTS:].any():
        coefficients = coefficients[:MOST_COEFFICIENTS]
    if len(coefficients) not in COEFFICIENT_COUNTS:
        raise InputError(
            f"D{number} of {source} has {len(coefficients)} coefficients that are not 0, and not "
            f"4, 5, 8 or 12: calibrate with one of OpenCV's models of these, without a tilted "
            f"sensor."
        )
    return Lens(size, found, coefficients)


def _rotation(rotation: ArrayLike, source: str) -> Floats:
    turned = _array(rotation, (3, 3), "R", source)
    is_rotation = np.allclose(turned @ turned.T, np.eye(3), atol=ROTATION_TOLERANCE)
    if not is_rotation or np.linalg.det(turned) < 0:
        raise InputError(
            f"R of {source} is no rotation: write the 3x3 matrix of stereoCalibrate there."
        )
    return turned


def _translation(translation: ArrayLike, source: str) -> Floats:
    moved = _array(finite_numbers(translation, f"T of {source}").ravel(), (3,), "T", source)
    if not moved.any():
        raise InputError(
            f"T of {source} is 0: a camera and a projector that share a pinhole show no depth; "
            f"move them apart and calibrate."
        )
    return moved


def _array(values: ArrayLike, shape: tuple[int, ...], name: str, source: str) -> Floats:
    found = finite_numbers(values, f"{name} of {source}").astype(np.float64)
    if found.shape != shape:
        raise InputError(
            f"{name} of {source} is {'x'.join(map(str, found.shape))}, not "
            f"{'x'.join(map(str, shape))}: write OpenCV's {name} there."
        )
    return found
