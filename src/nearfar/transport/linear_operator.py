"""A transport as a SciPy operator."""

import numpy as np
from scipy.sparse.linalg import LinearOperator

from nearfar.arrays import Floats
from nearfar.checks import finite_numbers
from nearfar.transport.factors import Factors


def linear_operator(factors: Factors) -> LinearOperator:
    """Return a transport of one channel as a SciPy operator of shape (C, P)."""

    def matvec(light: Floats) -> Floats:
        lights = finite_numbers(light, "the light").reshape(1, 1, -1).astype(np.float64)
        return np.asarray(sum(factors.pictures(lights)))[0, :, 0]

    def rmatvec(image: Floats) -> Floats:
        return factors.back(finite_numbers(image, "the image").ravel(), 0).ravel()

    shape = (len(factors.q), factors.projector.pixels)
    return LinearOperator(shape, matvec=matvec, rmatvec=rmatvec, dtype=np.float64)
