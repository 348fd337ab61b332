"""What spoils photos: which ones, how, and what to do, a sentence each."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, Literal

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

# Photos that are swapped, and named one by one.
MOST_SWAPS = 4
# Which photo it is that is so many places away.
LATE = {1: "photo", 2: "second photo", 3: "third photo"}
SHOOT_AGAIN = "shoot again from there on, or all, with camera, projector and scene at rest"


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


def _photos(numbers: Sequence[int]) -> str:
    return f"photo{'s' if len(numbers) > 1 else ''} {listed_numbers(numbers)}"


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
            return f"{_photos(self.photos)} are in reverse: put them in the order of the plan."
        if len(pairs) > 1 and all(pairs.get(other) == photo for photo, other in pairs.items()):
            swaps = [(a, b) for a, b in pairs.items() if a < b]
            what = ", ".join(f"{a} and {b}" for a, b in swaps)
            return f"photos {what} are swapped: put them in the order of the plan, or shoot again."
        shift = {photo - other for photo, other in pairs.items()}
        if len(shift) == 1 and (abs(*shift) == 1 or len(pairs) > MOST_SWAPS):
            (by,) = shift
            late = LATE.get(abs(by), f"photo {abs(by)} places")
            return (
                f"{_photos(self.photos)} show{'s' if len(pairs) == 1 else ''} the pattern of the "
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
    how : {"rotated by 180 degrees", "mirrored left to right", "mirrored top to bottom"}
    """

    photos: tuple[int, ...]
    how: str
    cause: ClassVar[Cause] = "turned"

    def __str__(self) -> str:
        return f"{_photos(self.photos)} {_is(self.photos)} {self.how}: turn back, or shoot again."


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
            f"{_photos(self.photos)} show{'s' if len(self.photos) == 1 else ''} in {how} the "
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
            f"{_photos(self.photos)} {_is(self.photos)} mixed with {upto}{self.share:.0%} of the "
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
            f"{_photos(self.photos)} show{'s' if len(self.photos) == 1 else ''} no more than black:"
            f" the projector was dark; shoot {'it' if len(self.photos) == 1 else 'them'} again."
        )


@dataclass(frozen=True)
class ColoursSwapped:
    """Photos whose colour channels are in another order than those of the others."""

    photos: tuple[int, ...]
    cause: ClassVar[Cause] = "colours"

    def __str__(self) -> str:
        return (
            f"{_photos(self.photos)} {_is(self.photos)} with colours in another order than the "
            f"others: read all photos in one order of red, green and blue."
        )


@dataclass(frozen=True)
class ExposureChanged:
    """Photos under another exposure, lamp or ambient light than the others.

    Attributes
    ----------
    photos : tuple of int
    gain : float
        Largest change of lamp or exposure, as a share.
    offset : float
        Largest change of ambient light, as a share of white.
    """

    photos: tuple[int, ...]
    gain: float
    offset: float
    cause: ClassVar[Cause] = "exposure"

    def __str__(self) -> str:
        if abs(self.offset) > abs(self.gain):
            what = f"other light, {self.offset:+.1%} of white"
            cure = "shut out other light"
        else:
            what = f"another exposure or lamp, {self.gain:+.1%}"
            cure = "turn off automatic exposure and gain"
        return f"{_photos(self.photos)} {_is(self.photos)} under {what}: {cure}, and shoot again."


@dataclass(frozen=True)
class LampJumped:
    """Lamp or exposure that changed at once, between two photos of white.

    Drift between these two is taken to be steady, so that the photos between them are off.

    Attributes
    ----------
    after, before : int
        Numbers of the photos of white between which it was.
    gain : float
        The change, as a share.
    """

    after: int
    before: int
    gain: float
    cause: ClassVar[Cause] = "exposure"

    def __str__(self) -> str:
        return (
            f"the lamp or the exposure changed at once, by {self.gain:+.1%}, between photos "
            f"{self.after} and {self.before}: keep it steady, and shoot again."
        )


@dataclass(frozen=True)
class AmbientJumped:
    """Ambient light that changed at once, between two photos of black.

    Attributes
    ----------
    after, before : int
        Numbers of the photos of black between which it was.
    offset : float
        The change, as a share of white.
    """

    after: int
    before: int
    offset: float
    cause: ClassVar[Cause] = "exposure"

    def __str__(self) -> str:
        return (
            f"ambient light changed at once, by {self.offset:+.1%} of white, between photos "
            f"{self.after} and {self.before}: shut out other light, and shoot again."
        )


