"""The geometry of a camera and a projector from poses of a board.

Each is calibrated by itself (Zhang 2000), the projector as a camera that runs backwards, and then
both together, all parameters at once, by OpenCV.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from nearfar.arrays import Floats, Size
from nearfar.errors import InputError
from nearfar.stereo import StereoCalibration
from nearfar.workflow.geometry.opencv import opencv
from nearfar.workflow.geometry.poses import Pose

FEWEST_POSES = 3
# Boards within this angle of one another, in degrees, do not determine a focal length.
LEAST_ANGLE = 8.0
# Focal length over the longer side of the picture, by which the angles of boards are compared.
NOMINAL_FOCAL = 1.2
# A pose is named if its error is above this many times that of the median pose, and above so many
# pixels.
WORSE_POSE = 3.0
WORSE_PIXELS = 0.5
# Reprojection error in pixels above which a calibration is doubtful.
LARGEST_ERROR = 1.0


@dataclass(frozen=True, eq=False)
class GeometryFindings:
    """A stereo calibration, and how well the poses agree with it.

    Attributes
    ----------
    stereo : StereoCalibration
    poses : int
    camera_error, projector_error : float
        Root mean square reprojection error of each by itself, in its pixels.
    camera_deviation, projector_deviation : ndarray, shape (4,)
        Standard deviations of fx, fy, cx and cy, each by itself.
    notes : tuple of str
        What a user should know, a sentence each.
    """

    stereo: StereoCalibration
    poses: int
    camera_error: float
    projector_error: float
    camera_deviation: Floats
    projector_deviation: Floats
    notes: tuple[str, ...]

    def describe(self) -> str:
        """Return in lines what was found."""
        lines = [
            f"{self.poses} poses; reprojection error {self.stereo.error:.3f} pixels of camera and "
            f"projector together"
        ]
        for name, lens, error, deviation in (
            ("camera", self.stereo.camera, self.camera_error, self.camera_deviation),
            ("projector", self.stereo.projector, self.projector_error, self.projector_deviation),
        ):
            lines.append(
                f"{name} of {lens.size}: reprojection error {error:.3f} pixels by itself, focal "
                f"length {lens.matrix[0, 0]:.1f} ± {deviation[0]:.1f} pixels"
            )
        lines.append(f"baseline {self.stereo.baseline:.4g}")
        return "\n".join(lines)


def calibrate_geometry(
    poses: Sequence[Pose], *, scale: int = 1, native: Size | None = None
) -> GeometryFindings:
    """Calibrate the geometry of a camera and a projector.

    Parameters
    ----------
    poses : sequence of Pose
        Three at least, and more are better: the board turned about both its axes, all over the
        picture.
    scale : int
        Side of a pattern pixel in the projector's.
    native : Size, optional
        The projector's pixels, in whose middle the pattern grid was shown; those that the grid
        covers if left out.

    Returns
    -------
    GeometryFindings

    Raises
    ------
    InputError
        If the poses are too few, parallel, or of different sizes; if OpenCV finds no calibration.
    MissingPackageError
    """
    cv2 = opencv()
    _require_poses(cv2, poses)
    camera_size, grid = poses[0].camera_size, poses[0].projector_size
    native = native or Size(scale * grid.height, scale * grid.width)
    corner = [(outer - scale * inner) // 2 for outer, inner in zip(native, grid, strict=True)]
    places = [pose.places for pose in poses]
    seen = [pose.camera for pose in poses]
    lit = [
        (scale * (pose.projector + 0.5) - 0.5 + corner[::-1]).astype(np.float32) for pose in poses
    ]
    try:
        camera = _alone(cv2, places, seen, camera_size)
        projector = _alone(cv2, places, lit, native)
        error, m1, d1, m2, d2, rotation, translation, *_ = cv2.stereoCalibrate(
            places, seen, lit, *camera.lens, *projector.lens, _wide(camera_size),
            flags=cv2.CALIB_USE_INTRINSIC_GUESS | cv2.CALIB_FIX_K3,
        )  # fmt: skip
    except cv2.error as fault:
        raise InputError(
            f"OpenCV finds no calibration that explains these poses "
            f"({' '.join(str(fault).split())[:120]}): check the size of the board, and take other "
            f"poses."
        ) from None
    stereo = StereoCalibration.from_opencv(
        camera_size, m1, d1, native, m2, d2, rotation, translation, float(error)
    )
    return GeometryFindings(
        stereo,
        len(poses),
        camera.error,
        projector.error,
        camera.deviation,
        projector.deviation,
        tuple(_notes(poses, (camera, projector), float(error))),
    )


@dataclass(frozen=True, eq=False)
class _Alone:
    """One of the two, calibrated by itself."""

    error: float
    lens: tuple[Any, Any]
    deviation: Floats
    by_pose: Floats


def _alone(cv2: Any, places: list[Floats], seen: list[Floats], size: Size) -> _Alone:
    error, matrix, distortion, _, _, deviation, _, by_pose = cv2.calibrateCameraExtended(
        places, seen, _wide(size), None, None, flags=cv2.CALIB_FIX_K3
    )
    return _Alone(float(error), (matrix, distortion), deviation.ravel()[:4], by_pose.ravel())


def _wide(size: Size) -> tuple[int, int]:
    return size.width, size.height


def _require_poses(cv2: Any, poses: Sequence[Pose]) -> None:
    if len(poses) < FEWEST_POSES:
        raise InputError(
            f"{len(poses)} pose{'' if len(poses) == 1 else 's'} of the board cannot tell lenses "
            f"from distances: take {FEWEST_POSES} at least, better ten, turned differently."
        )
    first = poses[0]
    for pose in poses[1:]:
        if (pose.camera_size, pose.projector_size) != (first.camera_size, first.projector_size):
            raise InputError(
                f"{pose.name} has a camera of {pose.camera_size} and a pattern grid of "
                f"{pose.projector_size}, {first.name} one of {first.camera_size} and of "
                f"{first.projector_size}: take all poses with the same rig and plan."
            )
    normals = np.stack([_normal(cv2, pose) for pose in poses])
    cosines = np.abs(normals @ normals.T).min()
    if np.degrees(np.arccos(min(1.0, cosines))) < LEAST_ANGLE:
        raise InputError(
            f"all {len(poses)} boards stand within {LEAST_ANGLE:.0f} degrees of one another, and "
            f"parallel boards tell no focal length: turn the board by 20 to 40 degrees, about both "
            f"its axes."
        )


def _normal(cv2: Any, pose: Pose) -> Floats:
    """Return the normal of a board, by a lens of nominal focal length.

    Whatever the lens, parallel boards have the same.
    """
    matrix, _ = cv2.findHomography(pose.places[:, :2], pose.camera)
    size = pose.camera_size
    focal = NOMINAL_FOCAL * max(size)
    lens = np.array([[focal, 0, size.width / 2], [0, focal, size.height / 2], [0, 0, 1]])
    horizon = np.linalg.inv(matrix).T @ [0.0, 0.0, 1.0]
    normal = lens.T @ horizon
    return np.asarray(normal / np.linalg.norm(normal))


def _notes(poses: Sequence[Pose], alone: Sequence[_Alone], error: float) -> list[str]:
    found = []
    for each, whose in zip(alone, ("camera", "projector"), strict=True):
        limit = max(WORSE_PIXELS, WORSE_POSE * float(np.median(each.by_pose)))
        found += [
            f"{pose.name} does not agree with the other poses, by {worst:.2f} {whose} pixels: "
            f"leave it out, or take it again with the board flat and still."
            for pose, worst in zip(poses, each.by_pose, strict=True)
            if worst > limit
        ]
    if error > LARGEST_ERROR:
        found.append(
            f"the reprojection error is {error:.2f} pixels: check that the board is flat and its "
            f"size right, and that nothing moved while it was photographed."
        )
    return found
