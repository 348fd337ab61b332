"""Simulated scenes whose transport is known exactly, its components apart.

Direct light and one reflection, light under the surface of a translucent body, and all
inter-reflections are computed without noise on patches that follow the projector's pixels
(radiosity with the dipole of Jensen et al. 2001).

A built-in scene is one file, which describes it, and one line of `SCENES`.
"""

from collections.abc import Callable
from typing import TYPE_CHECKING

from nearfar.arrays import Size
from nearfar.errors import ExtensionError, InputError
from nearfar.registry import Registry
from nearfar.scenes.description import ByRadiosity, SceneDescription

if TYPE_CHECKING:
    from nearfar.transport.exact import ExactTransport
    from nearfar.transport.exact_operator import ExactOperator

SCENES: Registry[SceneDescription] = Registry(
    "scene",
    "nearfar.scenes",
    {
        "cornell": "nearfar.scenes.cornell:CORNELL",
        "cornell-aside": "nearfar.scenes.cornell:CORNELL_ASIDE",
        "cornell-left": "nearfar.scenes.cornell:CORNELL_LEFT",
        "cornell-right": "nearfar.scenes.cornell:CORNELL_RIGHT",
        "wedge": "nearfar.scenes.wedge:WEDGE",
        "corner": "nearfar.scenes.corner:CORNER",
        "alcove": "nearfar.scenes.alcove:ALCOVE",
        "shelf": "nearfar.scenes.shelf:SHELF",
        "hand": "nearfar.scenes.hand:HAND",
        "marble": "nearfar.scenes.marble:MARBLE_STEPS",
    },
    SceneDescription,
)


def sizes(
    name: str, projector: Size | None = None, camera: Size | None = None
) -> tuple[Size, Size]:
    """Fill in the sizes of pattern grid and photo that are left out.

    Raises
    ------
    InputError
        If there is no scene of that name.
    """
    scene = SCENES[name]
    projector = projector or scene.projector
    finer = scene.camera_scale
    return projector, camera or Size(finer * projector.height, finer * projector.width)


def build(
    name: str,
    projector: Size | None = None,
    camera: Size | None = None,
    *,
    progress: Callable[[str, float], None] | None = None,
) -> "ExactTransport":
    """Compute the transport of a scene.

    Parameters
    ----------
    name : str
        One of `SCENES`.
    projector, camera : Size, optional
        Sizes of the pattern grid and of the photo; the scene's own where left out. The field of
        view of a built-in scene is shaped like the pattern grid.
    progress : callable, optional
        Called with what is being done and the share done, 0 to 1.

    Returns
    -------
    ExactTransport
        In photo units. A built-in scene has three channels (red, green, blue), and its brightest
        camera pixel is 0.9 under full white.

    Raises
    ------
    InputError
        If there is no scene of that name.
    ExtensionError
        If a scene of another package cannot be loaded, or its transport has other sizes.
    """
    projector, camera = sizes(name, projector, camera)
    transport = SCENES[name].compute(projector, camera, progress or (lambda _, __: None))
    if (transport.projector, transport.camera) != (projector, camera):
        raise ExtensionError(
            f"the scene {name} was to be computed for a projector of {projector} and a camera of "
            f"{camera}, and came out for {transport.projector} and {transport.camera}: ask for "
            f"these sizes, or update the package that adds the scene."
        )
    return transport


def build_operator(
    name: str,
    projector: Size | None = None,
    camera: Size | None = None,
    *,
    progress: Callable[[str, float], None] | None = None,
) -> "ExactOperator":
    """Compute the transport of a scene as an operator, of which nothing is of size C x P.

    Parameters
    ----------
    name, projector, camera, progress
        As `build`.

    Returns
    -------
    ExactOperator
        In the units of `build`.

    Raises
    ------
    InputError
        If there is no scene of that name, or it can be computed as a matrix alone.
    ExtensionError
        If a scene of another package cannot be loaded.
    """
    projector, camera = sizes(name, projector, camera)
    compute = SCENES[name].compute
    if not isinstance(compute, ByRadiosity):
        raise InputError(
            f"the scene {name} can be computed as a matrix alone, not as an operator: choose a "
            f"built-in scene, or smaller sizes of projector and camera."
        )
    return compute.operator(projector, camera, progress or (lambda _, __: None))
