"""Recognise what a set of pictures shows that were projected, one for each photo."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Floats, Size
from nearfar.plan.recognition.contents import (
    AnyPicture,
    Axis,
    Binary,
    Code,
    Content,
    Fringes,
    HadamardRow,
    Uniform,
)
from nearfar.plan.recognition.gray import find_gray_code
from nearfar.plan.recognition.two_levels import (
    AxisCode,
    code_of_axis,
    hadamard_row,
    name_code,
    name_picture,
)
from nearfar.plan.recognition.waves import Samples, find_fringes, find_raised_fringes, take_samples

# Levels that differ by less are one: half a step of 8 bits.
SAME_LEVEL = 0.5 / 255
# Rows of Hadamard matrices without another name that make a set one of them.
FEWEST_HADAMARD_ROWS = 4
# Places at which two pictures are compared for being inverse.
COMPARED_PLACES = 1024
# Fringes of so many cycles on the picture tell the power that they were raised to.
TELLING_CYCLES = 2.0
# Fewest fringes that tell a power of all, and how much theirs may differ.
FEWEST_TELLING = 2
SAME_POWER = 1.05


@dataclass(frozen=True)
class Recognised:
    """What a set of pictures shows.

    Attributes
    ----------
    size : Size
        Of every picture.
    contents : tuple of Content
        One for each picture.
    inverse_of : tuple of (int or None)
        For each picture the one whose inverse it is: the two sum to the same level everywhere.
    """

    size: Size
    contents: tuple[Content, ...]
    inverse_of: tuple[int | None, ...]


class _Seen(NamedTuple):
    """What one picture shows by itself."""

    content: Content
    code: AxisCode | None
    hadamard: HadamardRow | None
    signature: NDArray[np.float64]
    lowest: float
    highest: float
    is_binary: bool
    samples: Samples | None


def recognise(
    pictures: Iterable[Floats], progress: Callable[[int], None] | None = None
) -> Recognised:
    """Recognise pictures, which are read one after the other.

    Parameters
    ----------
    pictures : iterable of ndarray, shape (Py, Px) or (Py, Px, 3)
        Values from 0 to 1; all of one size. There is at least one.
    progress : callable, optional
        Called with the number of pictures seen so far.

    Returns
    -------
    Recognised
    """
    seen: list[_Seen] = []
    size = Size(0, 0)
    for picture in pictures:
        size = Size(*picture.shape[:2])
        seen.append(_see(picture))
        if progress is not None:
            progress(len(seen))
    total = min(each.lowest for each in seen) + max(each.highest for each in seen)
    return Recognised(size, tuple(_settle(seen)), _inverses(seen, total))


def _see(picture: Floats) -> _Seen:
    lowest, highest = float(picture.min()), float(picture.max())
    grey = picture.mean(axis=-1) if picture.ndim == 3 else picture
    is_colour = picture.ndim == 3 and bool((np.ptp(picture, axis=-1) > SAME_LEVEL).any())
    code, hadamard, is_binary = None, None, False
    content: Content
    if is_colour:
        content = AnyPicture(is_colour=True)
    elif highest - lowest < SAME_LEVEL:
        content = Uniform(level=round(0.5 * (lowest + highest), 6))
    else:
        is_bright = grey > 0.5 * (lowest + highest)
        off = np.abs(grey - np.where(is_bright, np.float32(highest), np.float32(lowest)))
        is_binary = bool(off.max() < SAME_LEVEL)
        if is_binary:
            code, hadamard = code_of_axis(is_bright), hadamard_row(is_bright)
            content = name_picture(is_bright) if code is None else name_code(code)
            if isinstance(content, Binary | Code):
                # A cosine of 1/3 cycle a pixel has two levels.
                fringes = find_fringes(grey)
                content = content if fringes is None or fringes.exponent != 1.0 else fringes
        else:
            content = find_fringes(grey) or AnyPicture()
    return _Seen(
        content=content,
        code=code,
        hadamard=hadamard,
        signature=_signature(grey),
        lowest=lowest,
        highest=highest,
        is_binary=is_binary,
        samples=take_samples(grey) if _may_be_raised(content, Size(*grey.shape)) else None,
    )


def _may_be_raised(content: Content, size: Size) -> bool:
    """Return whether other pictures may tell that this one is fringes raised to a power."""
    if isinstance(content, Fringes):
        return _cycles(content, size) < TELLING_CYCLES
    return isinstance(content, AnyPicture) and not content.is_colour


def _cycles(fringes: Fringes, size: Size) -> float:
    """Return the cycles that fringes have on the picture."""
    return float(np.hypot(fringes.fy * size.height, fringes.fx * size.width))


def _signature(grey: Floats) -> NDArray[np.float64]:
    """Return values by which a picture is compared with others: pixels, and means of lines."""
    places = np.random.default_rng(0).integers(0, grey.size, COMPARED_PLACES)
    exact = grey.astype(np.float64)
    return np.concatenate([exact.ravel()[places], exact.mean(axis=0), exact.mean(axis=1)])


def _settle(seen: list[_Seen]) -> list[Content]:
    """Return the content of each picture in view of the others: Gray code, Hadamard matrices."""
    contents = _raised_alike([each.content for each in seen], seen)
    rows = {i: each.hadamard for i, each in enumerate(seen) if each.hadamard is not None}
    square = sum(isinstance(seen[i].content, Binary) for i in rows)
    binary = sum(each.is_binary for each in seen)
    if square >= FEWEST_HADAMARD_ROWS and 2 * len(rows) >= binary:
        for i, row in rows.items():
            contents[i] = row
        return contents
    axes: tuple[Axis, Axis] = ("rows", "columns")
    for axis in axes:
        codes = {i: s.code for i, s in enumerate(seen) if s.code is not None and s.code[0] == axis}
        bits = find_gray_code(axis, [code.bright for code in codes.values()])
        for i, bit in zip(codes, bits, strict=True):
            contents[i] = bit or contents[i]
    return contents


def _raised_alike(contents: list[Content], seen: list[_Seen]) -> list[Content]:
    """Return fringes of few cycles as raised to the power that others in the set tell."""
    fringes = [each for each in contents if isinstance(each, Fringes)]
    powers = [each.exponent for each in fringes if each.exponent != 1.0]
    if len(powers) < FEWEST_TELLING:
        return contents
    power = float(np.median(powers))
    is_told = [
        max(each.exponent, power) < SAME_POWER * min(each.exponent, power)
        for each, its in zip(contents, seen, strict=True)
        if isinstance(each, Fringes) and (its.samples is None or each.exponent != 1.0)
    ]
    if not all(is_told):
        return contents
    return [
        content if its.samples is None else find_raised_fringes(its.samples, power) or content
        for content, its in zip(contents, seen, strict=True)
    ]


def _inverses(seen: list[_Seen], total: float) -> tuple[int | None, ...]:
    """Return for each picture an earlier one with which it sums to `total` everywhere."""
    waiting: dict[bytes, dict[int, NDArray[np.float64]]] = {}
    found: list[int | None] = []
    for number, each in enumerate(seen):
        inverse = total - each.signature
        candidates = waiting.get(_key(each, inverse, total), {})
        match = next((i for i, other in candidates.items() if _are_same(other, inverse)), None)
        if match is None:
            key = _key(each, each.signature, total)
            waiting.setdefault(key, {})[number] = each.signature
        else:
            del candidates[match]
        found.append(match)
    return tuple(found)


def _key(each: _Seen, signature: NDArray[np.float64], total: float) -> bytes:
    """Return a key that equal pictures share: bright pixels where there are two levels."""
    if not each.is_binary:
        return b""
    return np.packbits(signature[:COMPARED_PLACES] > total / 2).tobytes()


def _are_same(one: NDArray[np.float64], other: NDArray[np.float64]) -> bool:
    # Most pictures differ at the first places already.
    return all(
        bool((np.abs(one[part] - other[part]) < 3 * SAME_LEVEL).all())
        for part in (slice(8), slice(None))
    )
