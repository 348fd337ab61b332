"""The interface of estimators, which make a transport from measurements and correspondence.

nearfar's own estimators are listed in `ESTIMATORS`; other packages add theirs through the entry
point group ``nearfar.estimators``, an instance of a subclass of `Estimator`.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import NamedTuple

from nearfar.arrays import Floats, Size
from nearfar.devices import Device
from nearfar.photometry.measurements import Measurements
from nearfar.plan import Plan
from nearfar.registry import Registry
from nearfar.transport.model import Transport
from nearfar.transport.rows import of_rows


class Model(NamedTuple):
    """Sizes of the model that an estimate is made in.

    Attributes
    ----------
    window : int
        W, the side of the near-range window in functions.
    far : Size
        Far band, in frequencies.
    dropped : Size
        Block of lowest near frequencies that are not measured.
    pitch : int
        Projector pixels between the window's functions; 1 for a window of single pixels.
    """

    window: int
    far: Size
    dropped: Size
    pitch: int = 1


def model_of(plan: Plan) -> Model:
    """Return the sizes of the model that a plan was made for."""
    return Model(plan.window, plan.far, plan.dropped, plan.pitch)


class Memory(NamedTuple):
    """Memory of an estimate.

    Attributes
    ----------
    shared : int
        Bytes that all camera pixels share.
    pixel : int
        Bytes of each camera pixel.
    peak_factor : float
        Memory at its peak, with temporary arrays, over that of the arrays that are counted.
    """

    shared: int
    pixel: int
    peak_factor: float = 1.5


class Estimator(ABC):
    """From measurements and correspondence to a transport.

    Camera pixels may be estimated in tiles of camera rows. If the estimate of a row depends on rows
    beside it, `halo` is their number on each side; a tile is then estimated together with them, and
    they are dropped from the result.
    """

    @property
    def halo(self) -> int:
        """Rows of the camera on either side of a tile that its estimate depends on."""
        return 0

    def rows_beside(self, plan: Plan) -> int:
        """Return the rows on either side of a tile that the estimate from a plan depends on."""
        return self.halo

    @abstractmethod
    def require(self, plan: Plan) -> None:
        """Refuse a plan whose photos this estimator cannot use.

        Raises
        ------
        PlanError
        """

    @abstractmethod
    def memory(self, plan: Plan, channels: int) -> Memory:
        """Return the memory that an estimate from a plan's photos of `channels` channels takes."""

    @abstractmethod
    def estimate(
        self,
        measurements: Measurements,
        q: Floats,
        model: Model,
        *,
        device: Device = "cpu",
        progress: Callable[[float], None] | None = None,
    ) -> Transport:
        """Estimate the transport of the camera pixels that were measured.

        Parameters
        ----------
        measurements : Measurements
        q : ndarray, shape (Cy, Cx, 2), float32
            Correspondence as (y, x) in projector pixels, NaN without direct light.
        model : Model
        device : {"cpu", "cuda", "torch"}
            NumPy on the processor, PyTorch on an accelerator, or PyTorch on the processor.
        progress : callable, optional
            Called with the share done, 0 to 1.

        Raises
        ------
        InputError, MissingPackageError
            If the measurements do not suffice, or the device is not there.
        """

    def estimate_rows(
        self,
        measurements: Measurements,
        q: Floats,
        model: Model,
        rows: slice,
        *,
        device: Device = "cpu",
        progress: Callable[[float], None] | None = None,
    ) -> Transport:
        """Estimate the transport of some rows of the camera; other parameters as in `estimate`.

        Parameters
        ----------
        rows : slice
            Of those that were measured. The others lie beside them, and need no estimate but where
            one of these rows depends on it.
        """
        whole = self.estimate(measurements, q, model, device=device, progress=progress)
        return of_rows(whole, rows)


ESTIMATORS = Registry(
    "method",
    "nearfar.estimators",
    {
        "joint": "nearfar.estimate.joint.estimator:JOINT",
        "paper": "nearfar.estimate.paper_estimator:PAPER",
    },
    Estimator,  # type: ignore[type-abstract]
)
