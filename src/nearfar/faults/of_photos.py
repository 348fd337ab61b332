"""What spoils photos: which ones, how, and what to do, a sentence each."""

from dataclasses import dataclass
from typing import ClassVar

from nearfar.faults.of_light import (
    AmbientFlickers,
    AmbientJumped,
    ColoursJumped,
    ExposureChanged,
    FollowsPattern,
    LampFlickers,
    LampJumped,
    NoisyRows,
    RowsFlicker,
)
from nearfar.faults.of_single_photos import (
    ColoursSwapped,
    PhotosDark,
    PhotosIncomplete,
    PhotosMisfit,
    PhotosMixed,
    PhotosTorn,
    PhotosTurned,
    ShowsOtherPattern,
)
from nearfar.faults.words import Cause, listed_numbers

SHOOT_AGAIN = "shoot again from there on, or all, with camera, projector and scene at rest"


@dataclass(frozen=True)
class PatternsLinger:
    """Photos that hold light of the pattern shown before.

    Attributes
    ----------
    share : float
        Of the light of a photo.
    """

    share: float
    cause: ClassVar[Cause] = "order"

    def __str__(self) -> str:
        return (
            f"every photo holds {self.share:.1%} of the pattern before: the projector is slow, or "
            f"photos are taken too soon; leave more time between a pattern and its photo, and "
            f"shoot again."
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
        How far, in camera pixels, but in those of the projector if this moved, where it is known.
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
        far = f"{self.pixels:.2g}" if self.pixels is not None else ""
        plural = "" if far == "1" else "s"
        match self.what:
            case "projector":
                if self.pixels is None:
                    return f"the projector moved, or its focus changed, {where}"
                return f"the projector moved by about {far} projector pixel{plural} {where}"
            case "camera's focus":
                return f"the camera's focus changed {where}"
            case _:
                what = "the camera" if self.what == "camera" else "part of the scene"
                if self.pixels is None:
                    return f"{what} moved {where}"
                return f"{what} moved by about {far} camera pixel{plural} {where}"


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
    | ColoursJumped
    | LampFlickers
    | FollowsPattern
    | AmbientFlickers
    | RowsFlicker
    | NoisyRows
    | PatternsLinger
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
