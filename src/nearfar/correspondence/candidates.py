"""The best places of camera pixels, in one pass over their scores.

Index convention: g runs over groups of photos, c over camera pixels, p over places, row by row.
"""

import numpy as np

from nearfar.arrays import Floats, Integers
from nearfar.compiled import compiled

# Places whose highest score is known; their scores are looked at again where it changes.
PLACES_TOGETHER = 64


@compiled
def _highest(bits: Integers, part: int) -> np.int32:
    """Return the highest of the scores of places that are held together."""
    most: np.int32 = bits[part * PLACES_TOGETHER]
    for i in range(part * PLACES_TOGETHER, (part + 1) * PLACES_TOGETHER):
        most = bits[i] if bits[i] > most else most
    return most


@compiled
def best_places(
    products: Floats, height: int, width: int, down: int, across: int, count: int
) -> Integers:
    """Return the places with the highest scores, none within reach of a better one.

    Parameters
    ----------
    products : ndarray, shape (g, c, p), float32
        Of whitened sequences and unit codes. A score is the sum of the squares of those above 0.
    height, width : int
        Places down and across.
    down, across : int
        Places within which codes are alike.
    count : int
        Places to find.

    Returns
    -------
    ndarray, shape (count, c), int64
    """
    number = products.shape[1]
    found = np.zeros((count, number), dtype=np.int64)
    parts = (height * width + PLACES_TOGETHER - 1) // PLACES_TOGETHER
    scores = np.zeros(parts * PLACES_TOGETHER, dtype=np.float32)
    # Bits of floats that are not negative are in the order of their values, as integers.
    bits = scores.view(np.int32)
    highest = np.zeros(parts, dtype=np.int32)
    for c in range(number):
        scores[:] = 0
        for g in range(products.shape[0]):
            its = products[g, c]
            for p in range(height * width):
                above = its[p] if its[p] > 0 else np.float32(0)
                scores[p] += above * above
        for part in range(parts):
            highest[part] = _highest(bits, part)
        for k in range(count):
            best = int(np.argmax(highest))
            p = best * PLACES_TOGETHER
            while bits[p] != highest[best]:
                p += 1
            found[k, c] = p
            y, x = p // width, p % width
            first, last = max(0, x - across), min(width, x + across + 1)
            for row in range(max(0, y - down), min(height, y + down + 1)):
                start, end = row * width + first, row * width + last
                scores[start:end] = 0
                for part in range(start // PLACES_TOGETHER, (end - 1) // PLACES_TOGETHER + 1):
                    highest[part] = _highest(bits, part)
    return found
