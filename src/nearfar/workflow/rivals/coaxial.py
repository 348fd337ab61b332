"""What methods that project what they see ask of a scene: a square and symmetric T."""

import numpy as np

from nearfar.transport.known import KnownTransport

# Of T v, for a random light v, the share by which T^T v may differ; the built-in coaxial scenes
# stay below 0.001, those seen from aside above 1.
LARGEST_ASYMMETRY = 0.01
LIGHTS_TRIED = 3


def why_not_coaxial(scene: KnownTransport) -> str | None:
    """Return in a clause why T is not square and symmetric, or None if it is."""
    if scene.camera != scene.projector:
        return (
            f"needs a coaxial camera with the projector's pixels, and that of {scene.name} has "
            f"{scene.camera} for {scene.projector}"
        )
    generator = np.random.default_rng(0)
    for _ in range(LIGHTS_TRIED):
        light = generator.normal(size=(*scene.projector, 1)).astype(np.float32)
        light = np.repeat(light, scene.channels, axis=2)
        there = scene @ light
        difference = np.linalg.norm(there - scene.adjoint(light))
        if difference > LARGEST_ASYMMETRY * np.linalg.norm(there):
            return (
                f"needs a coaxial camera, under which T is symmetric, and that of {scene.name} "
                f"stands aside"
            )
    return None
