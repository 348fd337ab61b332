"""Light under the surface of a translucent body, finer than patches.

The dipole depends on the straight distance alone, so it is a convolution in space: the light that
enters is spread from the points where it falls onto a lattice by cubic B-splines, convolved there
by FFT, and read at the points that the camera sees by the same splines. The kernel is filtered so
that this interpolates R_d (cubic spline interpolation at both ends; Unser, "Splines: a perfect fit
for signal and image processing", 1999).
"""

from collections.abc import Sequence

import numpy as np
from scipy import fft

from nearfar.arrays import Floats, Integers
from nearfar.transport.dipole import Dipole, diffuse_profile
from nearfar.transport.mediated import ConvolvedBetween

# Step of the lattice over the smallest depth of a real source, the scale of R_d's peak.
STEP_OF_DEPTH = 0.4
# Nodes along an axis that a cubic B-spline reaches.
REACH = 4


class Lattice:
    """Cubic lattice around a body.

    Parameters
    ----------
    low, high : ndarray, shape (3,)
        Opposite corners of a box around the body, in metres.
    step : float
        In metres.
    """

    def __init__(self, low: Floats, high: Floats, step: float) -> None:
        self.step = step
        self.origin = low - step
        inner = np.ceil((high - low) / step).astype(int)
        # One node below the box and two above, where splines reach.
        self.sides = (int(inner[0]) + REACH, int(inner[1]) + REACH, int(inner[2]) + REACH)

    @property
    def nodes(self) -> int:
        """Number of nodes."""
        return int(np.prod(self.sides))

    def cells_at(self, position: Floats, per_step: int) -> Integers:
        """Return numbers of cubic cells, `per_step` along a step, that points (m, 3) lie in."""
        place = np.floor((position - self.origin) / self.step * per_step).astype(np.int64)
        rows, columns = (per_step * side for side in self.sides[1:])
        return np.asarray((place[:, 0] * rows + place[:, 1]) * columns + place[:, 2])

    def weights_at(self, position: Floats) -> tuple[Integers, Floats]:
        """Return nodes (m, 64), int32, and B-spline weights (m, 64), float32, at points (m, 3)."""
        place = (position - self.origin) / self.step
        base = np.floor(place)
        splines = [_spline(fraction) for fraction in (place - base).T]
        first = base.astype(np.int64) - 1
        weight = np.einsum("ma,mb,mc->mabc", *splines, optimize=True)
        along = np.arange(REACH)
        node = (first[:, 0, None] + along)[:, :, None, None] * self.sides[1]
        node = (node + (first[:, 1, None] + along)[:, None, :, None]) * self.sides[2]
        node = node + (first[:, 2, None] + along)[:, None, None, :]
        each = (len(node), REACH**3)
        return node.reshape(each).astype(np.int32), weight.reshape(each).astype(np.float32)


def _spline(fraction: Floats) -> Floats:
    """Weights (m, 4) of the cubic B-splines about the nodes -1, 0, 1 and 2."""
    rest = 1 - fraction
    return np.stack(
        [
            rest**3 / 6,
            2 / 3 - fraction**2 * (2 - fraction) / 2,
            2 / 3 - rest**2 * (2 - rest) / 2,
            fraction**3 / 6,
        ],
        axis=-1,
    ).astype(np.float32)


def step_of(sources: Sequence[Dipole]) -> float:
    """Return the step of a lattice that resolves the dipoles, in metres."""
    return STEP_OF_DEPTH * min(source.real for source in sources)


def dipoles_between(
    lattice: Lattice, sources: Sequence[Dipole], entering: Sequence[float]
) -> ConvolvedBetween:
    """Return the dipoles between the nodes of a lattice, times the shares of light that enter.

    Parameters
    ----------
    lattice : Lattice
    sources : sequence of Dipole
        One per channel.
    entering : sequence of float
        Share of the light that enters, per channel.
    """
    deep, high, wide = (fft.next_fast_len(2 * side, real=True) for side in lattice.sides)
    padded = (deep, high, wide)
    square = np.zeros(padded)
    # The B-spline's own samples, 1/6, 2/3, 1/6, once at either end.
    narrowing = np.ones((deep, high, wide // 2 + 1))
    for axis, side in enumerate(padded):
        along = [-1 if other == axis else 1 for other in range(3)]
        number = np.arange(side)
        square += (lattice.step * np.minimum(number, side - number)).reshape(along) ** 2
        turns = number[: narrowing.shape[axis]] / side
        narrowing *= ((2 + np.cos(2 * np.pi * turns)).reshape(along) / 3) ** 2
    spectra = [
        (share * fft.rfftn(diffuse_profile(source, square)).real / narrowing).astype(np.float32)
        for source, share in zip(sources, entering, strict=True)
    ]
    return ConvolvedBetween(lattice.sides, np.stack(spectra), padded)
