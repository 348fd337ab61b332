"""Direct light from a second place: camera pixels at outlines, which see two surfaces.

Where a surface ends before another, a camera pixel sees both. The second one's direct light comes
from a place about which a neighbour's q lies. Within the window it is a spike. Beyond, no part of a
row holds it: photos are then explained by far-range light at the measured frequencies, which is
wrong at all others.

The photos choose: by the evidence of the prior components and scales of a camera pixel and of its
neighbours, with direct light at a place or without. What comes from a second place is taken off the
responses, and the camera pixel is estimated anew from what is left.

Index convention: arrays are (n, channels, ...); r runs over real responses, i over eigenvectors, k
over places, g over the amplitudes of `nuisance`.
"""

from typing import NamedTuple

import numpy as np

from nearfar.arrays import Floats, Integers, Size, beside, blocks, fetch, namespace, product
from nearfar.devices import batch_length
from nearfar.estimate.joint import nuisance
from nearfar.estimate.joint.batch import PixelBatch, gather
from nearfar.estimate.joint.problem import ComponentChoice, EstimatedRows, Problem
from nearfar.illumination.near_basis import NearBasis
from nearfar.illumination.real_basis import RealBasis
from nearfar.priors.fitted import FREE, LIT_COMPONENTS
from nearfar.priors.responses import ResponsePrior
from nearfar.transport.direct import footprint

# Log evidence by which photos must be more probable with a second place than without. A camera
# pixel has up to eight neighbours with five places each.
LEAST_GAIN = 20.0
# Log evidence that the likeliest coarse place must add for finer places about it to be tried. The
# least that any of 297 second places on eight scenes had was -7.
LEAST_COARSE_GAIN = -10.0
# Places about a neighbour's q that are tried, projector pixels down and across; and those about the
# likeliest of them.
COARSE_STEPS = np.array([(0.0, 0.0), (-1.0, 0.0), (1.0, 0.0), (0.0, -1.0), (0.0, 1.0)])
FINE_STEPS = np.stack(np.meshgrid(*[0.25 * np.arange(-2, 3)] * 2, indexing="ij"), -1).reshape(-1, 2)
NEIGHBOURS = [(a, b) for a in (-1, 0, 1) for b in (-1, 0, 1) if (a, b) != (0, 0)]
# Prior scales that are tried, over the mean of those of the camera pixel and its neighbours.
SCALE_FACTORS = (0.25, 0.5, 1.0, 2.0, 4.0)
BATCH_PIXELS = 128


class SecondPlaces(NamedTuple):
    """Direct light of n camera pixels from a second place.

    Attributes
    ----------
    pixels : ndarray of int, shape (n,)
        Camera pixels, ascending.
    places : ndarray, shape (n, 2)
    direct : ndarray, shape (n, channels), float32
        0 or more.
    """

    pixels: Integers
    places: Floats
    direct: Floats

    def of(self, chosen: Integers | slice) -> "SecondPlaces":
        """Return those of some entries."""
        return SecondPlaces(self.pixels[chosen], self.places[chosen], self.direct[chosen])

    def within(self, pixels: slice) -> "SecondPlaces":
        """Return those of camera pixels side by side, counted from the first of these."""
        first, last = np.searchsorted(self.pixels, [pixels.start, pixels.stop])
        found = self.of(slice(int(first), int(last)))
        return found._replace(pixels=found.pixels - pixels.start)


