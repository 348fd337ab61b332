"""Direct and global light from photos of patterns that were chosen (`separation_choice`).

Let D and G be a camera pixel's direct and global light under white less black, W = D + G, B what it
sees under black, l_n(q) the level that pattern n lights it with directly and m_n the pattern's mean
level, by which global light of fine patterns is scaled. Photo n is

    B + l_n(q) D + m_n G = B + m_n W + (l_n(q) - m_n) D.

Of fringes, l_n(q) - m_n = a_n cos(2 pi (k.q + phase_n)), linear in D cos and D sin of k.q; of a
pair of inverses, the two (l_n(q) - m_n) D are each other's negatives. With B and W these make one
least squares problem for all camera pixels. Of patterns of two levels without inverses, each camera
pixel has bright and dark photos, and their means are two equations for D and G.

Index convention: photos are (n, rows, Cx, channels); pictures are (rows, Cx, channels).
"""

from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Floats
from nearfar.baselines.separation import STRADDLING_SHARE, Separation, direct_of_samples
from nearfar.baselines.separation_choice import Choice, Measured

# Levels of uniform patterns that differ by more tell black from white.
DIFFERENT_LEVELS = 0.1
# Singular values below this share of the largest are none.
LEAST_SINGULAR = 1e-3


class Solved(NamedTuple):
    """Direct and global light of some camera rows, and what they are checked by.

    Attributes
    ----------
    pictures : Separation
    residuals : ndarray, shape (n, rows, Cx), or None
        Photos less the light found, channels together; None where nothing but this light fits.
    degrees : int
        Photos beyond the numbers that were found of each camera pixel.
    """

    pictures: Separation
    residuals: Floats | None = None
    degrees: int = 0


class Solver(Protocol):
    """From photos to direct and global light."""

    @property
    def has_black(self) -> bool:
        """Whether black is found in the photos, and not taken as 0 or subtracted before."""

    def __call__(self, photos: Floats) -> Solved:
        """Separate photos, in the order of `Choice.photos`."""


def solver(choice: Choice, black_level: float | None) -> Solver:
    """Return the solver for direct and global light that the chosen patterns allow.

    Parameters
    ----------
    choice : Choice
    black_level : float or None
        Where photos come less a dark one, B / W that is left in them: 0 where that was under black.
        None where photos come as they are, and black is found or taken as 0.
    """
    if choice.shifted:
        return _by_levels(choice, black_level)
    return _by_least_squares(choice, black_level)


@dataclass(frozen=True, eq=False)
class _LeastSquares:
    """Unknowns are B, if it is one, W, then for each wave D cos and D sin, for each pair its s."""

    solution: NDArray[np.float32]  # (unknowns, n)
    design: NDArray[np.float32]  # (n, unknowns)
    has_black: bool
    waves: int
    contrast: NDArray[np.float32]  # (pairs, 2)

    def __call__(self, photos: Floats) -> Solved:
        found = np.tensordot(self.solution, photos, axes=(1, 0))
        first = 1 + self.has_black
        white = found[first - 1]
        by_wave = found[first : first + 2 * self.waves].reshape(-1, 2, *white.shape)
        samples = np.concatenate([_along_phase(by_wave), self._of_pairs(found)])
        direct = direct_of_samples(samples)
        pictures, degrees = Separation(direct, white - direct), len(photos) - len(found)
        if degrees <= 0:
            return Solved(pictures)
        left = photos - np.tensordot(self.design, found, axes=(1, 0))
        return Solved(pictures, left.sum(axis=-1), degrees)

    def _of_pairs(self, found: Floats) -> Floats:
        """Return +-D of each pair: s = (l(q) - m) D of its first pattern."""
        pairs = found[1 + self.has_black + 2 * self.waves :]
        is_lit = pairs.sum(axis=-1, keepdims=True) > 0
        above, below = (self.contrast[:, i, None, None, None] for i in (0, 1))
        return np.asarray(np.where(is_lit, pairs / above, pairs / below))


def _along_phase(by_wave: Floats) -> Floats:
    """Return D of each wave (waves, 2, rows, Cx, channels), at the phase of all channels."""
    fitted = by_wave[:, 0] + 1j * by_wave[:, 1]
    together = fitted.sum(axis=-1, keepdims=True)
    modulus = np.maximum(np.abs(together), np.finfo(by_wave.dtype).tiny)
    return np.asarray((fitted * together.conj() / modulus).real)


