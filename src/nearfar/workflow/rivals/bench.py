"""The bench on which rival methods are tried: one scene, one camera, one noise."""

from collections.abc import Callable
from dataclasses import dataclass

from nearfar.baselines.shooting import Shooting
from nearfar.errors import InputError
from nearfar.rigs.simulated.camera import SimulatedCamera
from nearfar.rigs.simulated.projector import SimulatedProjector
from nearfar.rigs.simulated.rig import SimulatedRig
from nearfar.transport.exact import ExactTransport
from nearfar.transport.known import KnownTransport
from nearfar.workflow.rivals.rival import Budget


@dataclass(frozen=True, eq=False)
class Bench:
    """The scene, the camera and the noise that all methods share.

    Attributes
    ----------
    scene : ExactTransport or ExactOperator
        The truth; an operator only for rivals that are not dense. A rival may choose its
        regularisation by it, which favours the rival.
    camera : SimulatedCamera
    window : int
        W of the joint estimate's plans.
    gain : float
        Photo units per unit of the scene's transport.
    progress : callable
        For a method that takes long: called with the share of its work at one budget that is
        done, 0 to 1.
    note : callable
        For a method that takes long: called with a sentence that says so, before the work.
    """

    scene: KnownTransport
    camera: SimulatedCamera
    window: int
    gain: float
    progress: Callable[[float], None] = lambda _share: None
    note: Callable[[str], None] = lambda _sentence: None

    @property
    def matrices(self) -> ExactTransport:
        """The truth, for a rival that is dense.

        Raises
        ------
        InputError
            If it is an operator.
        """
        if not isinstance(self.scene, ExactTransport):
            raise InputError(
                f"{self.scene.name} with a projector of {self.scene.projector} is too large for a "
                f"method that holds each entry of T: compare other methods, or give a smaller "
                f"`projector`."
            )
        return self.scene

    def rig(self, exposure: float) -> SimulatedRig:
        """Return a rig that exposes for `exposure` units, its full well deeper in proportion."""
        camera = self.camera.model_copy(update={"full_well": self.camera.full_well * exposure})
        return SimulatedRig(self.scene, self.scene.name, SimulatedProjector(), camera, self.gain, 0)

    def shooting(self, budget: Budget, photos: int | None = None) -> Shooting:
        """Return a rig for a method that asks for its photos one batch after the other.

        Parameters
        ----------
        budget : Budget
        photos : int, optional
            How many it may take, if it knows that it takes fewer than the budget's. A total
            exposure is shared among so many: light of photos that are not taken is lost.
        """
        photos = budget.photos if photos is None else photos
        return Shooting(self.rig(budget.exposure(photos)), photos)

    def exposure_of(self, budget: Budget, shooting: Shooting) -> float:
        """Return the total exposure of what was shot by a `shooting` of the whole budget."""
        return shooting.taken * budget.exposure(budget.photos)
