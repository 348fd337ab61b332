"""One sweep of the joint estimate over half of the camera pixels, at a pitch over 1.

What is expected of all of them is subtracted from their responses first. Of each run of camera
pixels of a row one then chooses its prior component and scale by its own photos and is estimated,
and after that those beside it, with the same choice where their responses fit it as well.

Index convention: n runs over the camera pixels of the sweep, its places, in an order of its own;
arrays are (n, channels, ...); r runs over real responses, j over functions.
"""

from collections.abc import Callable, Iterator
from functools import partial
from typing import NamedTuple

import numpy as np

from nearfar.arrays import Booleans, Floats, Integers, blocks
from nearfar.estimate.joint.batch import PixelBatch
from nearfar.estimate.joint.chessboard import Part
from nearfar.estimate.joint.choose import choose, is_doubtful
from nearfar.estimate.joint.cut import border_distances, is_cut, near_responses
from nearfar.estimate.joint.footprint import put_footprint_weights, unit_responses
from nearfar.estimate.joint.neighbour_loops import (
    Expectation,
    expect_each_by_pixel,
    expect_together_by_pixel,
)
from nearfar.estimate.joint.nuisance import COMMON_AMPLITUDES
from nearfar.estimate.joint.problem import Choices, ComponentChoice, EstimatedRows, Problem
from nearfar.estimate.joint.shared_choice import chooser_of_each
from nearfar.estimate.joint.solve import variance_ratio
from nearfar.estimate.joint.solve_hats import leading_count, solve_hats
from nearfar.estimate.joint.turn import left_of_responses, put_ones, put_sums
from nearfar.parallel import side_by_side
from nearfar.priors.fitted import LIT_COMPONENTS

# Camera pixels of a batch.
BATCH_PIXELS = 2048
# Log likelihood by which the responses of a camera pixel may fit a choice better or worse than
# those of the camera pixel that made it.
LARGEST_MISFIT = 20.0


def sweep_half(
    problem: Problem,
    before: EstimatedRows | None,
    report: Callable[[float], None],
    chosen: ComponentChoice | None,
    part: Part,
) -> EstimatedRows:
    """Estimate half of the camera pixels once.

    Parameters
    ----------
    problem : Problem
    before : EstimatedRows, optional
        Of the sweep before, whose arrays are overwritten; None in the first.
    report : callable
        Called with the share done.
    chosen : ComponentChoice, optional
        Prior components and scales, if they are chosen already.
    part : Part
        Camera pixels to estimate.
    """
    order = _order(problem, part.selected)
    if before is None:
        rows = _empty_rows(problem)
        left = _whole(problem, order)
    else:
        sweeps = (*before.choices.sweeps, before.choices.sweeps[-1].of(slice(None)))
        rows = before._replace(choices=before.choices._replace(sweeps=sweeps))
        left = _less_expected(problem, before, part._replace(selected=order))
    sweep = _HalfSweep(
        problem,
        rows,
        left,
        order,
        starts=before is None,
        is_new=not part.known.all(),
        moves_q=part.moves_q,
        has_offset=problem.has_offset_noise,
        misfit=np.zeros(len(order)),
    )
    sweep.run(chosen, report)
    if before is None:
        choices = rows.choices._replace(of_error_bars=rows.choices.sweeps[-1])
        rows = rows._replace(choices=choices)
    return rows


class _Left(NamedTuple):
    """What is expected of the camera pixels of a sweep, and what that leaves of their responses.

    Attributes
    ----------
    near : ndarray, shape (n, channels, J)
    far : ndarray, shape (n, channels, R)
        As measured.
    responses : ndarray, shape (n, channels, R)
        Re-centred.
    """

    near: Floats
    far: Floats
    responses: Floats


