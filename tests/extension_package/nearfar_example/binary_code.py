"""Correspondence by the binary numbers of rows and columns, each bit beside its inverse.

Unlike in Gray code, neighbours may differ in many bits, so it is for whole projector pixels only.
"""

from typing import Literal

import numpy as np

from nearfar.correspondence import Correspondence, CorrespondenceMethod
from nearfar.plan import Pattern

AXES = ("binary rows", "binary columns")
# A bit is read where photo and inverse differ by this share of their sum.
LEAST_CONTRAST = 0.04


class BinaryBit(Pattern):
    """White where a bit of the row's or column's number is 1, or its inverse."""

    kind: Literal["binary rows", "binary columns"]
    bit: int
    inverse: bool = False
    purpose: Literal["correspondence"] = "correspondence"

    def draw(self, size):
        """Draw the 8-bit pattern, shape (Py, Px)."""
        numbers = np.indices(size)[AXES.index(self.kind)]
        white = (numbers >> self.bit) & 1 != self.inverse
        return np.where(white, 255, 0).astype(np.uint8)


def _patterns(projector):
    return tuple(
        BinaryBit(kind=kind, bit=bit, inverse=inverse)
        for kind, side in zip(AXES, projector, strict=True)
        for bit in range((side - 1).bit_length())
        for inverse in (False, True)
    )


def _serves(plan):
    return set(_patterns(plan.projector)) <= set(plan.patterns)


def _find(photos, rows, measure, progress=None):
    plan, places, lit = photos.plan, [], True
    for kind in AXES:
        place = 0
        for pattern in _patterns(plan.projector)[::2]:
            if pattern.kind != kind:
                continue
            number = plan.patterns.index(pattern)
            one, other = photos.read([number, number + 1], rows).sum(axis=-1)
            place = place + (one > other) * (1 << pattern.bit)
            lit = lit & (np.abs(one - other) > LEAST_CONTRAST * (one + other))
        places.append(place)
    q = np.where(lit[..., None], np.stack(places, axis=-1), np.nan)
    return Correspondence(q.astype(np.float32), lit.astype(np.float32))


BINARY_CODE = CorrespondenceMethod(
    patterns=_patterns, pattern_types=(BinaryBit,), serves=_serves, find=_find
)
