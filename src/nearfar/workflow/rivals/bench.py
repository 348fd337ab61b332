"""The bench on which rival methods are tried: one scene, one camera, one noise."""

from collections.abc import Callable
from dataclasses import dataclass

from nearfar.rigs.simulated.camera import SimulatedCamera
from nearfar.rigs.simulated.projector import SimulatedProjector
from nearfar.rigs.simulated.rig import SimulatedRig
from nearfar.transport.exact import ExactTransport


@dataclass(frozen=True, eq=False)
class Bench:
    """The scene, the camera and the noise that all methods share.

    Attributes
    ----------
    scene : ExactTransport
        The truth. A rival may choose its regularisation by it, which favours the rival.
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

    scene: ExactTransport
    camera: SimulatedCamera
    window: int
    gain: float
    progress: Callable[[float], None] = lambda _share: None
    note: Callable[[str], None] = lambda _sentence: None

    def rig(self, exposure: float) -> SimulatedRig:
        """Return a rig that exposes for `exposure` units, its full well deeper in proportion."""
        camera = self.camera.model_copy(update={"full_well": self.camera.full_well * exposure})
        return SimulatedRig(self.scene, self.scene.name, SimulatedProjector(), camera, self.gain, 0)
