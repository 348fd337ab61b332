"""One turn of the joint estimate over all camera pixels.

The first is taken alone; later ones start from what the neighbours expect of each camera pixel and
estimate what differs.

Index convention: arrays are (C, channels, ...); r runs over real responses, w over window entries.
"""

from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np
from array_api_compat import device
from numpy.typing import NDArray

from nearfar.arrays import Booleans, Floats, Integers, beside, blocks, fetch, namespace, product
from nearfar.estimate.joint.cut import rounded, solve_cut
from nearfar.estimate.joint.edges import MOST, SURE, likeliest_spike, with_spike
from nearfar.estimate.joint.evidence import Kinds, best_kind
from nearfar.estimate.joint.neighbours import expect_each, expect_together
from nearfar.estimate.joint.nuisance import KEPT
from nearfar.estimate.joint.pixels import (
    Pixels,
    Whole,
    gather,
)
from nearfar.estimate.joint.prior import Prior
from nearfar.estimate.joint.problem import Choice, Problem, Rows
from nearfar.estimate.joint.solve import Found, ratio_of, solve_whole
from nearfar.estimate.matrices import Band
from nearfar.parallel import side_by_side
from nearfar.transport import near
from nearfar.transport.direct import footprint, look_up_each
from nearfar.transport.kinds import LIT

# Camera pixels at once; and where the border cuts their windows.
BLOCK = 2048
CUT = 512


class _Known(NamedTuple):
    """What a turn starts from."""

    before: Rows
    expected: Rows  # by the neighbours
    misdrawn: Callable[[slice | NDArray[np.int64]], Floats]  # see `_misdrawn`


def take_turn(
    problem: Problem,
    before: Rows | None,
    report: Callable[[float], None],
    kept: Choice | None = None,
) -> Rows:
    """Estimate every camera pixel once.

    Parameters
    ----------
    problem : Problem
    before : Rows, optional
        Of the turn before; none in the first.
    report : callable
        Called with the share done.
    kept : Choice, optional
        Kinds that need not be chosen any more.
    """
    whole, model = problem.whole, problem.model
    band, projector = model.band, problem.measurements.projector
    xp, number = namespace(whole.responses), len(whole.responses)
    rows = _empty_rows(problem, before)
    choice = rows.choices[-1]
    known = None
    if before is not None:
        known = _Known(before, _expected(problem, before), _misdrawn(problem))
    cut = whole.lit & ~xp.all(near.inside(whole.centres, problem.window, projector), axis=1)

    def shown(chosen: slice | NDArray[np.int64]) -> Floats | None:
        """Responses that are expected, and what 8 bits made of direct light."""
        if known is None:
            return None
        responses = product(known.expected.near[chosen], band.on_window.T)
        responses = band.uncentre(responses, whole.centres[chosen])
        responses += known.expected.far[chosen]
        responses += known.before.shared[chosen, :, 1, None] * known.misdrawn(chosen)[:, None]
        return responses

    def put(chosen: NDArray[np.int64], pixels: Pixels, found: Found) -> None:
        rows.shared[chosen] = found.shared[..., :KEPT]
        rows.near[chosen] = found.near
        rows.far[chosen] = band.uncentre(found.far, pixels.centres)
        rows.near_noise[chosen] = found.near_noise

    done = [0]

    def choose(block: slice) -> None:
        """Choose the kinds of a block, and estimate those whose windows are whole."""
        pixels = gather(whole, block, band, projector, shown(block))
        for lit, first, kinds in ((True, 0, model.lit), (False, len(LIT), model.unlit)):
            (mine,) = xp.nonzero(pixels.lit == lit)
            if not len(mine) or kinds is None:
                continue
            settled = kept and kept.of(block.start + mine, first)
            kind, strength = _kinds_of(pixels.only(mine), kinds, settled)
            choice.kind[block.start + mine] = kind + first
            choice.strength[block.start + mine] = strength
            uncut = ~cut[block.start + mine]
            for place in np.unique(fetch(kind[uncut])).tolist():
                (of_kind,) = xp.nonzero(uncut & (kind == place))
                some = pixels.only(mine[of_kind])
                ratio = ratio_of(some, strength[of_kind])
                put(
                    block.start + mine[of_kind],
                    some,
                    _with_edges(some, kinds.priors[place], ratio, solve_whole, band),
                )
        done[0] += block.stop - block.start
        report(done[0] / number)

    def estimate_cut(part: NDArray[np.int64]) -> None:
        """Estimate camera pixels of one kind whose windows the border cuts."""
        chosen = beside(part, whole.responses)
        pixels = gather(whole, chosen, band, projector, shown(chosen))
        prior = model.lit.priors[int(choice.kind[chosen[0]])]
        ratio = rounded(ratio_of(pixels, choice.strength[chosen]))
        put(chosen, pixels, _with_edges(pixels, prior, ratio, solve_cut, band))

    side_by_side(choose, blocks(number, BLOCK))
    side_by_side(estimate_cut, _cut_alike(whole, choice.kind, cut))
    if known is None:
        return rows
    return rows._replace(near=rows.near + known.expected.near, far=rows.far + known.expected.far)


