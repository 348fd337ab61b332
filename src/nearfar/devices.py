"""Devices for arrays: NumPy on the processor, PyTorch on an accelerator.

Estimators and prepared transports use the functions of the Python array API; the library that
computes is that of the arrays they are given.
"""

from collections.abc import Callable
from functools import lru_cache
from typing import Any, Literal

import numpy as np
from array_api_compat import device as device_of
from numpy.typing import NDArray

from nearfar.errors import InputError, MissingPackageError

# "torch" is PyTorch on the processor: the code for an accelerator, without an accelerator.
Device = Literal["cpu", "cuda", "torch"]
# How many times as many items an accelerator takes at once as the processor, which takes as many as
# its cache holds: an accelerator waits for calls, not for arithmetic.
ACCELERATOR_BATCH = 16


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
    _load_linear_algebra()
    return lambda values: torch.asarray(np.ascontiguousarray(values), device="cuda")


@lru_cache(maxsize=1)
def _load_linear_algebra() -> None:
    """Load what PyTorch solves equations with on an accelerator.

    It is loaded at the first use, and PyTorch fails where that is in several threads at once
    (pytorch/pytorch issue 90613).
    """
    import torch

    unit = torch.eye(2, device="cuda")
    torch.linalg.solve(unit, unit)


def is_on_accelerator(values: Any) -> bool:
    """Return whether an array lies on an accelerator."""
    return str(device_of(values)).startswith("cuda")


def batch_length(length: int, values: Any) -> int:
    """Return how many items to take at once on the device of `values`.

    Parameters
    ----------
    length : int
        How many the processor takes.
    values : array
    """
    return ACCELERATOR_BATCH * length if is_on_accelerator(values) else length


def require_device(device: Device) -> None:
    """Raise the error of `mover` if a device is not there."""
    mover(device)
