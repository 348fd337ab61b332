"""The outside world: what shows patterns and takes photos."""
