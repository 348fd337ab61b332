"""Estimate D, N and F from photos of any patterns, known by their levels alone."""

from nearfar.estimate.any_patterns.estimate import estimate_from_patterns

__all__ = ["estimate_from_patterns"]
