r"""What the photos of some patterns tell of free rows, the same for all camera pixels.

A photo of pattern l_n is y_n = b + sum_p l_np t_p + noise, b the black. Of a row
t_p = m + r_p nothing is known but that the r_p vary alike: b and m have flat priors, and r_p the
variance s^2. Photos are taken apart into what b and m explain, k directions in which r is seen,

    L' = V diag(S) W^T,   L' = L less its projection on the sequences of b and m,

and the rest, in which there is nothing but noise.

Index convention: n runs over photos, p over lamps, i over the k directions, g over b and m.
"""

from dataclasses import dataclass

import numpy as np

from nearfar.arrays import Floats

# Singular values below this share of the largest are rounding.
LEAST_SINGULAR_VALUE = 1e-6
# Patterns whose total light varies by less than this share do not tell b from m.
LEAST_VARIATION = 1e-4


@dataclass(frozen=True, eq=False)
class Design:
    """Patterns of lamps, taken apart; all float64.

    Attributes
    ----------
    patterns : ndarray, shape (N, P)
        Levels from 0 to 1.
    has_black : bool
        Whether the black is estimated; else it is taken as 0.
    from_known : ndarray, shape (g, N)
        Makes b, if it is estimated, and m of photos less those of r and of direct light.
    basis : ndarray, shape (N, g)
        Orthonormal basis of the sequences of b and m.
    directions : ndarray, shape (N, k)
        V.
    strengths : ndarray, shape (k,)
        S, falling.
    modes : ndarray, shape (k, P)
        W^T.
    """

    patterns: Floats
    has_black: bool
    from_known: Floats
    basis: Floats
    directions: Floats
    strengths: Floats
    modes: Floats

    @property
    def lamps(self) -> int:
        """P."""
        return int(self.patterns.shape[1])

    @property
    def seen(self) -> int:
        """Directions of a photo's sequence in which b and m are not all, N - g."""
        return int(self.patterns.shape[0] - self.basis.shape[1])

    @property
    def spare(self) -> int:
        """Directions in which the photos have nothing but noise."""
        return self.seen - len(self.strengths)

    @property
    def is_complete(self) -> bool:
        """Whether the patterns tell all lamps apart."""
        return len(self.strengths) == self.lamps - 1

    @property
    def mean(self) -> Floats:
        """Weights of the lamps' light in the estimate of m, (P,)."""
        return np.asarray(self.from_known[-1] @ self.patterns)

    @property
    def of_lamps(self) -> Floats:
        """Return the photos of one lamp each, in the k directions: (k, P)."""
        return np.asarray(self.strengths[:, None] * self.modes)


def design_of(patterns: Floats) -> Design:
    """Take patterns apart.

    Parameters
    ----------
    patterns : ndarray, shape (N, P)
        Levels from 0 to 1.

    Returns
    -------
    Design
    """
    exact = patterns.astype(np.float64)
    ones = np.ones((len(exact), 1))
    of_mean = exact.sum(axis=1, keepdims=True)
    has_black = _tells_black(exact)
    known = np.concatenate([ones, of_mean], axis=1) if has_black else of_mean
    basis, _ = np.linalg.qr(known)
    left = exact - basis @ (basis.T @ exact)
    directions, strengths, modes = np.linalg.svd(left, full_matrices=False)
    # Rounding of the patterns themselves counts too, where b and m explain them all.
    largest = max(float(strengths.max(initial=0.0)), float(np.abs(exact).max(initial=0.0)))
    kept = strengths > LEAST_SINGULAR_VALUE * largest
    return Design(
        exact,
        has_black,
        np.linalg.pinv(known),
        basis,
        directions[:, kept],
        strengths[kept],
        modes[kept],
    )


def _tells_black(patterns: Floats) -> bool:
    """Return whether photos of patterns (N, P) tell the black from the lamps' light."""
    number, lamps = patterns.shape
    sequences, strengths, _ = np.linalg.svd(patterns, full_matrices=False)
    kept = strengths > LEAST_SINGULAR_VALUE * strengths.max(initial=0.0)
    ones = np.ones(number)
    beyond = ones - sequences[:, kept] @ (sequences[:, kept].T @ ones)
    if float(beyond @ beyond) > LEAST_SINGULAR_VALUE * number:
        return True
    # The patterns make up for any black. Where they tell all lamps apart, it must be known; where
    # they do not, the lamps' equal shares tell it, unless every photo has as much light.
    total = patterns.sum(axis=1)
    varies = float(np.ptp(total)) > LEAST_VARIATION * float(total.max(initial=0.0))
    return bool(np.count_nonzero(kept) < lamps and varies)
