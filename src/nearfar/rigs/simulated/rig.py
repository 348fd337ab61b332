"""A simulated rig: photo = sensor(noise(T l)) on a transport that is known."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from itertools import islice
from typing import Any, Protocol, Self

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Floats, Size
from nearfar.errors import InputError
from nearfar.illumination.frames import fit_frame
from nearfar.rigs.base import Photo
from nearfar.rigs.calibration import Calibration
from nearfar.rigs.linear import PRIMARY_COUNT, LinearProjector
from nearfar.rigs.simulated.camera import SimulatedCamera
from nearfar.rigs.simulated.projector import SimulatedProjector

# Patterns lit at once: a matrix product, not a pass over T for each.
PATTERNS_AT_ONCE = 32


class World(Protocol):
    """Whatever turns lights into pictures: an exact or a measured transport."""

    @property
    def projector(self) -> Size:
        """Pattern grid."""
        ...

    def pictures(self, lights: Floats) -> Floats:
        """Pictures (n, Cy, Cx, channels) of lights (n, Py, Px) or (n, Py, Px, channels)."""
        ...


@dataclass(frozen=True)
class SimulatedRig:
    """A simulated projector and camera before a known transport.

    Attributes
    ----------
    world : World
    name : str
        What the scene or transport is called.
    optics : SimulatedProjector
    sensor : SimulatedCamera
    exposure : float
        Photo units per unit of the world's transport.
    seed : int
        Each photo's noise follows from the seed and its number alone.
    details : mapping
        What else a capture should remember of how the world was made, as JSON.
    notes : tuple of str
        What a user should know of the world, a sentence each.
    calibration : Calibration, optional
        By which patterns are drawn, so that light is linear in their levels; without one the
        projector is taken as linear.
    """

    world: World
    name: str
    optics: SimulatedProjector
    sensor: SimulatedCamera
    exposure: float
    seed: int
    details: Mapping[str, Any] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    calibration: Calibration | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_fault: object) -> None:
        """Do nothing: there are no devices to give back."""

    @property
    def projector(self) -> Size:
        """Pattern grid."""
        return self.world.projector

    @property
    def full_scale(self) -> float:
        """Highest level of the sensor."""
        return float(self.sensor.full_scale)

    def describe(self) -> dict[str, Any]:
        """Return the scene, the settings and the exposure, as JSON types."""
        return {
            "kind": "simulated",
            "scene": self.name,
            "projector": self.optics.model_dump(),
            "camera": self.sensor.model_dump(),
            "transport_exposure": self.exposure,
            "seed": self.seed,
            **({"calibration": self.calibration.made} if self.calibration else {}),
            **self.details,
        }

    @property
    def alarms(self) -> tuple[str, ...]:
        """None: nothing goes wrong in a simulation."""
        return ()

    def conditions(self) -> dict[str, float]:
        """Return nothing: only the settings change a simulation."""
        return {}

    def shoot(self, patterns: Iterable[NDArray[np.uint8]], first: int = 0) -> Iterator[Photo]:
        """Yield a photo for each pattern, in order; `first` is the number of the first."""
        number = first
        for batch in _batches(map(self._drawing(), patterns), PATTERNS_AT_ONCE, first):
            # Dark lights fill the batch up to the first: the last digit of a picture depends on how
            # many are computed at once, and photos must not depend on where a capture was resumed.
            before = number % PATTERNS_AT_ONCE
            colours = max((pattern.shape[2:] for pattern in batch), key=len)
            lights = np.zeros((before + len(batch), *self.projector, *colours), dtype=np.float32)
            for i, pattern in enumerate(batch):
                alike = pattern if pattern.ndim == lights.ndim - 1 else pattern[..., None]
                lights[before + i] = self.optics.emit(alike, number + i)
            for picture in self.world.pictures(lights)[before:]:
                generator = np.random.default_rng([self.seed, number])
                yield self.sensor.photograph(self.exposure * picture, generator, number)
                number += 1

    def _drawing(self) -> Callable[[NDArray[np.uint8]], NDArray[np.uint8]]:
        """Return the function from a pattern to the levels sent to the projector."""
        if self.calibration is None:
            return lambda pattern: pattern
        # The primaries of a simulated projector have one response.
        response = self.calibration.response_table().mean(axis=1, keepdims=True)
        layout = fit_frame(self.projector, 1, None)
        draw = LinearProjector(np.repeat(response, PRIMARY_COUNT, axis=1), layout).draw
        return lambda pattern: draw(pattern) if pattern.ndim == 3 else draw(pattern)[..., 0]


def _batches(
    patterns: Iterable[NDArray[np.uint8]], length: int, first: int
) -> Iterator[list[NDArray[np.uint8]]]:
    """Cut patterns where their numbers are multiples of `length`."""
    remaining = iter(patterns)
    batch = list(islice(remaining, length - first % length))
    while batch:
        yield batch
        batch = list(islice(remaining, length))


def brightest(world: World, name: str = "the transport") -> float:
    """Return the brightest camera pixel under full white.

    Raises
    ------
    InputError
        If there is no light at all.
    """
    floodlit = world.pictures(np.ones((1, *world.projector), dtype=np.float32))
    highest = float(floodlit.max())
    if not highest > 0:
        raise InputError(
            f"{name} is black under full white, so there is nothing to expose for: name a "
            f"transport with light in it."
        )
    return highest
