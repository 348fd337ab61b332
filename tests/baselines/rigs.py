"""Rigs and transports for tests of adaptive methods."""

import numpy as np

from nearfar.arrays import Size
from nearfar.baselines.shooting import Shooting
from nearfar.rigs.simulated.projector import SimulatedProjector
from nearfar.rigs.simulated.rig import SimulatedRig
from nearfar.transport.exact import ExactTransport
from tests.conftest import QUIET


def transport_of(matrices, projector: Size, camera: Size | None = None) -> ExactTransport:
    """Make a transport of matrices (channels, C, P), its brightest pixel at 0.6 under white."""
    far = np.asarray(matrices, dtype=np.float32)
    far = far * np.float32(0.6) / far.sum(axis=2).max()
    return ExactTransport(projector, camera or projector, (), (), far)


def shooting_of(world: ExactTransport, photos: int, camera=None, optics=None) -> Shooting:
    """Return a rig before it, with ambient light and black levels but, by default, no noise."""
    camera = camera or QUIET.model_copy(update={"ambient": 0.1, "black_level": 0.05})
    optics = optics or SimulatedProjector(black_level=0.02)
    return Shooting(SimulatedRig(world, "test", optics, camera, 1.0, 0), photos)


def decibels(found, truth: ExactTransport, mean: float = 0.5) -> float:
    """Return the SNR of pictures under random lights of a mean; those of mean 0 are signed."""
    generator = np.random.default_rng(7)
    error = signal = 0.0
    for light in generator.random((20, *truth.projector)).astype(np.float32) - 0.5 + mean:
        known = truth @ light
        error += float(np.sum((found @ light - known) ** 2))
        signal += float(np.sum(known**2))
    return 10 * np.log10(signal / error)
