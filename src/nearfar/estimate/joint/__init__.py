"""The joint estimate of direct, near- and far-range transport, and its error bars (ours)."""

from nearfar.estimate.joint.estimate import Choices, choose_kinds, estimate_jointly
from nearfar.estimate.joint.posterior import ErrorBars

__all__ = ["Choices", "ErrorBars", "choose_kinds", "estimate_jointly"]
