"""Adding what is found for some camera pixels to the rows of all."""

from typing import Any

import numpy as np
from array_api_compat import is_numpy_array
from numpy.typing import NDArray

from nearfar.arrays import Floats
from nearfar.compiled import compiled


def add_rows(total: Floats, selected: NDArray[np.int64], values: Any) -> None:
    """Add values (n, channels, j) to chosen rows of a total (C, channels, j); each stands once.

    NumPy would gather, add and scatter, each in a pass of its own.
    """
    if is_numpy_array(total):
        _add_rows(total, selected, values)
    else:
        total[selected] += values


@compiled
def _add_rows(total: Floats, selected: NDArray[np.int64], values: Floats) -> None:
    for n in range(len(selected)):
        for channel in range(values.shape[1]):
            row, more = total[selected[n], channel], values[n, channel]
            for j in range(len(row)):
                row[j] += more[j]
