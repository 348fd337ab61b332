"""Products of sparse matrices with several columns at once, in threads over blocks of rows."""

import numpy as np
from scipy import sparse

from nearfar.arrays import Floats, blocks
from nearfar.parallel import side_by_side

# A fixed number, so that a sum does not depend on the number of processors.
ROW_BLOCKS = 4


def times(matrix: sparse.csr_array, columns: Floats) -> Floats:
    """Return ``matrix @ columns``.

    Parameters
    ----------
    matrix : scipy.sparse.csr_array, shape (a, b), float32
    columns : ndarray, shape (b, k), float32

    Returns
    -------
    ndarray, shape (a, k), float32
    """
    result = np.empty((matrix.shape[0], columns.shape[1]), dtype=np.float32)

    def fill(rows: slice) -> None:
        result[rows] = rows_of(matrix, rows) @ columns

    side_by_side(fill, _row_blocks(matrix))
    return result


def transposed_times(matrix: sparse.csr_array, columns: Floats) -> Floats:
    """Return ``matrix.T @ columns``.

    Parameters
    ----------
    matrix : scipy.sparse.csr_array, shape (a, b), float32
    columns : ndarray, shape (a, k), float32

    Returns
    -------
    ndarray, shape (b, k), float32
    """
    parts = list(enumerate(_row_blocks(matrix)))
    sums = np.zeros((max(1, len(parts)), matrix.shape[1], columns.shape[1]), dtype=np.float32)

    def fill(part: tuple[int, slice]) -> None:
        number, rows = part
        sums[number] = rows_of(matrix, rows).T @ np.ascontiguousarray(columns[rows])

    side_by_side(fill, parts)
    for each in sums[1:]:
        sums[0] += each
    return np.asarray(sums[0])


def rows_of(matrix: sparse.csr_array, rows: slice) -> sparse.csr_array:
    """Return consecutive rows of a matrix without a copy of their entries."""
    first, last = matrix.indptr[rows.start], matrix.indptr[rows.stop]
    entries = (
        matrix.data[first:last],
        matrix.indices[first:last],
        matrix.indptr[rows.start : rows.stop + 1] - first,
    )
    return sparse.csr_array(entries, shape=(rows.stop - rows.start, matrix.shape[1]))


def scaled(matrix: sparse.csr_array, factor: float) -> sparse.csr_array:
    """Return a matrix times a number; it shares its indices."""
    data = matrix.data * np.float32(factor)
    return sparse.csr_array((data, matrix.indices, matrix.indptr), shape=matrix.shape)


def _row_blocks(matrix: sparse.csr_array) -> list[slice]:
    return list(blocks(matrix.shape[0], -(-matrix.shape[0] // ROW_BLOCKS)))
