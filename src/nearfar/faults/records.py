"""The faults: what is wrong, how bad, and the cure, a sentence each."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal, Protocol

from nearfar.illumination.frequencies import Frequency


class Fault(Protocol):
    """A fault; its text is a sentence."""

    def __str__(self) -> str: ...


@dataclass(frozen=True)
class ExposureBeats:
    """The exposure is not a whole number of the projector's refreshes.

    Attributes
    ----------
    camera : str
        What a message calls the camera.
    exposure, refresh : float
        Seconds.
    """

    camera: str
    exposure: float
    refresh: float

    def __str__(self) -> str:
        return (
            f"{self.camera} exposes {self.exposure:g} s, which is not a whole number of the "
            f"projector's refreshes of {self.refresh:.5g} s: brightness may beat from photo to "
            f"photo; choose another exposure, or close the aperture for a longer one."
        )


@dataclass(frozen=True)
class NotLinearLight:
    """The camera gives JPEGs, whose levels are not proportional to light."""

    camera: str

    def __str__(self) -> str:
        return (
            f"{self.camera} gives JPEGs, whose 8 bits are encoded for a screen and not linear in "
            f"light: set it to raw."
        )


@dataclass(frozen=True)
class LightDoesNotAdd:
    """The photos of two patterns do not sum to that of their sum, which is white.

    Attributes
    ----------
    patterns : str
        The two patterns.
    share : float
        Light of both over that of white.
    is_calibrated : bool
        Whether the projector's response has been calibrated.
    """

    patterns: str
    share: float
    is_calibrated: bool

    def __str__(self) -> str:
        when = "again" if self.is_calibrated else "first"
        return (
            f"light does not add up: {self.patterns} together give {self.share:.1%} of white; turn "
            f"off the projector's picture enhancement and the camera's automatic settings, and run "
            f"nearfar calibrate {when}."
        )


@dataclass(frozen=True)
class PhotoTakenAgain:
    """A photo was lost or not of its pattern, and was taken again."""

    photo: int
    reason: str

    def __str__(self) -> str:
        return f"photo {self.photo} was taken again: {self.reason.removesuffix('.')}."


@dataclass(frozen=True)
class PatternsIndistinguishable:
    """The camera hardly resolves the patterns, so that a repeated photo cannot be detected."""

    photo: int

    def __str__(self) -> str:
        return (
            f"up to photo {self.photo} many photos are like the ones before, though their patterns "
            f"differ: the camera hardly resolves them, and repeated photos are not noticed from "
            f"here on; focus it, or move closer."
        )


@dataclass(frozen=True)
class InverseDoesNotAdd:
    """A pattern and its inverse do not sum to white and black.

    Attributes
    ----------
    photo : int
        The later of the two.
    share : float
        Excess over white and black, as a share of white.
    """

    photo: int
    share: float

    def __str__(self) -> str:
        return (
            f"photo {self.photo} and that of its inverse pattern sum to white and black "
            f"{self.share:+.1%} of white, though white and black have not changed: the response is "
            f"not linear, or something is saturated; run nearfar calibrate."
        )


@dataclass(frozen=True)
class LightChange:
    """How light differs from what it was.

    Attributes
    ----------
    light : {"lamp", "ambient", "any"}
        Exposure or lamp; ambient light; or either, for a while.
    share : float
        Size of the change: of the lamp as a share of its light before, else as a share of white.
    """

    light: Literal["lamp", "ambient", "any"]
    share: float

    def __str__(self) -> str:
        match self.light:
            case "lamp":
                return f"exposure or lamp changed by {self.share:+.1%}"
            case "ambient":
                return f"ambient light changed by {self.share:+.1%} of white"
            case _:
                return f"the light was off by {self.share:+.1%} of white for a while"


@dataclass(frozen=True)
class LightChanged:
    """Light has changed while photos were taken, and spoils some of them.

    Attributes
    ----------
    change : LightChange
    last_good : int or None
        The last photo known to be of the old light; None before the first comparison.
    last : int
        The last photo that may be spoilt.
    """

    change: LightChange
    last_good: int | None
    last: int

    def __str__(self) -> str:
        known = self.last_good is not None
        since = f"after photo {self.last_good}" if known else "before the first comparison"
        first = self.last_good + 1 if self.last_good is not None else 0
        return (
            f"{self.change}, {since} and up to photo {self.last}: shoot them again by "
            f"`shoot_again(numbers=range({first}, {self.last + 1}))`."
        )


@dataclass(frozen=True)
class LightChangedBefore:
    """Light had changed before a photo; since when is not known."""

    change: LightChange
    photo: int

    def __str__(self) -> str:
        return f"{self.change}, before photo {self.photo}: check the photos before it."


@dataclass(frozen=True)
class PhotoSaturated:
    """A share of a photo's values is at full scale."""

    photo: int
    share: float

    def __str__(self) -> str:
        return (
            f"{self.share:.1%} of photo {self.photo} is saturated: expose less, or those camera "
            f"pixels will be wrong."
        )


