"""The joint estimate: direct, near and far in one model, each camera pixel by its own kind.

First every camera pixel chooses a kind and a strength by its own photos and takes the posterior
mean. Then, in turns, each starts from what its neighbours expect and estimates what differs.

Index convention: arrays are (C, channels, ...); r runs over real answers, w over window entries.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Booleans, Floats, Integers, Size, blocks
from nearfar.errors import InputError
from nearfar.estimate.joint.edges import MOST, SURE, likeliest_spike, seen_beside, with_spike
from nearfar.estimate.joint.evidence import best_kind
from nearfar.estimate.joint.neighbours import expect_each, expect_together
from nearfar.estimate.joint.nuisance import KEPT
from nearfar.estimate.joint.pixels import Pixels, dc_place, gather, offset_noise, scale_of
from nearfar.estimate.joint.positive import raise_to
from nearfar.estimate.joint.prior import Prior, build_prior
from nearfar.estimate.joint.solve import Found, solve
from nearfar.estimate.matrices import Band, band_of
from nearfar.illumination.frequencies import DC, far_frequencies
from nearfar.photometry.measurements import Measurements
from nearfar.transport import near
from nearfar.transport.belief import Belief
from nearfar.transport.far import real_basis
from nearfar.transport.kinds import LIT, UNLIT, Kind
from nearfar.transport.model import Transport

# Turns: one alone, the rest with the neighbours.
TURNS = 3
# Camera pixels at once.
BLOCK = 4096
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


class _Problem(NamedTuple):
    """What all turns share."""

    measurements: Measurements
    correspondence: Floats  # (C, 2)
    lit: Booleans
    centres: NDArray[np.int64]
    band: Band
    window: int
    likely: Booleans
    lit_priors: tuple[Prior, ...]
    unlit_priors: tuple[Prior, ...]


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
    basis = real_basis(frequencies, measurements.projector)
    plain = band_of(basis, near.offsets(window))
    band = Band(basis, measurements.places(frequencies), plain.on_window, plain.on_corners)
    repeats = measurements.repeats[band.places]

    def built(kinds: tuple[Kind, ...]) -> tuple[Prior, ...]:
        return tuple(build_prior(kind, band, repeats) for kind in kinds)

    whole = np.rint(correspondence)
    correspondence = np.where(np.abs(correspondence - whole) < WHOLE, whole, correspondence)
    lit = np.isfinite(correspondence).all(axis=-1).ravel()
    problem = _Problem(
        measurements,
        correspondence.reshape(-1, 2),
        lit,
        near.centre(correspondence, measurements.projector),
        band,
        window,
        seen_beside(correspondence, window),
        built(LIT),
        built(UNLIT) if not lit.all() else (),
    )
    rows = None
    for turn in range(turns):

        def report(share: float, turn: int = turn) -> None:
            if progress is not None:
                progress((turn + share) / turns)

        rows = _turn(problem, None if rows is None else _expected(problem, rows), report)
        problem = problem._replace(correspondence=_moved(problem, rows))
    assert rows is not None
    return _transport(problem, rows, far)


def _turn(problem: _Problem, expected: _Rows | None, report: Callable[[float], None]) -> _Rows:
    """Estimate every camera pixel once."""
    measurements, band = problem.measurements, problem.band
    number, channels = measurements.answers.shape[:2]
    count = band.basis.count
    rows = _Rows(
        np.zeros((number, channels, KEPT), dtype=np.float32),
        np.zeros((number, channels, problem.window**2), dtype=np.float32),
        np.zeros((number, channels, count), dtype=np.float32),
        np.zeros((number, channels), dtype=np.float32),
        np.zeros(number, dtype=np.int64),
        np.zeros(number, dtype=np.float32),
    )
    for block in blocks(number, BLOCK):
        pixels = gather(
            measurements,
            problem.correspondence,
            problem.lit,
            problem.centres,
            block,
            band,
            problem.window,
            problem.likely,
        )
        if expected is not None:
            far = band.recentre(expected.far[block], pixels.centres)
            shown = expected.near[block] @ band.on_window.T + far
            pixels = pixels._replace(answers=pixels.answers - shown)
        for lit, first, priors in (
            (True, 0, problem.lit_priors),
            (False, len(LIT), problem.unlit_priors),
        ):
            chosen = np.flatnonzero(pixels.lit == lit)
            if len(chosen):
                some = pixels.only(chosen)
                kind, strength, _ = best_kind(some, priors)
                found = _by_kind(some, priors, kind, strength, band)
                far = band.uncentre(found.far, some.centres)
                new = _Rows(*found._replace(far=far), kind + first, strength)
                for values, estimated in zip(rows, new, strict=True):
                    values[block.start + chosen] = estimated
        report(block.stop / number)
    if expected is None:
        return rows
    # What differs from the neighbours' mean is weak because a camera pixel's own photos are in
    # that mean: the first turn's kind and strength tell the error (docs/decisions/0011).
    return rows._replace(
        near=rows.near + expected.near,
        far=rows.far + expected.far,
        kind=expected.kind,
        strength=expected.strength,
    )


def _by_kind(
    pixels: Pixels, priors: tuple[Prior, ...], kind: Integers, strength: Floats, band: Band
) -> Found:
    """Estimate each camera pixel as of its kind."""
    whole: Found | None = None
    for place, prior in enumerate(priors):
        chosen = np.flatnonzero(kind == place)
        if len(chosen):
            found = _with_edges(pixels.only(chosen), prior, strength[chosen], band)
            if whole is None:
                whole = Found._make(
                    np.empty((len(kind), *values.shape[1:]), dtype=np.float32) for values in found
                )
            for values, new in zip(whole, found, strict=True):
                values[chosen] = new
    assert whole is not None
    return whole


def _with_edges(pixels: Pixels, prior: Prior, strength: Floats, band: Band) -> Found:
    """Estimate camera pixels of one kind, direct light of second surfaces in their windows."""
    whole = solve(pixels, prior, strength, band)
    number = np.arange(len(strength))
    found, entries = whole, np.empty((len(number), 0), dtype=np.int64)
    for _ in range(MOST if pixels.lit.any() else 0):
        entry, gain = likeliest_spike(pixels, prior, strength, found, band)
        sure = np.flatnonzero(gain > SURE)
        if not len(sure):
            break
        number, strength = number[sure], strength[sure]
        entries = np.concatenate([entries[sure], entry[sure, None]], axis=1)
        pixels = with_spike(pixels.only(sure), entry[sure], band)
        found = solve(pixels, prior, strength, band)
        windows = found.near.copy()
        for spike in range(entries.shape[1]):
            at = (
                np.arange(len(number))[:, None],
                np.arange(windows.shape[1]),
                entries[:, spike, None],
            )
            windows[at] += found.shared[..., KEPT + spike]
        whole.near[number] = windows
        whole.far[number] = found.far
        whole.shared[number] = found.shared[..., :KEPT]
    return whole


def _expected(problem: _Problem, rows: _Rows) -> _Rows:
    """Ask the neighbours of each camera pixel what they expect of it."""
    measurements = problem.measurements
    camera, channels = measurements.camera, measurements.channels
    shape = (*camera, channels)
    white = scale_of(measurements).reshape(*shape, 1)
    variance = (measurements.noise.reshape(shape)[..., None] / white) ** 2
    repeats = measurements.repeats[problem.band.places]
    every = np.ones(camera, dtype=bool)
    tiny = np.finfo(np.float32).tiny ** 0.5
    far = expect_each(
        rows.far.reshape(*shape, -1) / white, np.maximum(variance / repeats, tiny), every
    )
    windows = expect_together(
        rows.near.reshape(*shape, -1) / white,
        rows.near_noise.reshape(shape) / white[..., 0] ** 2,
        problem.lit.reshape(camera),
    )
    inside = near.inside(problem.centres, problem.window, measurements.projector)
    return rows._replace(
        near=(windows * white).reshape(rows.near.shape) * inside[:, None],
        far=(far * white).reshape(rows.far.shape),
    )


def _moved(problem: _Problem, rows: _Rows) -> Floats:
    """Move q by what it was found to be off, but no further than its rounding allows."""
    direct = rows.shared[..., 1].astype(np.float64)
    energy = np.maximum(np.sum(direct**2, axis=1), np.finfo(np.float32).tiny)
    off = np.sum(rows.shared[..., 2:KEPT] * direct[..., None], axis=1) / energy[:, None]
    off = np.where((direct.sum(axis=1) > 0)[:, None], np.clip(off, -FURTHEST, FURTHEST), 0.0)
    last = np.array(problem.measurements.projector) - 1
    lowest = np.maximum(problem.centres - HALF, 0)
    return np.clip(problem.correspondence + off, lowest, np.minimum(problem.centres + HALF, last))


def _transport(problem: _Problem, rows: _Rows, far: Size) -> Transport:
    """Put the factors together: f at the far band's frequencies, its DC what d and n leave."""
    measurements, band = problem.measurements, problem.band
    wanted = set(far_frequencies(far, measurements.projector))
    low = [k for k in band.basis.frequencies if k in wanted or -k in wanted]
    basis = real_basis([DC, *low], measurements.projector)
    kept = np.flatnonzero(np.isin(band.basis.index, [band.basis.frequencies.index(k) for k in low]))
    white = (
        measurements.answers[..., dc_place(measurements)]
        - _share_of_white(measurements) * rows.shared[..., 0]
    )
    direct = np.maximum(rows.shared[..., 1], 0.0) * problem.lit[:, None]
    rest = white - direct - rows.near.sum(axis=-1)
    far_range = np.concatenate([rest[..., None], rows.far[..., kept]], axis=-1)
    windows = _positive(problem, rows.near, far_range, band_of(basis, near.offsets(problem.window)))
    shape = (*measurements.camera, measurements.channels)
    return Transport(
        projector=measurements.projector,
        correspondence=problem.correspondence.reshape(*measurements.camera, 2).astype(np.float32),
        direct=direct.reshape(shape),
        near=windows.reshape(*shape, problem.window, problem.window),
        far=far_range.reshape(*shape, -1),
        far_basis=basis,
        black=measurements.black.reshape(shape),
        noise=measurements.noise.reshape(shape),
        belief=Belief(
            kinds=(*LIT, *UNLIT),
            frequencies=band.basis.frequencies,
            repeats=measurements.repeats[band.places],
            kind=rows.kind.astype(np.uint8).reshape(measurements.camera),
            strength=rows.strength.reshape(measurements.camera),
            white=scale_of(measurements).reshape(shape),
            offset_noise=offset_noise(measurements).reshape(shape),
            light_noise=measurements.light_noise.reshape(shape),
            share_of_white=_share_of_white(measurements).astype(np.float32).reshape(shape),
        ),
    )


def _positive(problem: _Problem, windows: Floats, far_range: Floats, band: Band) -> Floats:
    """Raise window entries to where n and f together are not negative, white kept."""
    apart = np.abs(near.offsets(problem.window)).max(axis=1) > 1
    inside = near.inside(problem.centres, problem.window, problem.measurements.projector)
    free = inside & apart & problem.lit[:, None]
    found = np.empty_like(windows)
    weights = band.basis.weights.astype(np.float32)
    for block in blocks(len(windows), BLOCK):
        turned = band.recentre(far_range[block] * weights, problem.centres[block])
        least = -(turned @ band.on_window)
        mine = np.broadcast_to(free[block, None], least.shape)
        found[block] = raise_to(windows[block], least, mine)
    return found


def _share_of_white(measurements: Measurements) -> Floats:
    """How much of the references' error o is, on average, white's own error.

    o = -(e_w + e_k) and white's is e_w - e_k for errors e_w of white and e_k of black.
    """
    white, black = measurements.white_noise**2, measurements.black_noise**2
    return np.asarray((black - white) / np.maximum(white + black, np.finfo(np.float32).tiny))
