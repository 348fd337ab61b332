"""The joint estimate: direct, near and far in one model, each camera pixel by its own kind.

First every camera pixel chooses a kind and a strength by its own photos and takes the posterior
mean. Then, in turns, each starts from what its neighbours expect and estimates what differs.

Index convention: arrays are (C, channels, ...); r runs over real answers, w over window entries.
"""

from collections.abc import Callable, Iterator
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Floats, Integers, Size, blocks, product
from nearfar.errors import InputError
from nearfar.estimate.joint.cut import rounded, solve_cut
from nearfar.estimate.joint.edges import MOST, SURE, likeliest_spike, seen_beside, with_spike
from nearfar.estimate.joint.evidence import Kinds, best_kind, screened
from nearfar.estimate.joint.neighbours import expect_each, expect_together
from nearfar.estimate.joint.nuisance import KEPT
from nearfar.estimate.joint.pixels import (
    EXACT,
    Pixels,
    Whole,
    dc_place,
    gather,
    offset_noise,
    scale_of,
)
from nearfar.estimate.joint.positive import raise_to
from nearfar.estimate.joint.prior import Prior, build_prior
from nearfar.estimate.joint.solve import Found, ratio_of, solve_whole
from nearfar.estimate.matrices import Band, band_of
from nearfar.illumination.frequencies import DC, Frequency, far_frequencies
from nearfar.parallel import side_by_side
from nearfar.photometry.measurements import Measurements
from nearfar.transport import near
from nearfar.transport.belief import Belief
from nearfar.transport.direct import footprint
from nearfar.transport.far import real_basis
from nearfar.transport.kinds import LIT, UNLIT, Kind
from nearfar.transport.model import Transport

# Turns: one alone, the rest with the neighbours.
TURNS = 3
# Camera pixels at once; and where the border cuts their windows.
BLOCK = 2048
CUT = 512
# Direct light this close to a whole projector pixel is taken to be all that pixel's: noise moves q
# by as much, and a footprint of 10 % too much beside q cost 1.5 dB under a random light. What
# really lies beside it, kinds with spread find.
WHOLE = 0.1
# q moves by no more than this in one turn, and stays where it was rounded to.
FURTHEST = 0.25
HALF = 0.499


class _Rows(NamedTuple):
    """Rows of all camera pixels, photo units."""

    shared: Floats  # o, d and d times what q is off by, (C, channels, 4)
    near: Floats  # (C, channels, W^2)
    far: Floats  # (C, channels, R), as measured
    near_noise: Floats  # (C, channels)
    kind: Integers  # (C,), place in LIT + UNLIT
    strength: Floats  # (C,), share of white


class _Known(NamedTuple):
    """What a turn starts from."""

    before: _Rows
    expected: _Rows  # by the neighbours
    misdrawn: Callable[[slice | NDArray[np.int64]], Floats]  # see `_misdrawn`


class _Model(NamedTuple):
    """Kinds for a set of measured frequencies."""

    band: Band
    repeats: Floats
    lit: Kinds
    unlit: Kinds | None


class _Problem(NamedTuple):
    """What all turns share."""

    measurements: Measurements
    model: _Model
    whole: Whole
    window: int


def estimate_jointly(
    measurements: Measurements,
    correspondence: Floats,
    window: int,
    far: Size,
    *,
    turns: int = TURNS,
    progress: Callable[[float], None] | None = None,
) -> Transport:
    """Estimate D, N and F together.

    Parameters
    ----------
    measurements : Measurements
        With white, and at least one other frequency.
    correspondence : ndarray, shape (Cy, Cx, 2)
        q as (y, x), NaN where there is no direct light. The transport's own is rounded where it
        is nearly whole, and else moved by the little that the photos ask for.
    window : int
        W: near-range light lies within, however much less far it reaches.
    far : Size
        Far band: f is kept at its measured frequencies.
    turns : int
        One alone, the rest with the neighbours.
    progress : callable, optional
        Called with the share done.

    Returns
    -------
    Transport

    Raises
    ------
    InputError
        If white or everything else is missing.
    """
    frequencies = [k for k in measurements.basis.frequencies if k != DC]
    if len(frequencies) == len(measurements.basis.frequencies) or not frequencies:
        raise InputError(
            "these measurements lack white, or all but white: plan with --photos, or --near and "
            "--far."
        )
    problem = _problem(measurements, correspondence, window, frequencies)
    rows = None
    for turn in range(turns):

        def report(share: float, turn: int = turn) -> None:
            if progress is not None:
                progress((turn + share) / turns)

        rows = _turn(problem, rows, report)
        whole = problem.whole._replace(correspondence=_moved(problem, rows))
        problem = problem._replace(whole=whole)
    assert rows is not None
    return _transport(problem, rows, far)


