"""Light that is not the same in all photos: exposure, lamp and ambient light, a sentence each."""

from dataclasses import dataclass
from typing import ClassVar

from nearfar.faults.words import Cause, photos_are


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
        return f"{photos_are(self.photos)} under {what}: {cure}, and shoot again."


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
class ColoursJumped:
    """Colours of the lamp, or the camera's white balance, that changed at once.

    Drift between two photos of white is taken to be steady, so that the photos between them are
    off.

    Attributes
    ----------
    after, before : int
        Numbers of the photos of white between which it was.
    gains : tuple of float
        The change of each channel, as a share.
    """

    after: int
    before: int
    gains: tuple[float, ...]
    cause: ClassVar[Cause] = "exposure"

    def __str__(self) -> str:
        gains = ", ".join(f"{gain:+.1%}" for gain in self.gains)
        return (
            f"the colours of the light changed at once, by {gains}, between photos {self.after} "
            f"and {self.before}: fix the camera's white balance, keep the lamp steady, and shoot "
            f"again."
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