def find_second_places(problem: Problem, rows: EstimatedRows) -> SecondPlaces:
    """Find camera pixels with direct light from a second place beyond the window.

    Parameters
    ----------
    problem : Problem
    rows : EstimatedRows
        Of the first sweep.
    """
    camera = problem.measurements.camera
    q = fetch(problem.pixels.correspondence).reshape(*camera, 2)
    # Where the photos show no direct light at q, there is nothing that a second place would add to.
    lit = fetch(rows.choices.sweeps[-1].prior_component) < len(LIT_COMPONENTS)
    q = np.where(lit.reshape(*camera, 1), q, np.nan)
    pixels, places = _candidates(q, problem.near_basis.window, problem.measurements.projector)
    channels = problem.measurements.channels
    # Those with as many places side by side, so that few are tried in vain.
    count = np.isfinite(places[..., 0]).sum(axis=1)
    order = np.argsort(count, kind="stable")
    where = np.full((len(pixels), 2), np.nan)
    direct = np.zeros((len(pixels), channels), dtype=np.float32)
    for some in blocks(len(pixels), batch_length(BATCH_PIXELS, rows.far)):
        these = np.sort(order[some])
        most = count[these].max()
        where[these], direct[these] = _of_some(problem, rows, pixels[these], places[these, :most])
    has = np.isfinite(where).all(axis=1)
    return SecondPlaces(pixels[has], where[has], direct[has])


