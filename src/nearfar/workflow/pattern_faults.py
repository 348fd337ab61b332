"""What looks wrong with photos of anybody's patterns: sums of pairs, and the way that q runs."""

from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.ndimage import uniform_filter

from nearfar.arrays import Floats, blocks
from nearfar.capture import Capture
from nearfar.plan.recognition.contents import Uniform
from nearfar.plan.recognition.own import recognised_in
from nearfar.transport.verdict import Reason

# Values of photos that are held at once.
VALUES_AT_ONCE = 1 << 23
# Camera pixels with less than this share of the brightest ones' light are not judged.
LEAST_LIGHT = 0.1
BRIGHTEST_PERCENTILE = 99.0
# Share of a camera pixel's light that is no longer noise, and share of the camera pixels above
# which it is a fault of the capture.
FAULT_SHARE_OF_LIGHT = 0.05
FAULT_SHARE_OF_PIXELS = 0.04
# Noise differs from pixel to pixel, faults less so: means over squares of so many camera pixels are
# judged, where they keep this share of the deviation.
SIDE = 5
LEAST_KEPT_SHARE = 0.4
# Camera pixels with q that tell which way it runs.
FEWEST_PIXELS = 16


class SumMisfit(NamedTuple):
    """How far photos that sum to one white are off.

    Attributes
    ----------
    share : float
        Share of the lit camera pixels where they are off by more than `FAULT_SHARE_OF_LIGHT`.
    typical : float
        By how much they are off there, as a share of the light; the median, 0 where none are.
    """

    share: float
    typical: float

    def warning(self, path: Path) -> list[str]:
        """Return a sentence if that is a fault."""
        if self.share <= FAULT_SHARE_OF_PIXELS:
            return []
        return [
            f"photos of {path} do not sum to one white at {self.share:.0%} of the camera pixels, "
            f"by {self.typical:.0%} of their light: projector or camera is not linear, the light "
            f"changed, something moved, or photos are not of their patterns."
        ]


def mean_around(pictures: Floats) -> Floats:
    """Return the mean around each camera pixel of pictures (..., Cy, Cx)."""
    size = (*(1 for _ in pictures.shape[:-2]), SIDE, SIDE)
    return np.asarray(uniform_filter(pictures, size, mode="nearest"))


def deviation(residuals: Floats, degrees: int) -> Floats:
    """Return the root mean square of what residuals share with their neighbours, (Cy, Cx).

    Parameters
    ----------
    residuals : ndarray, shape (n, Cy, Cx)
    degrees : int
        Their degrees of freedom.

    Returns
    -------
    ndarray, shape (Cy, Cx)
        0 where residuals are not of one sign with their neighbours', as of noise.
    """
    shared = (mean_around(residuals) ** 2).sum(axis=0) / degrees
    whole = mean_around((residuals**2).sum(axis=0) / degrees)
    return np.sqrt(np.where(shared > LEAST_KEPT_SHARE**2 * whole, shared, 0.0))


def misfit_of(off: Floats, light: Floats) -> SumMisfit:
    """Judge by how much camera pixels are off, both (Cy, Cx) with channels together."""
    is_lit = light > LEAST_LIGHT * np.percentile(light, BRIGHTEST_PERCENTILE)
    if not is_lit.any():
        return SumMisfit(0.0, 0.0)
    share = off[is_lit] / light[is_lit]
    wrong = share > FAULT_SHARE_OF_LIGHT
    return SumMisfit(float(wrong.mean()), float(np.median(share[wrong])) if wrong.any() else 0.0)


def measure_sums(capture: Capture) -> SumMisfit | None:
    """Compare the sums of patterns and their inverses, which are white + black each.

    Parameters
    ----------
    capture : Capture
        Of somebody's patterns.

    Returns
    -------
    SumMisfit or None
        None if there are fewer than two pairs.
    """
    recognised = recognised_in(capture.plan)
    pairs = [(i, j) for j, i in enumerate(recognised.inverse_of) if i is not None]
    if len(pairs) < 2:
        return None
    uniform = [isinstance(recognised.contents[i], Uniform) for i, _ in pairs]
    numbers = np.array(pairs)
    off, light = [], []
    row = 2 * len(pairs) * capture.camera.width * capture.channels
    for rows in blocks(capture.camera.height, max(1, VALUES_AT_ONCE // row)):
        first, second = (capture.read(numbers[:, i], rows).sum(axis=-1) for i in (0, 1))
        sums = first + second
        white = sums[uniform] if any(uniform) else sums
        reference = white.mean(axis=0)
        darkest = np.minimum(first, second).min(axis=0)
        off.append(deviation(sums - reference, len(pairs) - 1))
        light.append(np.maximum(reference - 2 * darkest, 0.0))
    return misfit_of(np.concatenate(off), np.concatenate(light))


def sums_of_pairs(capture: Capture) -> list[Reason]:
    """Return a fault if photos of patterns and their inverses do not sum to one white photo."""
    sums = measure_sums(capture)
    return [] if sums is None else [Reason("unknown", each) for each in sums.warning(capture.path)]


def find_pattern_faults(capture: Capture, q: Floats) -> list[str]:
    """Return a sentence for each thing that looks wrong, of somebody's patterns and their q.

    Parameters
    ----------
    capture : Capture
    q : ndarray, shape (Cy, Cx, 2)
    """
    return [*(fault.sentence for fault in sums_of_pairs(capture)), *find_turns(q)]


def find_turns(q: Floats) -> list[str]:
    """Return a sentence if q, (Cy, Cx, 2), runs otherwise than the camera's rows and columns."""
    return _say_directions(_slopes(q))


def _say_directions(slopes: Floats) -> list[str]:
    """Say where q runs otherwise than the camera's rows and columns."""
    (down, down_across), (across_down, across) = np.abs(slopes)
    if down_across > down and across_down > across:
        return [
            "q's rows run along the camera's columns: the photos of rows and of columns are "
            "swapped, unless projector or camera is turned by 90 degrees; look at the picture of q."
        ]
    against = [name for i, name in enumerate(("rows", "columns")) if slopes[i, i] < 0]
    if not against:
        return []
    how = "stand upside down" if against[0] == "rows" else "are mirrored"
    if len(against) == 2:
        how = "are turned by 180 degrees"
    return [
        f"q runs against the camera's {' and '.join(against)}: the patterns {how} against the "
        f"photos, unless projector or camera does, or a mirror is between; look at the picture "
        f"of q."
    ]


def _slopes(q: Floats) -> Floats:
    """Return the median change of q's rows and columns along the camera's, (2, 2); 0 if unknown."""
    found = np.zeros((2, 2))
    for axis in (0, 1):
        for along in (0, 1):
            step = max(1, q.shape[along] // 8)
            moved = np.moveaxis(q[..., axis], along, 0)
            change = moved[step:] - moved[:-step]
            change = change[np.isfinite(change)]
            if change.size >= FEWEST_PIXELS:
                found[axis, along] = np.median(change) / step
    return found
