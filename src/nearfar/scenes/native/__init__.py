"""Built-in scenes at native size: an operator instead of a matrix."""
