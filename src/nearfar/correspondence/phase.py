"""Correspondence from the photos of transport themselves, without photos of its own.

Direct light is a peak of a row t, so its responses to all frequencies have the phases of one place.
Far-range light responds to low frequencies alone, and near-range light mostly to those. So each
response is divided by the variance of all else in it (noise, far- and near-range light), and the
inverse transform of the result scores every place of the pattern grid: a whitened matched filter.
It is used with several backgrounds. A weak one finds the place, since every response helps to tell
one place from another. Stronger ones measure the footprint, the 5 x 5 entries of t around it, and
tell direct light from concentrated near-range light, as in a crease. Where neighbours expect other
places, these are tried instead (`nearfar.correspondence.sidelobes`).

The inverse transform is computed as matrix products, first along rows and then down, so that
frequencies may lie off the DFT grid. On projectors too large for that, and where few frequencies
are high, places are searched for from coarse to fine (`nearfar.correspondence.coarse_to_fine`).

Index convention: c runs over camera pixels, r over real responses, k over frequencies, g over
frequencies of one fy.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Floats, Integers, blocks
from nearfar.correspondence.ambiguity import require_settled
from nearfar.correspondence.background import (
    DETECTION_BACKGROUND,
    FOOTPRINT_BACKGROUND,
    SEARCH_BACKGROUND,
)
from nearfar.correspondence.coarse_to_fine import (
    LEAST_LARGE_EXCESS,
    correspond_coarse_to_fine,
    rows_beside,
)
from nearfar.correspondence.entries import entries_about, places_among
from nearfar.correspondence.methods import CorrespondenceMethod
from nearfar.correspondence.neighbours import REACH
from nearfar.correspondence.orientation import is_mirrored
from nearfar.correspondence.result import Correspondence
from nearfar.correspondence.sidelobes import replace_sidelobes
from nearfar.correspondence.size import is_coarse_to_fine
from nearfar.correspondence.weighing import (
    Weighed,
    division_by_white,
    weigh,
    without_dc,
)
from nearfar.illumination.frequencies import DC, representatives
from nearfar.illumination.real_basis import RealBasis
from nearfar.parallel import side_by_side
from nearfar.photometry.measurements import Measurements
from nearfar.photometry.photos import Photos
from nearfar.plan import Plan
from nearfar.plan.patterns import Sinusoid

# Values of the score that are in memory at once.
SCORES_AT_ONCE = 2**22
# Camera pixels at once.
PIXELS_AT_ONCE = 1024
# Least root mean square over the responses of what direct light explains, in deviations of the
# background, for it to be seen. It lies between the 98th percentile of unlit and the 0.05th of lit
# camera pixels of a Cornell box seen from aside, by plans of 79 to 340 photos
# (benchmarks/correspondence.py).
LEAST_EXCESS = 2.25
# Factor on that where q is mirrored, as by light by way of another surface. This value makes the
# fewest errors, lit and unlit together, on the same box.
MIRRORED_FACTOR = 1.35


def correspond_by_phase(measurements: Measurements, *, pitch: int) -> Correspondence:
    """Find q(c) from the responses to the sinusoids.

    Parameters
    ----------
    measurements : Measurements
        Of DC and of any frequencies that determine a place.
    pitch : int
        Projector pixels between the window's functions, as the plan has it: at a pitch over 1 few
        frequencies are high, and places are searched for from coarse to fine.

    Returns
    -------
    Correspondence
        q is the centroid of the direct light within a pixel or so of it: where one camera pixel
        sees two surfaces, that of the stronger. NaN where no direct light stands above near-range
        light; where q is mirrored it must stand further above. Confidence is 1/2 at this
        threshold.

    Raises
    ------
    InputError
        If there is no response to DC, or if the frequencies leave several places alike.
    """
    basis = without_dc(measurements)
    require_settled(basis, pitch)
    if is_coarse_to_fine(basis.projector, pitch):
        least = LEAST_LARGE_EXCESS
        q, excess = correspond_coarse_to_fine(measurements, basis)
    else:
        least = LEAST_EXCESS
        q, excess = _correspond_at_every_place(measurements, basis)
    q[excess <= least] = np.nan
    ratio = excess / np.where(is_mirrored(q), MIRRORED_FACTOR * least, least)
    q[ratio <= 1] = np.nan
    power = ratio**4
    return Correspondence(q, (power / (1 + power)).astype(np.float32))


def _correspond_at_every_place(
    measurements: Measurements, basis: RealBasis
) -> tuple[Floats, Floats]:
    """Return q, (Cy, Cx, 2), and how far direct light stands above the background, (Cy, Cx)."""
    camera = measurements.camera
    division = division_by_white(measurements, basis)
    q = np.empty((camera.pixels, 2), dtype=np.float32)
    excess = np.empty(camera.pixels, dtype=np.float32)
    waves = _waves(basis)

    def place(pixels: slice | Integers, around: NDArray[np.float64] | None = None) -> None:
        relative = division.of_pixels(pixels)
        if around is None:
            around = _search(basis, waves, weigh(basis, relative, SEARCH_BACKGROUND))
        seen = entries_about(basis, weigh(basis, relative, FOOTPRINT_BACKGROUND), around)
        q[pixels] = np.clip(places_among(seen, around), 0, np.array(basis.projector) - 1)
        detected = entries_about(basis, weigh(basis, relative, DETECTION_BACKGROUND), around)
        excess[pixels] = detected.excess

    side_by_side(place, blocks(camera.pixels, PIXELS_AT_ONCE))
    lit = (excess > LEAST_EXCESS).reshape(camera)
    pixels, places = replace_sidelobes(division, q.reshape(*camera, 2), lit)
    for block in blocks(len(pixels), PIXELS_AT_ONCE):
        place(pixels[block], places[block])
    return q.reshape(*camera, 2), excess.reshape(camera)


class _Group(NamedTuple):
    """Frequencies of one fy.

    Attributes
    ----------
    cosines, sines : ndarray of int
        Places of their responses; a frequency that is its own negative has no sine.
    along : ndarray, shape (len(cosines) + len(sines), 2 Px), float32
        From these responses to real and imaginary parts of their sum along a row.
    """

    cosines: NDArray[np.int64]
    sines: NDArray[np.int64]
    along: Floats


class _Waves(NamedTuple):
    """Scores of all places from responses.

    Attributes
    ----------
    groups : tuple of _Group
    down : ndarray, shape (Py, 2 G), float32
        From the sums along rows to scores.
    """

    groups: tuple[_Group, ...]
    down: Floats


def _waves(basis: RealBasis) -> _Waves:
    """Split exp(j 2 pi k.p) into a factor along rows and one down."""
    height, width = (np.arange(side) for side in basis.projector)
    cosine = np.flatnonzero(~basis.is_sine)
    paired = np.diff(np.append(cosine, basis.count)) == 2
    groups = []
    levels = np.unique(basis.cycles[:, 0])
    for level in levels:
        mine = np.flatnonzero(basis.cycles[:, 0] == level)
        wave = np.exp(2j * np.pi * (np.outer(basis.cycles[mine, 1], width) % 1.0))
        # The response to a cosine less j times that to its sine.
        waves = np.concatenate([wave, -1j * wave[paired[mine]]])
        along = np.concatenate([waves.real, waves.imag], axis=1).astype(np.float32)
        groups.append(_Group(cosine[mine], cosine[mine][paired[mine]] + 1, along))
    angle = 2 * np.pi * (np.outer(height, levels) % 1.0)
    down = np.stack([np.cos(angle), -np.sin(angle)], axis=-1).reshape(len(height), -1)
    return _Waves(tuple(groups), down.astype(np.float32))


def _scores(responses: Floats, waves: _Waves) -> Floats:
    """Scores of all places, (n, Py, Px), of responses (n, R)."""
    width = waves.groups[0].along.shape[1] // 2
    sums = np.empty((len(responses), len(waves.groups), 2, width), dtype=np.float32)
    for g, group in enumerate(waves.groups):
        chosen = np.concatenate([group.cosines, group.sines])
        sums[:, g] = (responses[:, chosen] @ group.along).reshape(-1, 2, width)
    return np.asarray(np.matmul(waves.down, sums.reshape(len(responses), -1, width)))


def _search(basis: RealBasis, waves: _Waves, weighed: Weighed) -> NDArray[np.float64]:
    """Return the place, to half a pixel, at which direct light explains the responses best: (C, 2).

    Light at half a pixel is shared by the two pixels beside it, so its score is the mean of theirs.
    """
    best = np.empty((len(weighed.responses), 2))
    for block in blocks(len(weighed.responses), max(1, SCORES_AT_ONCE // basis.projector.pixels)):
        score = _scores(weighed.responses[block], waves)
        best[block] = _highest(basis, score, weighed.weights[block])
    return best


def _highest(basis: RealBasis, score: Floats, weights: Floats) -> NDArray[np.float64]:
    """Return the places of the scores that are highest in units of their deviation: (n, 2)."""
    number, (height, width) = np.arange(len(score)), basis.projector
    flat = score.reshape(len(score), -1)
    place = flat.argmax(axis=1)
    peak = flat[number, place]
    # Squares of a cosine and its sine add up to 1 at every whole place, and to this between two.
    down, across = np.cos(np.pi * basis.cycles.T) ** 2
    whole = np.sqrt(weights.sum(axis=1)) + 1e-12
    between = np.sqrt(weights @ np.stack([across, down, down * across], axis=1)) + 1e-12
    found = np.stack(np.divmod(place, width), axis=-1).astype(np.float64)
    # A place between two pixels can only be better beside a score above this bound.
    bound = peak * between.min(axis=1) / whole
    above = np.flatnonzero(flat > np.where(peak > 0, bound, np.inf)[:, None])
    c, y, x = np.unravel_index(above, score.shape)
    of, places, deviations = [], [], []
    for dy, dx in ((0, -1), (0, 1), (-1, 0), (1, 0), (-1, -1), (-1, 1), (1, -1), (1, 1)):
        there = (y + dy >= 0) & (y + dy < height) & (x + dx >= 0) & (x + dx < width)
        pixel, down_from, across_from = c[there], y[there], x[there]
        down_to, across_to = down_from + dy, across_from + dx
        mean = 0.5 * (score[pixel, down_from, across_from] + score[pixel, down_to, across_to])
        if dy and dx:
            aside = score[pixel, down_to, across_from] + score[pixel, down_from, across_to]
            mean = 0.5 * mean + 0.25 * aside
        of.append(pixel)
        deviations.append(mean / between[pixel, int(dy != 0) + int(dy * dx != 0)])
        places.append(np.stack([down_from + dy / 2, across_from + dx / 2], axis=-1))
    pixel, deviation = np.concatenate(of), np.concatenate(deviations)
    order = np.lexsort((deviation, pixel))
    last = order[np.flatnonzero(np.diff(pixel[order], append=-1))]
    last = last[deviation[last] > (peak / whole)[pixel[last]]]
    found[pixel[last]] = np.concatenate(places)[last]
    return found


def _find(
    photos: Photos,
    rows: slice,
    measure: Callable[[], Measurements],
    progress: Callable[[int], None] | None = None,
) -> Correspondence:
    return correspond_by_phase(measure(), pitch=photos.plan.pitch)


def _rows_beside(plan: Plan) -> int:
    """Return the rows of neighbours that tell places, sidelobes, and whether q is mirrored."""
    if not is_coarse_to_fine(plan.projector, plan.pitch):
        return REACH + 1
    shown = representatives(p.frequency for p in plan.patterns if isinstance(p, Sinusoid))
    return rows_beside(len(set(shown) - {DC})) + 1


# Every plan has sinusoids; whether they determine q is checked when they are measured.
PHASE = CorrespondenceMethod(serves=lambda _plan: True, find=_find, rows_beside=_rows_beside)