def _problem(
    measurements: Measurements, correspondence: Floats, window: int, frequencies: list[Frequency]
) -> _Problem:
    # Pairs of a cosine and a sine side by side, those that answer no sine at the end.
    frequencies = sorted(frequencies, key=lambda k: k.is_own_negative)
    basis = real_basis(frequencies, measurements.projector)
    plain = band_of(basis, near.offsets(window))
    band = Band(basis, measurements.places(frequencies), plain.on_window, plain.on_corners)
    rounded = np.rint(correspondence)
    close = np.abs(correspondence - rounded) < WHOLE
    correspondence = np.where(close, rounded, correspondence).astype(np.float64)
    lit = np.isfinite(correspondence).all(axis=-1).ravel()
    white = scale_of(measurements)
    whole = Whole(
        answers=measurements.answers[..., band.places],
        correspondence=correspondence.reshape(-1, 2),
        centres=near.centre(correspondence, measurements.projector),
        lit=lit,
        noise=np.maximum(measurements.noise, EXACT * white),
        offset_noise=offset_noise(measurements),
        white=white,
        likely=seen_beside(correspondence, window),
    )
    repeats = measurements.repeats[band.places]
    shown = (tuple(frequencies), measurements.projector, window, tuple(repeats.tolist()))
    unlit = None if lit.all() else _kinds(UNLIT, *shown)
    model = _Model(band, repeats, _kinds(LIT, *shown), unlit)
    return _Problem(measurements, model, whole, window)


# Blocks of camera rows share them, those of lit and of unlit camera pixels.
@lru_cache(maxsize=2)
def _kinds(
    kinds: tuple[Kind, ...],
    frequencies: tuple[Frequency, ...],
    projector: Size,
    window: int,
    repeats: tuple[float, ...],
) -> Kinds:
    """Build the kinds for a set of measured frequencies and how often each was measured."""
    band = band_of(real_basis(frequencies, projector), near.offsets(window))
    measured = np.array(repeats, dtype=np.float32)
    return screened(tuple(build_prior(kind, band, measured) for kind in kinds), band, measured)


def _turn(problem: _Problem, before: _Rows | None, report: Callable[[float], None]) -> _Rows:
    """Estimate every camera pixel once."""
    whole, model = problem.whole, problem.model
    band, projector = model.band, problem.measurements.projector
    number, channels, count = whole.answers.shape
    rows = _Rows(
        np.zeros((number, channels, KEPT), dtype=np.float32),
        np.zeros((number, channels, problem.window**2), dtype=np.float32),
        np.zeros((number, channels, count), dtype=np.float32),
        np.zeros((number, channels), dtype=np.float32),
        np.zeros(number, dtype=np.int64),
        np.zeros(number, dtype=np.float32),
    )
    known = None
    if before is not None:
        known = _Known(before, _expected(problem, before), _misdrawn(problem))
    cut = whole.lit & ~near.inside(whole.centres, problem.window, projector).all(axis=1)

    def shown(chosen: slice | NDArray[np.int64]) -> Floats | None:
        """Answers that are expected, and what 8 bits made of direct light."""
        if known is None:
            return None
        answers = product(known.expected.near[chosen], band.on_window.T)
        answers = band.uncentre(answers, whole.centres[chosen])
        answers += known.expected.far[chosen]
        answers += known.before.shared[chosen, :, 1, None] * known.misdrawn(chosen)[:, None]
        return answers

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
            mine = np.flatnonzero(pixels.lit == lit)
            if not len(mine) or kinds is None:
                continue
            kind, strength, _ = best_kind(pixels.only(mine), kinds)
            rows.kind[block.start + mine] = kind + first
            rows.strength[block.start + mine] = strength
            uncut = ~cut[block.start + mine]
            for place in np.unique(kind[uncut]):
                of_kind = np.flatnonzero(uncut & (kind == place))
                some = pixels.only(mine[of_kind])
                ratio = ratio_of(some, strength[of_kind])
                put(
                    block.start + mine[of_kind],
                    some,
                    _with_edges(some, kinds.priors[place], ratio, solve_whole, band),
                )
        done[0] += block.stop - block.start
        report(done[0] / number)

    def estimate_cut(chosen: NDArray[np.int64]) -> None:
        """Estimate camera pixels of one kind whose windows the border cuts."""
        pixels = gather(whole, chosen, band, projector, shown(chosen))
        prior = model.lit.priors[rows.kind[chosen[0]]]
        ratio = rounded(ratio_of(pixels, rows.strength[chosen]))
        put(chosen, pixels, _with_edges(pixels, prior, ratio, solve_cut, band))

    side_by_side(choose, blocks(number, BLOCK))
    side_by_side(estimate_cut, _cut_alike(whole, rows.kind, np.flatnonzero(cut)))
    if known is None:
        return rows
    # What differs from the neighbours' mean is weak because a camera pixel's own photos are in
    # that mean: the first turn's kind and strength tell the error (docs/decisions/0011).
    return rows._replace(
        near=rows.near + known.expected.near,
        far=rows.far + known.expected.far,
        kind=known.before.kind,
        strength=known.before.strength,
    )


