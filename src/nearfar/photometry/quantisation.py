"""What 8-bit patterns get wrong: the part that the measured frequencies tell, and the rest.

A pattern on the projector is a cosine or sine rounded to 256 levels. The light that a camera pixel
receives at the measured frequencies answers to the rounding as well, and as that light is measured,
so is this answer: it is taken off the responses.

Index convention: r runs over real responses, p over projector pixels.
"""

from functools import lru_cache

import numpy as np
from scipy.sparse import csr_array

from nearfar.arrays import Floats, blocks
from nearfar.illumination import patterns
from nearfar.illumination.frequencies import is_on_grid
from nearfar.illumination.real_basis import MOST_HELD, RealBasis
from nearfar.parallel import side_by_side, single_threaded_products

# Smaller answers are rounding. A rounded wave holds multiples of its own frequency alone, so that
# all but 2 to 4 % of the answers are.
LEAST_ANSWER = 1e-6
# Camera pixels, each channel apart, whose answers are taken off at once.
ROWS_AT_ONCE = 2**12


def quantisation_error(basis: RealBasis) -> Floats:
    """Return each 8-bit cosine and sine, 2 l / 255 - 1, less the ideal one, shape (R, P).

    Without projector pixels, (R, 0), where there are so many of them that footprints of direct
    light average the error.
    """
    if basis.count * basis.projector.pixels > MOST_HELD:
        return np.empty((basis.count, 0), dtype=np.float32)
    ideal = basis.patterns
    error = np.empty_like(ideal)
    for r, (i, sine) in enumerate(zip(basis.index, basis.is_sine, strict=True)):
        draw = patterns.sine if sine else patterns.cosine
        drawn = patterns.quantise(draw(basis.frequencies[i], basis.projector)).ravel()
        error[r] = drawn.astype(np.float32) * np.float32(2 / 255) - 1 - ideal[r]
    return error


def without_quantisation(basis: RealBasis, responses: Floats) -> tuple[Floats, Floats]:
    """Take off responses what light at the measured frequencies answers to quantisation errors.

    To first order: the light is taken from the responses as they were measured, whose own
    quantisation errors change the answer by some thousandths of it.

    Parameters
    ----------
    basis : RealBasis
    responses : ndarray, shape (C, channels, R), float32

    Returns
    -------
    responses : ndarray, shape (C, channels, R), float32
        The same where errors are not held.
    error : ndarray, shape (R, P or 0), float32
        What is left of `quantisation_error`: the part at frequencies that were not measured.
    """
    error = quantisation_error(basis)
    if not error.shape[1]:
        return responses, error
    answers, flat = _answers(basis), responses.reshape(-1, basis.count)
    found = np.empty_like(flat)

    def work(block: slice) -> None:
        found[block] = flat[block] - (answers @ flat[block].T).T

    side_by_side(work, blocks(len(flat), ROWS_AT_ONCE))
    return found.reshape(responses.shape), error - answers @ basis.patterns


# Tiles of camera rows share it.
@lru_cache(maxsize=2)
def _answers(basis: RealBasis) -> csr_array:
    """Return the answer to each error of a row of F whose one coefficient is 1, shape (R, R).

    Frequencies off the DFT grid have none: their waves are not orthogonal to the others.
    """
    # The last bits of a product change with its threads, and those of responses must not.
    with single_threaded_products():
        found = basis.analyse(quantisation_error(basis)).astype(np.float32)
    on_grid = np.array([is_on_grid(k, basis.projector) for k in basis.frequencies])[basis.index]
    found[:, ~on_grid] = 0.0
    found[np.abs(found) < LEAST_ANSWER] = 0.0
    return csr_array(found)
