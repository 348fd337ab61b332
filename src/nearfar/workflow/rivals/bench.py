"""The bench on which rival methods are tried: one scene, one camera, one noise."""

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
    """

    scene: ExactTransport
    camera: SimulatedCamera
    window: int
    gain: float

    def rig(self, exposure: float) -> SimulatedRig:
        """Return a rig that exposes for `exposure` units, its full well deeper in proportion."""
        camera = self.camera.model_copy(update={"full_well": self.camera.full_well * exposure})
        return SimulatedRig(self.scene, self.scene.name, SimulatedProjector(), camera, self.gain, 0)
