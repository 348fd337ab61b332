"""The joint estimate of direct, near- and far-range transport, and its error bars (ours)."""

from nearfar.estimate.joint.error_bars import ErrorBars
from nearfar.estimate.joint.estimate import Choices, choose_components, estimate_jointly

__all__ = ["Choices", "ErrorBars", "choose_components", "estimate_jointly"]
