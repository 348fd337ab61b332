"""Reconstruction of a transport from a capture, in tiles of camera rows."""
