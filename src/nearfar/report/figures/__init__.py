"""The paper's figures and its table, drawn from the experiments' data."""

# In the order of the paper, and the table last.
NAMES: tuple[str, ...] = ("1", "2", "3", "4", "5", "6", "table")
