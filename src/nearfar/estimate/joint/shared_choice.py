"""Which camera pixels choose prior components, and which take over their choice.

Index convention: n runs over camera pixels of one colour of a chessboard.
"""

import numpy as np

from nearfar.arrays import Integers, Size

# Camera pixels of one colour in a row that share a choice, and which of them chooses.
RUN = 4
CHOOSER = 2


def chooser_of_each(selected: Integers, camera: Size) -> Integers:
    """Return the index, among chosen camera pixels, of the one that chooses for each.

    Parameters
    ----------
    selected : ndarray of int, shape (n,)
        Every other camera pixel of some rows, in any order.
    camera : Size

    Returns
    -------
    ndarray of int, shape (n,)
        Those that choose for themselves have their own index.
    """
    y, x = np.divmod(selected, camera.width)
    field, first = np.divmod(x, 2)
    fields = (camera.width - first + 1) // 2
    chooser = np.minimum(field // RUN * RUN + CHOOSER, fields - 1)
    index = np.zeros(camera.pixels, dtype=np.int64)
    index[selected] = np.arange(len(selected))
    return np.asarray(index[y * camera.width + 2 * chooser + first])
