"""From measurements to transport."""
