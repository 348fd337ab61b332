"""What is known of a scene before its transport is computed.

A scene of another package is a `SceneDescription` too, added by an entry point of the group
``nearfar.scenes``.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from nearfar.arrays import Size
from nearfar.callbacks import Report

if TYPE_CHECKING:
    from nearfar.scenes.geometry import Scene
    from nearfar.transport.exact import ExactTransport
    from nearfar.transport.exact_operator import ExactOperator


@dataclass(frozen=True, kw_only=True)
class SceneDescription:
    """A scene by name.

    Attributes
    ----------
    summary : str
        What it shows, in a few words for a table.
    projector : Size
        Pattern grid, where none is asked for.
    camera_scale : int
        Camera pixels per projector pixel along each axis, where no size of the photo is asked for.
    compute : callable
        From the sizes of pattern grid and photo, and a progress callback, to the transport:
        `ByRadiosity`, or a function that computes it in another way. The callback takes what is
        being done and the share done, 0 to 1. A size that the scene cannot have is an
        `InputError`.
    held_out : bool
        Whether estimators are judged on this scene. If so, nothing is tuned on it.
    """

    summary: str
    projector: Size
    camera_scale: int = 1
    compute: "Callable[[Size, Size, Report], ExactTransport]"
    held_out: bool = False


@dataclass(frozen=True)
class ByRadiosity:
    """Compute the transport of surfaces by radiosity on patches.

    Attributes
    ----------
    surfaces : callable
        Returns the surfaces, and the views of projector and camera.
    """

    surfaces: "Callable[[], Scene]"

    def __call__(self, projector: Size, camera: Size, progress: Report) -> "ExactTransport":
        """Compute the transport for the sizes of pattern grid and photo."""
        # Ray casting is heavy to import, and a scene is described without it.
        from nearfar.scenes.render import render

        return render(self.surfaces(), projector, camera, progress=progress)

    def operator(self, projector: Size, camera: Size, progress: Report) -> "ExactOperator":
        """Compute the transport as an operator, for sizes at which a matrix is too large."""
        from nearfar.scenes.native.render import render_native

        return render_native(self.surfaces(), projector, camera, progress=progress)
