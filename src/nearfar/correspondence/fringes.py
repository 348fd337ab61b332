"""Correspondence by phase shifting: fringes of one period, unwrapped by Gray code of cells.

Index convention: positions are in projector pixels along the fringes' axis, any shape.
"""

import numpy as np

from nearfar.arrays import Floats


def position_in_period(phase: Floats, period: float) -> Floats:
    """Return x within its period, from 0 to `period`, from the phase of cos(2 pi x / period)."""
    return np.asarray(phase / (2 * np.pi) * period % period)


def unwrap(position: Floats, period: float, near: Floats) -> Floats:
    """Choose, of the positions a period apart, the one closest to a rough one.

    Parameters
    ----------
    position : array
        Within the period.
    period : float
    near : array
        Rough position; right if it is less than half a period off.
    """
    return np.asarray(position + np.rint((near - position) / period) * period)
