"""The joint estimate of direct, near- and far-range transport (ours)."""

from nearfar.estimate.joint.estimate import Choices, choose_components, estimate_jointly

__all__ = ["Choices", "choose_components", "estimate_jointly"]
