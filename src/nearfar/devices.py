"""Where arrays are worked at: NumPy's on the processor, PyTorch's on an accelerator.

Estimators and prepared transports are written in the functions of the Python array API; which
library they run in follows from the arrays that they are given.
"""

from collections.abc import Callable
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from nearfar.errors import InputError, MissingPackageError

# "torch" is PyTorch on the processor: the accelerator's code without one.
Device = Literal["cpu", "cuda", "torch"]


def mover(device: Device) -> Callable[[NDArray[Any]], Any]:
    """Return what puts NumPy arrays onto a device.

    Raises
    ------
    MissingPackageError
        If PyTorch is not installed, and needed.
    InputError
        If there is no such device.
    """
    if device == "cpu":
        return np.asarray
    try:
        import torch
    except ImportError as error:
        raise MissingPackageError(
            f"the device {device} needs PyTorch, which is not installed ({error}): install it by "
            f"pip install 'nearfar[torch]', or as pytorch.org says for your driver, or use the "
            f"device cpu."
        ) from error
    if device == "torch":
        return lambda values: torch.asarray(np.ascontiguousarray(values))
    if not torch.cuda.is_available():
        raise InputError(
            "there is no CUDA device that PyTorch can use: look at nvidia-smi and at the PyTorch "
            "that is installed, or use the device cpu."
        )
    return lambda values: torch.asarray(np.ascontiguousarray(values), device="cuda")


def require_device(device: Device) -> None:
    """Refuse a device that is not there; raises as `mover`."""
    mover(device)
