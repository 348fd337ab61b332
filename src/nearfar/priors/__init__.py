"""Prior distributions of the rows of a transport."""
