"""Words that faults of photos share: causes, and photo numbers."""

from collections.abc import Sequence
from typing import Literal

Cause = Literal[
    "order",
    "turned",
    "torn",
    "exposure",
    "colours",
    "moved",
    "focus",
    "not-linear",
    "compressed",
    "saturated",
    "unknown",
]


def listed_numbers(numbers: Sequence[int], most: int = 8) -> str:
    """Return photo numbers for a message: runs as ranges, and how many more there are."""
    runs: list[list[int]] = []
    for number in sorted(numbers):
        if runs and number == runs[-1][-1] + 1:
            runs[-1].append(number)
        else:
            runs.append([number])
    texts = [str(r[0]) if len(r) == 1 else f"{r[0]} to {r[-1]}" for r in runs]
    more = sum(map(len, runs[most:]))
    return ", ".join(texts[:most]) + (f" and {more} more" if more else "")


def named(numbers: Sequence[int]) -> str:
    """Return photos by their numbers, for a message."""
    return f"photo{'s' if len(numbers) > 1 else ''} {listed_numbers(numbers)}"


def photos_are(numbers: Sequence[int]) -> str:
    """Return photos by their numbers, and the verb of what is said of them."""
    return f"{named(numbers)} {'is' if len(numbers) == 1 else 'are'}"
