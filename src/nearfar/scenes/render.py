"""From a scene's description to its exact transport."""

from collections.abc import Callable, Sequence
from dataclasses import fields
from typing import NamedTuple

import numpy as np

from nearfar.arrays import Floats, Integers, Size
from nearfar.scenes.camera import Gather, gather
from nearfar.scenes.dipole import dipole, subsurface
from nearfar.scenes.form_factors import exchange
from nearfar.scenes.geometry import Part, Scene
from nearfar.scenes.optics import pinhole
from nearfar.scenes.patches import Patches, albedo, build_patches, texture, with_medium
from nearfar.scenes.radiosity import components
from nearfar.scenes.rays import surface
from nearfar.transport.exact import ExactTransport

# Sub-rays along each side of a projector pixel.
SAMPLES_PER_SIDE = 4
# The brightest camera pixel under full white.
WHITE_LEVEL = 0.9


class PatchedScene(NamedTuple):
    """A scene cut into patches, and what they see of each other.

    Attributes
    ----------
    patches : Patches
    gathered : Gather
        What the camera sees of them.
    form : ndarray, shape (n, n), float32
        Areas times form factors, symmetric.
    albedo : ndarray, shape (n, channels)
    translucent : ndarray of int, shape (m,)
        The patches of the translucent body.
    inside : tuple of ndarray, shape (m, m)
        Its dipole per channel; empty where nothing is translucent.
    hidden : int
        The first so many patches are neither lit nor seen, nor of the translucent body.
    """

    patches: Patches
    gathered: Gather
    form: Floats
    albedo: Floats
    translucent: Integers
    inside: tuple[Floats, ...]
    hidden: int


def patched(
    scene: Scene,
    projector: Size,
    camera: Size,
    *,
    progress: Callable[[str, float], None],
) -> PatchedScene:
    """Cut a scene into patches, and compute what they see of each other."""
    progress("patches", 0.0)
    everything = surface(scene.parts, range(len(scene.parts)))
    occluders = surface(scene.parts, [i for i, part in enumerate(scene.parts) if part.occludes])
    eye = pinhole(scene.projector_view, projector)
    lens = pinhole(scene.camera_view or scene.projector_view, projector)
    patches = build_patches(everything, scene.parts, eye, projector, samples=SAMPLES_PER_SIDE)
    finest = min(camera.height / projector.height, camera.width / projector.width)
    seen = gather(
        everything,
        scene.parts,
        patches,
        (eye, projector),
        (lens, camera),
        samples=max(1, int(np.ceil(SAMPLES_PER_SIDE / finest))),
    )
    patches, seen, hidden = _hidden_first(patches, scene.parts, seen)
    progress("form factors", 0.1)
    form = exchange(patches, scene.parts, occluders)
    progress("subsurface", 0.3)
    translucent = np.flatnonzero(with_medium(patches, scene.parts))
    inside = subsurface_of(patches, scene.parts, translucent)
    reflected = albedo(patches, scene.parts)
    return PatchedScene(patches, seen, form, reflected, translucent, inside, hidden)


def _hidden_first(
    patches: Patches, parts: Sequence[Part], seen: Gather
) -> tuple[Patches, Gather, int]:
    """Put patches first that are neither lit nor seen, nor translucent, and return how many."""
    shown = (patches.pixel >= 0) | with_medium(patches, parts)
    shown[seen.radiosity.indices] = True
    order = np.argsort(shown, kind="stable")
    gathered = Gather(seen.radiosity[:, order], seen.gloss[:, order])
    return body_of(patches, order), gathered, int(np.sum(~shown))


def render(
    scene: Scene,
    projector: Size,
    camera: Size,
    *,
    progress: Callable[[str, float], None],
) -> ExactTransport:
    """Compute the transport of a scene.

    Parameters
    ----------
    scene : Scene
    projector, camera : Size
    progress : callable
        Called with what is being done and the share done, 0 to 1.

    Returns
    -------
    ExactTransport
        In photo units: the brightest camera pixel and channel is 0.9 under full white.
    """
    found = patched(scene, projector, camera, progress=progress)
    direct, near, far = components(
        found.gathered,
        found.patches,
        projector.pixels,
        found.form,
        albedo=found.albedo,
        translucent=found.translucent,
        inside=found.inside,
        hidden=found.hidden,
        progress=lambda share: progress("inter-reflections", 0.4 + 0.6 * share),
    )
    brightest = max(
        float((d.sum(axis=1) + n.sum(axis=1) + f.sum(axis=1)).max())
        for d, n, f in zip(direct, near, far, strict=True)
    )
    scale = np.float32(WHITE_LEVEL / brightest)
    far *= scale
    return ExactTransport(
        projector=projector,
        camera=camera,
        direct=tuple(d * scale for d in direct),
        near=tuple(n * scale for n in near),
        far=far,
        name=scene.name,
    )


def body_of(patches: Patches, chosen: Integers) -> Patches:
    """Take some of the patches."""
    return Patches(
        **{field.name: getattr(patches, field.name)[chosen] for field in fields(Patches)}
    )


def subsurface_of(
    patches: Patches, parts: Sequence[Part], translucent: Integers
) -> tuple[Floats, ...]:
    """Compute the dipole of the translucent body per channel; empty where there is none."""
    if not len(translucent):
        return ()
    body = body_of(patches, translucent)
    material = parts[body.part[0]].material
    assert material.medium is not None
    # What the surface does not reflect enters. The root of the texture dims it there, and again
    # where it leaves.
    tone = np.sqrt(texture(body, parts))
    return tuple(
        (1 - material.albedo[channel])
        * (tone[:, None] * subsurface(body, dipole(material.medium, channel)) * tone)
        for channel in range(len(material.albedo))
    )
