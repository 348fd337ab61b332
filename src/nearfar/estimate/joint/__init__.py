"""The joint estimate of direct, near- and far-range transport (ours)."""

from nearfar.estimate.joint.estimate import estimate_jointly

__all__ = ["estimate_jointly"]
