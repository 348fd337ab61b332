"""Relight from stored photos alone, without a transport: a weighted sum of the photos of a capture.

Light adds up, so where a light is a sum of patterns that were shown, its picture is the same sum of
their photos. The weights find

    min |l - sum_k w_k l_k|^2 + ridge |w|^2  with  sum_k w_k = 0,

so that ambient light and black level cancel, whatever they are: only differences of patterns count.
The ridge is the photos' noise over the mean square of an entry of T; it keeps weights small that
would add more noise than light. The residual of l was never shown, and a sum of photos does not
tell its picture.

Some sums of patterns vanish: an inverse pair less another, a pattern less its repeat. The same sums
of photos are noise alone, from which its size is estimated.

Index convention: k and j run over photos, i over channels of the camera.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from nearfar.arrays import Floats, blocks
from nearfar.capture import Capture
from nearfar.checks import as_light
from nearfar.errors import InputError
from nearfar.photometry.drift_removal import remove_drift
from nearfar.photometry.noise import NoiseModel, fit_noise, mean_of_few
from nearfar.photometry.photos import Photos
from nearfar.progress import Report, ignore_progress

# Values of photos in memory at once.
VALUES_AT_ONCE = 1 << 24
# Values of patterns, of two blocks together: the fewer blocks, the less often patterns are drawn.
PATTERN_VALUES = 1 << 26
# Projector pixels whose products are summed at once, in double precision.
PIXELS_AT_ONCE = 1 << 16
# Camera rows by which noise is estimated, spread over the photo.
ROWS_OF_NOISE = 32
# A sum of patterns vanishes if its eigenvalue is below this share of the largest one.
LEAST_SHARE = 1e-9
# A photo that is saturated spoils the picture if its weight is above this share of the largest.
LEAST_WEIGHT = 1e-3


@dataclass(frozen=True, eq=False)
class Superposition:
    """A picture from stored photos alone.

    Attributes
    ----------
    picture : ndarray, shape (Cy, Cx, channels), float32
        In photo units: photo(shown) - photo(black).
    sigma : ndarray, shape (Cy, Cx, channels), float32, or None
        Its standard deviation by the photos' noise; infinite where a photo that counts is
        saturated. None if no sum of patterns vanishes, so that the noise is not known.
    shown : ndarray, shape (Py, Px) or (Py, Px, channels), float32
        The sum of patterns whose picture this is.
    missing : float
        Norm of the light less `shown`, as a share of the light's norm.

    Examples
    --------
    >>> found = nearfar.superpose(capture, light)
    >>> found.picture.shape
    (8, 8, 1)
    >>> bool(0 <= found.missing <= 1)
    True
    """

    picture: Floats
    sigma: Floats | None
    shown: Floats
    missing: float

    @property
    def missing_decibels(self) -> float:
        """The missing share in dB, 0 where all of the light is missing, -inf where none is."""
        return 20 * float(np.log10(self.missing)) if self.missing > 0 else -np.inf


def superpose(
    capture: Capture, light: Floats, *, progress: Report = ignore_progress
) -> Superposition:
    """Relight by a weighted sum of the photos of a capture.

    Parameters
    ----------
    capture : Capture
        Of any grey patterns.
    light : ndarray, shape (Py, Px) or (Py, Px, channels)
        Linear, white = 1; with channels, what each channel of the camera sees of it.
    progress : callable, optional
        Called with what is done and its share.

    Returns
    -------
    Superposition

    Raises
    ------
    PlanError
        If the patterns are complex.
    InputError
        If the patterns are coloured or all alike, or the light has another size or is black.

    Examples
    --------
    >>> relit = nearfar.superpose(capture, light).picture
    """
    capture.plan.require_real("superpose")
    checked = np.asarray(as_light(light, capture.plan.projector, capture.channels))
    lights = checked.reshape(capture.plan.projector.pixels, -1).astype(np.float64)
    if not lights.any():
        raise InputError("the light is black, of which there is no picture: give one with light.")
    patterns = _Patterns(capture)
    gram, cross = patterns.products(lights, progress)
    centred, wanted = _centre(gram, cross)
    values, vectors = np.linalg.eigh(centred)
    if not values[-1] > LEAST_SHARE * gram.trace():
        raise InputError(
            f"all patterns of {capture.path} are alike, and no sum of them is a light without "
            f"black: add others."
        )
    # By reference, lamp and ambient light are followed; as in `measure`.
    photos: Photos = remove_drift(capture) if capture.plan.offset == "reference" else capture
    noise = _estimate_noise(photos, capture, _sums_of_nothing(values, vectors))
    ridge = _ridge(photos, noise, values.sum())
    weights = vectors @ ((vectors.T @ wanted) / (np.maximum(values, 0.0) + ridge)[:, None])
    picture, sigma = _add_up(photos, weights, noise, progress)
    shown = patterns.sum(weights)
    missing = float(np.linalg.norm(lights - shown) / np.linalg.norm(lights))
    return Superposition(
        picture,
        sigma if noise.is_measured else None,
        shown.reshape(checked.shape).astype(np.float32),
        missing,
    )


class _Patterns:
    """The patterns of a capture, drawn a few at a time."""

    def __init__(self, capture: Capture) -> None:
        self.capture = capture
        self.count = len(capture.plan.patterns)
        # Two blocks are in memory at once.
        self.blocks = list(blocks(self.count, PATTERN_VALUES // 2 // capture.plan.projector.pixels))

    def draw(self, block: slice) -> Floats:
        """Return patterns, (n, P), float32."""
        drawn = [self.capture.pattern(k) for k in range(*block.indices(self.count))]
        if any(pattern.ndim == 3 for pattern in drawn):
            raise InputError(
                f"{self.capture.path} holds coloured patterns, whose photos are not superposed: "
                f"give a capture of grey ones."
            )
        return np.stack(drawn).reshape(len(drawn), -1)

    def products(self, lights: Floats, progress: Report) -> tuple[Floats, Floats]:
        """Return the products of patterns with each other, (K, K), and with lights, (K, n)."""
        gram = np.empty((self.count, self.count))
        cross = np.empty((self.count, lights.shape[1]))
        for number, rows in enumerate(self.blocks):
            mine = self.draw(rows)
            cross[rows] = _products(mine, lights.T)
            gram[rows, rows] = _products(mine, mine)
            for columns in self.blocks[number + 1 :]:
                gram[rows, columns] = _products(mine, self.draw(columns))
                gram[columns, rows] = gram[rows, columns].T
            progress("patterns", (number + 1) / len(self.blocks))
        return gram, cross

    def sum(self, weights: Floats) -> Floats:
        """Return weighted sums of all patterns, (P, n), of weights (K, n)."""
        total = np.zeros((self.capture.plan.projector.pixels, weights.shape[1]))
        for block in self.blocks:
            drawn = self.draw(block)
            for some in blocks(len(total), PIXELS_AT_ONCE):
                total[some] += drawn[:, some].T.astype(np.float64) @ weights[block]
        return total


def _products(one: Floats, other: Floats) -> Floats:
    """Return the products of patterns (n, P) with others (m, P), (n, m), in double precision."""
    total = np.zeros((len(one), len(other)))
    for some in blocks(one.shape[1], PIXELS_AT_ONCE):
        total += one[:, some].astype(np.float64) @ other[:, some].T.astype(np.float64)
    return total


def _centre(gram: Floats, cross: Floats) -> tuple[Floats, Floats]:
    """Take the mean pattern out: weights that follow sum to 0."""
    rows = gram.mean(axis=0)
    return gram - rows - rows[:, None] + rows.mean(), cross - cross.mean(axis=0)


def _sums_of_nothing(values: Floats, vectors: Floats) -> Floats:
    """Return orthonormal weights that sum to 0 and under which all patterns cancel, (K, n)."""
    nothing = vectors[:, values < LEAST_SHARE * values[-1]]
    # Equal weights cancel the differences, not the patterns.
    count = len(vectors)
    equal = np.full((count, 1), 1 / np.sqrt(count))
    left, size, _ = np.linalg.svd(nothing - equal @ (equal.T @ nothing), full_matrices=False)
    return np.asarray(left[:, size > 0.5])


class _Noise(NamedTuple):
    """A model of each channel's noise, and whether photos told it or rounding alone."""

    models: tuple[NoiseModel, ...]
    is_measured: bool


