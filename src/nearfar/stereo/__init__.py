"""A camera and a projector as two pinholes with lenses: where they stand, and their rays."""

from nearfar.stereo.calibration import StereoCalibration
from nearfar.stereo.lens import Lens
from nearfar.stereo.opencv_file import read_stereo_calibration, save_stereo_calibration
from nearfar.stereo.triangulation import Triangulated, triangulate_pixels

__all__ = [
    "Lens",
    "StereoCalibration",
    "Triangulated",
    "read_stereo_calibration",
    "save_stereo_calibration",
    "triangulate_pixels",
]
