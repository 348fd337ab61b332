"""The SNR_b that a plan is expected to reach, which is kept with the plan."""

from typing import Annotated

from pydantic import AfterValidator, FiniteFloat

from nearfar.plan.patterns import Frozen


def _require_order(limits: tuple[float, float]) -> tuple[float, float]:
    if limits[0] > limits[1]:
        raise ValueError(f"the lowest of {limits} is above the highest")
    return limits


Limits = Annotated[tuple[FiniteFloat, FiniteFloat], AfterValidator(_require_order)]


class ExpectedRange(Frozen):
    """SNR_b in dB, from the lowest to the highest, under pictures and under a random light.

    Attributes
    ----------
    pictures, random : tuple of float
        Lowest and highest.
    """

    pictures: Limits
    random: Limits