def _some_rows(photos: Photos) -> Iterator[Floats]:
    """Yield all photos of some rows of the camera, (K, pixels, channels)."""
    count, height = len(photos.plan.patterns), photos.camera.height
    for row in np.unique(np.linspace(0, height - 1, ROWS_OF_NOISE).astype(int)).tolist():
        read = photos.read(range(count), slice(row, row + 1))
        yield read.reshape(count, -1, photos.channels).astype(np.float64)


def _estimate_noise(photos: Photos, capture: Capture, nothing: Floats) -> _Noise:
    """Fit shot and read noise to sums of photos whose patterns add up to nothing."""
    is_whole = np.issubdtype(capture.photos.dtype, np.integer)
    rounding = 1 / capture.full_scale**2 / 12 if is_whole else 0.0
    if nothing.shape[1] == 0:
        model = NoiseModel(0.0, rounding, rounding)
        return _Noise((model,) * capture.channels, is_measured=False)
    levels, squares, darkest = [], [], []
    for read in _some_rows(photos):
        usable = (read < 1.0).all(axis=0)
        sums = np.tensordot(nothing.T, read, axes=1)
        level = np.tensordot(np.mean(nothing**2, axis=1), read, axes=1)
        levels.append(np.where(usable, level, np.nan))
        squares.append(np.mean(sums**2, axis=0))
        darkest.append(read.min(axis=0))
    level, square = np.concatenate(levels), np.concatenate(squares)
    dark = np.median(np.concatenate(darkest), axis=0)
    models = []
    for i in range(capture.channels):
        kept = np.isfinite(level[:, i])
        if not kept.any():
            raise InputError(
                f"every camera pixel of {capture.path} is saturated in some photo: expose less "
                f"and shoot again."
            )
        models.append(
            fit_noise(
                level[kept, i],
                square[kept, i],
                float(dark[i]),
                photos=1,
                least=rounding,
                typical=mean_of_few,
            )
        )
    return _Noise(tuple(models), is_measured=True)


