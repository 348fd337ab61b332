"""Whether photos follow their patterns, and if not, which order of them would."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from nearfar.arrays import Floats, Integers
from nearfar.correspondence.codes import Codes
from nearfar.correspondence.places import find_places

# Of the camera pixels that change most, the median share of a sequence that direct light explains
# is above this where photos follow the patterns, and below where they do not.
FOLLOWED = 0.6
# Another order is named where it explains this much.
EXPLAINED_BY_OTHER = 0.8
# Share of camera pixels that change most.
CHANGING_SHARE = 0.5


class PhotoOrder(NamedTuple):
    """Another order of photos.

    Attributes
    ----------
    numbers : ndarray of int
        Number of the photo that belongs to each pattern.
    description : str
        What happened, in words.
    """

    numbers: Integers
    description: str


def explained_share(sequences: Floats, codes: Sequence[Codes]) -> float:
    """Return the median share that direct light explains, of camera pixels that change most.

    Parameters
    ----------
    sequences : ndarray, shape (C, N)
    codes : sequence of Codes

    Returns
    -------
    float
    """
    return float(np.median(find_places(_changing(sequences), codes, 0.0).explained))


def unexplained_share(sequences: Floats, codes: Sequence[Codes]) -> float:
    """Return the mean share that direct light leaves, of camera pixels that change most.

    Other than the median, it tells of the edges of stripes.
    """
    return float(np.mean(1.0 - find_places(_changing(sequences), codes, 0.0).explained))


def _changing(sequences: Floats) -> Floats:
    changes = sequences.std(axis=1)
    return np.asarray(sequences[changes >= np.quantile(changes, 1 - CHANGING_SHARE)])


def find_order(
    sequences: Floats, photos: Integers, codes: Sequence[Codes], count: int
) -> PhotoOrder | None:
    """Find an order in which photos follow their patterns, where they do not as they are.

    Parameters
    ----------
    sequences : ndarray, shape (C, count)
        Of all photos.
    photos : ndarray of int
        Those that the codes are of.
    codes : sequence of Codes
    count : int
        Number of photos.

    Returns
    -------
    PhotoOrder or None
    """
    shares = [
        (explained_share(sequences[:, order.numbers][:, photos], codes), order)
        for order in _orders(count)
    ]
    best, order = max(shares, key=lambda each: each[0])
    return order if best >= EXPLAINED_BY_OTHER else None


def _orders(count: int) -> Iterator[PhotoOrder]:
    """Yield orders that happen by mistake."""
    numbers = np.arange(count)
    yield PhotoOrder(numbers[::-1], "the photos are in reverse order")
    for step in (1, 2, -1, -2):
        places = "one place" if abs(step) == 1 else f"{abs(step)} places"
        when = "late" if step > 0 else "early"
        yield PhotoOrder(np.roll(numbers, -step), f"the first photo stands {places} too {when}")
    # img1, img10, img11, ..., img2: names sorted as text.
    for first in (0, 1):
        as_text = sorted(range(first, count + first), key=str)
        place = np.argsort(np.array(as_text), kind="stable")
        yield PhotoOrder(
            place, "the photos are in the order of their names as text (1, 10, 11, 2 ...)"
        )
        yield PhotoOrder(np.argsort(place), "the patterns are in the order of their names as text")
    if count % 2 == 0:
        pairs = numbers.reshape(-1, 2)
        yield PhotoOrder(
            pairs[:, ::-1].ravel(), "each photo is swapped with the one of its inverse"
        )
        halves = numbers.reshape(2, -1)
        yield PhotoOrder(
            halves[::-1].ravel(), "the first half of the photos is swapped with the second"
        )
        yield PhotoOrder(
            halves.T.ravel(), "the inverse photos stand after all others, not beside them"
        )
        yield PhotoOrder(
            pairs.T.ravel(), "the inverse photos stand beside the others, not after all of them"
        )
