"""Parallel single-pixel imaging: every camera pixel sees a small part of the projector.

After Jiang, Li, Zhao and others, "Parallel single-pixel imaging: a general method for direct-global
separation and 3D shape reconstruction under strong global illumination" (International Journal of
Computer Vision, 2021; Optics Express, 2019). A camera pixel is taken to be lit from a reception
field of at most Ms x Ns projector pixels. Sinusoids of periods Ms and Ns and their harmonics, in
3 or 4 phases each, give the Fourier coefficients of its row folded onto one period: with 4 phases
2 Ms Ns photos, with 3 phases three fourths as many. The local region extension puts the period
where the reception field is.

Where that is, 1-D sinusoids of few periods tell beforehand: they measure the row's projections onto
the two axes, coarsely. The window is as large as the largest reception field among the camera
pixels, if the photos suffice for that; otherwise as large as they allow, and of each row the part
with the most light is found. What a row holds beyond its window is folded into it.

Index convention: m and n run over the pixels of one period, u and v over its frequencies.
"""

from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Complexes, Floats, Integers, Size
from nearfar.baselines.shooting import Shooting
from nearfar.errors import InputError
from nearfar.illumination.patterns import quantise
from nearfar.transport.exact import ExactTransport

FEWEST_STEPS = 3
SMALLEST_SIDE = 3
# A reception field is where a projection of the row is above this share of its peak; only those of
# camera pixels that receive at least the second share of the brightest one's light count.
SHARE_OF_PEAK = 0.1
SHARE_OF_LIGHT = 0.02


@dataclass(frozen=True, eq=False)
class Waves:
    """Sinusoids in several phases.

    Attributes
    ----------
    frequencies : ndarray, shape (F, 2), float64
        In cycles per projector pixel, (fy, fx).
    steps : int
        Phases of each, 3 or more, evenly spaced.
    """

    frequencies: Floats
    steps: int

    @property
    def photos(self) -> int:
        """Number of patterns."""
        return self.steps * len(self.frequencies)

    def patterns(self, projector: Size) -> NDArray[np.uint8]:
        """Draw the patterns, (F * steps, Py, Px), 8-bit: all phases of one after the other."""
        y, x = np.indices(projector)
        turns = np.tensordot(self.frequencies, np.stack([y, x]), axes=1)
        phases = np.arange(self.steps) / self.steps
        waves = np.cos(2 * np.pi * (turns[:, None] + phases[:, None, None]))
        return quantise(0.5 + 0.5 * waves).reshape(-1, *projector)

    def coefficients(self, photos: Floats) -> Complexes:
        """Return sum_p t(p) exp(-2 pi j k.p) of each frequency k: (F * steps, ...) to (F, ...)."""
        phases = np.exp(2j * np.pi * np.arange(self.steps) / self.steps)
        grouped = photos.reshape(len(self.frequencies), self.steps, *photos.shape[1:])
        return np.asarray(4 / self.steps * np.einsum("s,fs...->f...", phases, grouped))


def parallel_single_pixel(
    shooting: Shooting, *, periods: Size, steps: int
) -> ExactTransport | None:
    """Find the reception fields, then measure them all at once.

    Parameters
    ----------
    shooting : Shooting
    periods : Size
        Sinusoids along each axis, of 1 period and more, by which reception fields are found.
    steps : int
        Phases of each sinusoid: 3 or more.

    Returns
    -------
    ExactTransport or None
        In photo units, all in `far`. None where the photos do not suffice for the smallest window;
        then none is taken.

    Raises
    ------
    InputError
        If there are too few phases, or more periods than the projector's pixels can show.
    """
    projector = shooting.projector
    _check(projector, periods, steps)
    slices = slice_waves(projector, periods, steps)
    largest = largest_window(projector, shooting.left - 1 - slices.photos, steps)
    if largest is None:
        return None
    black = shooting.shoot(np.zeros((1, *projector), dtype=np.uint8))[0]
    photos = shooting.shoot(slices.patterns(projector))
    light = 2 * (photos.mean(axis=0) - black).sum(axis=-1)
    along = slices.coefficients(photos.sum(axis=-1))
    down = coarse_projections(light, along[: periods.height], projector.height)
    across = coarse_projections(light, along[periods.height :], projector.width)
    bright = light > SHARE_OF_LIGHT * light.max()
    window = Size(
        min(largest.height, max(SMALLEST_SIDE, _longest_field(down[bright]))),
        min(largest.width, max(SMALLEST_SIDE, _longest_field(across[bright]))),
    )
    waves = window_waves(window, steps)
    photos = shooting.shoot(waves.patterns(projector))
    total = 2 * (photos.mean(axis=0) - black)
    folded = fold(window, total, waves.coefficients(photos))
    start = _brightest_part(down, window.height), _brightest_part(across, window.width)
    far = _extend(folded, window, start, projector)
    return ExactTransport(projector, shooting.camera, (), (), far, "parallel single-pixel imaging")


def _check(projector: Size, periods: Size, steps: int) -> None:
    if steps < FEWEST_STEPS:
        raise InputError(
            f"{steps} phases tell no Fourier coefficient: give {FEWEST_STEPS} or more."
        )
    for side, count in zip(projector, periods, strict=True):
        if not 0 <= count <= (side - 1) // 2:
            raise InputError(
                f"{count} sinusoids of whole periods do not fit {side} projector pixels: give 0 "
                f"to {(side - 1) // 2}."
            )


