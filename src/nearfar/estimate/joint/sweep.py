"""One sweep of the joint estimate over all camera pixels.

The first takes each camera pixel alone; later ones start from what is expected from its neighbours
and estimate the difference.

Index convention: arrays are (C, channels, ...); r runs over real responses, w over window entries.
"""

from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np
from array_api_compat import device
from numpy.typing import NDArray

from nearfar.arrays import Floats, beside, blocks, fetch, namespace, product
from nearfar.devices import batch_length
from nearfar.estimate.joint.add_rows import add_rows
from nearfar.estimate.joint.batch import PixelBatch, gather
from nearfar.estimate.joint.choose import choose
from nearfar.estimate.joint.clipped import solve_clipped
from nearfar.estimate.joint.clipped_windows import is_clipped, rounded_ratio
from nearfar.estimate.joint.in_common import keep_common
from nearfar.estimate.joint.leave_one_out import (
    calibrated,
    mean_errors,
    standardised_errors,
    weights_of,
)
from nearfar.estimate.joint.neighbours import expect_each, expect_together
from nearfar.estimate.joint.nuisance import COMMON_AMPLITUDES
from nearfar.estimate.joint.pooled_choice import no_probabilities, pooled_choice
from nearfar.estimate.joint.problem import (
    Choices,
    ComponentChoice,
    EstimatedRows,
    Problem,
)
from nearfar.estimate.joint.solve import (
    PosteriorMean,
    response_gain,
    solve_whole,
    variance_ratio,
)
from nearfar.estimate.joint.spikes import (
    LEAST_GAIN,
    MAXIMUM_SPIKES,
    likeliest_spike,
    with_spike,
)
from nearfar.illumination.centred_basis import CentredBasis
from nearfar.parallel import on_device_of
from nearfar.priors.fitted import LIT_COMPONENTS
from nearfar.priors.responses import ResponsePrior
from nearfar.transport import near
from nearfar.transport.direct import footprint, look_up_each

# Camera pixels of a batch.
BATCH_PIXELS = 2048


def sweep_once(
    problem: Problem,
    before: EstimatedRows | None,
    report: Callable[[float], None],
    chosen: ComponentChoice | None = None,
) -> EstimatedRows:
    """Estimate camera pixels once, where functions are of single projector pixels.

    Parameters
    ----------
    problem : Problem
    before : EstimatedRows, optional
        Of the sweep before, whose arrays are overwritten; None in the first.
    report : callable
        Called with the share done.
    chosen : ComponentChoice, optional
        Prior components and scales, if they are chosen already.
    """
    rows = _empty_rows(problem) if before is None else _from_neighbours(problem, before)
    pools = before is None and chosen is None
    probability = no_probabilities(
        len(problem.pixels.responses) if pools else 0, problem.model, problem.pixels.white
    )
    sweep = _Sweep(
        problem,
        rows,
        of_quantisation(problem),
        chosen,
        probability,
        problem.model.priors,
    )
    done, parts = [0], list(_parts(problem))
    count = sum(len(selected) for selected, _ in parts)

    def work(some: tuple[NDArray[np.int64], bool]) -> None:
        selected = beside(some[0], problem.pixels.responses)
        sweep.estimate(selected, clips=some[1], starts=before is None)
        done[0] += len(some[0])
        report(done[0] / count)

    on_device_of(problem.pixels.responses)(work, parts)
    if before is None:
        of_error_bars = rows.choices.sweeps[-1]
        if pools:
            of_error_bars = pooled_choice(probability, problem.model, problem.measurements.camera)
            of_error_bars = _calibrated(problem, of_error_bars, parts)
        rows = rows._replace(choices=rows.choices._replace(of_error_bars=of_error_bars))
    return rows


def _calibrated(
    problem: Problem, choice: ComponentChoice, parts: list[tuple[NDArray[np.int64], bool]]
) -> ComponentChoice:
    """Return a choice with larger scales where responses are foretold worse than expected."""
    xp, white = namespace(problem.pixels.white), problem.pixels.white
    errors: Floats = xp.full(len(white), xp.nan, dtype=xp.float32, device=device(white))
    weights = weights_of(problem)

    def work(of: PixelBatch, prior: ResponsePrior, scale: Floats) -> Floats:
        return mean_errors(of, prior, scale, weights, problem.near_basis)

    _fill_with_direct_light(errors, problem, choice, parts, work)
    return calibrated(choice, errors, problem.measurements.camera)


def squares_of_foretold(problem: Problem) -> Floats:
    """Return squares of the standardised errors of foretold responses.

    They are about 1 on average where the prior and the noise are as expected.

    Parameters
    ----------
    problem : Problem
        Where functions are of single projector pixels.

    Returns
    -------
    ndarray, shape (number, R)
        Means over channels; NaN at camera pixels without direct light.
    """
    choice = sweep_once(problem, None, lambda _share: None).choices.of_error_bars
    assert choice is not None
    pixels = problem.pixels
    number, _, count = pixels.responses.shape
    xp = namespace(pixels.white)
    squares: Floats = xp.full(
        (number, count), xp.nan, dtype=xp.float32, device=device(pixels.white)
    )

    def work(of: PixelBatch, prior: ResponsePrior, scale: Floats) -> Floats:
        errors = standardised_errors(of, prior, scale, problem.near_basis)
        mean: Floats = xp.mean(errors**2, axis=1)
        return mean

    _fill_with_direct_light(squares, problem, choice, list(_parts(problem)), work)
    return np.asarray(fetch(squares))


