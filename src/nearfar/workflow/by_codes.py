"""Correspondence from a capture of any patterns, by the code of each projector pixel."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize_scalar

from nearfar.arrays import Floats, Size, blocks
from nearfar.capture import Capture
from nearfar.correspondence import Correspondence, joined
from nearfar.correspondence.photo_order import (
    FOLLOWED,
    PhotoOrder,
    explained_share,
    find_order,
    unexplained_share,
)
from nearfar.correspondence.places import find_places, is_lit, typical_misfit
from nearfar.progress import Report, ignore_progress
from nearfar.transport.verdict import Reason
from nearfar.workflow.pattern_codes import (
    AS_IN_THE_FILE,
    TWO_LEVELS,
    PatternLevels,
    Seen,
    Telling,
    find_telling,
    read_levels,
    read_sequences,
)

# Values of photos that are held at once.
VALUES_AT_ONCE = 2**26
# Rows of the camera that tell how well photos follow the patterns typically.
SAMPLE_ROWS = 16
# Share of camera pixels with q below which something is wrong.
LEAST_LIT = 0.05
# Steps of the photos' numbers that direct light makes at least.
LEAST_STEPS = 2.0
AXES = ("rows", "columns")
# What powers of the patterns' levels mean, projector and camera together.
POWERS = (
    "1 is linear; a projector of gamma 2.2 alone makes 2.2, photos encoded by a gamma of 2.2 alone "
    "1/2.2 = 0.45"
)
# Camera pixels by which a power is fitted; it counts where it leaves less than this share of what
# linear levels leave unexplained, and differs from 1 by more than these octaves.
FITTED_PIXELS = 4096
CLEARLY_BETTER = 0.8
LEAST_OCTAVES = 0.1
# Footprints of camera pixels that are tried: from this size in projector pixels on, each so much
# larger than the one before, up to this share of a side of the projector; they end where so much
# more is left unexplained than by the best.
SMALLEST_FOOTPRINT = 2**0.5
FOOTPRINT_STEP = 2**0.5
LARGEST_FOOTPRINT = 1 / 8
CLEARLY_WORSE = 1.5
# Steps by which footprints of single camera pixels are smaller and larger than the typical one.
OTHER_FOOTPRINTS = 2


@dataclass(frozen=True, eq=False)
class FoundCorrespondence:
    """Correspondence, and what it was found by.

    Attributes
    ----------
    correspondence : Correspondence
        NaN in the axis that no pattern tells; 0 in the axis of a single projector pixel.
    axes : tuple of str
        Of "rows" and "columns" those that are known.
    places : ndarray, shape (Cy, Cx, 2), float32
        The most probable q, whether or not there is direct light; NaN in an axis that no pattern
        tells.
    explained : float
        Median share of a camera pixel's changes over the photos that direct light from q explains,
        beyond offset and far-range light.
    order : PhotoOrder or None
        An order in which photos would follow the patterns, where they do not as they are.
    exponent : float
        Power of the patterns' levels that photos follow; 1 where projector and camera are linear.
    """

    correspondence: Correspondence
    axes: tuple[str, ...]
    places: Floats
    explained: float
    order: PhotoOrder | None = None
    exponent: float = 1.0

    def faults(self) -> list[Reason]:
        """Return the faults of the photos that the correspondence shows: order, nonlinearity."""
        found = []
        if self.explained < FOLLOWED:
            cure = "check that each photo is of its pattern, in the same order"
            if self.order is not None:
                cure = f"it seems that {self.order.description}: import them in the right order"
            found.append(
                Reason(
                    "order",
                    f"the photos do not follow the patterns: direct light explains "
                    f"{self.explained:.0%} of how they change; {cure}.",
                )
            )
        if self.exponent != 1.0:
            found.append(
                Reason(
                    "not-linear",
                    f"projector or camera is not linear: the photos' values follow the patterns' "
                    f"levels to a power of about {self.exponent:.2f} ({POWERS}). q allows for "
                    f"that, a transport does not: set the gamma of both to 1, or calibrate.",
                )
            )
        return found

    def warnings(self) -> list[str]:
        """Return warnings about the photos, one sentence each."""
        found = [fault.sentence for fault in self.faults()]
        lit = float(np.isfinite(self.correspondence.q).any(axis=-1).mean())
        if lit < LEAST_LIT and self.explained >= FOLLOWED:
            found.append(
                f"q was found at {lit:.1%} of the camera pixels alone: check that the camera sees "
                f"what the projector lights, and is neither saturated nor too dark."
            )
        found += [
            f"no pattern tells {axis} apart: q is NaN on that axis, and no transport can be "
            f"reconstructed with it."
            for axis in AXES
            if axis not in self.axes
        ]
        return found


def correspond_by_codes(
    capture: Capture, progress: Report = ignore_progress
) -> FoundCorrespondence:
    """Find q(c) by the sequence of levels that each projector pixel shows, whatever the patterns.

    Parameters
    ----------
    capture : Capture
        With any patterns; see `nearfar.correspondence.codes`.
    progress : callable
        Called with what is done and its share.

    Returns
    -------
    FoundCorrespondence

    Raises
    ------
    InputError
        If the patterns do not tell places.
    """
    patterns = read_levels(capture, progress)
    telling = find_telling(capture, patterns)
    height, width = capture.camera
    sample = read_sequences(capture, patterns, slice(None, None, max(1, height // SAMPLE_ROWS)))
    seen = _fit_seen(capture, patterns, sample)
    if seen != AS_IN_THE_FILE:
        telling = find_telling(capture, patterns, seen)
    misfits = [typical_misfit(sample[:, each.photos], each.codes) for each in telling]
    explained = min(explained_share(sample[:, each.photos], each.codes) for each in telling)
    order = None
    if explained < FOLLOWED:
        order = find_order(sample, telling[0].photos, telling[0].codes, sample.shape[1])
    parts, places = [], []
    for rows in blocks(height, max(1, VALUES_AT_ONCE // (width * len(patterns.along)))):
        sequences = read_sequences(capture, patterns, rows)
        found, likely = _find(sequences, capture, telling, misfits)
        parts.append(_as_rows(found, width))
        places.append(likely.reshape(-1, width, 2))
        progress("correspondence", min(rows.stop, height) / height)
    known = {axis for each in telling for axis in each.axes}
    known |= {axis for axis, side in enumerate(capture.plan.projector) if side == 1}
    return FoundCorrespondence(
        joined(parts),
        tuple(AXES[axis] for axis in sorted(known)),
        np.concatenate(places),
        explained,
        order,
        seen.exponent,
    )


def _fit_seen(capture: Capture, patterns: PatternLevels, sample: Floats) -> Seen:
    """Return the power and the footprints with which direct light explains photos best.

    The power is kept as in the file where no other is clearly better.
    """
    chosen = np.random.default_rng(0).permutation(len(sample))[:FITTED_PIXELS]
    some = sample[chosen]

    def unexplained(seen: Seen) -> float:
        telling = find_telling(capture, patterns, seen)
        return sum(unexplained_share(some[:, each.photos], each.codes) for each in telling)

    best, least = AS_IN_THE_FILE, unexplained(AS_IN_THE_FILE)
    if (patterns.groups != TWO_LEVELS).any():
        found = minimize_scalar(
            lambda octaves: unexplained(Seen(2.0**octaves)),
            bounds=(-2.0, 2.0),
            method="bounded",
            options={"xatol": 0.02},
        )
        if found.fun < CLEARLY_BETTER * least and abs(found.x) > LEAST_OCTAVES:
            best = Seen(float(2.0**found.x))
    height, width = capture.plan.projector
    best = _typical(lambda size: best._replace(heights=(size,)), height, unexplained)
    best = _typical(lambda size: best._replace(widths=(size,)), width, unexplained)
    return best._replace(heights=_about(best.heights[0]), widths=_about(best.widths[0]))


def _typical(
    seen_by: Callable[[float], Seen], side: int, unexplained: Callable[[Seen], float]
) -> Seen:
    """Return the codes seen through footprints of the size that explains the photos best."""
    best, size = seen_by(0.0), SMALLEST_FOOTPRINT
    least = unexplained(best)
    while size <= LARGEST_FOOTPRINT * side:
        seen = seen_by(size)
        left = unexplained(seen)
        if left > CLEARLY_WORSE * least:
            break
        if left < least:
            best, least = seen, left
        size *= FOOTPRINT_STEP
    return best


def _about(size: float) -> tuple[float, ...]:
    """Return sizes of footprints about the typical one."""
    steps = np.arange(-OTHER_FOOTPRINTS, OTHER_FOOTPRINTS + 1)
    sizes = np.maximum(size, SMALLEST_FOOTPRINT / FOOTPRINT_STEP) * FOOTPRINT_STEP**steps
    return tuple(float(each) if each >= SMALLEST_FOOTPRINT - 1e-9 else 0.0 for each in sizes)


def _step(capture: Capture) -> float:
    """Return the step of the photos' numbers, in photo units; 0 for floats."""
    return 0.0 if capture.photos.dtype.kind == "f" else 1.0 / capture.full_scale


