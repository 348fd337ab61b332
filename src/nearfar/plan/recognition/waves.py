"""Sinusoids: frequency, phase, mean and amplitude of the fringes that a picture shows.

Index convention: s runs over samples of a picture; frequencies are (fy, fx) in cycles per pixel.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Floats
from nearfar.plan.recognition.contents import Fringes

# A sinusoid of 8 bits is off by 0.0011 of full scale in the root mean square.
LARGEST_MISFIT = 0.003
# The same where values are a power of a sinusoid.
LARGEST_MISFIT_OF_POWER = 0.006
LEAST_AMPLITUDE = 0.02
# Rows and columns by which a frequency is found before the whole picture refines it.
FIRST_SIDE = 256
SAMPLES = 4096
STEPS = 12
# Powers that are tried where values are no sinusoid's: of a projector of gamma 2.2, or corrected
# for one of 1.2 to 3.
EXPONENTS = np.geomspace(1 / 3.2, 3.2, 33)
# A power of a sinusoid has at least this share of its variance at its fundamental.
LEAST_FUNDAMENTAL = 0.5
# A number of cycles on the picture this close to a whole one is rounded, if that fits as well.
WHOLE_CYCLES = 0.05
# Cycles on the picture about those of the highest peak that are tried, and the step between.
CYCLES_AROUND = 1.0
CYCLES_STEP = 0.1
# Misfits that differ by less are as good as each other.
AS_GOOD = 1.02


class _Wave(NamedTuple):
    """A sinusoid mean + cosine cos(2 pi k.p) + sine sin(2 pi k.p), and its misfit."""

    frequency: NDArray[np.float64]  # (2,)
    coefficients: NDArray[np.float64]  # mean, cosine, sine
    misfit: float  # root mean square


def find_fringes(picture: Floats) -> Fringes | None:
    """Return the sinusoid that a picture shows, or None if it shows none.

    Parameters
    ----------
    picture : ndarray, shape (Py, Px)
        Values from 0 to 1.

    Returns
    -------
    Fringes or None
        Where the picture's values raised to a power are a sinusoid, `Fringes.exponent` is this
        power.
    """
    values = picture.astype(np.float64)
    start = _first_frequency(values)
    if start is None:
        return None
    places, samples = _samples(values)
    wave = _refined(places, samples, start)
    if wave.misfit <= LARGEST_MISFIT:
        return _as_fringes(_with_whole_cycles(wave, places, samples, values.shape), 1.0)
    if wave.misfit**2 > (1 - LEAST_FUNDAMENTAL) * samples.var():
        return None
    # At the fundamental's frequency, any power has the same crests.
    misfits = [_fit(places, samples**power, start).misfit for power in EXPONENTS]
    best = int(np.argmin(misfits))
    around = EXPONENTS[max(best - 1, 0)], EXPONENTS[min(best + 1, len(EXPONENTS) - 1)]
    waves = {power: _refined(places, samples**power, start) for power in np.geomspace(*around, 41)}
    power = min(waves, key=lambda each: _misfit_in_file(waves[each], places, samples, each))
    if _misfit_in_file(waves[power], places, samples, power) <= LARGEST_MISFIT_OF_POWER:
        wave = _with_whole_cycles(waves[power], places, samples**power, values.shape)
        return _as_fringes(wave, float(power))
    return None


class Samples(NamedTuple):
    """Values of a picture at some places.

    Attributes
    ----------
    shape : tuple of int
        Of the picture.
    places : ndarray, shape (s, 2)
    values : ndarray, shape (s,)
    start : ndarray, shape (2,)
        The frequency with the highest peak.
    """

    shape: tuple[int, ...]
    places: NDArray[np.float64]
    values: NDArray[np.float64]
    start: NDArray[np.float64]


def take_samples(picture: Floats) -> Samples | None:
    """Return the values by which `find_raised_fringes` knows a picture, or None if it is flat."""
    values = picture.astype(np.float64)
    start = _first_frequency(values)
    return None if start is None else Samples(values.shape, *_samples(values), start)


def find_raised_fringes(samples: Samples, exponent: float) -> Fringes | None:
    """Return the sinusoid that values raised to a known power are, or None if they are none.

    The power that many cycles tell serves pictures of one or two, which do not tell it themselves.
    """
    places, values, size = samples.places, samples.values, np.array(samples.shape)
    raised = values**exponent
    # Of few cycles the peak is shifted, and it is that of the values before.
    around = [
        samples.start + step * (samples.start != 0) / size
        for step in np.arange(-CYCLES_AROUND, CYCLES_AROUND + 0.01, CYCLES_STEP)
    ]
    tried = [_fit(places, raised, each) for each in around if (each != 0).any()]
    if not tried:
        return None
    start = min(tried, key=lambda each: each.misfit).frequency
    wave = _refined(places, raised, start)
    if _misfit_in_file(wave, places, values, exponent) > LARGEST_MISFIT_OF_POWER:
        return None
    return _as_fringes(_with_whole_cycles(wave, places, raised, samples.shape), exponent)


def _misfit_in_file(
    wave: _Wave,
    places: NDArray[np.float64],
    samples: NDArray[np.float64],
    power: float,
) -> float:
    """Return the misfit of a wave in the values of the file, whose rounding errors are equal."""
    angle = 2 * np.pi * (places @ wave.frequency)
    mean, cosine, sine = wave.coefficients
    values = np.maximum(mean + cosine * np.cos(angle) + sine * np.sin(angle), 0.0)
    return float(np.sqrt(np.mean((values ** (1 / power) - samples) ** 2)))


def _with_whole_cycles(
    wave: _Wave,
    places: NDArray[np.float64],
    samples: NDArray[np.float64],
    shape: tuple[int, ...],
) -> _Wave:
    """Round numbers of cycles on the picture that are nearly whole, where that fits as well."""
    for axis, side in enumerate(shape):
        cycles = wave.frequency[axis] * side
        if abs(cycles - round(cycles)) > WHOLE_CYCLES:
            continue
        frequency = wave.frequency.copy()
        frequency[axis] = round(cycles) / side
        rounded = _fit(places, samples, frequency)
        if rounded.misfit <= AS_GOOD * wave.misfit:
            wave = rounded
    return wave


def _first_frequency(values: NDArray[np.float64]) -> NDArray[np.float64] | None:
    """Return the frequency with the highest peak in a corner of the picture, or None if flat."""
    height, width = (min(side, FIRST_SIDE) for side in values.shape)
    is_of_columns, is_of_rows = (values == values[:1]).all(), (values == values[:, :1]).all()
    # A picture of one axis is known along all of it.
    if is_of_columns:
        corner = values[:1]
    elif is_of_rows:
        corner = values[:, :1]
    else:
        corner = values[:height, :width]
    padded = tuple(4 * side if side > 1 else 1 for side in corner.shape)
    window = np.outer(*(np.hanning(side + 2)[1:-1] for side in corner.shape))
    weighed = window * (corner - (window * corner).sum() / window.sum())
    spectrum = np.abs(np.fft.fft2(weighed, padded))
    if spectrum.max() <= 1e-9 * corner.size:
        return None
    y, x = np.unravel_index(int(spectrum.argmax()), spectrum.shape)
    return np.array([np.fft.fftfreq(padded[0])[y], np.fft.fftfreq(padded[1])[x]])


def _samples(values: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return places (s, 2), and the values there: half in the corner, half all over."""
    height, width = values.shape
    if values.size <= SAMPLES:
        every = np.argwhere(np.ones_like(values, dtype=bool))
        return np.tile(every, (2, 1)).astype(np.float64), np.tile(values.ravel(), 2)
    random = np.random.default_rng(0)
    corner = [min(height, FIRST_SIDE), min(width, FIRST_SIDE)]
    places = np.concatenate(
        [
            random.integers(0, corner, size=(SAMPLES // 2, 2)),
            random.integers(0, [height, width], size=(SAMPLES // 2, 2)),
        ]
    )
    return places.astype(np.float64), values[places[:, 0], places[:, 1]]


def _fit(
    places: NDArray[np.float64], samples: NDArray[np.float64], frequency: NDArray[np.float64]
) -> _Wave:
    """Fit mean, cosine and sine at a frequency."""
    angle = 2 * np.pi * (places @ frequency)
    design = np.stack([np.ones_like(angle), np.cos(angle), np.sin(angle)], axis=1)
    coefficients, *_ = np.linalg.lstsq(design, samples, rcond=None)
    misfit = float(np.sqrt(np.mean((samples - design @ coefficients) ** 2)))
    return _Wave(frequency, coefficients, misfit)


def _refined(
    places: NDArray[np.float64], samples: NDArray[np.float64], start: NDArray[np.float64]
) -> _Wave:
    """Refine a frequency by Gauss-Newton steps: in the corner first, then over all."""
    wave = _fit(places, samples, start)
    for selected in (slice(0, len(places) // 2), slice(None)):
        mine, values = places[selected], samples[selected]
        wave = _fit(mine, values, wave.frequency)
        for _ in range(STEPS):
            angle = 2 * np.pi * (mine @ wave.frequency)
            _, cosine, sine = wave.coefficients
            slope = 2 * np.pi * (sine * np.cos(angle) - cosine * np.sin(angle))
            along = slope[:, None] * mine
            # An axis along which nothing changes keeps its 0.
            along = along[:, moved := wave.frequency != 0]
            design = np.column_stack([np.ones_like(angle), np.cos(angle), np.sin(angle), along])
            fitted, *_ = np.linalg.lstsq(design, values, rcond=None)
            step = np.zeros(2)
            step[moved] = fitted[3:]
            tried = _fit(mine, values, wave.frequency + step)
            if tried.misfit >= wave.misfit * (1 - 1e-9):
                break
            wave = tried
    return _fit(places, samples, wave.frequency)


def _as_fringes(wave: _Wave, exponent: float) -> Fringes | None:
    mean, cosine, sine = wave.coefficients
    amplitude = float(np.hypot(cosine, sine))
    if amplitude < LEAST_AMPLITUDE:
        return None
    frequency = np.round(wave.frequency, 9) + 0.0
    phase = np.arctan2(-sine, cosine) / (2 * np.pi)
    if frequency[0] < 0 or (frequency[0] == 0 and frequency[1] < 0):
        frequency, phase = -frequency, -phase
    # Just under one cycle is none.
    phase = round(float(phase % 1.0), 6) % 1.0
    return Fringes(
        fy=float(frequency[0]),
        fx=float(frequency[1]),
        phase=phase,
        mean=round(float(mean), 6),
        amplitude=round(amplitude, 6),
        exponent=round(exponent, 4),
    )
