"""One sweep of the joint estimate over all camera pixels.

The first takes each camera pixel alone; later ones start from what is expected from its neighbours
and estimate the difference.

Index convention: arrays are (C, channels, ...); r runs over real responses, w over window entries.
"""

from collections.abc import Callable, Iterator
from math import log
from typing import Any, NamedTuple

import numpy as np
from array_api_compat import device
from numpy.typing import NDArray

from nearfar.arrays import Booleans, Floats, Integers, beside, blocks, fetch, namespace, product
from nearfar.estimate.joint.add_rows import add_rows
from nearfar.estimate.joint.batch import PixelBatch, gather
from nearfar.estimate.joint.clipped import is_clipped, rounded_ratio, solve_clipped
from nearfar.estimate.joint.cut import border_distances, is_cut, near_responses, solve_cut
from nearfar.estimate.joint.evidence import (
    best_of,
    log_evidence,
    log_evidence_by_row,
    log_evidences,
)
from nearfar.estimate.joint.neighbour_loops import (
    expect_each_by_pixel,
    expect_together_by_pixel,
)
from nearfar.estimate.joint.neighbours import expect_each, expect_together
from nearfar.estimate.joint.nuisance import COMMON_AMPLITUDES
from nearfar.estimate.joint.pooled_choice import (
    no_probabilities,
    pooled_choice,
    put_probabilities,
)
from nearfar.estimate.joint.problem import (
    Choices,
    ComponentChoice,
    EstimatedRows,
    Model,
    Problem,
)
from nearfar.estimate.joint.solve import PosteriorMean, solve_whole, variance_ratio
from nearfar.estimate.joint.spikes import (
    LEAST_GAIN,
    MAXIMUM_SPIKES,
    likeliest_spike,
    with_spike,
)
from nearfar.illumination.centred_basis import CentredBasis
from nearfar.parallel import side_by_side
from nearfar.priors.fitted import LIT_COMPONENTS
from nearfar.priors.responses import ResponsePrior
from nearfar.transport import near
from nearfar.transport.direct import footprint, look_up_each

# Where direct light explains this share of the power of the responses, it is there.
CERTAIN_SHARE = 0.5
# Camera pixels of a batch.
BATCH_PIXELS = 2048


class _Start(NamedTuple):
    """The state that a later sweep starts from."""

    before: EstimatedRows
    expected: EstimatedRows  # from the neighbours
    of_quantisation: Callable[[slice | NDArray[np.int64]], Floats]  # see `_of_quantisation`


def sweep_once(
    problem: Problem,
    before: EstimatedRows | None,
    report: Callable[[float], None],
    chosen: ComponentChoice | None = None,
) -> EstimatedRows:
    """Estimate every camera pixel once.

    Parameters
    ----------
    problem : Problem
    before : EstimatedRows, optional
        Of the sweep before; None in the first.
    report : callable
        Called with the share done.
    chosen : ComponentChoice, optional
        Prior components and scales, if they are chosen already.
    """
    pixels, model = problem.pixels, problem.model
    centred, projector = model.centred, problem.measurements.projector
    count = len(pixels.responses)
    rows = _empty_rows(problem)
    start = None
    if before is not None:
        start = _Start(before, _expected(problem, before), _of_quantisation(problem))
        # What is found is added to what was expected: no camera pixel reads another's expectation.
        rows = rows._replace(near=start.expected.near, far=start.expected.far)
        sweeps = (*before.choices.sweeps, *rows.choices.sweeps)
        rows = rows._replace(choices=before.choices._replace(sweeps=sweeps))
    choice = rows.choices.sweeps[-1]
    pools = start is None and chosen is None
    probability = no_probabilities(count if pools else 0, model, pixels.white)

    def put(selected: NDArray[np.int64], batch: PixelBatch, found: PosteriorMean) -> None:
        rows.amplitudes[selected] = found.amplitudes[..., :COMMON_AMPLITUDES]
        add_rows(rows.near, selected, found.near)
        add_rows(rows.far, selected, centred.uncentre(found.far, batch.centres))
        rows.near_noise[selected] = found.near_noise

    done = [0]
    solve_lit = {False: solve_whole, True: solve_clipped}
    if problem.near_basis.pitch > 1:
        solve_lit[True] = solve_cut

    def estimate(part: tuple[NDArray[np.int64], bool]) -> None:
        """Choose prior components, and estimate camera pixels whose windows are whole or not."""
        selected, clips = beside(part[0], pixels.responses), part[1]
        batch = gather(pixels, selected, centred, projector, _explained(problem, start, selected))
        given = chosen and chosen.of(selected)
        found, of_batch = _choose(batch, model, given, is_first=start is None)
        component, scale = found
        choice.prior_component[selected], choice.prior_scale[selected] = component, scale
        if pools:
            probability[selected] = of_batch
        seen = component < len(LIT_COMPONENTS)
        batch.direct_weights[~seen] = 0.0
        batch = batch._replace(lit=seen)
        priors = model.priors
        for place, alike, cut in _alike(batch, component, model, clips=clips):
            some = batch.only(alike)
            ratio = variance_ratio(some, scale[alike])
            ratio = rounded_ratio(ratio) if cut else ratio
            mean = _with_spikes(some, priors[place], ratio, solve_lit[cut], centred)
            put(selected[alike], some, mean)
        done[0] += len(part[0])
        report(done[0] / count)

    side_by_side(estimate, _parts(problem))
    if start is None:
        of_error_bars = choice
        if pools:
            of_error_bars = pooled_choice(probability, model, problem.measurements.camera)
        rows = rows._replace(choices=rows.choices._replace(of_error_bars=of_error_bars))
    return rows


