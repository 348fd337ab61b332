"""`nearfar.plan.expect.ErrorsTogether` in products of thin matrices.

Before any photo, the covariance of the responses is A A^T + diag(f): A what direct light and the
window's functions answer, folded about q, and f far-range light's variance. Each measurement takes
away u u^T. How much measuring a candidate lowers the errors follows from sum_i w_i c_ik^2, which is
kept up to date, so that no K x K matrix is ever formed: choosing takes a fraction of the time.

The gains of two candidates that mirror each other are equal, and rounding decides between them.
Equal ones are told apart by their order here, and by rounding there, so that the two choose other
frequencies of the same worth.

Index convention: k runs over candidate frequencies, j over prior components with cosines and sines
apart, r over columns of A, l over pictures and the random light.
"""

from typing import NamedTuple

import numpy as np

from nearfar.arrays import Floats, Size
from nearfar.illumination.frequencies import Frequency
from nearfar.illumination.near_basis import window_offsets
from nearfar.illumination.real_basis import real_basis
from nearfar.plan.expect import TYPICAL_DIRECT_DEVIATION, light_weights, waves_on_window
from nearfar.priors.covariance import far_variance, near_covariance
from nearfar.priors.typical import TypicalScenes

# Eigenvalues of a window's covariance of less than this share of its trace are left out.
NEGLIGIBLE = 1e-9
# Share by which rounding makes gains differ that are equal, and more: it makes 1e-6 of the highest.
ROUNDING = 1e-5


class _Responses(NamedTuple):
    """The responses of one prior component to the candidates, cosines or sines.

    Attributes
    ----------
    near : ndarray, shape (K, r)
        A.
    far : ndarray, shape (K,)
        f.
    measured : ndarray, shape (most measurements, K)
        u of each measurement so far, and room for others.
    """

    near: Floats
    far: Floats
    measured: Floats

    def column(self, candidate: int, count: int) -> Floats:
        """Return the covariance of all responses with one, after `count` measurements, (K,)."""
        found = self.near @ self.near[candidate]
        found[candidate] += self.far[candidate]
        before = self.measured[:count]
        return np.asarray(found - before[:, candidate] @ before)

    def times(self, vectors: Floats, count: int) -> Floats:
        """Return rows of vectors (n, K) times the covariance after `count` measurements."""
        before = self.measured[:count]
        prior = (vectors @ self.near) @ self.near.T + vectors * self.far
        return np.asarray(prior - (vectors @ before.T) @ before)


class ErrorsLowRank:
    """Posterior covariances of the responses of typical camera pixels while a plan grows.

    Parameters
    ----------
    frequencies : list of Frequency
        Candidates.
    projector : Size
    window, pitch : int
        W, and the projector pixels between the window's functions.
    typical : TypicalScenes
    most : int
        No more measurements than these will be conditioned on.
    """

    rounding = ROUNDING

    def __init__(
        self,
        frequencies: list[Frequency],
        projector: Size,
        window: int,
        pitch: int,
        typical: TypicalScenes,
        most: int,
    ) -> None:
        self.weights = light_weights(frequencies, projector, pitch)
        self.shares = np.repeat(typical.shares, 2, axis=1)
        self._responses = _responses(frequencies, projector, window, pitch, typical, most)
        self._count = 0
        self._variance = np.stack([np.sum(r.near**2, axis=1) + r.far for r in self._responses])
        self._squares = np.stack([_squares(self.weights, r) for r in self._responses])

    def errors(self) -> Floats:
        """Return the expected squared errors of pictures and of the random light, (scenes, 2)."""
        return np.asarray(self.shares @ self._variance @ self.weights.T)

    def gains(self, noise: float) -> Floats:
        """Return by how much measuring each candidate would lower the errors, (scenes, 2, K)."""
        each = self._squares / (self._variance + noise**2)[:, None]
        return np.asarray(np.tensordot(self.shares, each, axes=1))

    def condition_on(self, candidate: int, noise: float) -> None:
        """Condition on one measurement of a candidate."""
        for j, responses in enumerate(self._responses):
            column = responses.column(candidate, self._count)
            taken = column / np.sqrt(column[candidate] + noise**2)
            weighted = self.weights * taken
            # sum_i w_i (c_ik - u_i u_k)^2, multiplied out.
            cross = responses.times(weighted, self._count)
            self._squares[j] += taken * ((weighted @ taken)[:, None] * taken - 2 * cross)
            self._variance[j] -= taken**2
            responses.measured[self._count] = taken
        self._count += 1


def _squares(weights: Floats, responses: _Responses) -> Floats:
    """Return sum_i w_i c_ik^2 of a prior covariance for both lights, (2, K)."""
    near, far = responses.near, responses.far
    both = np.stack([np.sum(near @ ((near.T * w) @ near) * near, axis=1) for w in weights])
    return np.asarray(both + weights * (2 * far * np.sum(near**2, axis=1) + far**2))


def _responses(
    frequencies: list[Frequency],
    projector: Size,
    window: int,
    pitch: int,
    typical: TypicalScenes,
    most: int,
) -> list[_Responses]:
    """Return the responses of each prior component to cosines and, next to them, to sines."""
    basis = real_basis(frequencies, projector)
    cosines, sines = waves_on_window(frequencies, window, pitch)
    even, odd, kept = _folded(window)
    paired = np.array([not k.is_own_negative for k in frequencies], dtype=np.float64)
    direct = np.full((len(frequencies), 1), TYPICAL_DIRECT_DEVIATION)
    found = []
    for prior_component, scale in typical.prior_components:
        covariance = near_covariance(prior_component, window, projector)
        far = scale**2 * far_variance(basis, prior_component)[~basis.is_sine]
        of_cosines = scale * cosines[:, kept] @ _root(even @ covariance @ even.T)
        of_sines = scale * (sines * paired[:, None])[:, kept] @ _root(odd @ covariance @ odd.T)
        for near, own_far in ((np.hstack([direct, of_cosines]), far), (of_sines, far * paired)):
            room = np.empty((most, len(frequencies)))
            found.append(_Responses(np.ascontiguousarray(near), own_far, room))
    return found


def _folded(window: int) -> tuple[Floats, Floats, list[int]]:
    """Return the sums and the differences of opposite entries, over entries, and whose they are.

    A cosine sees the sums alone, a sine the differences.
    """
    offsets = [(int(y), int(x)) for y, x in window_offsets(window)]
    places = {offset: place for place, offset in enumerate(offsets)}
    kept = [i for i, (y, x) in enumerate(offsets) if places.get((-y, -x), i) >= i]
    even, odd = (np.zeros((len(kept), len(offsets))) for _ in range(2))
    for row, place in enumerate(kept):
        y, x = offsets[place]
        opposite = places.get((-y, -x), place)
        even[row, [place, opposite]] = 1.0
        odd[row, opposite], odd[row, place] = -1.0, 1.0
    return even, odd, kept


def _root(covariance: Floats) -> Floats:
    """Return B with B B^T = covariance, its columns but the negligible."""
    values, vectors = np.linalg.eigh(covariance)
    kept = values > NEGLIGIBLE * max(float(np.trace(covariance)), np.finfo(np.float64).tiny)
    return np.asarray(vectors[:, kept] * np.sqrt(values[kept]))
