"""Write a transport for other programs."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from nearfar.transport.model import Transport


def dense_array(transport: Transport) -> NDArray[Any]:
    """Return T as a dense array, the channels last, or left out where there is one.

    Parameters
    ----------
    transport : Transport

    Returns
    -------
    ndarray, shape (C, P) or (C, P, channels)
    """
    dense = np.moveaxis(transport.dense(), 1, 2)
    return dense[..., 0] if transport.channels == 1 else dense