def _alike(
    batch: PixelBatch, component: Integers, model: Model, *, clips: bool
) -> Iterator[tuple[int, NDArray[np.int64], bool]]:
    """Yield each prior component, its camera pixels, and whether the border cuts their windows.

    A component that fades soon does not reach every border that is in reach of the functions.
    """
    xp, centred = namespace(component), model.centred
    for place in np.unique(fetch(component)).tolist():
        (alike,) = xp.nonzero(component == place)
        cut = clips and place < len(LIT_COMPONENTS)
        if not cut or centred.near_basis.pitch == 1:
            yield place, alike, cut
            continue
        at_border = is_cut(
            batch.centres[alike],
            centred.near_basis,
            centred.basis.projector,
            model.priors[place].reach,
        )
        for is_one, some in ((False, alike[~at_border]), (True, alike[at_border])):
            if len(some):
                yield place, some, is_one


def _explained(
    problem: Problem, start: _Start | None, selected: slice | NDArray[np.int64]
) -> Floats | None:
    """Return the expected responses, plus those of direct light to the quantisation error."""
    if start is None:
        return None
    centred = problem.model.centred
    centres = problem.pixels.centres[selected]
    if centred.near_basis.pitch == 1:
        responses = product(start.expected.near[selected], centred.on_window.T)
    else:
        responses = near_responses(start.expected.near[selected], centres, centred)
    responses = centred.uncentre(responses, centres)
    responses += start.expected.far[selected]
    direct = start.before.amplitudes[selected, :, 1, None]
    responses += direct * start.of_quantisation(selected)[:, None]
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
        Choices((ComponentChoice(zeros(number, dtype=xp.int64), zeros(number)),)),
    )


def _choose(
    batch: PixelBatch, model: Model, given: ComponentChoice | None, *, is_first: bool
) -> tuple[ComponentChoice, Floats]:
    """Choose prior components where they are not given.

    In the first sweep a camera pixel for which q was found may turn out to have no direct light.

    Returns
    -------
    choice : ComponentChoice
    probability : ndarray, shape (n or 0, components, scales)
        In the first sweep, of all components and scales where they are not given; elsewhere 0.
    """
    xp = namespace(batch.white)
    if given is None:
        left = xp.ones_like(batch.lit)
        number = xp.zeros(left.shape, dtype=xp.int64, device=device(left))
        given = ComponentChoice(number, xp.zeros_like(batch.white[:, 0]))
    else:
        # Chosen when the camera pixel was lit and is not now, or the reverse.
        left = batch.lit != (given.prior_component < len(LIT_COMPONENTS))
    probability = no_probabilities(len(left) if is_first else 0, model, batch.white)
    # No shift of q has a say; nor has, among functions of several projector pixels, the references'
    # error, which takes a third of the time and changes no choice that matters.
    batch = batch._replace(direct_weights=batch.direct_weights[:, :1])
    evidence_of = log_evidence
    if model.centred.near_basis.pitch > 1:
        batch = batch._replace(of_offset=batch.of_offset[:, :0])
        evidence_of = log_evidence_by_row
    for selected, candidates in (
        (left & batch.lit, model.lit if is_first else model.lit_differences),
        (left & ~batch.lit, model.unlit),
    ):
        (mine,) = xp.nonzero(selected)
        if not len(mine):
            continue
        of_mine = batch if len(mine) == len(left) else batch.only(mine)
        values = log_evidences(of_mine, candidates, evidence_of)
        component, scale, evidence = best_of(values, candidates)
        if is_first:
            put_probabilities(probability, mine, values, candidates, model)
        if is_first and candidates is model.lit:
            (doubted,) = xp.nonzero(_is_doubtful(of_mine, model.centred))
            if len(doubted):
                dark_ones = _without_direct(of_mine.only(doubted))
                values = log_evidences(dark_ones, model.unlit, evidence_of)
                unlit, its_scale, without = best_of(values, model.unlit)
                # q was chosen among all projector pixels.
                none = without > evidence[doubted] - log(model.centred.basis.projector.pixels)
                component[doubted] = xp.where(none, unlit, component[doubted])
                scale[doubted] = xp.where(none, its_scale, scale[doubted])
                dark = mine[doubted[none]]
                put_probabilities(probability, dark, values[:, none], model.unlit, model)
        given.prior_component[mine] = component
        given.prior_scale[mine] = xp.astype(scale, xp.float32)
    return given, probability


