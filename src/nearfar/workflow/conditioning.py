"""Condition number of the near patterns on a window (equation 5)."""

from dataclasses import dataclass

import numpy as np

from nearfar.arrays import AnySize, Booleans, Floats, as_size
from nearfar.checks import as_count
from nearfar.errors import InputError
from nearfar.illumination.frequencies import as_array, near_frequencies, representatives
from nearfar.illumination.near_basis import window_offsets

# Eigenvectors with eigenvalues below this share of the largest are seen by no pattern.
SMALLEST_EIGENVALUE = 1e-6


@dataclass(frozen=True)
class Conditioning:
    """How well near patterns determine the entries of a window.

    Attributes
    ----------
    windows : int
        Different ways in which the projector's border clips a window, the whole one included.
    unseen : int
        Directions of a whole window that no pattern sees: one for each frequency dropped, and
        for even W the checkerboard, which is the direct measurement.
    whole, worst : float
        Largest over smallest singular value in the directions that are seen: of the whole
        window, and of the worst clipped one. 1 is ideal (equation 5).
    """

    windows: int
    unseen: int
    whole: float
    worst: float


def condition_near(projector: AnySize, window: int, dropped: AnySize) -> Conditioning:
    """Compute the condition of the near patterns over every window on a projector (equation 5).

    Parameters
    ----------
    projector : Size or (height, width)
    window : int
        W.
    dropped : Size or (height, width)
        Block of lowest near frequencies that are not shot.

    Returns
    -------
    Conditioning

    Raises
    ------
    InputError
        If no near frequency is left.

    Examples
    --------
    >>> nearfar.condition_near((32, 32), window=5, dropped=(1, 1)).unseen
    1
    """
    projector = as_size(projector, "projector")
    dropped = as_size(dropped, "block of dropped frequencies")
    window = as_count(window, "window", 1)
    frequencies = representatives(near_frequencies(window, dropped))
    if not frequencies:
        raise InputError(
            f"W = {window} with {dropped} near frequencies dropped leaves no near pattern: choose "
            f"a larger W or drop fewer."
        )
    angle = 2 * np.pi * (as_array(frequencies) @ window_offsets(window).T)
    # Each pair +-k counts twice, k = -k once; its sine is zero.
    twice = np.array([1.0 if k.is_own_negative else 2.0 for k in frequencies])[:, None]
    patterns = np.concatenate([np.sqrt(twice) * np.cos(angle), np.sqrt(twice) * np.sin(angle)])
    gram = patterns.T @ patterns / window**2
    # The border clips rows and columns of a window each for itself.
    rows, columns = (_clipped(window, side) for side in projector)
    shapes = [np.outer(down, across).ravel() for down in rows for across in columns]
    spectra = [np.linalg.eigvalsh(gram[np.ix_(shape, shape)]) for shape in shapes]
    full = np.linalg.eigvalsh(gram)
    return Conditioning(
        windows=len(shapes),
        unseen=int(np.sum(full <= SMALLEST_EIGENVALUE * full[-1])),
        whole=_ratio(full),
        worst=max(_ratio(values) for values in spectra),
    )


def _clipped(window: int, side: int) -> Booleans:
    """Return which entries of windows lie on an axis of the projector, one of each kind, (n, W)."""
    entries = np.arange(side)[:, None] + np.arange(window) - window // 2
    return np.unique((entries >= 0) & (entries < side), axis=0)


def _ratio(eigenvalues: Floats) -> float:
    """Largest over smallest singular value of what is seen, from rising eigenvalues."""
    seen = eigenvalues[eigenvalues > SMALLEST_EIGENVALUE * eigenvalues[-1]]
    return float(np.sqrt(seen[-1] / seen[0]))
