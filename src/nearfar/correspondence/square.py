"""The paper's square T: one row per projector pixel, the mean of the camera pixels it lights."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from nearfar.arrays import Booleans, Floats, Integers, Size
from nearfar.correspondence.result import Correspondence
from nearfar.photometry.measurements import Measurements


def onto_projector(
    parts: Sequence[Measurements], correspondence: Correspondence
) -> tuple[Measurements, Floats]:
    """Average measurements over the camera pixels of each projector pixel (section 5.1).

    Parameters
    ----------
    parts : sequence of Measurements
        Blocks of camera rows, in order.
    correspondence : Correspondence
        q of every camera pixel.

    Returns
    -------
    measurements : Measurements
        As of a camera with the projector's size; zero where no camera pixel is lit by it.
    q : ndarray, shape (Py, Px, 2), float32
        Each projector pixel's own place, NaN where no camera pixel is lit by it.
    """
    projector = parts[0].projector
    lit, place = _places(correspondence, projector)
    count = np.bincount(place, minlength=projector.pixels)
    share = (1.0 / np.maximum(count, 1)).astype(np.float32)[:, None]

    def mean(values: Sequence[Floats]) -> Floats:
        together = np.concatenate(list(values))[lit]
        total = np.zeros((projector.pixels, *together.shape[1:]), dtype=np.float32)
        np.add.at(total, place, together)
        return total * share.reshape(-1, *(1,) * (together.ndim - 1))

    def noise(name: str) -> Floats:
        # Independent noise: the mean's variance is the variances' mean over their number.
        return np.asarray(np.sqrt(mean([getattr(part, name) ** 2 for part in parts]) * share))

    measurements = replace(
        parts[0],
        camera=projector,
        responses=mean([part.responses for part in parts]),
        noise=noise("noise"),
        black=mean([part.black for part in parts]),
        white_noise=noise("white_noise"),
        black_noise=noise("black_noise"),
        light_noise=noise("light_noise"),
    )
    y, x = np.divmod(np.arange(projector.pixels), projector.width)
    q = np.stack([y, x], axis=-1).astype(np.float32)
    q[count == 0] = np.nan
    return measurements, q.reshape(*projector, 2)


def quality_on_projector(
    correspondence: Correspondence, saturated: Booleans | None, projector: Size
) -> tuple[Floats, Booleans | None]:
    """Return the quality of each row of the square T: its confidence, and whether it is saturated.

    Parameters
    ----------
    correspondence : Correspondence
    saturated : ndarray of bool, shape (Cy, Cx), optional
        Camera pixels at full scale under white.
    projector : Size

    Returns
    -------
    confidence : ndarray, shape (Py, Px), float32
        Mean over the camera pixels that a projector pixel lights; 0 where there are none.
    saturated : ndarray of bool, shape (Py, Px), optional
        Whether one of them is saturated.
    """
    lit, place = _places(correspondence, projector)
    count = np.bincount(place, minlength=projector.pixels)
    total = np.bincount(place, correspondence.confidence.ravel()[lit], minlength=projector.pixels)
    confidence = (total / np.maximum(count, 1)).astype(np.float32).reshape(projector)
    if saturated is None:
        return confidence, None
    full = np.bincount(place, saturated.ravel()[lit], minlength=projector.pixels) > 0
    return confidence, full.reshape(projector)


def _places(correspondence: Correspondence, projector: Size) -> tuple[Booleans, Integers]:
    """Return which camera pixels are lit, (C,), and the projector pixel nearest to q of those."""
    nearest = np.rint(correspondence.q).reshape(-1, 2)
    lit = np.isfinite(nearest[:, 0])
    return lit, (nearest[lit, 0] * projector.width + nearest[lit, 1]).astype(np.int64)
