"""The paper's figures and its table, drawn from the experiments' data."""

# What can be drawn, in the order of the paper; the table stands last.
NAMES: tuple[str, ...] = ("1", "2", "3", "4", "5", "6", "table")
