"""Free rows: light from each lamp as a number of its own, with no lamp beside another."""
