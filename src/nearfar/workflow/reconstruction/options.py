"""The options of a reconstruction."""

from dataclasses import dataclass
from numbers import Integral
from typing import get_args

from nearfar.devices import Device
from nearfar.errors import InputError
from nearfar.estimate.base import ESTIMATORS, Estimator

# Default of `ReconstructionOptions.memory`.
DEFAULT_MEMORY = 2 * 10**9


@dataclass(frozen=True)
class ReconstructionOptions:
    """How a transport is reconstructed.

    Parameters
    ----------
    method : str
        Name of the estimator: ``"joint"``, ``"paper"``, or one that another package adds.
    square : bool
        Whether to estimate the paper's square T, with a row for each projector pixel: the mean
        over the camera pixels that it lights.
    memory : int
        Memory in bytes for the work, not counting the result. The camera is reconstructed in
        tiles of as many rows as fit. A square T is the exception: it needs the measurements of the
        whole camera at once.
    device : {"cpu", "cuda", "torch"}
        Device of the estimate: NumPy, PyTorch on an accelerator, or PyTorch on the processor.
    half : bool
        Whether n and f are stored as float16, in half the bytes. The provenance's ``rounding`` is
        the rounding error as a share of their noise.
    tiles_at_once : int
        Tiles that this process reconstructs at the same time; they share the memory.

    Raises
    ------
    InputError
        If there is no such method or device, or the memory is not a number of bytes.

    Examples
    --------
    >>> nearfar.ReconstructionOptions(method="paper", memory=500_000_000).half
    False
    """

    method: str = "joint"
    square: bool = False
    memory: int = DEFAULT_MEMORY
    device: Device = "cpu"
    half: bool = False
    tiles_at_once: int = 1

    def __post_init__(self) -> None:
        if self.method not in ESTIMATORS:
            raise InputError(
                f"there is no method {self.method!r}: choose one of {', '.join(ESTIMATORS)}."
            )
        if self.device not in get_args(Device):
            raise InputError(
                f"there is no device {self.device!r}: choose one of {', '.join(get_args(Device))}."
            )
        for name in ("memory", "tiles_at_once"):
            value = getattr(self, name)
            if isinstance(value, bool) or not isinstance(value, Integral) or value < 1:
                raise InputError(f"{name} is {value!r}: give a whole number above 0.")

    @property
    def estimator(self) -> Estimator:
        """The estimator that the method names."""
        return ESTIMATORS[self.method]
