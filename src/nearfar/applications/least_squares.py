"""Least squares for lights between limits, by accelerated projected gradients.

Beck and Teboulle, "A fast iterative shrinkage-thresholding algorithm for linear inverse problems",
SIAM J. Imaging Sciences 2009; restarted where a step leads uphill, after O'Donoghue and Candes,
"Adaptive restart for accelerated gradient schemes", Found. Comput. Math. 2015.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from nearfar.arrays import Floats
from nearfar.callbacks import Report

# Iteration ends once a step changes the light by less than this share of its norm, or after so many
# steps.
LEAST_CHANGE = 1e-5
STEPS = 400
# Steps of power iteration for the greatest eigenvalue; the margin covers what they leave.
POWER_STEPS = 15
EIGENVALUE_MARGIN = 1.1


@dataclass(frozen=True, eq=False)
class LeastSquares:
    """Minimise |W (A l - v)|^2 + mu |gradient of l|^2 for lights l.

    Attributes
    ----------
    forward : callable
        A: takes a light, returns a picture.
    adjoint : callable
        A^T.
    weights : ndarray
        W^2; as a picture, or (Cy, Cx, 1).
    diagonal : ndarray
        Positive, as a light: the preconditioner, about the diagonal of A^T W^2 A.
    smoothness : float
        mu.
    """

    forward: Callable[[Floats], Floats]
    adjoint: Callable[[Floats], Floats]
    weights: Floats
    diagonal: Floats
    smoothness: float

    def information(self, light: Floats) -> Floats:
        """Return the information matrix A^T W^2 A + mu G^T G, times a light."""
        back = self.adjoint(self.weights * self.forward(light))
        return np.asarray(back + self.smoothness * roughness(light))

    def greatest_eigenvalue(self) -> float:
        """Return about the greatest eigenvalue of the preconditioned matrix, with a margin."""
        root = np.sqrt(self.diagonal)
        light = np.random.default_rng(0).random(self.diagonal.shape) + 1.0
        value = 1.0
        for _ in range(POWER_STEPS):
            light /= np.linalg.norm(light)
            light = self.information(light / root) / root
            value = float(np.linalg.norm(light))
        return EIGENVALUE_MARGIN * value

    def solve(
        self, picture: Floats, start: Floats, most: float, progress: Report | None = None
    ) -> Floats:
        """Return the light between 0 and `most` that fits a picture best.

        Parameters
        ----------
        picture : ndarray
            v.
        start : ndarray
            The light at which the iteration starts.
        most : float
            Greatest value of the light; may be infinite.
        progress : callable, optional

        Returns
        -------
        ndarray, of the shape of `start`
        """
        step = 1.0 / (self.greatest_eigenvalue() * self.diagonal)
        towards = self.adjoint(self.weights * picture)
        light = np.clip(start, 0.0, most)
        ahead, momentum = light, 1.0
        for number in range(STEPS):
            downhill = towards - self.information(ahead)
            new = np.clip(ahead + step * downhill, 0.0, most)
            change = new - light
            if np.vdot((ahead - new) * self.diagonal, change) > 0:
                momentum = 1.0
            following = (1 + np.sqrt(1 + 4 * momentum**2)) / 2
            ahead = new + (momentum - 1) / following * change
            light, momentum = new, following
            if progress is not None:
                progress("compensation", number / STEPS)
            if np.linalg.norm(change) <= LEAST_CHANGE * np.linalg.norm(light):
                break
        return np.asarray(light)


def roughness(light: Floats) -> Floats:
    """Return G^T G l, G being differences between neighbours down and across, (Py, Px, ...)."""
    found = np.zeros_like(light)
    for axis in (0, 1):
        nothing = np.zeros_like(np.take(light, [0], axis=axis))
        steps = np.concatenate([nothing, np.diff(light, axis=axis), nothing], axis=axis)
        found -= np.diff(steps, axis=axis)
    return found