def _cut_alike(whole: Whole, kind: Integers, cut: NDArray[np.int64]) -> Iterator[NDArray[np.int64]]:
    """Cut camera pixels into groups of one kind, those whose windows are cut alike together."""
    centres = whole.centres[cut]
    order = cut[np.lexsort((centres[:, 1], centres[:, 0], kind[cut]))]
    for group in np.split(order, np.flatnonzero(np.diff(kind[order])) + 1):
        for part in blocks(len(group), CUT):
            yield group[part]


def _misdrawn(problem: _Problem) -> Callable[[slice | NDArray[np.int64]], Floats]:
    """Return what tells the answers (n, R) of unit direct light to what 8 bits got wrong."""
    # A row for each projector pixel, so that what a camera pixel asks for lies side by side.
    error = np.ascontiguousarray(problem.measurements.shown_error[problem.model.band.places].T)
    where = footprint(problem.whole.correspondence, problem.measurements.projector)

    def of(chosen: slice | NDArray[np.int64]) -> Floats:
        pixels, weights = where.pixels[chosen], where.weights[chosen]
        found = error[pixels[:, 0]] * weights[:, :1]
        for corner in range(1, 4):
            if weights[:, corner].any():
                found += error[pixels[:, corner]] * weights[:, corner, None]
        return np.asarray(found)

    return of


def _with_edges(
    pixels: Pixels,
    prior: Prior,
    ratio: Floats,
    solve: Callable[[Pixels, Prior, Floats, Band], Found],
    band: Band,
) -> Found:
    """Estimate camera pixels of one kind, direct light of second surfaces in their windows."""
    whole = solve(pixels, prior, ratio, band)
    number = np.arange(len(ratio))
    found = whole
    for _ in range(MOST if pixels.lit.any() else 0):
        entry, gain = likeliest_spike(pixels, prior, ratio, found)
        sure = np.flatnonzero(gain > SURE)
        if not len(sure):
            break
        number, ratio = number[sure], ratio[sure]
        pixels = with_spike(pixels.only(sure), entry[sure])
        found = solve(pixels, prior, ratio, band)
        windows = found.near.copy()
        for spike, entries in enumerate(pixels.spikes.T):
            at = (np.arange(len(number))[:, None], np.arange(windows.shape[1]), entries[:, None])
            windows[at] += found.shared[..., KEPT + spike]
        whole.near[number] = windows
        whole.far[number] = found.far
        whole.shared[number] = found.shared[..., :KEPT]
    return whole


