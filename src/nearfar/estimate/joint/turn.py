"""Re-centring on q and back, in one pass with what comes before and after it.

A cosine and its sine are a complex number, turned by a camera pixel's phases; a frequency without a
sine changes its sign at most.

Index convention: n runs over camera pixels, r over real responses, k over frequencies: those with a
cosine and a sine come first.
"""

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Complexes, Floats, Integers
from nearfar.compiled import compiled


@compiled
def left_of_responses(
    responses: Floats,
    selected: Integers,
    far: Floats,
    centres: NDArray[np.int64],
    phases: tuple[Complexes, Complexes],
    left: Floats,
) -> None:
    """Subtract what is expected from responses, and re-centre the rest on q.

    Parameters
    ----------
    responses : ndarray, shape (C, channels, R), float32
    selected : ndarray of int, shape (n,)
        Indices of the camera pixels.
    far : ndarray, shape (n, channels, R), float32
        Expected responses to far-range light, not re-centred.
    centres : ndarray of int, shape (n, 2)
        q rounded.
    phases : tuple of ndarray, shapes (Py, K) and (Px, K), complex64
        exp(j 2 pi k y) and exp(j 2 pi k x).
    left : ndarray, shape (n, channels, R), float32
        Expected responses to near-range light, re-centred; overwritten by what is left.
    """
    down, across = phases
    count, number = responses.shape[2], down.shape[1]
    pairs = count - number
    for n in range(len(selected)):
        of_y, of_x = down[centres[n, 0]], across[centres[n, 1]]
        for channel in range(responses.shape[1]):
            measured, expected = responses[selected[n], channel], far[n, channel]
            found = left[n, channel]
            for k in range(pairs):
                c = of_y[k].real * of_x[k].real - of_y[k].imag * of_x[k].imag
                s = of_y[k].real * of_x[k].imag + of_y[k].imag * of_x[k].real
                cosine = measured[2 * k] - expected[2 * k]
                sine = measured[2 * k + 1] - expected[2 * k + 1]
                found[2 * k] = (cosine * c + sine * s) - found[2 * k]
                found[2 * k + 1] = (sine * c - cosine * s) - found[2 * k + 1]
            for k in range(pairs, number):
                sign = of_y[k].real * of_x[k].real
                r = pairs + k
                found[r] = (measured[r] - expected[r]) * sign - found[r]


@compiled
def put_ones(
    centres: NDArray[np.int64], phases: tuple[Complexes, Complexes], found: Floats
) -> None:
    """Write re-centred responses that are all 1 into the first of an array's second axis.

    Parameters
    ----------
    centres : ndarray of int, shape (n, 2)
    phases : tuple of ndarray
        As in `left_of_responses`.
    found : ndarray, shape (n, G, R), float32
    """
    down, across = phases
    number = down.shape[1]
    pairs = found.shape[2] - number
    for n in range(len(centres)):
        of_y, of_x, ones = down[centres[n, 0]], across[centres[n, 1]], found[n, 0]
        for k in range(pairs):
            c = of_y[k].real * of_x[k].real - of_y[k].imag * of_x[k].imag
            s = of_y[k].real * of_x[k].imag + of_y[k].imag * of_x[k].real
            ones[2 * k], ones[2 * k + 1] = c + s, c - s
        for k in range(pairs, number):
            ones[pairs + k] = of_y[k].real * of_x[k].real


@compiled
def put_sums(
    expected_near: Floats,
    expected_far: Floats,
    near: Floats,
    far: Floats,
    places: Integers,
    selected: Integers,
    centres: NDArray[np.int64],
    phases: tuple[Complexes, Complexes],
    all_near: Floats,
    all_far: Floats,
) -> None:
    """Put the sums of what was expected and what is found into the rows of all camera pixels.

    Parameters
    ----------
    expected_near, expected_far : ndarray, shapes (N, channels, J) and (N, channels, R), float32
        Of the camera pixels of a sweep.
    near, far : ndarray, shapes (n, channels, J) and (n, channels, R), float32
        What is found; f re-centred.
    places, selected : ndarray of int, shape (n,)
        Their indices among those of the sweep, and among all.
    centres : ndarray of int, shape (n, 2)
    phases : tuple of ndarray
        As in `left_of_responses`.
    all_near, all_far : ndarray, shapes (C, channels, J) and (C, channels, R), float32
        Overwritten at the selected ones.
    """
    down, across = phases
    count, number = far.shape[2], down.shape[1]
    pairs = count - number
    for n in range(len(selected)):
        of_y, of_x = down[centres[n, 0]], across[centres[n, 1]]
        for channel in range(far.shape[1]):
            before, more = expected_near[places[n], channel], near[n, channel]
            total = all_near[selected[n], channel]
            for j in range(len(total)):
                total[j] = before[j] + more[j]
            before, more = expected_far[places[n], channel], far[n, channel]
            total = all_far[selected[n], channel]
            for k in range(pairs):
                c = of_y[k].real * of_x[k].real - of_y[k].imag * of_x[k].imag
                s = of_y[k].real * of_x[k].imag + of_y[k].imag * of_x[k].real
                total[2 * k] = before[2 * k] + (more[2 * k] * c - more[2 * k + 1] * s)
                total[2 * k + 1] = before[2 * k + 1] + (more[2 * k + 1] * c + more[2 * k] * s)
            for k in range(pairs, number):
                r = pairs + k
                total[r] = before[r] + more[r] * (of_y[k].real * of_x[k].real)
