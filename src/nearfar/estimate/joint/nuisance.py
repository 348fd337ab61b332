"""The few numbers of a camera pixel that stand out of all expectation, by least squares.

They are the references' error o, the same in every answer, the direct light d, by how much q is
off, times d, down and across, and at depth edges direct light of a second surface, d2, d3 ...
With K the covariance of all else, y = rest + sum_g x_g a_g for their answers a_g. Given K^-1 they
are a small least squares with what is known of them beforehand: the references' noise, that direct
light is about as bright as white at most, and that q was found well.

Index convention: arrays are (n, channels, ...); g and h run over the numbers, r over answers.
"""

import numpy as np

from nearfar.arrays import Floats
from nearfar.estimate.joint.pixels import Pixels

# Deviation of direct light expected beforehand, as a share of white: no opinion.
UNKNOWN = 4.0
# Deviation of q, in projector pixels, times direct light as a share of white. Under a random light
# of cornell-aside at 58, 234 and 468 photos 0.015 gives 45.3, 48.3 and 49.3 dB, 0.008 45.1, 49.2
# and 50.5, none 44.5, 48.5 and 50.1: where no kind fits well, q must not move to make up for it.
OFF = 0.008
# All numbers but those of second surfaces.
KEPT = 4
# References that cannot err still need a number.
LEAST = 1e-12


def columns(pixels: Pixels) -> Floats:
    """Answers a_g of unit o, d, shifts, d2 ..., shape (n, R, G)."""
    two = np.stack([pixels.of_offset, pixels.of_direct], axis=-1)
    return np.concatenate([two, pixels.of_shift, pixels.of_second], axis=-1)


def precision(pixels: Pixels) -> Floats:
    """Precision of o, d, shifts, d2 ... before any answer, shape (n, channels, G), float64."""
    known = precision_of(pixels.white, pixels.offset_noise)
    return np.concatenate([known, np.repeat(known[..., 1:2], pixels.extra, axis=-1)], axis=-1)


def precision_of(white: Floats, offset_noise: Floats) -> Floats:
    """Precision of o, d and shifts, for arrays (n, channels) as in `Pixels`."""
    white = white.astype(np.float64)
    offset = 1.0 / np.maximum(offset_noise, LEAST * white) ** 2
    direct = 1.0 / (UNKNOWN * white) ** 2
    shift = 1.0 / (OFF * white) ** 2
    return np.stack([offset, direct, shift, shift], axis=-1)


def solve(normal: Floats, right: Floats, known: Floats) -> Floats:
    """Solve (normal + diag(known)) x = right, float64.

    Parameters
    ----------
    normal : ndarray, shape (n, channels, G, G)
    right, known : ndarray, shape (n, channels, G)
    """
    matrix = normal + known[..., None] * np.eye(known.shape[-1])
    return np.asarray(np.linalg.solve(matrix, right[..., None])[..., 0])