def _is_doubtful(batch: PixelBatch, centred: CentredBasis) -> Booleans:
    """Return at which camera pixels direct light explains little of the responses, shape (n,)."""
    xp = namespace(batch.responses)
    direct = centred.of_direct(batch.direct_weights[:, :1])
    along = xp.sum(batch.responses * direct, axis=-1) ** 2
    power = xp.sum(batch.responses**2, axis=-1) * xp.sum(direct**2, axis=-1)
    doubtful: Booleans = xp.sum(along, axis=1) < CERTAIN_SHARE * xp.sum(power, axis=1)
    return doubtful


def _without_direct(batch: PixelBatch) -> PixelBatch:
    return batch._replace(direct_weights=batch.direct_weights[:, :1] * 0.0)


def _parts(problem: Problem) -> Iterator[tuple[NDArray[np.int64], bool]]:
    """Yield batches of camera pixels, and whether the border clips their windows.

    Windows clipped alike are next to each other.
    """
    pixels, near_basis = problem.pixels, problem.near_basis
    projector = problem.measurements.projector
    clipped = fetch(pixels.lit & is_clipped(pixels.centres, near_basis, projector))
    (selected,) = np.nonzero(clipped)
    places = fetch(pixels.centres)[selected]
    if near_basis.pitch > 1:
        places = border_distances(places, near_basis, projector)
    ordered = selected[np.lexsort(places.T[::-1])]
    for part, clips in ((np.flatnonzero(~clipped), False), (ordered, True)):
        for batch in blocks(len(part), BATCH_PIXELS):
            yield part[batch], clips


def _of_quantisation(problem: Problem) -> Callable[[slice | NDArray[np.int64]], Floats]:
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
    # A function of several projector pixels is no spike.
    has_spikes = centred.near_basis.pitch == 1 and bool(xp.any(batch.lit))
    for _ in range(MAXIMUM_SPIKES if has_spikes else 0):
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


def _expected(problem: Problem, rows: EstimatedRows) -> EstimatedRows:
    """Return the expectation of each camera pixel's rows from its neighbours."""
    pixels, measurements = problem.pixels, problem.measurements
    camera, channels = measurements.camera, measurements.channels
    xp, shape = namespace(rows.near), (*camera, channels)
    white = pixels.white.reshape(shape)
    tiny = float(np.finfo(np.float32).tiny) ** 0.5
    noise = beside(measurements.noise.reshape(shape), rows.near)
    variance = xp.clip((noise / white) ** 2, min=tiny)
    basis = problem.model.centred.basis
    cycles = np.linalg.norm(basis.cycles * np.array(basis.projector), axis=1)[basis.index]
    each, together = expect_each, expect_together
    if problem.near_basis.pitch > 1:
        each, together = expect_each_by_pixel, expect_together_by_pixel
    far = each(
        rows.far.reshape((*shape, -1)),
        white,
        variance,
        problem.model.multiplicity,
        beside(np.flatnonzero(cycles >= np.median(cycles)), white),
    )
    windows = together(
        rows.near.reshape((*shape, -1)),
        white,
        rows.near_noise.reshape(shape) / white**2,
        pixels.lit.reshape(camera),
    )
    windows = windows.reshape(rows.near.shape)
    if problem.near_basis.pitch == 1:
        inside = near.inside_basis(pixels.centres, problem.near_basis, measurements.projector)
        windows *= inside[:, None]
    return rows._replace(near=windows, far=far.reshape(rows.far.shape))
