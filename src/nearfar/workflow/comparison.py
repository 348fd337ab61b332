"""Results of methods side by side on one scene, and of those that failed or were not tried."""

from dataclasses import dataclass
from typing import Any, NamedTuple

from nearfar.arrays import Size


class Trial(NamedTuple):
    """Result of one method at one budget.

    Attributes
    ----------
    method : str
        Of `nearfar.workflow.rivals.RIVALS`.
    budget : int
        Photos, or total exposure, that were allowed.
    photos : int
        All that were taken.
    exposure : float
        Total, in units of one photo's at the camera's own setting.
    pictures, white, random : float
        SNR_b in dB; of pictures the mean over five.
    """

    method: str
    budget: int
    photos: int
    exposure: float
    pictures: float
    white: float
    random: float


class Failure(NamedTuple):
    """A method that came to nothing at one budget.

    Attributes
    ----------
    method : str
        Of `nearfar.workflow.rivals.RIVALS`.
    budget : int
        Photos, or total exposure, that were allowed.
    reason : str
        A sentence.
    """

    method: str
    budget: int
    reason: str


class LeftOut(NamedTuple):
    """A method that was not tried, as the scene is not what it assumes.

    Attributes
    ----------
    method : str
        Of `nearfar.workflow.rivals.RIVALS`.
    reason : str
        A clause, such as "needs a coaxial camera, ...".
    """

    method: str
    reason: str


@dataclass(frozen=True)
class Comparison:
    """Trials of one scene.

    Attributes
    ----------
    scene : str
    projector, camera : Size
    equal_photos : tuple of Trial
        Each photo exposed alike.
    equal_exposure : tuple of Trial
        Each method's longest plan, at each budget of total exposure.
    failures : tuple of Failure
        Methods that failed, which cost no other method its trials.
    is_finished : bool
        Whether every method had its turn.
    left_out : tuple of LeftOut
        Methods that do not suit the scene.
    """

    scene: str
    projector: Size
    camera: Size
    equal_photos: tuple[Trial, ...]
    equal_exposure: tuple[Trial, ...]
    failures: tuple[Failure, ...] = ()
    is_finished: bool = True
    left_out: tuple[LeftOut, ...] = ()

    def numbers(self) -> dict[str, Any]:
        """Return everything as JSON holds it."""
        return {
            "scene": self.scene,
            "projector": list(self.projector),
            "camera": list(self.camera),
            "equal_photos": [trial._asdict() for trial in self.equal_photos],
            "equal_exposure": [trial._asdict() for trial in self.equal_exposure],
            "failures": [failure._asdict() for failure in self.failures],
            "left_out": [method._asdict() for method in self.left_out],
            "finished": self.is_finished,
        }
