"""The dense T from a complete set of patterns: one light at a time, Hadamard, or any other.

A set is complete if its patterns tell every pixel of their grid apart. Then T is the least squares
solution of photos = b + T l, without any prior, b the black. If the patterns do not tell b apart
from T, as without a black one, b is taken as 0.

Index convention: patterns are (N, P), photos (N, C), T is (C, P).
"""

from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from nearfar.arrays import Floats, Size, blocks
from nearfar.capture import Capture
from nearfar.errors import InputError
from nearfar.files import new_output
from nearfar.progress import Report, ignore_progress

# Pixels of a pattern grid whose least squares take minutes at most.
MOST_UNKNOWNS = 128**2
# Eigenvalues of the normal matrix below this share of the largest are none.
LEAST_EIGENVALUE = 1e-9
# Values of photos that are held at once.
VALUES_AT_ONCE = 2**26


class CompleteT(NamedTuple):
    """A dense T that was written.

    Attributes
    ----------
    shape : tuple of int
        (Cy, Cx, Py, Px), and channels if there are several.
    grid : Size
        Pattern grid: a pixel for each block that all patterns are made of.
    has_black : bool
        Whether the patterns tell black; else it was taken as 0.
    noise_gain : float
        Root mean square deviation of an entry of T over that of a photo's pixel.
    """

    shape: tuple[int, ...]
    grid: Size
    has_black: bool
    noise_gain: float


def write_complete(
    capture: Capture, output: Path, *, force: bool = False, progress: Report = ignore_progress
) -> CompleteT:
    """Solve for the dense T of a complete set of patterns, and write it as an .npy.

    Parameters
    ----------
    capture : Capture
        Of any grey patterns.
    output : Path
    force : bool
        Replace a file that is there.
    progress : callable
        Called with "inverting" and the share that is done.

    Raises
    ------
    InputError
        If the set is not complete, or too large.
    ExistingOutputError, MissingFileError, StorageError
        As `nearfar.files.new_output`.
    """
    patterns, grid = _patterns(capture)
    ones = np.ones((len(patterns), 1))
    solution = _least_squares(np.concatenate([patterns, ones], axis=1))
    has_black = solution is not None
    if solution is None:
        solution = _least_squares(patterns)
    if solution is None:
        raise InputError(
            "these patterns do not tell all pixels of their grid apart, so that the set is not "
            "complete: give the missing patterns, or an output that ends in .zarr, which "
            "estimates the rest."
        )
    camera, channels, pixels = capture.camera, capture.channels, grid.pixels
    solution = solution[:pixels]
    shape = (*camera, *grid) if channels == 1 else (*camera, *grid, channels)
    per_row = camera.width * channels * max(len(patterns), pixels)
    with new_output(output, force=force) as partial:
        written = np.lib.format.open_memmap(partial, mode="w+", dtype=np.float32, shape=shape)
        for rows in blocks(camera.height, max(1, VALUES_AT_ONCE // per_row)):
            photos = capture.read(slice(None), rows)
            entries = np.tensordot(solution, photos.astype(np.float64), axes=(1, 0))
            moved = np.moveaxis(entries, 0, 2).reshape(photos.shape[1], camera.width, *grid, -1)
            written[rows] = moved[..., 0] if channels == 1 else moved
            progress("inverting", min(rows.stop, camera.height) / camera.height)
        written.flush()
        del written
    gain = float(np.sqrt((solution**2).sum(axis=1).mean()))
    return CompleteT(shape, grid, has_black, gain)


def _patterns(capture: Capture) -> tuple[Floats, Size]:
    """Return the patterns on their own grid, (N, P): a pixel for each block they are made of."""
    if capture.shown is not None and capture.shown.ndim == 4:
        raise InputError(f"{capture.path} has colour patterns: give grey ones.")
    count = len(capture.plan.patterns)
    projector = capture.plan.projector
    changes = [np.zeros(side, bool) for side in projector]
    for number in range(count):
        pattern = capture.pattern(number)
        changes[0][1:] |= (pattern[1:] != pattern[:-1]).any(axis=1)
        changes[1][1:] |= (pattern[:, 1:] != pattern[:, :-1]).any(axis=0)
    steps = []
    for side, change in zip(projector, changes, strict=True):
        step = int(np.gcd.reduce(np.append(np.flatnonzero(change), side)))
        steps.append(step)
    grid = Size(projector.height // steps[0], projector.width // steps[1])
    if grid.pixels > MOST_UNKNOWNS:
        raise InputError(
            f"{capture.path} has patterns of a grid of {grid}, and a dense T is solved for up to "
            f"{MOST_UNKNOWNS} pixels: give patterns of larger blocks, or an output that ends in "
            f".zarr."
        )
    if grid.pixels > count:
        raise InputError(
            f"{capture.path} has {count} photos for {grid.pixels} pixels of its pattern grid of "
            f"{grid}, so that its set of patterns is not complete: give an output that ends in "
            f".zarr, which estimates the rest."
        )
    patterns = np.stack(
        [capture.pattern(i)[:: steps[0], :: steps[1]].ravel() for i in range(count)]
    )
    return patterns, grid


def _least_squares(design: Floats) -> Floats | None:
    """Return the matrix from photos to unknowns, (unknowns, N), or None if they are not told."""
    exact = design.astype(np.float64)
    if len(exact) < exact.shape[1]:
        return None
    normal = exact.T @ exact
    try:
        factor = cho_factor(normal, check_finite=False)
    except np.linalg.LinAlgError:
        return None
    if np.diag(factor[0]).min() ** 2 < LEAST_EIGENVALUE * np.trace(normal) / len(normal):
        return None
    return np.asarray(cho_solve(factor, exact.T, check_finite=False))
