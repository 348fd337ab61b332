"""Decibels in words.

Transports and pictures are float32, of 24 bits: rounding is 144 dB below a value. Sums of many
products lose some of these bits, and what is left is noise of the arithmetic, which no page shows
as if it were the quality of a transport.
"""

# Two pictures that agree better than this agree to rounding.
ROUNDING = 120.0
EXACT = "exact to rounding"


def in_words(decibels: float) -> str:
    """Return a signal-to-noise ratio with its unit; where it is rounding alone, `EXACT`."""
    return f"{decibels:.1f} dB" if decibels <= ROUNDING else EXACT


def in_figures(decibels: float) -> str:
    """Return the same without a unit, for a column that has it in its head."""
    return f"{decibels:.1f}" if decibels <= ROUNDING else EXACT
