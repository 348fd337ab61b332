"""Direct light's responses to the errors of 8-bit patterns, at a pitch over 1.

They are small: sweeps after the first estimate of a camera pixel would change them by next to
nothing, so they are subtracted from the responses once.
"""

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Floats, Integers, blocks
from nearfar.compiled import compiled
from nearfar.estimate.joint.problem import EstimatedRows, Problem
from nearfar.parallel import side_by_side
from nearfar.transport.direct import footprint

# Camera pixels of a batch: their responses fit a core's second cache.
BATCH_PIXELS = 512


def subtract_quantisation(problem: Problem, rows: EstimatedRows) -> None:
    """Subtract what direct light of some rows answers to quantisation errors from the responses."""
    pixels, errors = problem.pixels, problem.measurements.quantisation_error
    if not errors.shape[1]:
        return
    where = footprint(pixels.correspondence, problem.measurements.projector)
    direct = np.ascontiguousarray(rows.amplitudes[..., 1])

    def work(batch: slice) -> None:
        _subtract(
            pixels.responses[batch],
            errors,
            problem.model.centred.response_indices,
            where.pixels[batch],
            where.weights[batch],
            direct[batch],
        )

    side_by_side(work, blocks(len(pixels.lit), BATCH_PIXELS))


@compiled
def _subtract(
    responses: Floats,
    errors: Floats,
    indices: Integers,
    corners: NDArray[np.int64],
    weights: Floats,
    direct: Floats,
) -> None:
    """Subtract direct light (n, channels) times the errors (R, P) at its corners (n, 4)."""
    for r in range(len(indices)):
        row = errors[indices[r]]
        for n in range(len(corners)):
            error = np.float32(0.0)
            for corner in range(4):
                error += weights[n, corner] * row[corners[n, corner]]
            for channel in range(direct.shape[1]):
                responses[n, channel, r] -= direct[n, channel] * error
