"""Measurements without photos: the responses of a known transport, as the paper's theory has them.

One complex pattern exp(-j 2 pi k.p) for each frequency, no offset, no noise, no 8 bits; a real
transport responds to -k by the conjugate of its response to k.
"""

from functools import lru_cache
from typing import Protocol

import numpy as np

from nearfar.arrays import Floats, Size, blocks, product
from nearfar.errors import InputError, PlanError
from nearfar.illumination.frequencies import representatives
from nearfar.illumination.real_basis import real_basis
from nearfar.photometry.measurements import Measurements
from nearfar.plan import Plan
from nearfar.plan.patterns import Exponential

# Camera pixels at once.
PIXELS_AT_ONCE = 512
# Values of patterns, and of rows, at once: those of every projector pixel are many.
VALUES_AT_ONCE, VALUES_OF_ROWS = 2**25, 2**26


class Known(Protocol):
    """A transport whose rows can be read."""

    @property
    def projector(self) -> Size:
        """Pattern grid."""
        ...

    @property
    def camera(self) -> Size:
        """Height and width of the photos."""
        ...

    @property
    def channels(self) -> int:
        """Number of camera channels."""
        ...

    def rows(self, pixels: slice) -> Floats:
        """Dense rows t of camera pixels, (n, channels, P)."""
        ...


def measure_in_theory(plan: Plan, transport: Known) -> Measurements:
    """Compute the exact responses to a plan's complex patterns (equation 2).

    Parameters
    ----------
    plan : Plan
        With offset none.
    transport : Known
        An exact or a measured transport.

    Returns
    -------
    Measurements
        Without noise, black or quantisation error.

    Raises
    ------
    PlanError
        If the plan is one of real patterns: those are shot.
    InputError
        If the plan is for another projector.
    """
    frequencies = [p.frequency for p in plan.patterns if isinstance(p, Exponential)]
    if plan.offset != "none" or not frequencies:
        raise PlanError(
            f"a plan with `offset='{plan.offset}'` has real patterns, which are shot, not measured "
            f"in theory: make the plan with `offset='none'`."
        )
    if plan.projector != transport.projector:
        raise InputError(
            f"the plan is for a projector of {plan.projector}, the transport has "
            f"{transport.projector}: make the plan with `projector={tuple(transport.projector)}`."
        )
    basis = real_basis(representatives(frequencies), plan.projector)
    pixels, channels = transport.camera.pixels, transport.channels
    height, width = plan.projector
    # Sums over thousands of pixels: in float64, so that exact recovery stays exact.
    responses = np.zeros((pixels, channels, basis.count))
    # Rows are computed once. Patterns are drawn once if they all fit into memory, and otherwise for
    # each block of camera pixels.
    line_blocks = list(blocks(height, max(1, VALUES_AT_ONCE // (width * basis.count))))

    @lru_cache(maxsize=1)
    def drawn(number: int) -> Floats:
        patterns = basis.patterns_on(line_blocks[number]).T
        return np.ascontiguousarray(patterns, dtype=np.float64)

    at_once = max(1, min(PIXELS_AT_ONCE, VALUES_OF_ROWS // (channels * height * width)))
    for block in blocks(pixels, at_once):
        rows = transport.rows(block)
        for number, lines in enumerate(line_blocks):
            on_lines = slice(lines.start * width, lines.stop * width)
            responses[block] += product(rows[..., on_lines].astype(np.float64), drawn(number))
    nothing = np.zeros((pixels, channels), dtype=np.float32)
    return Measurements(
        camera=transport.camera,
        basis=basis,
        responses=responses.astype(np.float32),
        noise=nothing,
        black=nothing,
        quantisation_error=np.zeros((basis.count, plan.projector.pixels), dtype=np.float32),
    )