def _fill_with_direct_light(
    found: Floats,
    problem: Problem,
    choice: ComponentChoice,
    parts: list[tuple[NDArray[np.int64], bool]],
    of_alike: Callable[[PixelBatch, ResponsePrior, Floats], Floats],
) -> None:
    """Fill in values of camera pixels with direct light, those of one prior component at once."""
    pixels, model = problem.pixels, problem.model
    xp = namespace(pixels.white)

    def work(some: tuple[NDArray[np.int64], bool]) -> None:
        selected = beside(some[0], pixels.responses)
        component, scale = choice.of(selected)
        batch = gather(pixels, selected, model.centred, problem.measurements.projector)
        for place in np.unique(fetch(component)).tolist():
            if place >= len(LIT_COMPONENTS):
                continue
            (alike,) = xp.nonzero(component == place)
            found[selected[alike]] = of_alike(batch.only(alike), model.priors[place], scale[alike])

    on_device_of(pixels.white)(work, parts)


class _Sweep(NamedTuple):
    """What a sweep estimates from, and what it fills."""

    problem: Problem
    rows: EstimatedRows  # with what neighbours lead to expect, if there is a sweep before
    of_quantisation: Callable[[NDArray[np.int64]], Floats]
    chosen: ComponentChoice | None
    probability: Floats  # of components and scales, or of no camera pixels
    priors: dict[int, ResponsePrior]

    def estimate(self, selected: NDArray[np.int64], *, clips: bool, starts: bool) -> None:
        """Estimate some camera pixels by their own photos alone, or from what is expected."""
        model, rows = self.problem.model, self.rows
        centred, projector = model.centred, self.problem.measurements.projector
        known = None
        if not starts:
            known = _explained(self.problem, rows, self.of_quantisation, selected)
        batch = gather(self.problem.pixels, selected, centred, projector, known)
        given = self.chosen and self.chosen.of(selected)
        (component, scale), probability = choose(batch, model, given, is_first=starts)
        choice = rows.choices.sweeps[-1]
        choice.prior_component[selected], choice.prior_scale[selected] = component, scale
        if len(self.probability):
            self.probability[selected] = probability
        seen = component < len(LIT_COMPONENTS)
        batch.direct_weights[~seen] = 0.0
        batch = batch._replace(lit=seen)
        xp = namespace(component)
        for place in np.unique(fetch(component)).tolist():
            (alike,) = xp.nonzero(component == place)
            some, of_some = batch.only(alike), selected[alike]
            ratio = variance_ratio(some, scale[alike])
            is_clipped_too = clips and place < len(LIT_COMPONENTS)
            ratio = rounded_ratio(ratio) if is_clipped_too else ratio
            solve = solve_clipped if is_clipped_too else solve_whole
            found = _with_spikes(some, self.priors[place], ratio, solve, centred)
            rows.amplitudes[of_some] = found.amplitudes[..., :COMMON_AMPLITUDES]
            # What is found is added to what was expected.
            add_rows(rows.near, of_some, found.near)
            add_rows(rows.far, of_some, centred.uncentre(found.far, some.centres))
            rows.near_noise[of_some] = found.near_noise
            if place < len(LIT_COMPONENTS):
                # Neighbours across edges of direct light cost as much as they gain.
                rows.noise_left[of_some] = 1.0
            elif not starts:
                gain = response_gain(self.priors[place], ratio)
                rows.noise_left[of_some] = gain + (1.0 - gain) * rows.noise_left[of_some]


def _explained(
    problem: Problem,
    expected: EstimatedRows,
    of_quantisation: Callable[[NDArray[np.int64]], Floats],
    selected: NDArray[np.int64],
) -> Floats:
    """Return the expected responses, plus those of direct light to the quantisation error."""
    centred = problem.model.centred
    centres = problem.pixels.centres[selected]
    responses = product(expected.near[selected], centred.on_window.T)
    responses = centred.uncentre(responses, centres)
    responses += expected.far[selected]
    direct = expected.amplitudes[selected, :, 1, None]
    responses += direct * of_quantisation(selected)[:, None]
    return responses


def _empty_rows(problem: Problem) -> EstimatedRows:
    """Return rows of zeros for a sweep to fill."""
    responses = problem.pixels.responses
    xp, (number, channels, count) = namespace(responses), responses.shape

    def zeros(*shape: int, dtype: Any = xp.float32) -> Any:
        return xp.zeros(shape, dtype=dtype, device=device(responses))

    return EstimatedRows(
        zeros(number, channels, COMMON_AMPLITUDES),
        zeros(number, channels, problem.near_basis.count),
        zeros(number, channels, count),
        zeros(number, channels),
        xp.ones((number, channels), dtype=xp.float32, device=device(responses)),
        Choices((ComponentChoice(zeros(number, dtype=xp.int64), zeros(number)),)),
    )


