"""Pictures of a Mitsuba scene under patterns, rendered by Mitsuba's own projector and integrator.

Index convention: lights are (n, Py, Px), pictures (n, Cy, Cx, channels).
"""

from itertools import count
from math import ceil
from typing import Any

import numpy as np

from nearfar.arrays import Floats, Size
from nearfar.errors import InputError
from nearfar.scenes.mitsuba.loading import MitsubaScene, pattern_tensor, quiet_mitsuba

# Samples rendered at once: some hundred megabytes in the vectorised variants.
SAMPLES_AT_ONCE = 1 << 22


class RenderedWorld:
    """A Mitsuba scene that is photographed: a picture per light, with Monte Carlo noise.

    Each picture is a rendering of its own with a fresh seed, so that repeats of a pattern differ
    as photos do; the seeds follow from the world's seed and the number of the picture. Lights of
    the scene other than the projector are ambient light: they are in every picture.

    Parameters
    ----------
    loaded : MitsubaScene
    samples : int, optional
        Samples per camera pixel and picture; the scene's own number where left out.
    seed : int

    Raises
    ------
    InputError
        If `samples` is not positive.
    """

    def __init__(self, loaded: MitsubaScene, samples: int | None = None, seed: int = 0) -> None:
        self._loaded = loaded
        self._samples = require_samples(loaded.samples if samples is None else samples)
        self._seed = seed
        self._numbers = count()

    @property
    def projector(self) -> Size:
        """Pattern grid."""
        return self._loaded.projector

    @property
    def camera(self) -> Size:
        """Size of the photo."""
        return self._loaded.camera

    @property
    def channels(self) -> int:
        """Number of camera channels."""
        return self._loaded.channels

    @property
    def notes(self) -> tuple[str, ...]:
        """Warnings for the user, a sentence each."""
        return self._loaded.notes

    def describe(self) -> dict[str, Any]:
        """Return how the pictures were rendered, for a capture to keep."""
        import mitsuba as mi

        return {
            "mitsuba": mi.__version__,
            "variant": mi.variant(),
            "integrator": self._loaded.integrator,
            "samples": self._samples,
        }

    def pictures(self, lights: Floats) -> Floats:
        """Render the scene under each light.

        Parameters
        ----------
        lights : ndarray, shape (n, Py, Px)
            Full white is 1; each value is constant over its projector pixel.

        Returns
        -------
        ndarray, shape (n, Cy, Cx, channels), float32
            Linear light, in the scene's own units.

        Raises
        ------
        InputError
            If the lights are not of the projector's size.
        """
        lights = np.asarray(lights, dtype=np.float32)
        if lights.ndim != 3 or lights.shape[1:] != self.projector:
            raise InputError(
                f"the light is {'x'.join(map(str, lights.shape[1:]))}, the projector of "
                f"{self._loaded.name} is {self.projector}: resize the light to {self.projector}."
            )
        pictures = np.empty((len(lights), *self.camera, self.channels), dtype=np.float32)
        with quiet_mitsuba():
            for light, picture in zip(lights, pictures, strict=True):
                picture[...] = self._render(light, next(self._numbers))
        return pictures

    def _render(self, light: Floats, number: int) -> Floats:
        import mitsuba as mi

        scene = self._loaded.scene
        parameters = mi.traverse(projector_of(scene))
        parameters["irradiance.data"] = pattern_tensor(light, self._loaded.white)
        parameters.update()
        passes = ceil(self._samples * self.camera.pixels / SAMPLES_AT_ONCE)
        each = ceil(self._samples / passes)
        total: Floats = np.zeros((*self.camera, self.channels), dtype=np.float64)
        for seed in np.random.SeedSequence([self._seed, number]).generate_state(passes):
            rendered = np.asarray(mi.render(scene, spp=each, seed=int(seed)))
            # Integrators that render more than light put it first.
            total += rendered[..., : self.channels]
        return np.asarray(total / passes)


def require_samples(samples: int) -> int:
    """Refuse a number of samples that is not positive.

    Raises
    ------
    InputError
    """
    if samples < 1:
        raise InputError(f"{samples} samples per camera pixel show nothing: give at least 1.")
    return samples


def projector_of(scene: object) -> object:
    """Return the projector among a scene's emitters."""
    emitters = scene.emitters()  # type: ignore[attr-defined]
    return next(emitter for emitter in emitters if emitter.class_name() == "Projector")