def _expected(problem: _Problem, rows: _Rows) -> _Rows:
    """Ask the neighbours of each camera pixel what they expect of it."""
    whole, measurements = problem.whole, problem.measurements
    camera, channels = measurements.camera, measurements.channels
    shape = (*camera, channels)
    white = whole.white.reshape(*shape, 1)
    tiny = np.finfo(np.float32).tiny ** 0.5
    variance = np.maximum((measurements.noise.reshape(shape) / white[..., 0]) ** 2, tiny)
    far = expect_each(rows.far.reshape(*shape, -1) / white, variance, problem.model.repeats)
    windows = expect_together(
        rows.near.reshape(*shape, -1) / white,
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


def _moved(problem: _Problem, rows: _Rows) -> Floats:
    """Move q by what it was found to be off, but no further than its rounding allows."""
    direct = rows.shared[..., 1].astype(np.float64)
    energy = np.maximum(np.sum(direct**2, axis=1), np.finfo(np.float32).tiny)
    off = np.sum(rows.shared[..., 2:KEPT] * direct[..., None], axis=1) / energy[:, None]
    off = np.where((direct.sum(axis=1) > 0)[:, None], np.clip(off, -FURTHEST, FURTHEST), 0.0)
    whole, last = problem.whole, np.array(problem.measurements.projector) - 1
    lowest = np.maximum(whole.centres - HALF, 0)
    return np.clip(whole.correspondence + off, lowest, np.minimum(whole.centres + HALF, last))


def _transport(problem: _Problem, rows: _Rows, far: Size) -> Transport:
    """Put the factors together: f at the far band's frequencies, its DC what d and n leave."""
    measurements, band, whole = problem.measurements, problem.model.band, problem.whole
    wanted = set(far_frequencies(far, measurements.projector))
    low = [k for k in band.basis.frequencies if k in wanted or -k in wanted]
    basis = real_basis([DC, *low], measurements.projector)
    kept = np.flatnonzero(np.isin(band.basis.index, [band.basis.frequencies.index(k) for k in low]))
    white = (
        measurements.answers[..., dc_place(measurements)]
        - _share_of_white(measurements) * rows.shared[..., 0]
    )
    direct = np.maximum(rows.shared[..., 1], 0.0) * problem.whole.lit[:, None]
    rest = white - direct - rows.near.sum(axis=-1)
    far_range = np.concatenate([rest[..., None], rows.far[..., kept]], axis=-1)
    windows = _positive(problem, rows.near, far_range, band_of(basis, near.offsets(problem.window)))
    shape = (*measurements.camera, measurements.channels)
    return Transport(
        projector=measurements.projector,
        correspondence=whole.correspondence.reshape(*measurements.camera, 2).astype(np.float32),
        direct=direct.reshape(shape),
        near=windows.reshape(*shape, problem.window, problem.window),
        far=far_range.reshape(*shape, -1),
        far_basis=basis,
        black=measurements.black.reshape(shape),
        noise=measurements.noise.reshape(shape),
        belief=Belief(
            kinds=(*LIT, *UNLIT),
            frequencies=band.basis.frequencies,
            repeats=problem.model.repeats,
            kind=rows.kind.astype(np.uint8).reshape(measurements.camera),
            strength=rows.strength.reshape(measurements.camera),
            white=whole.white.reshape(shape),
            offset_noise=whole.offset_noise.reshape(shape),
            light_noise=measurements.light_noise.reshape(shape),
            share_of_white=_share_of_white(measurements).astype(np.float32).reshape(shape),
        ),
    )


def _positive(problem: _Problem, windows: Floats, far_range: Floats, band: Band) -> Floats:
    """Raise window entries to where n and f together are not negative, white kept."""
    apart = np.abs(near.offsets(problem.window)).max(axis=1) > 1
    inside = near.inside(problem.whole.centres, problem.window, problem.measurements.projector)
    free = inside & apart & problem.whole.lit[:, None]
    found = np.empty_like(windows)
    weights = band.basis.weights.astype(np.float32)

    def work(block: slice) -> None:
        turned = band.recentre(far_range[block] * weights, problem.whole.centres[block])
        least = -product(turned, band.on_window)
        mine = np.broadcast_to(free[block, None], least.shape)
        found[block] = raise_to(windows[block], least, mine)

    side_by_side(work, blocks(len(windows), BLOCK))
    return found


def _share_of_white(measurements: Measurements) -> Floats:
    """How much of the references' error o is, on average, white's own error.

    o = -(e_w + e_k) and white's is e_w - e_k for errors e_w of white and e_k of black.
    """
    white, black = measurements.white_noise**2, measurements.black_noise**2
    return np.asarray((black - white) / np.maximum(white + black, np.finfo(np.float32).tiny))
