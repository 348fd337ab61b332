"""The stereo calibration of a built-in scene, which its description tells."""

import numpy as np

from nearfar.arrays import Floats, Size
from nearfar.errors import InputError
from nearfar.scenes import SCENES, sizes
from nearfar.scenes.description import ByRadiosity
from nearfar.scenes.optics import Pinhole, pinhole
from nearfar.stereo import StereoCalibration

# Scenes have y upwards, OpenCV downwards.
TURNED = np.diag([1.0, -1.0, 1.0])


def stereo_of_scene(
    name: str, projector: Size | None = None, camera: Size | None = None
) -> StereoCalibration:
    """Return where the camera and the projector of a scene stand, in metres.

    Parameters
    ----------
    name : str
        One of `nearfar.scenes.SCENES`.
    projector, camera : Size, optional
        Pattern grid and photo; the scene's own where left out.

    Raises
    ------
    InputError
        If there is no scene of that name, its geometry is not known, or camera and projector share
        a pinhole.
    """
    projector, camera = sizes(name, projector, camera)
    compute = SCENES[name].compute
    if not isinstance(compute, ByRadiosity):
        raise InputError(
            f"the scene {name} does not tell where its camera and projector stand: choose a "
            f"built-in scene."
        )
    scene = compute.surfaces()
    if scene.camera_view is None:
        raise InputError(
            f"the camera of the scene {name} shares the projector's pinhole and so sees no depth: "
            f"choose cornell-aside or shelf."
        )
    eye, lens = pinhole(scene.projector_view, projector), pinhole(scene.camera_view, projector)
    of_camera, of_projector = (TURNED @ each.axes for each in (lens, eye))
    return StereoCalibration.from_opencv(
        camera,
        _matrix(lens, camera),
        None,
        projector,
        _matrix(eye, projector),
        None,
        of_projector @ of_camera.T,
        of_projector @ (lens.position - eye.position),
        source=f"the scene {name}",
    )


def _matrix(eye: Pinhole, size: Size) -> Floats:
    """Return a pinhole's matrix; a pixel's middle is at its whole number there, not half on."""
    matrix = np.eye(3)
    for row, axis in ((0, 1), (1, 0)):
        matrix[row, row] = size[axis] / (2 * eye.half[axis])
        matrix[row, 2] = (size[axis] - 1) / 2
    return matrix