@dataclass(frozen=True)
class LampFlickers:
    """Brightness that changes from photo to photo.

    Attributes
    ----------
    deviation : float
        Standard deviation of lamp or exposure, as a share.
    """

    deviation: float
    cause: ClassVar[Cause] = "exposure"

    def __str__(self) -> str:
        return (
            f"brightness changes by {self.deviation:.1%} from photo to photo: turn off automatic "
            f"exposure and contrast, and expose for a whole number of the projector's refreshes."
        )


@dataclass(frozen=True)
class FollowsPattern:
    """Brightness that depends on how bright the pattern is as a whole.

    Attributes
    ----------
    gain : float
        Of photos of white, over that of the others, as a share.
    """

    gain: float
    cause: ClassVar[Cause] = "exposure"

    def __str__(self) -> str:
        return (
            f"photos of white are off by {self.gain:+.1%} beside those of darker patterns: turn "
            f"off the camera's automatic exposure and the projector's dynamic contrast."
        )


@dataclass(frozen=True)
class AmbientFlickers:
    """Ambient light, or the camera's black level, that changes from photo to photo.

    Attributes
    ----------
    deviation : float
        Standard deviation, as a share of white.
    """

    deviation: float
    cause: ClassVar[Cause] = "exposure"

    def __str__(self) -> str:
        return (
            f"ambient light, or the camera's black level, changes by {self.deviation:.1%} of white "
            f"from photo to photo: shut out other light, and turn off automatic black level and "
            f"contrast."
        )


@dataclass(frozen=True)
class RowsFlicker:
    """Rows of the camera that are brighter or darker in each photo, as bands of light.

    Attributes
    ----------
    deviation : float
        Standard deviation of the mean of a row, as a share of white.
    """

    deviation: float
    cause: ClassVar[Cause] = "exposure"

    def __str__(self) -> str:
        return (
            f"rows of the camera change by {self.deviation:.1%} of white from photo to photo: the "
            f"light flickers while the camera reads row after row; expose for a whole number of "
            f"periods of the mains and of the projector's refreshes."
        )


@dataclass(frozen=True)
class NoisyRows:
    """Rows of the camera that read more or less in each photo, in the dark too.

    Attributes
    ----------
    deviation : float
        Standard deviation of the mean of a row, as a share of white.
    """

    deviation: float
    cause: ClassVar[Cause] = "exposure"

    def __str__(self) -> str:
        return (
            f"rows of the camera change by {self.deviation:.1%} of white from photo to photo, in "
            f"the dark too: it is noise of the camera, or other light that flickers; shut out "
            f"other light, and average several exposures."
        )


@dataclass(frozen=True)
class PixelsFlash:
    """Camera pixels that are far brighter or darker in single photos.

    Attributes
    ----------
    share : float
        Of all camera pixels, in a photo.
    """

    share: float
    cause: ClassVar[Cause] = "unknown"

    def __str__(self) -> str:
        return (
            f"{100 * self.share:.2g}% of the camera pixels flash in each photo, other ones each "
            f"time: cool the camera, expose more briefly, or average several exposures."
        )


@dataclass(frozen=True)
class SceneChanged:
    """Photos of white that differ before and after a moment, in parts of the picture.

    Attributes
    ----------
    after, before : int
        Numbers of the photos of white between which it was.
    """

    after: int
    before: int
    cause: ClassVar[Cause] = "moved"

    def __str__(self) -> str:
        return (
            f"parts of white look different from photo {self.before} on than up to photo "
            f"{self.after}: something moved, dust or a shadow fell on it, or the lens changed; "
            f"shoot again from photo {self.after} on, with all at rest."
        )


