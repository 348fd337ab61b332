"""Observers of a capture that estimate transport from the photos so far."""
