"""Transport as a linear operator: exact, or measured factors."""