class _HalfSweep(NamedTuple):
    """What a sweep estimates from, and what it fills."""

    problem: Problem
    rows: EstimatedRows
    left: _Left
    order: Integers  # camera pixel of each place
    starts: bool
    is_new: bool  # whether no sweep has estimated these camera pixels before
    moves_q: bool  # whether shifts of q are estimated
    has_offset: bool  # whether the references have noise
    misfit: Floats  # of each place's responses, by its choice

    def run(self, chosen: ComponentChoice | None, report: Callable[[float], None]) -> None:
        """Choose for, and estimate, all camera pixels."""
        # Row by row: rounding hangs on where a camera pixel stands in a product, which is then the
        # same in a tile that begins with the same row.
        everywhere = np.argsort(self.order)
        if chosen is not None:
            for mine, given in zip(self.rows.choices.sweeps[-1], chosen, strict=True):
                mine[self.order] = given[self.order]
            is_changed = self._chosen_lit() != self.problem.pixels.lit[self.order]
            self._choose(everywhere[is_changed[everywhere]])
            if self.is_new and not self.starts:
                batch = self._choosing(everywhere)
                doubted = batch.lit & is_doubtful(batch, self.problem.model.centred)
                self._forget(everywhere[doubted])
            self._solve(everywhere)
            report(1.0)
            return
        chooser = chooser_of_each(self.order, self.problem.measurements.camera)
        is_chooser = (chooser == np.arange(len(chooser)))[everywhere]
        choosers, others = everywhere[is_chooser], everywhere[~is_chooser]
        self._choose(choosers)
        self._solve(choosers)
        report(0.4)
        alike = self._adopt(others, chooser[others])
        fits = alike[self._solve(alike, like=chooser)]
        report(0.8)
        own = others[~np.isin(others, fits)]
        self._choose(own)
        self._solve(own)
        report(1.0)

    def _chosen_lit(self) -> Booleans:
        component = self.rows.choices.sweeps[-1].prior_component[self.order]
        return np.asarray(component < len(LIT_COMPONENTS))

    def _adopt(self, places: Integers, chooser: Integers) -> Integers:
        """Give places the choice of others, and return those that are lit as it says."""
        for values in self.rows.choices.sweeps[-1]:
            values[self.order[places]] = values[self.order[chooser]]
        lit = self.problem.pixels.lit[self.order]
        return np.asarray(places[self._chosen_lit()[places] == lit[places]])

    def _choose(self, places: Integers) -> None:
        """Choose prior components and scales by the photos of each place."""
        side_by_side(
            self._choose_some, [places[batch] for batch in blocks(len(places), BATCH_PIXELS)]
        )

    def _choose_some(self, places: Integers) -> None:
        problem = self.problem
        batch = self._choosing(places)
        rest = places
        if self.is_new and not self.starts:
            doubted = batch.lit & is_doubtful(batch, problem.model.centred)
            (alone,), (remaining,) = np.nonzero(doubted), np.nonzero(~doubted)
            if len(alone):
                self._forget(places[alone])
                afresh = self._choosing(places[alone])
                self._put_choice(places[alone], afresh, is_first=True)
                rest, batch = places[remaining], batch.only(remaining)
        if len(rest):
            self._put_choice(rest, batch, is_first=self.starts)

    def _put_choice(self, places: Integers, batch: PixelBatch, *, is_first: bool) -> None:
        found, _ = choose(batch, self.problem.model, None, is_first=is_first)
        for values, mine in zip(self.rows.choices.sweeps[-1], found, strict=True):
            values[self.order[places]] = mine

    def _forget(self, places: Integers) -> None:
        """Expect nothing of places: they may have no direct light, unlike their neighbours."""
        alone = _whole(self.problem, self.order[places])
        for mine, found in zip(self.left, alone, strict=True):
            mine[places] = found

    def _solve(self, places: Integers, like: Integers | None = None) -> Booleans:
        """Estimate places by their choices, and return which of them fit these.

        Only those that fit as well as the places `like` are put into the rows; all if it is None.
        """
        choice = self.rows.choices.sweeps[-1].of(self.order[places])
        fits = np.ones(len(places), dtype=bool)

        def work(some: tuple[int, int, Integers]) -> None:
            number, count, mine = some
            fits[mine] = self._solve_alike(places[mine], number, count, like)

        side_by_side(work, list(self._alike(choice, self.order[places])))
        return fits

    def _alike(
        self, choice: ComponentChoice, selected: Integers
    ) -> Iterator[tuple[int, int, Integers]]:
        """Yield components, and those of chosen camera pixels that share eigenvectors of each."""
        pixels = self.problem.pixels
        signal = np.max(pixels.white[selected] / pixels.noise[selected], axis=1)
        largest = (choice.prior_scale * signal) ** 2
        for number in np.unique(choice.prior_component).tolist():
            mine = np.flatnonzero(choice.prior_component == number)
            counts = leading_count(self.problem.model.priors[number], largest[mine])
            for count in np.unique(counts).tolist():
                some = mine[counts == count]
                for batch in blocks(len(some), BATCH_PIXELS):
                    yield number, count, some[batch]

    def _solve_alike(
        self, places: Integers, number: int, count: int, like: Integers | None
    ) -> Booleans:
        rows, centred = self.rows, self.problem.model.centred
        batch, units = self._with_units(places)
        doubted = np.zeros(len(places), dtype=bool)
        if like is not None and self.is_new:
            doubted = batch.lit & is_doubtful(batch, centred)
        seen = number < len(LIT_COMPONENTS)
        if not seen:
            batch.direct_weights[:] = 0.0
        batch = batch._replace(lit=np.full(len(places), seen))
        selected = self.order[places]
        ratio = variance_ratio(batch, rows.choices.sweeps[-1].prior_scale[selected])
        prior, near_basis = self.problem.model.priors[number], self.problem.near_basis
        found = solve_hats(batch, units, prior, ratio, count, near_basis)
        self.misfit[places] = found.misfit
        fits = ~doubted
        if like is not None:
            fits &= np.abs(found.misfit - self.misfit[like[places]]) < 2 * LARGEST_MISFIT
            kept = np.flatnonzero(fits)
            if len(kept) < len(fits):
                places, selected = places[kept], selected[kept]
                found = type(found)._make(values[kept] for values in found)
        rows.amplitudes[selected] = found.amplitudes[..., :COMMON_AMPLITUDES]
        rows.near_noise[selected] = found.near_noise
        # What is found is added to what was expected.
        put_sums(
            self.left.near,
            self.left.far,
            found.near,
            found.far,
            places,
            selected,
            self.problem.pixels.centres[selected],
            centred.basis.single_phases,
            rows.near,
            rows.far,
        )
        return fits

    def _choosing(self, places: Integers) -> PixelBatch:
        """Return a batch of places, with the responses that a choice asks for."""
        weights = _unit_direct(self.problem, self.order[places])
        nothing = np.zeros((len(places), 0, weights.shape[1]), dtype=np.float32)
        return self._batch(places, weights[:, None], nothing)

    def _with_units(self, places: Integers) -> tuple[PixelBatch, Floats]:
        """Return a batch of places, and responses to unit amplitudes, which it has views of."""
        problem, selected = self.problem, self.order[places]
        pixels, centred = problem.pixels, problem.model.centred
        centres, first = pixels.centres[selected], int(self.has_offset)
        of_direct = 3 if self.moves_q else 1
        units = np.empty((len(places), first + of_direct, centred.basis.count), dtype=np.float32)
        if first:
            put_ones(centres, centred.basis.single_phases, units)
        q, footprints = pixels.correspondence[selected], pixels.footprint[selected]
        if self.moves_q:
            put_footprint_weights(q, centres, footprints, centred, first, units)
        else:
            units[:, first] = _unit_direct(problem, selected)
        return self._batch(places, units[:, first:], units[:, :first]), units

    def _batch(self, places: Integers, direct_weights: Floats, of_offset: Floats) -> PixelBatch:
        pixels, selected = self.problem.pixels, self.order[places]
        nothing = np.zeros((len(places), 0), dtype=np.int64)
        return PixelBatch(
            centres=pixels.centres[selected],
            lit=pixels.lit[selected],
            inside=nothing.astype(bool),
            responses=self.left.responses[places],
            direct_weights=direct_weights,
            of_offset=of_offset,
            spikes=nothing,
            noise=pixels.noise[selected],
            offset_noise=pixels.offset_noise[selected],
            white=pixels.white[selected],
            spike_expected=nothing.astype(bool),
        )