def _candidates(q: Floats, window: int, projector: Size) -> tuple[Integers, Floats]:
    """Return camera pixels with a neighbour's q beyond their window, and these q, (n, 8, 2).

    NaN stands after them.
    """
    height, width = q.shape[:2]
    around = np.full((height, width, len(NEIGHBOURS), 2), np.nan)
    padded = np.pad(q, ((1, 1), (1, 1), (0, 0)), constant_values=np.nan)
    for number, (a, b) in enumerate(NEIGHBOURS):
        around[:, :, number] = padded[1 + a : 1 + a + height, 1 + b : 1 + b + width]
    apart = np.abs(np.rint(around) - np.rint(q)[:, :, None]).max(axis=-1)
    around[~(apart > window // 2)] = np.nan
    flat = around.reshape(height * width, len(NEIGHBOURS), 2)
    pixels = np.flatnonzero(np.isfinite(flat[..., 0]).any(axis=1))
    found = flat[pixels]
    known_first = np.argsort(np.isnan(found[..., 0]), axis=1, kind="stable")
    return pixels, np.take_along_axis(found, known_first[..., None], axis=1)


def _of_some(
    problem: Problem, rows: EstimatedRows, pixels: Integers, around: Floats
) -> tuple[Floats, Floats]:
    """Return second places (n, 2), NaN where there is none, and their direct light."""
    model, projector = problem.model, problem.measurements.projector
    choice, here = rows.choices.sweeps[-1], beside(pixels, problem.pixels.responses)
    batch = gather(problem.pixels, here, model.centred, projector)
    usual = _usual_choices(choice, pixels, problem.measurements.camera)
    coarse = (around[:, :, None] + COARSE_STEPS).reshape(len(pixels), -1, 2)
    found = _likeliest(problem, batch, usual, coarse)
    (promising,) = np.nonzero(found.with_it > found.without + LEAST_COARSE_GAIN)
    place = np.full((len(pixels), 2), np.nan)
    direct = np.zeros(found.direct.shape, dtype=np.float32)
    if not len(promising):
        return place, direct
    batch = batch.only(beside(promising, batch.responses))
    fine = found.place[promising, None] + FINE_STEPS
    found = _likeliest(problem, batch, (usual[0][promising], usual[1][promising]), fine)
    own = choice.of(beside(pixels[promising], problem.pixels.responses))
    without = np.maximum(found.without, _own_evidence(problem, batch, own))
    place[promising] = np.where(
        (found.with_it > without + LEAST_GAIN)[:, None], found.place, np.nan
    )
    direct[promising] = found.direct
    return place, direct


class _Likeliest(NamedTuple):
    """The likeliest place of each camera pixel, log evidences with it and without, its light."""

    place: Floats
    with_it: Floats
    without: Floats
    direct: Floats


def _likeliest(
    problem: Problem, batch: PixelBatch, usual: tuple[Integers, Floats], places: Floats
) -> _Likeliest:
    model, last = problem.model, np.array(problem.measurements.projector) - 1.0
    component, scale = usual
    n, count = places.shape[:2]
    places = np.clip(places, 0, last)
    # Light within the window is the window's: none of the 2 x 2 projector pixels may lie there.
    apart = np.abs(places - fetch(batch.centres)[:, None]).max(axis=-1)
    known = apart >= problem.near_basis.window // 2 + 1
    shown = responses_of(np.nan_to_num(places.reshape(-1, 2)), model.centred.basis)
    shown = beside(shown.reshape(n, count, -1), batch.responses)
    of_places = model.centred.recentre(shown, batch.centres)
    without, with_it = np.full(n, -np.inf), np.full(n, -np.inf)
    place, direct = np.full((n, 2), np.nan), np.zeros((n, batch.white.shape[1]))
    for number in np.unique(component[component >= 0]).tolist():
        mine = np.flatnonzero((component == number).any(axis=1))
        here = beside(mine, batch.responses)
        prior, some = model.priors[number], batch.only(here)
        projected = _projected(some, prior, of_places[here])
        scales = np.multiply.outer(SCALE_FACTORS, scale[mine])
        evidence, gains, lights = _evidence(some, prior, scales, projected, problem.near_basis)
        gains = np.where(known[mine], gains, -np.inf)
        for alone, gain, light in zip(evidence, gains, lights, strict=True):
            each, best = np.arange(len(mine)), gain.argmax(axis=1)
            without[mine] = np.maximum(without[mine], alone)
            value = alone + gain[each, best]
            better = value > with_it[mine]
            these, best = mine[better], best[better]
            with_it[these] = value[better]
            place[these] = places[these, best]
            direct[these] = light[each[better], best]
    return _Likeliest(place, with_it, without, direct)


def _own_evidence(problem: Problem, batch: PixelBatch, choice: ComponentChoice) -> Floats:
    """Return the log evidence of each camera pixel's own component and scale, (n,)."""
    component, scale = fetch(choice.prior_component), fetch(choice.prior_scale).astype(np.float64)
    found = np.full(len(component), -np.inf)
    for number in np.unique(component).tolist():
        mine = np.flatnonzero(component == number)
        prior, some = problem.model.priors[number], batch.only(beside(mine, batch.responses))
        projected = _projected(some, prior, some.responses[:, :0])
        (found[mine],), _, _ = _evidence(
            some, prior, scale[None, mine], projected, problem.near_basis
        )
    return found


def _usual_choices(
    choice: ComponentChoice, pixels: Integers, camera: Size
) -> tuple[Integers, Floats]:
    """Return components of camera pixels and their neighbours, (n, 9), and their mean scale, (n,).

    Components are -1 beyond the camera, and where light may come from anywhere: neighbours at an
    outline have chosen them for what is looked for here. The camera pixel's own is kept: besides a
    second place it may have more that no other component holds, as a q between two pixels.
    """
    component = fetch(choice.prior_component).reshape(camera).astype(np.int64)
    scale = fetch(choice.prior_scale).reshape(camera).astype(np.float64)
    free = [n for n, one in enumerate(LIT_COMPONENTS) if one.far_decay == FREE]
    unusual = (component >= len(LIT_COMPONENTS)) | np.isin(component, free)
    component = np.pad(np.where(unusual, -1, component), 1, constant_values=-1)
    scale = np.pad(scale, 1, constant_values=1.0)
    y, x = np.divmod(pixels, camera.width)
    around = [(y + 1 + a, x + 1 + b) for a, b in ((0, 0), *NEIGHBOURS)]
    components = np.stack([component[place] for place in around], axis=1)
    scales = np.stack([scale[place] for place in around], axis=1)
    known = components >= 0
    own = fetch(choice.prior_component)[pixels]
    components[:, 0] = np.where(own < len(LIT_COMPONENTS), own, -1)
    mean = np.sum(np.log(scales), axis=1, where=known) / np.maximum(known.sum(axis=1), 1)
    return components, np.exp(mean)


class _Projected(NamedTuple):
    """Responses in coordinates of eigenvectors, float64, in main memory."""

    measured: Floats  # (n, channels, i)
    amplitudes: Floats  # (n, g, i)
    places: Floats  # (n, k, i)


def _projected(batch: PixelBatch, prior: ResponsePrior, of_places: Floats) -> _Projected:
    amplitudes = nuisance.projected_amplitude_responses(batch, prior)
    measured, of_places = (
        product(part, prior.eigenvectors) for part in (batch.responses, of_places)
    )
    return _Projected(*(_float64(part) for part in (measured, amplitudes, of_places)))


def _float64(values: Floats) -> Floats:
    """Return values in main memory, in double precision."""
    return np.asarray(fetch(values), dtype=np.float64)


def _evidence(
    batch: PixelBatch,
    prior: ResponsePrior,
    scales: Floats,
    projected: _Projected,
    near_basis: NearBasis,
) -> tuple[Floats, Floats, Floats]:
    """Return log evidences without a second place, what places add, and their light.

    At scales (s, n) of the prior these are (s, n), (s, n, k) and (s, n, k, channels).
    """
    y, a, b = projected
    white, noise = _float64(batch.white), _float64(batch.noise)
    squared = (scales[..., None] * white)[..., None] ** 2
    precision = 1.0 / (squared * _float64(prior.eigenvalues) + noise[..., None] ** 2)
    before = _float64(nuisance.prior_precision(batch, near_basis))
    of_places = (b**2) @ precision.mT
    right = b @ (precision * y).mT
    without = np.zeros(scales.shape)
    for i in range(y.shape[1]):
        weighted = a * precision[:, :, i, None]
        normal = weighted @ a.mT + before[:, i, :, None] * np.eye(a.shape[1])
        told = (weighted @ y[:, i, :, None])[..., 0]
        inverse = np.linalg.inv(normal)
        amplitudes = (inverse @ told[..., None])[..., 0]
        cross = b @ weighted.mT
        of_places[..., i] -= np.vecdot(cross @ inverse, cross)
        right[..., i] -= (cross @ amplitudes[..., None])[..., 0]
        one = precision[:, :, i]
        squares = np.sum(one * y[:, i] ** 2 - np.log(one), axis=-1)
        told_squares = np.vecdot(told, amplitudes)
        without -= 0.5 * (squares - told_squares + np.linalg.slogdet(normal)[1])
    variance = white[:, None] ** 2
    posterior = of_places + 1.0 / variance
    right = np.maximum(right, 0.0)
    gain = 0.5 * np.sum(right**2 / posterior - np.log(variance * posterior), axis=-1)
    return without, gain, right / posterior


def responses_of(places: Floats, basis: RealBasis) -> Floats:
    """Return the responses of unit direct light at places, (n, R), float32."""
    where = footprint(places, basis.projector)
    width = basis.projector.width
    down, across = basis.single_phases
    found = np.zeros((len(places), len(basis.frequencies)), dtype=np.complex64)
    for pixel, weight in zip(where.pixels.T, where.weights.T, strict=True):
        found += weight[:, None] * down[pixel // width] * across[pixel % width]
    both = found[:, basis.index]
    return np.where(basis.is_sine, both.imag, both.real).astype(np.float32)


def without_second_places(problem: Problem, second: SecondPlaces) -> Problem:
    """Return the problem with what comes from second places taken off its responses."""
    of_places = responses_of(second.places, problem.model.centred.basis)
    light, responses = second.direct[..., None] * of_places[:, None], problem.pixels.responses
    left = namespace(responses).asarray(responses, copy=True)
    left[beside(second.pixels, left)] -= beside(light, left)
    return problem._replace(pixels=problem.pixels._replace(responses=left))