@dataclass(frozen=True)
class Moved:
    """Camera, scene or projector moved, or its focus changed, while photos were taken.

    Attributes
    ----------
    what : {"camera", "scene", "projector", "camera's focus"}
        The projector's focus looks like its motion.
    photo : int
        First photo after it.
    pixels : float or None
        How far, in camera pixels, where that is known.
    until : int or None
        First photo after it was back where it had been; None if it stayed.
    """

    what: str
    photo: int
    pixels: float | None
    until: int | None = None

    @property
    def cause(self) -> Cause:
        """Cause of a verdict."""
        return "focus" if self.what == "camera's focus" else "moved"

    def __str__(self) -> str:
        where = f"before photo {self.photo}: {SHOOT_AGAIN}."
        if self.until is not None:
            between = listed_numbers(range(self.photo, self.until))
            photos = "photo" if self.until == self.photo + 1 else "photos"
            where = (
                f"before photo {self.photo} and was back before photo {self.until}: shoot {photos} "
                f"{between} again, with camera, projector and scene at rest."
            )
        match self.what:
            case "projector":
                return f"the projector moved, or its focus changed, {where}"
            case "camera's focus":
                return f"the camera's focus changed {where}"
            case _:
                what = "the camera" if self.what == "camera" else "part of the scene"
                if self.pixels is None:
                    return f"{what} moved {where}"
                return f"{what} moved by about {self.pixels:.2g} camera pixels {where}"


@dataclass(frozen=True)
class BlackClipped:
    """Dark values are cut off at one level."""

    share: float
    cause: ClassVar[Cause] = "not-linear"

    def __str__(self) -> str:
        return (
            f"{self.share:.0%} of the camera pixels read the lowest level in every photo of black: "
            f"black is clipped; set the camera's black level above 0, or shoot raw."
        )


@dataclass(frozen=True)
class WhiteClipped:
    """Bright values are cut off at one level below full scale.

    Attributes
    ----------
    share : float
        Of all camera pixels.
    level : float
        As a share of full scale.
    """

    share: float
    level: float
    cause: ClassVar[Cause] = "saturated"

    def __str__(self) -> str:
        return (
            f"{self.share:.1%} of the camera pixels read the same level, {self.level:.1%} of full "
            f"scale, in every photo of white: the camera is saturated there; expose less, or give "
            f"that level as full scale."
        )


@dataclass(frozen=True)
class NotLinear:
    """Photos that are not proportional to light.

    Attributes
    ----------
    encoding : str
        The response that explains it best, such as "sRGB"; empty if none does. A gamma is that of
        the display: values are light to the power 1/gamma.
    """

    encoding: str
    cause: ClassVar[Cause] = "not-linear"

    def __str__(self) -> str:
        if self.encoding:
            return (
                f"the photos seem to be encoded by {self.encoding}: shoot raw, or decode them to "
                f"linear light before."
            )
        return "projector or camera is not linear: run nearfar calibrate, and shoot raw."


@dataclass(frozen=True)
class Compressed:
    """Photos that were stored as JPEG."""

    cause: ClassVar[Cause] = "compressed"

    def __str__(self) -> str:
        return "the photos were stored as JPEG: shoot raw, or store PNG or TIFF."


@dataclass(frozen=True)
class PhotosIncomplete:
    """Photos with rows of one value from side to side, which no camera takes."""

    photos: tuple[int, ...]
    cause: ClassVar[Cause] = "torn"

    def __str__(self) -> str:
        return (
            f"{_photos(self.photos)} {_is(self.photos)} incomplete, with rows of one value from "
            f"side to side: shoot {'it' if len(self.photos) == 1 else 'them'} again."
        )


@dataclass(frozen=True)
class PhotosMisfit:
    """Photos that do not fit the others, for no reason that is known."""

    photos: tuple[int, ...]
    cause: ClassVar[Cause] = "unknown"

    def __str__(self) -> str:
        return (
            f"{_photos(self.photos)} do{'es' if len(self.photos) == 1 else ''} not fit the others: "
            f"look at {'it' if len(self.photos) == 1 else 'them'}, and shoot again."
        )


def _is(photos: Sequence[int]) -> str:
    return "is" if len(photos) == 1 else "are"


Spoilt = (
    ShowsOtherPattern
    | PhotosTurned
    | PhotosTorn
    | PhotosMixed
    | PhotosDark
    | ColoursSwapped
    | ExposureChanged
    | LampJumped
    | AmbientJumped
    | LampFlickers
    | FollowsPattern
    | AmbientFlickers
    | RowsFlicker
    | NoisyRows
    | PixelsFlash
    | SceneChanged
    | Moved
    | BlackClipped
    | WhiteClipped
    | NotLinear
    | Compressed
    | PhotosIncomplete
    | PhotosMisfit
)
