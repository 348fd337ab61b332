"""Pictures of light after each bounce in a scene, exactly.

Index convention: c is a camera pixel, p a projector pixel, i and j patches. With the reflection R,
areas A, form factors F and the light phi that falls on patches, as in `nearfar.scenes.radiosity`,
radiosities after the n-th bounce are

    B_1 = R A^-1 phi,   B_(n+1) = R F B_n,

the terms of the Neumann series that its factorisation sums. A highlight is a part of the first
bounce, and so is light under the surface of a translucent body.
"""

import numpy as np

from nearfar.arrays import Floats, Size
from nearfar.callbacks import Report
from nearfar.checks import as_count, as_light
from nearfar.errors import InputError
from nearfar.scenes import SCENES, sizes
from nearfar.scenes.description import ByRadiosity
from nearfar.scenes.geometry import Scene
from nearfar.scenes.render import WHITE_LEVEL, PatchedScene, patched

# The series under white, which sets the exposure, ends where a bounce is this share of the picture.
NEGLIGIBLE = 1e-7
MOST_BOUNCES = 1000


def exact_bounces(
    name: str,
    light: Floats,
    count: int,
    projector: Size | None = None,
    camera: Size | None = None,
    *,
    progress: Report | None = None,
) -> Floats:
    """Compute the pictures of the first bounces of light in a built-in scene.

    Parameters
    ----------
    name : str
        One of `nearfar.scenes.SCENES`.
    light : ndarray, shape (Py, Px) or (Py, Px, channels)
    count : int
        Bounces, 1 or more.
    projector, camera : Size, optional
        As `nearfar.scenes.build`.
    progress : callable, optional
        Called with what is being done and the share done, 0 to 1.

    Returns
    -------
    ndarray, shape (count, Cy, Cx, channels), float32
        Photo units of `nearfar.scenes.build`. All bounces together are the scene's picture.

    Raises
    ------
    InputError
        If there is no scene of that name, it is not one of surfaces, or the light does not fit.
    """
    count = as_count(count, "count", least=1)
    projector, camera = sizes(name, projector, camera)
    compute = SCENES[name].compute
    if not isinstance(compute, ByRadiosity):
        raise InputError(
            f"the bounces of the scene {name} are not known: choose a scene that is computed by "
            f"radiosity."
        )
    return bounces_between(compute.surfaces(), light, count, projector, camera, progress=progress)


def bounces_between(
    scene: Scene,
    light: Floats,
    count: int,
    projector: Size,
    camera: Size,
    *,
    progress: Report | None = None,
) -> Floats:
    """Compute the pictures of the first bounces of light between surfaces.

    Parameters
    ----------
    scene : Scene
    light, count, projector, camera, progress
        As `exact_bounces`.

    Returns
    -------
    ndarray, shape (count, Cy, Cx, channels), float32
    """
    report = progress or (lambda _, __: None)
    found = patched(scene, projector, camera, progress=report)
    channels = found.albedo.shape[1]
    light = as_light(light, projector, channels).reshape(projector.pixels, -1)
    pictures, brightest = [], 0.0
    for channel in range(channels):
        own = light[:, min(channel, light.shape[1] - 1)]
        pictures.append(_series(found, channel, own, count))
        brightest = max(brightest, _all_under_white(found, channel, projector.pixels).max())
        report("bounces", (channel + 1) / channels)
    stacked = np.stack(pictures, axis=-1) * (WHITE_LEVEL / brightest)
    return stacked.reshape(count, *camera, channels).astype(np.float32)


def _series(found: PatchedScene, channel: int, light: Floats, count: int) -> Floats:
    """Return pictures of the first bounces, shape (count, C), as radiosities of white patches."""
    falling = _falling(found, light)
    leaving = _reflected(found, channel, falling)
    shine = found.gathered.gloss @ (falling / found.patches.area)
    pictures = [found.gathered.radiosity @ leaving + shine]
    for _ in range(count - 1):
        leaving = _bounced_once(found, channel, leaving)
        pictures.append(found.gathered.radiosity @ leaving)
    return np.stack(pictures)


def _all_under_white(found: PatchedScene, channel: int, projector_pixels: int) -> Floats:
    """Return the picture of all bounces under white, shape (C,)."""
    falling = _falling(found, np.ones(projector_pixels))
    leaving = total = _reflected(found, channel, falling)
    for _ in range(MOST_BOUNCES):
        leaving = _bounced_once(found, channel, leaving)
        total = total + leaving
        if leaving.max() < NEGLIGIBLE * total.max():
            break
    shine = found.gathered.gloss @ (falling / found.patches.area)
    return np.asarray(found.gathered.radiosity @ total + shine)


def _falling(found: PatchedScene, light: Floats) -> Floats:
    """Return the flux that falls on each patch from the projector, phi."""
    pixel = found.patches.pixel
    return np.where(pixel >= 0, found.patches.flux * light[np.maximum(pixel, 0)], 0.0)


def _bounced_once(found: PatchedScene, channel: int, leaving: Floats) -> Floats:
    """Return the radiosities that radiosities cause, R F B."""
    return _reflected(found, channel, found.form @ leaving.astype(np.float32))


def _reflected(found: PatchedScene, channel: int, flux: Floats) -> Floats:
    """Return the radiosities that flux on the patches causes, R A^-1 phi."""
    leaving = found.albedo[:, channel] / found.patches.area * flux
    if found.inside:
        leaving[found.translucent] += found.inside[channel] @ flux[found.translucent]
    return np.asarray(leaving)
