"""The prior component and scale of a camera pixel: those that make its photos most probable.

The log evidence of a component at prior scale s, noise sigma and eigenvalues l_i is, up to a
constant, -1/2 sum_i (y_i^2 / v_i + log v_i), v_i = s^2 l_i + sigma^2, with o and d integrated out.
v_i depends on s and sigma through their ratio alone, so every camera pixel shares one table over
variance ratios. Sums over i are compiled loops for NumPy arrays, and matrix products for others.

A few screening responses make a shortlist, and all responses choose from it. The screening
responses alone cost 1.7 dB on the wedge; all responses throughout take three times as long.

The evidence is summed over channels. That of the mean of the channels costs the coloured books of
the shelf 1.2 dB under a random light.

Index convention: arrays are (n, channels, ...); i runs over eigenvectors.
"""

from collections.abc import Callable
from typing import Any, NamedTuple
from weakref import WeakKeyDictionary

import numpy as np
from array_api_compat import device, is_numpy_array

from nearfar.arrays import Floats, Integers, beside, fetch, namespace, product_by_row
from nearfar.estimate.joint.batch import PixelBatch
from nearfar.estimate.joint.evidence_sums import sum_squares
from nearfar.estimate.joint.nuisance import DIRECT_PRIOR_DEVIATION
from nearfar.illumination.centred_basis import CentredBasis
from nearfar.priors.fitted import PRIOR_SCALES
from nearfar.priors.responses import Eigenbasis, ResponsePrior

# Steps of the table in (s / sigma)^2 from one prior scale to the next, twice as large.
STEPS_PER_SCALE = 4
# Responses by which the shortlist is made, and components on it.
SCREENING_RESPONSES = 100
SHORTLIST_LENGTH = 3
# Tables of variance ratios begin at multiples of as many steps, so that a few serve all batches.
TABLE_STEPS = 32


class PriorSet(NamedTuple):
    """Prior components to choose from.

    Attributes
    ----------
    priors : tuple of ResponsePrior
    screens : tuple of Eigenbasis
        The same for the screening responses alone; the priors themselves where all responses
        screen.
    screening : ndarray of int
        Indices of the screening responses.
    numbers : tuple of int
        Number of each, among those of all sweeps.
    """

    priors: tuple[ResponsePrior, ...]
    screens: tuple[Eigenbasis, ...]
    screening: Integers
    numbers: tuple[int, ...]

    def only(self, numbers: tuple[int, ...]) -> "PriorSet":
        """Return those of some numbers, in their order."""
        places = [self.numbers.index(number) for number in numbers]
        priors = tuple(self.priors[place] for place in places)
        screens = tuple(self.screens[place] for place in places)
        is_screened = self.screens is not self.priors
        return PriorSet(priors, screens if is_screened else priors, self.screening, numbers)

    def put(self, move: Callable[[Any], Any]) -> "PriorSet":
        """Put the arrays that every camera pixel is multiplied with onto a device."""
        priors = tuple(prior.put(move) for prior in self.priors)
        if self.screens is self.priors:
            return self._replace(priors=priors, screens=priors)
        return self._replace(
            priors=priors, screens=tuple(screen.put(move) for screen in self.screens)
        )


