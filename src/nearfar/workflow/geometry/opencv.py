"""OpenCV, which calibrates; depth itself does without it."""

from importlib import import_module
from typing import Any

from nearfar.packages import needed


def opencv() -> Any:
    """Return the module `cv2`.

    Raises
    ------
    MissingPackageError
    """
    with needed(extra="webcam", what="calibrating the geometry of a rig"):
        return import_module("cv2")
