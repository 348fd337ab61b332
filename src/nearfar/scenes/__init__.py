"""Simulated scenes whose transport is known exactly, its components apart.

Direct light and one reflection, light under the surface of a translucent body, and all
inter-reflections are computed without noise on patches that follow the projector's pixels
(radiosity with the dipole of Jensen et al. 2001).

Estimators are judged on alcove and shelf: neither serves to tune one.
"""

from collections.abc import Callable

from nearfar.arrays import Size
from nearfar.errors import InputError
from nearfar.transport.exact import ExactTransport

# Each scene's own pattern grid, and how many times finer its camera is on both axes.
_SIZES = {
    "cornell": (Size(64, 64), 1),
    "cornell-aside": (Size(64, 64), 2),
    "wedge": (Size(68, 100), 1),
    "corner": (Size(128, 128), 1),
    "alcove": (Size(64, 64), 1),
    "shelf": (Size(60, 90), 2),
}

NAMES: tuple[str, ...] = tuple(_SIZES)


def sizes(
    name: str, projector: Size | None = None, camera: Size | None = None
) -> tuple[Size, Size]:
    """Fill in the sizes of pattern grid and photo that are left out.

    Raises
    ------
    InputError
        If there is no scene of that name.
    """
    if name not in NAMES:
        raise InputError(f"there is no scene {name!r}: choose one of {', '.join(NAMES)}.")
    own, finer = _SIZES[name]
    projector = projector or own
    return projector, camera or Size(finer * projector.height, finer * projector.width)


def build(
    name: str,
    projector: Size | None = None,
    camera: Size | None = None,
    *,
    progress: Callable[[str, float], None] | None = None,
) -> ExactTransport:
    """Compute the transport of a built-in scene.

    Parameters
    ----------
    name : str
        One of `NAMES`.
    projector, camera : Size, optional
        Sizes of the pattern grid and of the photo; the scene's own where left out. The field of
        view is shaped like the pattern grid.
    progress : callable, optional
        Called with what is being done and the share done, 0 to 1.

    Returns
    -------
    ExactTransport
        Three channels (red, green, blue), in photo units: the brightest camera pixel is 0.9
        under full white.

    Raises
    ------
    InputError
        If there is no scene of that name.
    """
    projector, camera = sizes(name, projector, camera)
    # Ray casting is heavy to import and not needed to name the scenes.
    from nearfar.scenes.library import describe
    from nearfar.scenes.render import render

    return render(describe(name), projector, camera, progress=progress or (lambda _, __: None))