@dataclass(frozen=True)
class LightChangedWhileStopped:
    """White or black of a resumed capture differs from that before it was stopped.

    Attributes
    ----------
    photo : int
    pattern : {"white", "black"}
    share : float
        Difference as a share of white.
    """

    photo: int
    pattern: Literal["white", "black"]
    share: float

    def __str__(self) -> str:
        return (
            f"photo {self.photo}, of {self.pattern}, differs by {self.share:+.1%} of white from "
            f"the one before the capture was stopped: lamp, exposure or ambient light has changed; "
            f"set them as they were, or start anew with `force=True`."
        )


@dataclass(frozen=True)
class ModulationTooHigh:
    """Camera pixels respond to a sinusoid by more than to white, which no linear response does.

    Attributes
    ----------
    photo : int
        The later photo of the pair of cosine and sine.
    frequency : Frequency
    share : float
        Share of lit camera pixels.
    limit : float
        Modulation above which they count.
    """

    photo: int
    frequency: Frequency
    share: float
    limit: float

    def __str__(self) -> str:
        fy, fx = self.frequency
        return (
            f"{self.share:.0%} of the camera's pixels respond to frequency ({fy}, {fx}) by over "
            f"{self.limit:g} times what white adds, which no linear response does (photo "
            f"{self.photo}): run nearfar calibrate, and see that black is not clipped."
        )


@dataclass(frozen=True)
class PairsDoNotAdd:
    """In a whole capture, patterns and their inverses do not sum to white and black."""

    capture: Path
    excess: float

    def __str__(self) -> str:
        return (
            f"in {self.capture} a pattern and its inverse sum to {abs(self.excess):.1%} "
            f"{'more' if self.excess > 0 else 'less'} than white and black: projector or camera is "
            f"not linear, or the lamp drifts; relighting will be wrong by about as much."
        )


@dataclass(frozen=True)
class RoundedToHalf:
    """Rounding to float16 is not small beside the noise of windows and bands."""

    share_of_noise: float

    def __str__(self) -> str:
        return (
            f"float16 strays from the windows and bands by {self.share_of_noise:.2g} of their "
            f"noise: reconstruct again without `half` if that matters."
        )


@dataclass(frozen=True)
class LightDrifted:
    """Lamp and ambient light drifted over a capture, as shares of white."""

    capture: Path
    lamp: float
    ambient: float

    def __str__(self) -> str:
        return (
            f"in {self.capture} the lamp changed by {self.lamp:.1%}, and ambient light by "
            f"{self.ambient:.1%} of white: both were followed by the references and taken out, but "
            f"what changes between two of them is not seen."
        )


@dataclass(frozen=True)
class PhotosSaturated:
    """A share of all values of some photos is at full scale.

    Attributes
    ----------
    photos : str
        What a message calls the photos: a capture's path, or where they come from.
    share : float
    """

    photos: str
    share: float

    def __str__(self) -> str:
        return (
            f"{self.share:.2%} of the values in {self.photos} are saturated: expose less, or "
            f"their camera pixels will be wrong."
        )