def _parts(problem: Problem) -> Iterator[tuple[NDArray[np.int64], bool]]:
    """Yield batches of camera pixels, and whether the border clips their windows.

    Windows clipped alike are next to each other.
    """
    pixels, near_basis = problem.pixels, problem.near_basis
    projector = problem.measurements.projector
    length = batch_length(BATCH_PIXELS, pixels.responses)
    clipped = fetch(pixels.lit & is_clipped(pixels.centres, near_basis, projector))
    (selected,) = np.nonzero(clipped)
    places = fetch(pixels.centres)[selected]
    ordered = selected[np.lexsort(places.T[::-1])]
    for some, clips in ((np.flatnonzero(~clipped), False), (ordered, True)):
        for batch in blocks(len(some), length):
            yield some[batch], clips


def of_quantisation(problem: Problem) -> Callable[[slice | NDArray[np.int64]], Floats]:
    """Return a function that gives responses (n, R) of unit direct light to quantisation errors."""
    errors = problem.quantisation_error
    if not len(errors):
        return lambda selected: problem.pixels.responses[selected, 0] * np.float32(0.0)
    where = footprint(fetch(problem.pixels.correspondence), problem.measurements.projector)
    pixels, weights = (beside(values, errors) for values in where)
    return lambda selected: look_up_each(errors, pixels[selected], weights[selected])


def _with_spikes(
    batch: PixelBatch,
    prior: ResponsePrior,
    ratio: Floats,
    solve: Callable[[PixelBatch, ResponsePrior, Floats, CentredBasis], PosteriorMean],
    centred: CentredBasis,
) -> PosteriorMean:
    """Estimate camera pixels of one prior component, and add spikes to their windows."""
    mean = solve(batch, prior, ratio, centred)
    xp, here = namespace(mean.near), device(mean.near)
    number = xp.arange(len(ratio), device=here)
    found = mean
    for _ in range(MAXIMUM_SPIKES if bool(xp.any(batch.lit)) else 0):
        entry, gain = likeliest_spike(batch, prior, ratio, found)
        (accepted,) = xp.nonzero(gain > LEAST_GAIN)
        if not len(accepted):
            break
        number, ratio = number[accepted], ratio[accepted]
        batch = with_spike(batch.only(accepted), entry[accepted])
        found = solve(batch, prior, ratio, centred)
        windows = xp.asarray(found.near, copy=True)
        each, channel = (xp.arange(count, device=here) for count in windows.shape[:2])
        for spike in range(batch.spikes.shape[1]):
            at = (each[:, None], channel, batch.spikes[:, spike, None])
            windows[at] += found.amplitudes[..., COMMON_AMPLITUDES + spike]
        mean.near[number] = windows
        mean.far[number] = found.far
        mean.amplitudes[number] = found.amplitudes[..., :COMMON_AMPLITUDES]
    return mean


def _from_neighbours(problem: Problem, before: EstimatedRows) -> EstimatedRows:
    """Return the rows that a later sweep starts from: those expected from neighbours."""
    windows, far, noise_left = _expected(problem, before)
    sweeps = (*before.choices.sweeps, before.choices.sweeps[-1].of(slice(None)))
    choices = before.choices._replace(sweeps=sweeps)
    return before._replace(choices=choices, near=windows, far=far, noise_left=noise_left)


def _expected(problem: Problem, rows: EstimatedRows) -> tuple[Floats, Floats, Floats]:
    """Return n and f of camera pixels as neighbours lead to expect, and the noise left in f."""
    pixels, measurements = problem.pixels, problem.measurements
    camera, channels = measurements.camera, measurements.channels
    xp, shape = namespace(rows.near), (*camera, channels)
    white = pixels.white.reshape(shape)
    tiny = float(np.finfo(np.float32).tiny) ** 0.5
    noise = beside(measurements.noise.reshape(shape), rows.near)
    variance = xp.clip((noise / white) ** 2, min=tiny)
    basis = problem.model.centred.basis
    cycles = np.linalg.norm(basis.cycles * np.array(basis.projector), axis=1)[basis.index]
    far, noise_left = expect_each(
        rows.far.reshape((*shape, -1)),
        white,
        variance,
        problem.model.multiplicity,
        beside(np.flatnonzero(cycles >= np.median(cycles)), white),
    )
    far, noise_left = keep_common(far, noise_left, problem, variance)
    windows = expect_together(
        rows.near.reshape((*shape, -1)),
        white,
        rows.near_noise.reshape(shape) / white**2,
        pixels.lit.reshape(camera),
    )
    windows = windows.reshape((-1, *rows.near.shape[1:]))
    inside = near.inside_basis(pixels.centres, problem.near_basis, measurements.projector)
    windows *= inside[:, None]
    shapes = (-1, *rows.far.shape[1:]), rows.noise_left.shape
    return windows, far.reshape(shapes[0]), xp.astype(noise_left.reshape(shapes[1]), xp.float32)