def _by_least_squares(choice: Choice, black_level: float | None) -> _LeastSquares:
    place = {number: i for i, number in enumerate(choice.photos)}
    excess = 0.0 if black_level is None else black_level / (1 - black_level)
    columns = [np.ones(len(place)), np.zeros(len(place))]
    for each in (*choice.uniform, *choice.structured):
        columns[1][place[each.number]] = each.mean + excess
    for wave in choice.waves:
        cosine, sine = np.zeros((2, len(place)))
        for pattern, phase in zip(wave.patterns, wave.phases, strict=True):
            amplitude = 0.5 * (pattern.highest - pattern.lowest)
            cosine[place[pattern.number]] = amplitude * np.cos(2 * np.pi * phase)
            sine[place[pattern.number]] = -amplitude * np.sin(2 * np.pi * phase)
        columns += [cosine, sine]
    contrast = []
    for pair in choice.pairs:
        column = np.zeros(len(place))
        column[place[pair.pattern.number]], column[place[pair.inverse.number]] = 1, -1
        columns.append(column)
        of = pair.pattern
        contrast.append((of.highest - of.mean, of.mean - of.lowest))
    # Where all patterns have one mean level, black is no unknown.
    has_black = black_level is None and float(np.ptp(columns[1])) > DIFFERENT_LEVELS
    design = np.stack(columns[0 if has_black else 1 :], axis=1)
    return _LeastSquares(
        np.linalg.pinv(design, rcond=LEAST_SINGULAR).astype(np.float32),
        design.astype(np.float32),
        has_black,
        len(choice.waves),
        np.array(contrast, dtype=np.float32).reshape(-1, 2),
    )


@dataclass(frozen=True, eq=False)
class _Levels:
    """Bright and dark photos of each camera pixel, and uniform ones."""

    shifted: NDArray[np.intp]
    uniform: NDArray[np.intp]
    means: NDArray[np.float32]  # of the shifted patterns, with what black adds
    uniform_means: NDArray[np.float32]
    levels: tuple[float, float]  # dark, bright
    has_black: bool

    def __call__(self, photos: Floats) -> Solved:
        shown = photos[self.shifted]
        black, white = self._uniform(photos)
        shown = shown - black
        together = shown.sum(axis=-1, keepdims=True)
        middle = 0.5 * (together.max(axis=0) + together.min(axis=0))
        least = STRADDLING_SHARE * (together.max(axis=0) - middle)
        sums = []
        for chosen in (together <= middle - least, together >= middle + least):
            count = chosen.sum(axis=0)
            mean_level = np.tensordot(self.means, chosen, axes=(0, 0)) / count
            sums.append(((chosen * shown).sum(axis=0) / count, mean_level))
        (dark, dark_mean), (bright, bright_mean) = sums
        low, high = self.levels
        # bright = high D + bright_mean G, dark = low D + dark_mean G.
        determinant = high * dark_mean - low * bright_mean
        direct = (dark_mean * bright - bright_mean * dark) / determinant
        by_dark = (high * dark - low * bright) / determinant
        global_ = by_dark if white is None else white - direct
        single = (np.asarray(part, dtype=np.float32) for part in (direct, global_))
        return Solved(Separation(*single))

    def _uniform(self, photos: Floats) -> tuple[Floats, Floats | None]:
        """Return the photo under black, and that of white less black (None if it is unknown)."""
        nothing = np.zeros_like(photos[0])
        means, seen = self.uniform_means, photos[self.uniform]
        if not len(means):
            return nothing, None
        if not self.has_black:
            return nothing, (seen.mean(axis=0) / means.mean() if means.mean() > 0 else None)
        if np.ptp(means) <= DIFFERENT_LEVELS:
            return seen.mean(axis=0), None
        design = np.stack([np.ones_like(means), means], axis=1)
        black, white = np.tensordot(np.linalg.pinv(design), seen, axes=(1, 0))
        return black, white


def _by_levels(choice: Choice, black_level: float | None) -> _Levels:
    place = {number: i for i, number in enumerate(choice.photos)}
    excess = 0.0 if black_level is None else black_level / (1 - black_level)

    def places(patterns: tuple[Measured, ...]) -> NDArray[np.intp]:
        return np.array([place[each.number] for each in patterns], dtype=np.intp)

    def means(patterns: tuple[Measured, ...]) -> NDArray[np.float32]:
        return np.array([each.mean + excess for each in patterns], dtype=np.float32)

    lowest, highest = (
        float(np.median([getattr(each, name) for each in choice.shifted]))
        for name in ("lowest", "highest")
    )
    levels = means(choice.uniform)
    is_told = len(levels) > 0 and (levels.min() <= DIFFERENT_LEVELS or np.ptp(levels) > 0.1)
    return _Levels(
        places(choice.shifted),
        places(choice.uniform),
        means(choice.shifted),
        levels,
        (lowest + excess, highest + excess),
        black_level is None and bool(is_told),
    )
