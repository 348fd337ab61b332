"""Single photos that are of something else than planned, a sentence each."""

from dataclasses import dataclass
from typing import ClassVar

from nearfar.faults.words import Cause, listed_numbers, named, photos_are

# Photos that are swapped, and named one by one.
MOST_SWAPS = 4
# Which photo it is that is so many places away.
LATE = {1: "photo", 2: "second photo", 3: "third photo"}


@dataclass(frozen=True)
class ShowsOtherPattern:
    """Photos that are of the patterns of other photos.

    Attributes
    ----------
    photos : tuple of int
    others : tuple of int
        For each photo, the number of the one whose pattern it is of.
    """

    photos: tuple[int, ...]
    others: tuple[int, ...]
    cause: ClassVar[Cause] = "order"

    def __str__(self) -> str:
        pairs = dict(zip(self.photos, self.others, strict=True))
        if len(pairs) > MOST_SWAPS and len({photo + other for photo, other in pairs.items()}) == 1:
            return f"{named(self.photos)} are in reverse: put them in the order of the plan."
        if len(pairs) > 1 and all(pairs.get(other) == photo for photo, other in pairs.items()):
            swaps = [(a, b) for a, b in pairs.items() if a < b]
            what = ", ".join(f"{a} and {b}" for a, b in swaps)
            return f"photos {what} are swapped: put them in the order of the plan, or shoot again."
        shift = {photo - other for photo, other in pairs.items()}
        if len(shift) == 1 and (abs(*shift) == 1 or len(pairs) > MOST_SWAPS):
            (by,) = shift
            late = LATE.get(abs(by), f"photo {abs(by)} places")
            return (
                f"{named(self.photos)} show{'s' if len(pairs) == 1 else ''} the pattern of the "
                f"{late} {'before' if by > 0 else 'after'}: camera and projector were out of step; "
                f"shoot again with more time between a pattern and its photo."
            )
        what = ", ".join(f"{a} is of pattern {b}" for a, b in list(pairs.items())[:4])
        return f"photos are out of order ({what}): put them in the order of the plan."


@dataclass(frozen=True)
class PhotosTurned:
    """Photos that are rotated or mirrored.

    Attributes
    ----------
    photos : tuple of int
    how : str
        "rotated by 180 degrees", "rotated left by 90 degrees", "rotated right by 90 degrees",
        "mirrored left to right" or "mirrored top to bottom".
    """

    photos: tuple[int, ...]
    how: str
    cause: ClassVar[Cause] = "turned"

    def __str__(self) -> str:
        return f"{photos_are(self.photos)} {self.how}: turn back, or shoot again."


@dataclass(frozen=True)
class PhotosTorn:
    """Photos that show two patterns, one in some rows and one in the others.

    Attributes
    ----------
    photos : tuple of int
    others : tuple of int
        For each photo, the number of the one whose pattern it shows in part.
    is_interlaced : bool
        Whether every second row is of the other pattern.
    """

    photos: tuple[int, ...]
    others: tuple[int, ...]
    is_interlaced: bool
    cause: ClassVar[Cause] = "torn"

    def __str__(self) -> str:
        how = "every second row" if self.is_interlaced else "part of the rows"
        return (
            f"{named(self.photos)} show{'s' if len(self.photos) == 1 else ''} in {how} the "
            f"pattern of photo {listed_numbers(self.others)}: the pattern changed during the "
            f"exposure; shoot again with more time between them, and no interlacing."
        )


@dataclass(frozen=True)
class PhotosMixed:
    """Photos that were exposed under two patterns, one after the other.

    Attributes
    ----------
    photos : tuple of int
    others : tuple of int
        For each photo, the number of the one whose pattern it shows too.
    share : float
        Of the exposure that was under the other pattern, at most.
    """

    photos: tuple[int, ...]
    others: tuple[int, ...]
    share: float
    cause: ClassVar[Cause] = "torn"

    def __str__(self) -> str:
        upto = "" if len(self.photos) == 1 else "up to "
        return (
            f"{photos_are(self.photos)} mixed with {upto}{self.share:.0%} of the "
            f"pattern of photo {listed_numbers(self.others)}: the pattern changed during the "
            f"exposure; shoot again with more time between them."
        )


@dataclass(frozen=True)
class PhotosDark:
    """Photos that show no light of the projector."""

    photos: tuple[int, ...]
    cause: ClassVar[Cause] = "order"

    def __str__(self) -> str:
        return (
            f"{named(self.photos)} show{'s' if len(self.photos) == 1 else ''} no more than black:"
            f" the projector was dark; shoot {'it' if len(self.photos) == 1 else 'them'} again."
        )


@dataclass(frozen=True)
class ColoursSwapped:
    """Photos whose colour channels are in another order than those of the others."""

    photos: tuple[int, ...]
    cause: ClassVar[Cause] = "colours"

    def __str__(self) -> str:
        return (
            f"{photos_are(self.photos)} with colours in another order than the "
            f"others: read all photos in one order of red, green and blue."
        )


@dataclass(frozen=True)
class PhotosIncomplete:
    """Photos with rows of one value from side to side, which no camera takes."""

    photos: tuple[int, ...]
    cause: ClassVar[Cause] = "torn"

    def __str__(self) -> str:
        return (
            f"{photos_are(self.photos)} incomplete, with rows of one value from "
            f"side to side: shoot {'it' if len(self.photos) == 1 else 'them'} again."
        )


@dataclass(frozen=True)
class PhotosMisfit:
    """Photos that do not fit the others, for no reason that is known."""

    photos: tuple[int, ...]
    cause: ClassVar[Cause] = "unknown"

    def __str__(self) -> str:
        return (
            f"{named(self.photos)} do{'es' if len(self.photos) == 1 else ''} not fit the others: "
            f"look at {'it' if len(self.photos) == 1 else 'them'}, and shoot again."
        )
