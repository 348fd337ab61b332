"""The joint estimate of direct, near- and far-range transport, and its error bars (ours)."""

from nearfar.estimate.joint.estimate import estimate_jointly
from nearfar.estimate.joint.posterior import ErrorBars

__all__ = ["ErrorBars", "estimate_jointly"]
