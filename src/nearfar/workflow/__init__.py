"""Whole jobs: acquire, reconstruct, evaluate."""