def prior_set(
    priors: tuple[ResponsePrior, ...],
    centred: CentredBasis,
    multiplicity: Floats,
    numbers: tuple[int, ...] | None = None,
) -> PriorSet:
    """Choose screening responses: those of evenly spaced frequencies, in their order.

    Numbers count from 0 unless they are given.
    """
    numbers = tuple(range(len(priors))) if numbers is None else numbers
    frequencies = len(centred.basis.frequencies)
    if centred.basis.count <= 2 * SCREENING_RESPONSES:
        return PriorSet(priors, priors, np.arange(centred.basis.count), numbers)
    spaced = np.linspace(0, frequencies - 1, SCREENING_RESPONSES // 2).round().astype(np.int64)
    screening = np.flatnonzero(np.isin(centred.basis.index, spaced))
    screens = tuple(prior.of_responses(screening, centred, multiplicity) for prior in priors)
    return PriorSet(priors, screens, screening, numbers)


def log_evidences(batch: PixelBatch, candidates: PriorSet, evidence: "Evidence") -> Floats:
    """Return the log evidence of every candidate at every prior scale.

    Parameters
    ----------
    batch : PixelBatch
    candidates : PriorSet
    evidence : callable
        `log_evidence`, or `log_evidence_by_row`.

    Returns
    -------
    ndarray, shape (candidates, n, scales), float64
        Up to a constant of the camera pixel; minus infinity off its shortlist.
    """
    xp = namespace(batch.white)
    whitened = whiten(batch)
    screening = beside(candidates.screening, whitened.responses)
    some = whitened._replace(
        responses=whitened.responses[:, screening], of_offset=whitened.of_offset[:, screening]
    )
    values: Floats = xp.stack([evidence(some, screen) for screen in candidates.screens])
    if candidates.screens is candidates.priors:
        return values
    largest = xp.max(values, axis=2)
    least = xp.sort(largest, axis=0)[-min(SHORTLIST_LENGTH, len(candidates.priors))]
    shortlisted = largest >= least
    values[...] = -xp.inf
    for index, prior in enumerate(candidates.priors):
        (mine,) = xp.nonzero(shortlisted[index, :])
        if len(mine):
            values[index, mine] = evidence(whitened.only(mine), prior)
    return values


def best_of(values: Floats, candidates: PriorSet) -> tuple[Integers, Floats, Floats]:
    """Return the candidate and scale of the largest log evidence of each camera pixel.

    Parameters
    ----------
    values : ndarray, shape (candidates, n, scales)
        As `log_evidences` returns them.
    candidates : PriorSet

    Returns
    -------
    prior_component : ndarray of int, shape (n,)
        Number of a candidate.
    prior_scale : ndarray, shape (n,)
        s as a share of white.
    evidence : ndarray, shape (n,)
        Its logarithm, up to a constant of the camera pixel.
    """
    place, step, evidence = _best_places(values)
    number, scale = _at_places(place, step, values, candidates)
    return number, scale, evidence


def best_between_scales(values: Floats, candidates: PriorSet) -> tuple[Integers, Floats, Floats]:
    """Return the same with scales between those that were tried.

    The logarithm of the scale is where a parabola through the evidence at the best scale and the
    two next to it is highest.
    """
    place, step, evidence = _best_places(values)
    number, scale = _at_places(place, step, values, candidates)
    xp = namespace(values)
    here = xp.arange(len(place), device=device(values))
    middle = xp.clip(step, min=1, max=len(PRIOR_SCALES) - 2)
    below, at, above = (values[place, here, middle + side] for side in (-1, 0, 1))
    bend = below - 2 * at + above
    is_peak = (bend < 0) & (middle == step)
    slope = xp.where(is_peak, 0.5 * (below - above), xp.zeros_like(bend))
    shift = slope / xp.where(is_peak, bend, -xp.ones_like(bend))
    return number, scale * 2.0**shift, evidence


def _best_places(values: Floats) -> tuple[Integers, Integers, Floats]:
    """Return the candidate's place, the scale's, and the log evidence that is largest, (n,)."""
    xp = namespace(values)
    largest, steps = xp.max(values, axis=2), xp.argmax(values, axis=2)
    place = xp.argmax(largest, axis=0)
    step = xp.take_along_axis(steps, place[None, :], axis=0)[0, :]
    return place, step, xp.max(largest, axis=0)


def _at_places(
    place: Integers, step: Integers, values: Floats, candidates: PriorSet
) -> tuple[Integers, Floats]:
    """Return numbers of candidates, and prior scales."""
    number = beside(np.array(candidates.numbers), values)[place]
    return number, beside(np.array(PRIOR_SCALES), values)[step]


class WhitenedResponses(NamedTuple):
    """Responses in units of their noise, a row for each channel of each camera pixel.

    Rows with the same table of variance ratios are next to each other.

    Attributes
    ----------
    responses : ndarray, shape (m, R)
    white_ratio, offset_ratio : ndarray, shape (m, 1)
        White, and the standard deviation of the references' error, over the noise.
    table_step : ndarray of int, shape (m,)
        First step of the row's table, in ascending order.
    pixel : ndarray of int, shape (m,)
        Index of the camera pixel in the batch.
    direct_weights : ndarray, shape (n, 9)
        Weights of unit direct light on `FOOTPRINT_OFFSETS`.
    of_offset : ndarray, shape (n or 0, R)
        Responses to a unit error of the references; no rows if the references have no noise.
    """

    responses: Floats
    white_ratio: Floats
    offset_ratio: Floats
    table_step: Integers
    pixel: Integers
    direct_weights: Floats
    of_offset: Floats

    def only(self, selected: Integers) -> "WhitenedResponses":
        """Return the rows of some camera pixels."""
        xp, here = namespace(selected), device(selected)
        new_index = xp.full(len(self.direct_weights), -1, dtype=xp.int64, device=here)
        new_index[selected] = xp.arange(len(selected), dtype=xp.int64, device=here)
        pixel = new_index[self.pixel]
        (rows,) = xp.nonzero(pixel >= 0)
        return WhitenedResponses(
            self.responses[rows],
            self.white_ratio[rows],
            self.offset_ratio[rows],
            self.table_step[rows],
            pixel[rows],
            self.direct_weights[selected],
            self.of_offset[selected] if len(self.of_offset) else self.of_offset,
        )


def whiten(batch: PixelBatch) -> WhitenedResponses:
    """Divide the responses of camera pixels by their noise, and order them by their table."""
    xp = namespace(batch.white)
    noise = batch.noise.reshape((-1, 1))
    ratio = batch.white.reshape((-1, 1)) / noise
    octaves = xp.log2(xp.astype(ratio[:, 0], xp.float64) * PRIOR_SCALES[0])
    table_step = xp.round(STEPS_PER_SCALE * octaves)
    order = xp.argsort(table_step, stable=True)
    flat = batch.responses.reshape((len(order), -1))
    return WhitenedResponses(
        responses=flat[order] / noise[order],
        white_ratio=ratio[order],
        offset_ratio=(batch.offset_noise.reshape((-1, 1)) / noise)[order],
        table_step=xp.astype(table_step[order], xp.int64),
        pixel=order // batch.white.shape[1],
        direct_weights=batch.direct_weights[:, 0],
        of_offset=batch.of_offset.reshape((-1, flat.shape[1])),
    )


def log_evidence(whitened: WhitenedResponses, eigenbasis: Eigenbasis) -> Floats:
    """Return the log evidence of one prior component at every prior scale.

    Parameters
    ----------
    whitened : WhitenedResponses
    eigenbasis : Eigenbasis
        Of the component.

    Returns
    -------
    ndarray, shape (n, scales), float64
        The sum over channels, up to a constant of the camera pixel.
    """
    # In double precision: direct light takes most of the sums out again, and the choice between
    # components that are nearly as good would hang on rounding.
    if is_numpy_array(whitened.responses):
        return _sum_by_loop(whitened, _projected(whitened, eigenbasis, _double_product), eigenbasis)
    return _sum_by_products(whitened, eigenbasis)


def log_evidence_by_row(whitened: WhitenedResponses, eigenbasis: Eigenbasis) -> Floats:
    """Return the same for NumPy arrays, to single precision.

    What is found for a camera pixel does not depend on those after it.
    """
    return _sum_by_loop(whitened, _projected(whitened, eigenbasis, product_by_row), eigenbasis)


def _projected(
    whitened: WhitenedResponses,
    eigenbasis: Eigenbasis,
    product: Callable[[Floats, Floats], Floats],
) -> tuple[Floats, Floats, Floats]:
    """Return the coordinates y of responses, u of light of q, and v of errors of the references.

    Their shapes are (m, R), (n, R) and (n or 0, R).
    """
    return (
        product(whitened.responses, eigenbasis.eigenvectors),
        product(whitened.direct_weights, eigenbasis.of_footprint),
        product(whitened.of_offset, eigenbasis.eigenvectors),
    )


def _sum_by_loop(
    whitened: WhitenedResponses, projected: tuple[Floats, Floats, Floats], eigenbasis: Eigenbasis
) -> Floats:
    """Return the log evidence of NumPy arrays: a compiled loop sums row by row."""
    steps = whitened.table_step
    first, last = (int(step) // TABLE_STEPS * TABLE_STEPS for step in (steps[0], steps[-1]))
    squares = np.zeros((len(whitened.direct_weights), len(PRIOR_SCALES)))
    factors = np.ones_like(squares)
    sum_squares(
        *projected,
        whitened.pixel,
        steps - first,
        STEPS_PER_SCALE,
        _shared_table(eigenbasis, first, last + TABLE_STEPS),
        _direct_variance(whitened)[:, 0],
        _offset_variance(whitened)[:, 0],
        squares,
        factors,
    )
    squares += np.log(factors, out=factors)
    squares *= -0.5
    return squares


def _sum_by_products(whitened: WhitenedResponses, eigenbasis: Eigenbasis) -> Floats:
    """Return the log evidence of arrays of any library: sums are products with tables."""
    xp = namespace(whitened.responses)
    y, u, v = _projected(whitened, eigenbasis, _double_product)
    sums, log_determinant = _weighted_sums(whitened, (y, u, v), eigenbasis)
    yy, uy, uu, *of_offset = sums
    if of_offset:
        # Integrate o out first; what is left of y and u is independent of it.
        vy, vu, vv = of_offset
        offset_variance = _offset_variance(whitened)
        factor = 1.0 + offset_variance * vv
        yy, uy, uu = (
            whole - offset_variance * left * right / factor
            for whole, left, right in ((yy, vy, vy), (uy, vu, vy), (uu, vu, vu))
        )
        log_determinant = log_determinant + xp.log(factor)
    direct_variance = _direct_variance(whitened)
    factor = 1.0 + direct_variance * uu
    squares = yy - direct_variance * uy**2 / factor
    found = -0.5 * (squares + log_determinant + xp.log(factor))
    # Back to the order of camera pixels, with a row for each channel.
    together = found[xp.argsort(whitened.pixel, stable=True)]
    total: Floats = xp.sum(together.reshape((len(u), -1, len(PRIOR_SCALES))), axis=1)
    return total


def _direct_variance(whitened: WhitenedResponses) -> Floats:
    """Return the prior variance of direct light in units of the noise, (m, 1), float64."""
    xp = namespace(whitened.white_ratio)
    deviation: Floats = DIRECT_PRIOR_DEVIATION * xp.astype(whitened.white_ratio, xp.float64)
    return deviation**2


def _offset_variance(whitened: WhitenedResponses) -> Floats:
    """Return the variance of the references' error in units of the noise, (m, 1), float64."""
    xp = namespace(whitened.offset_ratio)
    deviation: Floats = xp.astype(whitened.offset_ratio, xp.float64)
    return deviation**2


def _double_product(rows: Floats, matrix: Floats) -> Floats:
    xp = namespace(rows)
    product: Floats = xp.astype(rows, xp.float64) @ xp.astype(matrix, xp.float64)
    return product


def _weighted_sums(
    whitened: WhitenedResponses, projected: tuple[Floats, Floats, Floats], eigenbasis: Eigenbasis
) -> tuple[list[Floats], Floats]:
    """Return weighted sums of products, and log determinants.

    Of y, light u of q and errors v of the references, the sums are yy, uy and uu, and where there
    are such errors vy, vu and vv; each (m, scales).
    """
    y, _, v = projected
    xp, table_step = namespace(y), fetch(whitened.table_step)
    step = STEPS_PER_SCALE * np.arange(len(PRIOR_SCALES))
    first = np.flatnonzero(np.diff(table_step, prepend=table_step[:1] - 1))
    steps, rows = np.unique(table_step[first, None] + step, return_inverse=True)
    weights, log_determinants = _table(steps, eigenbasis.eigenvalues, xp)
    every_row = np.repeat(rows, np.diff(first, append=len(y)), axis=0)
    shape = (6 if len(v) else 3, len(y), len(PRIOR_SCALES))
    sums: Floats = xp.empty(shape, dtype=xp.float64, device=device(y))
    _put_products(whitened.pixel, projected, first, rows, weights, sums)
    return list(sums), log_determinants[beside(every_row, y)]


def _put_products(
    pixel: Integers,
    projected: tuple[Floats, Floats, Floats],
    first: Integers,
    rows: Integers,
    weights: Floats,
    sums: Floats,
) -> None:
    """Write weighted sums, (3 or 6, m, scales), by products with the table of like rows.

    Parameters
    ----------
    pixel : ndarray of int, shape (m,)
    projected : tuple of ndarray
        y, u and v.
    first : ndarray of int, shape (t,)
        The first of the rows that have the same table.
    rows : ndarray of int, shape (t, scales)
        Their rows of `weights`.
    weights : ndarray, shape (T, R)
    sums : ndarray
    """
    y, u, v = projected
    starts = first.tolist()
    for start, stop, mine in zip(starts, [*starts[1:], len(y)], rows, strict=True):
        its_weights, here = weights[beside(mine, y)], pixel[start:stop]
        of_y, of_u = y[start:stop], u[here]
        pairs = [(of_y, of_y), (of_u, of_y), (of_u, of_u)]
        if len(v):
            of_v = v[here]
            pairs += [(of_v, of_y), (of_v, of_u), (of_v, of_v)]
        for number, (one, other) in enumerate(pairs):
            sums[number, start:stop] = (one * other) @ its_weights.T


def _shared_table(eigenbasis: Eigenbasis, first: int, last: int) -> tuple[Floats, Floats]:
    """Return the table for rows that begin at steps from `first` to before `last`."""
    kept = _tables.setdefault(eigenbasis, {})
    if (first, last) not in kept:
        beyond = last + STEPS_PER_SCALE * len(PRIOR_SCALES)
        kept[first, last] = _table(np.arange(first, beyond), eigenbasis.eigenvalues, np)
    return kept[first, last]


# Of components in use, by the steps they begin and end with: batches have more noise or less.
_tables: WeakKeyDictionary[Eigenbasis, dict[tuple[int, int], tuple[Floats, Floats]]]
_tables = WeakKeyDictionary()


def _table(steps: Integers, eigenvalues: Floats, xp: Any) -> tuple[Floats, Floats]:
    """Return 1 / v_i and the sum of log v_i at steps of the variance ratio: (T, R) and (T,)."""
    ratios = beside(4.0 ** (steps / STEPS_PER_SCALE), eigenvalues)
    variance = 1.0 + ratios[:, None] * xp.astype(eigenvalues, xp.float64)
    return 1.0 / variance, xp.sum(xp.log(variance), axis=1)


Evidence = Callable[[WhitenedResponses, Eigenbasis], Floats]
