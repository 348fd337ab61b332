"""A simulated camera: photo = sensor(noise(light))."""

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from nearfar.arrays import Floats
from nearfar.rigs.simulated.drift import SimulatedDrift

# Far above any full well, below what a generator of counts takes.
MAXIMUM_ELECTRONS = 1e18


class SimulatedCamera(BaseModel):
    """A linear camera with shot noise, read noise and a finite number of levels.

    Attributes
    ----------
    full_well : float
        Electrons at full scale.
    read_noise : float
        Standard deviation of a reading, electrons.
    bits : int
        Bit depth of the photos.
    black_level : float
        Level of no light at all, as a share of full scale.
    ambient : float
        Light that is not the projector's, as a share of full scale.
    ambient_drift : SimulatedDrift
        How the ambient light changes from photo to photo.
    shot_noise : bool
        Whether electrons are counted with Poisson noise.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    full_well: float = Field(default=30_000.0, gt=0.0)
    read_noise: float = Field(default=4.0, ge=0.0)
    bits: int = Field(default=14, ge=1, le=16)
    black_level: float = Field(default=0.02, ge=0.0, lt=1.0)
    ambient: float = Field(default=0.01, ge=0.0, lt=1.0)
    ambient_drift: SimulatedDrift = SimulatedDrift()
    shot_noise: bool = True

    @property
    def full_scale(self) -> int:
        """Highest level of the sensor."""
        return int(2**self.bits - 1)

    def expose(self, light: Floats, number: int = 0) -> Floats:
        """Return electrons from light in photo units, ambient light of photo `number` added."""
        # A measured transport may turn a dark light into a picture slightly below 0.
        ambient = self.ambient * self.ambient_drift.at(number)
        return np.asarray(np.maximum(light + ambient, 0.0) * self.full_well)

    def noise(self, electrons: Floats, generator: np.random.Generator) -> Floats:
        """Return the electrons that are read: counted by chance, read with an error."""
        # A measured transport may give slightly less than 0, and the generator has an upper limit.
        expected = np.clip(electrons, 0.0, MAXIMUM_ELECTRONS)
        counted = generator.poisson(expected) if self.shot_noise else electrons
        if self.read_noise == 0.0:
            return np.asarray(counted, dtype=np.float64)
        error = generator.normal(0.0, self.read_noise, size=electrons.shape)
        return np.asarray(counted + error)

    def sensor(self, electrons: Floats) -> NDArray[np.uint8] | NDArray[np.uint16]:
        """Return levels: black level added, rounded, clipped at both ends."""
        level = self.full_scale * (electrons / self.full_well + self.black_level)
        kind = np.uint8 if self.bits <= 8 else np.uint16
        clipped: Floats = np.clip(np.rint(level), 0, self.full_scale)
        return np.asarray(clipped.astype(kind))

    def photograph(
        self, light: Floats, generator: np.random.Generator, number: int = 0
    ) -> NDArray[np.uint8] | NDArray[np.uint16]:
        """Return photo `number`, of a picture in photo units: sensor(noise(light))."""
        return self.sensor(self.noise(self.expose(light, number), generator))
