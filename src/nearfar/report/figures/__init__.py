"""The paper's figures and its figures in numbers, from data that is made here."""

# What can be drawn, in the order of the paper; the table stands last.
NAMES: tuple[str, ...] = ("1", "2", "3", "4", "5", "6", "table")
