"""The joint estimate of direct, near- and far-range transport (ours)."""

from nearfar.estimate.joint.estimate import (
    choose_components,
    errors_of_foretold,
    estimate_by_sweeps,
    estimate_jointly,
)
from nearfar.estimate.joint.foretold import ErrorsOfForetold, means_of_blocks
from nearfar.estimate.joint.problem import Choices

__all__ = [
    "Choices",
    "ErrorsOfForetold",
    "choose_components",
    "errors_of_foretold",
    "estimate_by_sweeps",
    "estimate_jointly",
    "means_of_blocks",
]