def _ridge(photos: Photos, noise: _Noise, differences: float) -> float:
    """Return the noise of a photo over the mean square of an entry of T."""
    variance = scatter = 0.0
    for read in _some_rows(photos):
        mean = read.mean(axis=0)
        scatter += float(np.sum((read - mean) ** 2))
        variance += sum(
            float(model.variance(mean[:, i]).sum()) for i, model in enumerate(noise.models)
        )
    # Photos scatter by the entries' mean square times how much the patterns differ.
    return variance * differences / max(scatter, np.finfo(np.float64).tiny)


def _add_up(
    photos: Photos, weights: Floats, noise: _Noise, progress: Report
) -> tuple[Floats, Floats]:
    """Return the weighted sum of photos and its standard deviation, each (Cy, Cx, channels)."""
    count, camera, channels = len(photos.plan.patterns), photos.camera, photos.channels
    by_channel = np.broadcast_to(weights, (count, channels)).astype(np.float32)
    counts = np.abs(by_channel) > LEAST_WEIGHT * np.abs(by_channel).max(axis=0)
    pictures, sigmas = [], []
    rows_at_once = max(1, VALUES_AT_ONCE // (count * camera.width * channels))
    for rows in blocks(camera.height, rows_at_once):
        read = photos.read(range(count), rows)
        pictures.append(np.einsum("kyxi,ki->yxi", read, by_channel, optimize=True))
        variance = np.stack(
            [
                np.tensordot(by_channel[:, i] ** 2, model.variance(read[..., i]), axes=1)
                for i, model in enumerate(noise.models)
            ],
            axis=-1,
        )
        is_saturated = ((read >= 1.0) & counts[:, None, None]).any(axis=0)
        sigmas.append(np.where(is_saturated, np.inf, np.sqrt(variance)))
        progress("photos", min(rows.stop, camera.height) / camera.height)
    picture, sigma = np.concatenate(pictures), np.concatenate(sigmas)
    return picture.astype(np.float32), sigma.astype(np.float32)
