"""`nearfar.plan.expect.ErrorsTogether` in products of thin matrices.

Before any photo, the covariance of the responses is d^2 1 1^T + s^2 (B B^T + diag(f)): direct light
of deviation d, which all cosines share; what the window's functions answer, folded about q; and
far-range light of variances f, at a prior scale s. Each measurement takes away u u^T. How much
measuring a candidate lowers the errors follows from sum_i w_i c_ik^2, which is kept up to date, so
that no K x K matrix is ever formed: choosing takes a fraction of the time.

The gains of two candidates that mirror each other are equal, and rounding decides between them.
Equal ones are told apart by their order here, and by rounding there, so that the two choose other
frequencies of the same worth.

Index convention: k runs over candidate frequencies, s over the scales of one prior component, m
over measurements, r over columns of B, l over pictures and the random light.
"""

from typing import NamedTuple

import numpy as np

from nearfar.arrays import Floats, Size
from nearfar.illumination.frequencies import Frequency
from nearfar.illumination.near_basis import window_offsets
from nearfar.illumination.real_basis import real_basis
from nearfar.plan.expect import TYPICAL_DIRECT_DEVIATION, light_weights, waves_on_window
from nearfar.priors.component import PriorComponent
from nearfar.priors.covariance import far_variance, near_covariance
from nearfar.priors.typical import TypicalScenes

# Eigenvalues of a window's covariance of less than this share of its trace are left out.
NEGLIGIBLE = 1e-9
# Share by which rounding makes gains differ that are equal, and more: it makes 1e-6 of the highest.
ROUNDING = 1e-5


class _Responses(NamedTuple):
    """The responses of one prior component at several scales to the candidates, cosines or sines.

    Attributes
    ----------
    near : ndarray, shape (K, r)
        B.
    far : ndarray, shape (K,)
        f.
    direct : float
        d^2.
    scales : ndarray, shape (S,)
        s^2.
    measured : ndarray, shape (S, most measurements, K)
        u of each measurement so far, and room for others.
    """

    near: Floats
    far: Floats
    direct: float
    scales: Floats
    measured: Floats

    def variance(self) -> Floats:
        """Return the variances of the responses before any measurement, (S, K)."""
        unit = np.sum(self.near**2, axis=1) + self.far
        return np.asarray(self.direct + self.scales[:, None] * unit)

    def column(self, candidate: int, count: int) -> Floats:
        """Return the covariances of all responses with one, after `count` measurements, (S, K)."""
        unit = self.near @ self.near[candidate]
        unit[candidate] += self.far[candidate]
        before = self.measured[:, :count]
        taken = (before[:, None, :, candidate] @ before)[:, 0]
        return np.asarray(self.direct + self.scales[:, None] * unit - taken)

    def times(self, vectors: Floats, count: int) -> Floats:
        """Return rows of vectors (S, n, K) times the covariances after `count` measurements."""
        before = self.measured[:, :count]
        flat = vectors.reshape(-1, vectors.shape[-1])
        unit = ((flat @ self.near) @ self.near.T).reshape(vectors.shape) + vectors * self.far
        of_direct = self.direct * vectors.sum(axis=-1, keepdims=True)
        taken = (vectors @ before.swapaxes(1, 2)) @ before
        return np.asarray(of_direct + self.scales[:, None, None] * unit - taken)


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
        groups = _grouped(typical)
        self._responses = _responses(frequencies, projector, window, pitch, groups, most)
        places = [place for group in groups.values() for _ in range(2) for place, _ in group]
        self.shares = typical.shares[:, places]
        self._count = 0
        self._variance = [r.variance() for r in self._responses]
        self._squares = [_squares(self.weights, r) for r in self._responses]

    def errors(self) -> Floats:
        """Return the expected squared errors of pictures and of the random light, (scenes, 2)."""
        return np.asarray(self.shares @ np.concatenate(self._variance) @ self.weights.T)

    def gains(self, noise: float) -> Floats:
        """Return by how much measuring each candidate would lower the errors, (scenes, 2, K)."""
        measured = np.concatenate(self._variance) + noise**2
        each = np.concatenate(self._squares) / measured[:, None]
        return np.asarray(np.tensordot(self.shares, each, axes=1))

    def condition_on(self, candidate: int, noise: float) -> None:
        """Condition on one measurement of a candidate."""
        for group, responses in enumerate(self._responses):
            column = responses.column(candidate, self._count)
            taken = column / np.sqrt(column[:, [candidate]] + noise**2)
            weighted = self.weights * taken[:, None]
            # sum_i w_i (c_ik - u_i u_k)^2, multiplied out.
            cross = responses.times(weighted, self._count)
            power = weighted @ taken[:, :, None]
            self._squares[group] += taken[:, None] * (power * taken[:, None] - 2 * cross)
            self._variance[group] -= taken**2
            responses.measured[:, self._count] = taken
        self._count += 1


def _grouped(typical: TypicalScenes) -> dict[PriorComponent, list[tuple[int, float]]]:
    """Return the place and the scale of the prior components that differ in scale alone."""
    groups: dict[PriorComponent, list[tuple[int, float]]] = {}
    for place, (prior_component, scale) in enumerate(typical.prior_components):
        groups.setdefault(prior_component, []).append((place, scale))
    return groups


def _squares(weights: Floats, responses: _Responses) -> Floats:
    """Return sum_i w_i c_ik^2 of the prior covariances for both lights, (S, 2, K)."""
    near, far, direct = responses.near, responses.far, responses.direct
    scales = responses.scales[:, None, None]
    own = np.sum(near**2, axis=1)
    both = np.stack([np.sum(near @ ((near.T * w) @ near) * near, axis=1) for w in weights])
    unit = both + weights * (2 * far * own + far**2)
    across = (weights @ near) @ near.T + weights * far
    total = weights.sum(axis=1, keepdims=True)
    return np.asarray(scales**2 * unit + 2 * direct * scales * across + direct**2 * total)


def _responses(
    frequencies: list[Frequency],
    projector: Size,
    window: int,
    pitch: int,
    groups: dict[PriorComponent, list[tuple[int, float]]],
    most: int,
) -> list[_Responses]:
    """Return the responses of each prior component to cosines and, next to them, to sines."""
    basis = real_basis(frequencies, projector)
    cosines, sines = waves_on_window(frequencies, window, pitch)
    even, odd, kept = _folded(window)
    paired = np.array([not k.is_own_negative for k in frequencies], dtype=np.float64)
    found = []
    for prior_component, group in groups.items():
        covariance = near_covariance(prior_component, window, projector)
        far = far_variance(basis, prior_component)[~basis.is_sine]
        of_cosines = cosines[:, kept] @ _root(even @ covariance @ even.T)
        of_sines = (sines * paired[:, None])[:, kept] @ _root(odd @ covariance @ odd.T)
        scales = np.array([scale for _, scale in group]) ** 2
        for near, own_far, direct in (
            (of_cosines, far, TYPICAL_DIRECT_DEVIATION**2),
            (of_sines, far * paired, 0.0),
        ):
            room = np.empty((len(group), most, len(frequencies)))
            found.append(_Responses(np.ascontiguousarray(near), own_far, direct, scales, room))
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
