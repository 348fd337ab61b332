"""Values of camera pixels as those around tell them: by planes, or by planes and a guide.

Index convention: c runs over the camera pixels that are told, t over the terms of a fit.
"""

from typing import NamedTuple

import numpy as np

from nearfar.arrays import Booleans, Floats, Integers
from nearfar.estimate.physical.around import steps

# Camera pixels on each side that a fit goes through.
REACH = 2
# Weight of a plane's squared slope for each camera pixel that it is fitted to: at outlines, camera
# pixels on one side alone tell little of a slope.
LEVEL = 0.5
# Of a guide, as a share of its root mean square: differences as small as this tell little.
TELLING_OF_GUIDE = 0.01
TINY = float(np.finfo(np.float64).tiny)


class LocalFit(NamedTuple):
    """What the camera pixels around tell of each one's values.

    Attributes
    ----------
    value : ndarray, shape (c, channels)
        At the camera pixel.
    left : ndarray, shape (c,)
        Sum of the squared distances of the others from the fit, mean over channels.
    number : ndarray, shape (c,)
        How many others there are.
    """

    value: Floats
    left: Floats
    number: Floats


def planes_about(values: Floats, seen: Booleans, pixels: Integers) -> LocalFit:
    """Fit planes to the values around camera pixels.

    Parameters
    ----------
    values : ndarray, shape (Cy, Cx, channels)
    seen : ndarray of bool, shape (Cy, Cx)
        Camera pixels that planes are fitted to.
    pixels : ndarray of int, shape (c,)
        Those that are told, flattened row by row. A camera pixel's own values do not count.

    Returns
    -------
    LocalFit
    """
    return _fitted(values, seen, pixels, None)


def guided_about(values: Floats, guide: Floats, seen: Booleans, pixels: Integers) -> LocalFit:
    """Fit planes and a multiple of a guide to the values around camera pixels.

    Where values go with the guide, as those of a texture do, this keeps all of its edges: a guided
    filter (He, Sun and Tang, Guided Image Filtering, 2013), with slopes.

    Parameters
    ----------
    values : ndarray, shape (Cy, Cx, channels)
    guide : ndarray, shape (Cy, Cx)
    seen, pixels : ndarray
        As for `planes_about`.

    Returns
    -------
    LocalFit
    """
    return _fitted(values, seen, pixels, guide)


def share_of_noise(fit: LocalFit, apart: Floats, noise: Floats, least_number: int) -> Floats:
    """Return how much of what camera pixels deviate by from a fit is noise, shape (c,), 0 to 1.

    Parameters
    ----------
    fit : LocalFit
    apart : ndarray, shape (c, channels)
        The camera pixels' own values less those of the fit.
    noise : ndarray, shape (c,)
        Variance of the noise, mean over channels.
    least_number : int
        Others that tell anything, at least.
    """
    scatter = (fit.left + (apart**2).mean(axis=1)) / (fit.number + 1)
    share = np.minimum(noise / np.maximum(scatter, TINY), 1.0)
    return np.asarray(share * (fit.number >= least_number))


def _fitted(values: Floats, seen: Booleans, pixels: Integers, guide: Floats | None) -> LocalFit:
    channels, width = values.shape[2], seen.shape[1] + 2 * REACH
    border = (REACH, REACH)
    of_all = np.pad(np.where(seen[..., None], values, 0.0), (border, border, (0, 0)))
    of_all, telling = of_all.reshape(-1, channels), np.pad(seen, REACH).ravel()
    guides = None if guide is None else np.pad(np.where(seen, guide, 0.0), REACH).ravel()
    y, x = np.divmod(pixels, seen.shape[1])
    own = (y + REACH) * width + x + REACH
    terms = np.ones((len(pixels), 3 if guides is None else 4))
    normal = np.zeros((len(pixels), terms.shape[1], terms.shape[1]))
    right = np.zeros((len(pixels), terms.shape[1], channels))
    squares, of_guide = np.zeros((len(pixels), channels)), np.zeros(len(pixels))
    for down, across in steps(REACH):
        other = own + down * width + across
        terms[:, 1:3] = down, across
        if guides is not None:
            terms[:, 3] = guides[other] - guides[own]
            of_guide += guides[other] ** 2
        counted = telling[other, None] * terms
        normal += counted[:, :, None] * terms[:, None]
        right += terms[:, :, None] * of_all[other, None]
        squares += of_all[other] ** 2
    number = normal[:, 0, 0].copy()
    # Where there are no others, or the guide is dark, terms of 0 solve the equations.
    held = np.repeat((number == 0).astype(np.float64)[:, None], terms.shape[1], axis=1)
    held[:, 1:3] += LEVEL * number[:, None]
    if guides is not None:
        held[:, 3] += TELLING_OF_GUIDE**2 * of_guide + (of_guide == 0)
    fit = np.linalg.solve(normal + held[:, :, None] * np.eye(terms.shape[1]), right)
    left = squares - (fit * (2 * right - normal @ fit)).sum(axis=1)
    return LocalFit(fit[:, 0], np.maximum(left, 0.0).mean(axis=1), number)
