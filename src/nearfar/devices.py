"""Devices for arrays: NumPy on the processor, PyTorch on an accelerator.

Estimators and prepared transports use the functions of the Python array API; the library that
computes is that of the arrays they are given.
"""

from collections.abc import Callable
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from nearfar.errors import InputError, MissingPackageError

# "torch" is PyTorch on the processor: the code for an accelerator, without an accelerator.
Device = Literal["cpu", "cuda", "torch"]


def mover(device: Device) -> Callable[[NDArray[Any]], Any]:
    """Return a function that copies NumPy arrays to a device.

    Raises
    ------
    MissingPackageError
        If the device needs PyTorch and it is not installed.
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
    """Raise the error of `mover` if a device is not there."""
    mover(device)
