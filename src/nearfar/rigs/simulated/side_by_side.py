"""Simulated projectors before one camera, as one projector: their pattern grids side by side."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from nearfar.arrays import Floats, Size
from nearfar.errors import InputError
from nearfar.rigs.simulated.opening import choose_exposure
from nearfar.rigs.simulated.rig import SimulatedRig


@dataclass(frozen=True, eq=False)
class SideBySideWorld:
    """Worlds whose light adds up before one camera: T = [e_1 T_1 | e_2 T_2 | ...].

    Attributes
    ----------
    rigs : tuple of SimulatedRig
        Of one pattern grid and one camera; e_i are their exposures.
    """

    rigs: tuple[SimulatedRig, ...]

    @property
    def projector(self) -> Size:
        """Pattern grid, as wide as all together."""
        own = self.rigs[0].projector
        return Size(own.height, own.width * len(self.rigs))

    def pictures(self, lights: Floats) -> Floats:
        """Pictures (n, Cy, Cx, channels) of lights (n, Py, Px)."""
        parts = np.split(lights, len(self.rigs), axis=2)
        return np.asarray(
            sum(
                np.float32(rig.exposure) * rig.world.pictures(np.ascontiguousarray(part))
                for rig, part in zip(self.rigs, parts, strict=True)
            )
        )


def simulated_side_by_side(rigs: Sequence[SimulatedRig], names: Sequence[str]) -> SimulatedRig:
    """Return one rig of several projectors; its exposure is such that all whites fit the sensor.

    Parameters
    ----------
    rigs : sequence of SimulatedRig
    names : sequence of str
        What to call each.

    Raises
    ------
    InputError
        If they are not before one camera, or respond differently.
    """
    first = rigs[0]
    black = np.zeros((1, *first.projector), dtype=np.float32)
    pictures = [rig.world.pictures(black).shape for rig in rigs]
    for rig, shape, name in zip(rigs[1:], pictures[1:], names[1:], strict=True):
        for what, one, other in (
            ("the photo's size and channels", pictures[0][1:], shape[1:]),
            ("the settings under [camera]", first.sensor, rig.sensor),
            ("the settings under [projector]", first.optics, rig.optics),
        ):
            if one != other:
                raise InputError(
                    f"{names[0]} and {name} cannot share photos, for they differ in {what}: make "
                    f"these the same, or photograph by one projector after the other."
                )
    world = SideBySideWorld(tuple(rigs))
    called = " and ".join(names)
    exposure = choose_exposure(None, world, called)
    each = [{**rig.describe(), "transport_exposure": exposure * rig.exposure} for rig in rigs]
    notes = tuple(note for rig in rigs for note in rig.notes)
    return SimulatedRig(
        world,
        called,
        first.optics,
        first.sensor,
        exposure,
        first.seed,
        details={"projectors": each},
        notes=notes,
    )