def _empty_rows(problem: Problem, before: Rows | None) -> Rows:
    """Make room for what a turn finds, behind the choices of the turns before."""
    responses = problem.whole.responses
    xp, (number, channels, count) = namespace(responses), responses.shape

    def zeros(*shape: int, dtype: Any = xp.float32) -> Any:
        return xp.zeros(shape, dtype=dtype, device=device(responses))

    return Rows(
        zeros(number, channels, KEPT),
        zeros(number, channels, problem.window**2),
        zeros(number, channels, count),
        zeros(number, channels),
        (
            *(before.choices if before is not None else ()),
            Choice(zeros(number, dtype=xp.int64), zeros(number)),
        ),
    )


def _kinds_of(pixels: Pixels, kinds: Kinds, settled: Choice | None) -> tuple[Integers, Floats]:
    """Choose the kinds of camera pixels, places among `kinds`, where they are not settled."""
    if settled is None:
        kind, strength, _ = best_kind(pixels, kinds)
        return kind, namespace(strength).astype(strength, namespace(strength).float32)
    xp = namespace(settled.kind)
    (left,) = xp.nonzero((settled.kind < 0) | (settled.kind >= len(kinds.priors)))
    if len(left):
        kind, strength = _kinds_of(pixels.only(left), kinds, None)
        settled.kind[left], settled.strength[left] = kind, strength
    return settled


def _cut_alike(whole: Whole, kind: Integers, cut: Booleans) -> Iterator[NDArray[np.int64]]:
    """Cut camera pixels into groups of one kind, those whose windows are cut alike together."""
    (chosen,) = np.nonzero(fetch(cut))
    centres, kind = fetch(whole.centres)[chosen], fetch(kind)
    order = chosen[np.lexsort((centres[:, 1], centres[:, 0], kind[chosen]))]
    for group in np.split(order, np.flatnonzero(np.diff(kind[order])) + 1):
        for part in blocks(len(group), CUT):
            yield group[part]


def _misdrawn(problem: Problem) -> Callable[[slice | NDArray[np.int64]], Floats]:
    """Return what tells the responses (n, R) of unit direct light to what 8 bits got wrong."""
    # A row for each projector pixel, so that what a camera pixel asks for lies side by side.
    quantisation_error = problem.measurements.quantisation_error[problem.model.band.places]
    where = footprint(fetch(problem.whole.correspondence), problem.measurements.projector)
    error, places, shares = (
        beside(np.ascontiguousarray(values), problem.whole.responses)
        for values in (quantisation_error.T, where.pixels, where.weights)
    )

    return lambda chosen: look_up_each(error, places[chosen], shares[chosen])


def _with_edges(
    pixels: Pixels,
    prior: Prior,
    ratio: Floats,
    solve: Callable[[Pixels, Prior, Floats, Band], Found],
    band: Band,
) -> Found:
    """Estimate camera pixels of one kind, direct light of second surfaces in their windows."""
    whole = solve(pixels, prior, ratio, band)
    xp, here = namespace(whole.near), device(whole.near)
    number = xp.arange(len(ratio), device=here)
    found = whole
    for _ in range(MOST if bool(xp.any(pixels.lit)) else 0):
        entry, gain = likeliest_spike(pixels, prior, ratio, found)
        (sure,) = xp.nonzero(gain > SURE)
        if not len(sure):
            break
        number, ratio = number[sure], ratio[sure]
        pixels = with_spike(pixels.only(sure), entry[sure])
        found = solve(pixels, prior, ratio, band)
        windows = xp.asarray(found.near, copy=True)
        each, channel = (xp.arange(count, device=here) for count in windows.shape[:2])
        for spike in range(pixels.spikes.shape[1]):
            at = (each[:, None], channel, pixels.spikes[:, spike, None])
            windows[at] += found.shared[..., KEPT + spike]
        whole.near[number] = windows
        whole.far[number] = found.far
        whole.shared[number] = found.shared[..., :KEPT]
    return whole


def _expected(problem: Problem, rows: Rows) -> Rows:
    """Ask the neighbours of each camera pixel what they expect of it."""
    whole, measurements = problem.whole, problem.measurements
    camera, channels = measurements.camera, measurements.channels
    xp, shape = namespace(rows.near), (*camera, channels)
    white = whole.white.reshape((*shape, 1))
    tiny = float(np.finfo(np.float32).tiny) ** 0.5
    noise = beside(measurements.noise.reshape(shape), rows.near)
    variance = xp.clip((noise / white[..., 0]) ** 2, min=tiny)
    far = expect_each(rows.far.reshape((*shape, -1)) / white, variance, problem.model.multiplicity)
    windows = expect_together(
        rows.near.reshape((*shape, -1)) / white,
        rows.near_noise.reshape(shape) / white[..., 0] ** 2,
        whole.lit.reshape(camera),
    )
    inside = near.inside(whole.centres, problem.window, measurements.projector)
    windows *= white
    far *= white
    return rows._replace(
        near=windows.reshape(rows.near.shape) * inside[:, None],
        far=far.reshape(rows.far.shape),
    )