def _find(
    sequences: Floats, capture: Capture, telling: Sequence[Telling], misfits: Sequence[float]
) -> tuple[Correspondence, Floats]:
    """Return q and confidence as (C, 2) and (C,), and the most probable q of all, (C, 2)."""
    count, step = len(sequences), _step(capture)
    q = np.full((count, 2), np.nan, dtype=np.float32)
    # There is one place on the axis of a single projector pixel.
    q[:, np.array(capture.plan.projector) == 1] = 0.0
    confidence = np.ones(count, dtype=np.float32)
    lit = np.ones(count, dtype=np.bool_)
    for each, misfit in zip(telling, misfits, strict=True):
        found = find_places(sequences[:, each.photos], each.codes, misfit)
        for axis in each.axes:
            q[:, axis] = found.place[:, axis]
        confidence = np.minimum(confidence, found.confidence.astype(np.float32))
        lit &= is_lit(found, sequences) & (found.light >= LEAST_STEPS * step)
    places = q.copy()
    q[~lit] = np.nan
    return Correspondence(q, confidence), places


def _as_rows(found: Correspondence, width: int) -> Correspondence:
    return Correspondence(found.q.reshape(-1, width, 2), found.confidence.reshape(-1, width))


def on_grid(q: Floats, projector: Size, grid: Size) -> Floats:
    """Return q counted in the pixels of another pattern grid that fills the same screen.

    Parameters
    ----------
    q : ndarray, shape (Cy, Cx, 2)
        In pixels of `projector`.
    projector, grid : Size
    """
    scale = np.array(grid, dtype=np.float64) / np.array(projector)
    return np.asarray(((q + 0.5) * scale - 0.5).astype(np.float32))