def _unit_direct(problem: Problem, selected: Integers) -> Floats:
    """Return responses of unit direct light of camera pixels, (n, R); 0 where there is none."""
    pixels, lit = problem.pixels, problem.pixels.lit[selected]
    offsets = pixels.correspondence[selected] - pixels.centres[selected]
    middles = np.where(lit[:, None], offsets, 0.0)
    found = unit_responses(middles, pixels.footprint[selected], problem.model.centred)
    found[~lit] = 0.0
    return found


def _order(problem: Problem, selected: Integers) -> Integers:
    """Return camera pixels so that those whose functions are cut alike are next to each other."""
    pixels, near_basis = problem.pixels, problem.near_basis
    projector = problem.measurements.projector
    cut = pixels.lit[selected] & is_cut(pixels.centres[selected], near_basis, projector)
    at_border = selected[cut]
    distances = border_distances(pixels.centres[at_border], near_basis, projector)
    return np.concatenate([selected[~cut], at_border[np.lexsort(distances.T[::-1])]])


def _batches(problem: Problem, order: Integers) -> list[slice]:
    """Return batches of ordered camera pixels; those whose functions are cut alike are in one."""
    pixels, near_basis = problem.pixels, problem.near_basis
    distances = border_distances(pixels.centres[order], near_basis, problem.measurements.projector)
    changes = np.any(distances[1:] != distances[:-1], axis=1)
    whole = np.flatnonzero(np.all(distances == near_basis.reach, axis=1))
    found, start = [], 0
    ends = np.concatenate([whole[BATCH_PIXELS::BATCH_PIXELS], 1 + np.flatnonzero(changes)])
    for end in [*np.unique(ends).tolist(), len(order)]:
        if end - start >= BATCH_PIXELS or end == len(order):
            found.append(slice(start, end))
            start = end
    return found


