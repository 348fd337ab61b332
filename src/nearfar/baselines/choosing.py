"""Choose how strongly compressive light transport is regularised.

`best_share` compares with the truth and so favours the rival. `held_out_share` needs no truth: it
holds some patterns out and takes the lambda that predicts their responses best. Both try every
share of a grid on the same random rows, with and without the refit, and return the best.

Index convention: g runs over the shares tried.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from nearfar.arrays import Floats, Integers
from nearfar.baselines.compressive import PENALTY_SHARES, refit_few
from nearfar.baselines.lasso import highest_penalty, settle, start
from nearfar.baselines.random_patterns import CompressiveMeasurements
from nearfar.baselines.sensing import sense
from nearfar.errors import InputError
from nearfar.transport.exact import ExactTransport

ROWS_TRIED = 200
# One pattern in this many is held out.
PATTERNS_PER_HELD_OUT = 10
# Fitting noise costs time: the search ends where the score is this far below the best, dB.
MAXIMUM_DROP_DECIBELS = 1.5
# An exact match has no finite SNR.
ENERGY_FLOOR = 1e-30


@dataclass(frozen=True)
class Choice:
    """The shares that were tried, and the SNR of each.

    Attributes
    ----------
    shares : tuple of float
        Values of lambda that were tried, each as a share of the least lambda that leaves a row
        without wavelets; down to where the SNR has fallen by `MAXIMUM_DROP_DECIBELS`.
    plain, refitted : tuple of float
        SNR of each share in dB, without the refit and with it.
    """

    shares: tuple[float, ...]
    plain: tuple[float, ...]
    refitted: tuple[float, ...]

    @property
    def is_refitted(self) -> bool:
        """Whether the best is refitted."""
        return max(self.refitted) >= max(self.plain)

    @property
    def share(self) -> float:
        """The best share."""
        scores = self.refitted if self.is_refitted else self.plain
        return self.shares[int(np.argmax(scores))]


def best_share(
    measurements: CompressiveMeasurements,
    truth: ExactTransport,
    *,
    exposure: float = 1.0,
    rows: int = ROWS_TRIED,
    seed: int = 0,
    shares: Sequence[float] = PENALTY_SHARES,
    progress: Callable[[float], None] | None = None,
) -> Choice:
    """Try shares on random rows, judged by the SNR of T against the truth.

    Parameters
    ----------
    measurements : CompressiveMeasurements
    truth : ExactTransport
    exposure : float
        Photo units per unit of the truth.
    rows : int
        Rows of T to try them on, drawn from all camera pixels and channels.
    seed : int
    shares : sequence of float
        In (0, 1], decreasing.
    progress : callable, optional
        Called with the share of the values that were tried, of all that may be.

    Raises
    ------
    InputError
        If the truth is of other sizes, or there is no share to try.
    """
    sizes = (measurements.projector, measurements.camera, measurements.responses.shape[1])
    if sizes != (truth.projector, truth.camera, truth.channels):
        raise InputError(
            f"the truth is of a projector {truth.projector}, a camera {truth.camera} and "
            f"{truth.channels} channels, the measurements of {sizes[0]}, {sizes[1]} and "
            f"{sizes[2]}: compare two of the same scene and sizes."
        )
    chosen = _draw(len(measurements.rows), rows, seed)
    known = np.float32(exposure) * _rows_of(truth, chosen)
    everything = np.arange(len(measurements.patterns))

    def judge(found: Floats) -> float:
        return _decibels(known, found - known)

    return _try(measurements, chosen, everything, shares, judge, progress)


def held_out_share(
    measurements: CompressiveMeasurements,
    *,
    held_out: int | None = None,
    rows: int = ROWS_TRIED,
    seed: int = 0,
    shares: Sequence[float] = PENALTY_SHARES,
) -> Choice:
    """Try shares on random rows, judged by how well they predict responses to held-out patterns.

    Parameters
    ----------
    measurements : CompressiveMeasurements
    held_out : int, optional
        Patterns to hold out; one in `PATTERNS_PER_HELD_OUT` by default.
    rows, seed, shares
        As `best_share`.

    Raises
    ------
    InputError
        If no pattern is held out or none is left, or there is no share to try.
    """
    count = len(measurements.patterns)
    held_out = max(1, count // PATTERNS_PER_HELD_OUT) if held_out is None else held_out
    if not 1 <= held_out < count:
        raise InputError(
            f"{held_out} of {count} patterns cannot be held out: keep back at least 1 and leave "
            f"at least 1."
        )
    order = np.random.default_rng([seed, 10]).permutation(count)
    kept, back = np.sort(order[held_out:]), np.sort(order[:held_out])
    chosen = _draw(len(measurements.rows), rows, seed)
    asked = measurements.rows[chosen][:, back]
    patterns = measurements.patterns[back].reshape(held_out, -1).astype(np.float32)

    def judge(found: Floats) -> float:
        return _decibels(asked, found @ patterns.T - asked)

    return _try(measurements, chosen, kept, shares, judge)


def _rows_of(truth: ExactTransport, chosen: Integers) -> Floats:
    """Return true rows i = camera pixel * channels + channel, (n, P), float32."""
    pixel, channel = np.divmod(chosen, truth.channels)
    return np.stack(
        [truth.rows(slice(c, c + 1))[0, i] for c, i in zip(pixel, channel, strict=True)]
    )


def _draw(count: int, rows: int, seed: int) -> Integers:
    generator = np.random.default_rng([seed, 11])
    return np.sort(generator.choice(count, size=min(rows, count), replace=False))


def _try(
    measurements: CompressiveMeasurements,
    chosen: Integers,
    kept: Integers,
    shares: Sequence[float],
    judge: Callable[[Floats], float],
    progress: Callable[[float], None] | None = None,
) -> Choice:
    """Reconstruct the chosen rows from the patterns kept, with every share, and judge (n, P)."""
    if not shares or not all(0 < share <= 1 for share in shares):
        raise InputError(f"shares of {list(shares)} give no lambda: try some above 0 and up to 1.")
    shares = sorted(shares, reverse=True)
    sensing = sense(measurements.patterns[kept])
    responses, along = sensing.project(measurements.rows[chosen][:, kept])
    rows = start(sensing.columns, responses)
    highest = highest_penalty(rows)
    plain: list[float] = []
    refitted: list[float] = []
    for share in shares:
        settle(sensing.columns, responses, rows, share * highest, np.arange(len(chosen)))
        found = (rows.coefficients, refit_few(sensing, responses, rows.coefficients))
        for scores, coefficients in zip((plain, refitted), found, strict=True):
            pictures = sensing.pictures(coefficients, along)
            scores.append(judge(pictures.reshape(len(chosen), -1)))
        if progress is not None:
            progress(len(plain) / len(shares))
        if max(plain[-1], refitted[-1]) < max(*plain, *refitted) - MAXIMUM_DROP_DECIBELS:
            break
    return Choice(tuple(shares[: len(plain)]), tuple(plain), tuple(refitted))


def _decibels(signal: Floats, error: Floats) -> float:
    energies = (float(np.sum(np.square(values, dtype=np.float64))) for values in (signal, error))
    kept, lost = (max(energy, ENERGY_FLOOR) for energy in energies)
    return float(10 * np.log10(kept / lost))
