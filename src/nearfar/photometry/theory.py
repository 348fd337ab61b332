"""Measurements without photos: the responses of a known transport, as the paper's theory has them.

One complex pattern exp(-j 2 pi k.p) for each frequency, no offset, no noise, no 8 bits; a real
transport responds to -k by the conjugate of its response to k.
"""

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
    # Sums over thousands of pixels: in float64, so that exact recovery stays exact.
    patterns = np.ascontiguousarray(basis.patterns.T, dtype=np.float64)
    pixels, channels = transport.camera.pixels, transport.channels
    responses = np.empty((pixels, channels, basis.count), dtype=np.float32)
    for block in blocks(pixels, PIXELS_AT_ONCE):
        responses[block] = product(transport.rows(block).astype(np.float64), patterns)
    nothing = np.zeros((pixels, channels), dtype=np.float32)
    return Measurements(
        camera=transport.camera,
        basis=basis,
        responses=responses,
        noise=nothing,
        black=nothing,
        quantisation_error=np.zeros((basis.count, plan.projector.pixels), dtype=np.float32),
    )