def _empty_rows(problem: Problem) -> EstimatedRows:
    """Return rows of zeros for the first sweep to fill."""
    number, channels, count = problem.pixels.responses.shape

    def zeros(*shape: int) -> Floats:
        return np.zeros((number, channels, *shape), dtype=np.float32)

    choice = ComponentChoice(np.zeros(number, dtype=np.int64), np.zeros(number, dtype=np.float32))
    return EstimatedRows(
        zeros(COMMON_AMPLITUDES),
        zeros(problem.near_basis.count),
        zeros(count),
        zeros(),
        np.ones((number, channels), dtype=np.float32),
        Choices((choice,)),
    )


def _whole(problem: Problem, order: Integers) -> _Left:
    """Return that nothing is expected of camera pixels."""
    _, channels, count = problem.pixels.responses.shape
    shape = (len(order), channels)
    near = np.zeros((*shape, problem.near_basis.count), dtype=np.float32)
    far = np.zeros((*shape, count), dtype=np.float32)
    found = _Left(near, far, np.zeros_like(far))
    side_by_side(partial(_put_residuals, problem, order, found), _batches(problem, order))
    return found


def _less_expected(problem: Problem, rows: EstimatedRows, part: Part) -> _Left:
    """Return the expectation of a part's camera pixels from their neighbours, and the residuals."""
    near, far = (
        np.empty((len(part.selected), *values.shape[1:]), dtype=np.float32)
        for values in (rows.near, rows.far)
    )
    found = _Left(near, far, np.empty_like(far))
    put_near, put_far = _expectations(problem, rows, part.known)

    def work(batch: slice) -> None:
        some = part.selected[batch]
        put_near(some, near[batch])
        put_far(some, far[batch])
        centres = problem.pixels.centres[some]
        found.responses[batch] = near_responses(near[batch], centres, problem.model.centred)
        _put_residuals(problem, part.selected, found, batch)

    side_by_side(work, _batches(problem, part.selected))
    return found


def _put_residuals(problem: Problem, order: Integers, left: _Left, batch: slice) -> None:
    """Replace the expected near-range responses of a batch by the residuals of its responses."""
    pixels, some = problem.pixels, order[batch]
    left_of_responses(
        pixels.responses,
        some,
        left.far[batch],
        pixels.centres[some],
        problem.model.centred.basis.single_phases,
        left.responses[batch],
    )


def _expectations(
    problem: Problem, rows: EstimatedRows, known: Booleans
) -> tuple[Expectation, Expectation]:
    """Return filters that write n and f of camera pixels as their neighbours lead to expect."""
    pixels, measurements = problem.pixels, problem.measurements
    shape = (*measurements.camera, measurements.channels)
    white = pixels.white.reshape(shape)
    tiny = float(np.finfo(np.float32).tiny) ** 0.5
    variance = np.clip((measurements.noise.reshape(shape) / white) ** 2, min=tiny)
    basis = problem.model.centred.basis
    cycles = np.linalg.norm(basis.cycles * np.array(basis.projector), axis=1)[basis.index]
    of_far = expect_each_by_pixel(
        rows.far.reshape((*shape, -1)),
        white,
        variance,
        problem.model.multiplicity,
        np.flatnonzero(cycles >= np.median(cycles)),
        known,
    )
    of_near = expect_together_by_pixel(
        rows.near.reshape((*shape, -1)),
        white,
        rows.near_noise.reshape(shape) / white**2,
        pixels.lit.reshape(measurements.camera),
        known,
    )
    return of_near, of_far