def slice_waves(projector: Size, periods: Size, steps: int) -> Waves:
    """Return the 1-D sinusoids that find reception fields: those along y, then those along x."""
    down = [(f / projector.height, 0.0) for f in range(1, periods.height + 1)]
    across = [(0.0, f / projector.width) for f in range(1, periods.width + 1)]
    return Waves(np.array([*down, *across]).reshape(-1, 2), steps)


def window_waves(window: Size, steps: int) -> Waves:
    """Return the sinusoids that repeat with the window, but for the constant, one of each +-k."""
    chosen = [(u / window.height, v / window.width) for u, v in _half(window)]
    return Waves(np.array(chosen).reshape(-1, 2), steps)


def largest_window(projector: Size, photos: int, steps: int) -> Size | None:
    """Return the largest window, about square, that so many photos measure, or None."""
    found = None
    for side in range(SMALLEST_SIDE, max(projector) + 1):
        for wider in (side, side + 1):
            window = Size(min(side, projector.height), min(wider, projector.width))
            if steps * len(_half(window)) > photos:
                return found
            found = window
    return found


def _half(window: Size) -> list[tuple[int, int]]:
    """List one frequency (u, v) of each pair of opposite ones, without the constant."""
    height, width = window
    return [
        (u, v)
        for u, v in product(range(height), range(width))
        if (0, 0) < (u, v) <= (-u % height, -v % width)
    ]


def coarse_projections(light: Floats, coefficients: Complexes, side: int) -> Floats:
    """Return the projections of all rows onto an axis, at low resolution.

    Parameters
    ----------
    light : ndarray, shape (C,)
        Sum of each row.
    coefficients : ndarray, shape (F, C), complex
        Of 1 to F periods along the axis.
    side : int
        Projector pixels along the axis.

    Returns
    -------
    ndarray, shape (C, side)
        Never below 0.
    """
    count = np.arange(1, len(coefficients) + 1)
    # A Hann window: without it a bright pixel would ring all over the axis.
    taper = 0.5 + 0.5 * np.cos(np.pi * count / (len(count) + 1))
    waves = taper[:, None] * np.exp(2j * np.pi * np.outer(count, np.arange(side)) / side)
    sums = light[:, None] + 2 * np.real(coefficients.T @ waves)
    return np.asarray(np.maximum(sums / side, 0.0))


def _longest_field(projections: Floats) -> int:
    """Return the length of the longest reception field, of projections (n, side)."""
    lit = projections > SHARE_OF_PEAK * projections.max(axis=1, keepdims=True)
    side = lit.shape[1]
    # Projections are periodic, so a field at a border has parts at both. Twice around, the longest
    # run of dark pixels is all but the field.
    gap = longest = np.zeros(len(lit), dtype=np.int64)
    for place in range(2 * side):
        gap = np.where(lit[:, place % side], 0, gap + 1)
        longest = np.maximum(longest, gap)
    return int((side - longest).max(initial=0))


def _brightest_part(projections: Floats, length: int) -> Integers:
    """Return where the brightest part of each projection (C, side) of a length begins, (C,)."""
    sums = np.cumsum(np.pad(projections, ((0, 0), (1, 0))), axis=1)
    return np.asarray((sums[:, length:] - sums[:, :-length]).argmax(axis=1))


def fold(window: Size, total: Floats, coefficients: Complexes) -> Floats:
    """Return all rows folded onto one period.

    Parameters
    ----------
    window : Size
    total : ndarray, shape (C, channels)
        Sum of each row.
    coefficients : ndarray, shape (F, C, channels), complex
        Of `window_waves`.

    Returns
    -------
    ndarray, shape (Ms, Ns, C, channels)
        At (m, n) the sum of a row over all (y, x) with y = m mod Ms and x = n mod Ns.
    """
    spectrum = np.zeros((*window, *total.shape), dtype=np.complex128)
    spectrum[0, 0] = total
    for (u, v), coefficient in zip(_half(window), coefficients, strict=True):
        spectrum[-u % window.height, -v % window.width] = np.conj(coefficient)
        spectrum[u, v] = coefficient
    return np.asarray(np.fft.ifft2(spectrum, axes=(0, 1)).real)


def _extend(
    folded: Floats, window: Size, start: tuple[Integers, Integers], projector: Size
) -> Floats:
    """Put the period of each row where its reception field is: (channels, C, P), float32."""
    pixels, channels = folded.shape[2:]
    y, x = (begin[:, None] + np.arange(length) for begin, length in zip(start, window, strict=True))
    places = (y[:, :, None] * projector.width + x[:, None, :]).reshape(pixels, -1)
    pixel = np.arange(pixels)[:, None, None]
    rows = np.zeros((channels, pixels, projector.pixels), dtype=np.float32)
    period = folded[y[:, :, None] % window.height, x[:, None, :] % window.width, pixel]
    for channel in range(channels):
        values = period[..., channel].reshape(pixels, -1)
        np.put_along_axis(rows[channel], places, values.astype(np.float32), axis=1)
    return rows
