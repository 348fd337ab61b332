"""Matrices in a Zarr group: dense ones in chunks of rows, sparse ones as three arrays."""

from typing import Any

import numpy as np
from scipy import sparse

from nearfar.arrays import Floats, blocks
from nearfar.files.stores import add_array, open_array, read_array, read_selection

# Bytes of a chunk: large enough for the disk, small enough to read a few rows.
CHUNK_BYTES = 8 * 2**20


def rows_of_chunk(values: Floats) -> int:
    """Return how many rows of an array fit in a chunk."""
    return max(1, CHUNK_BYTES // max(1, values[:1].nbytes))


def write_in_rows(group: Any, name: str, values: Floats) -> None:
    """Write an array in chunks of rows."""
    rows = min(len(values), rows_of_chunk(values))
    add_array(group, name, values.shape, values.dtype, (rows, *values.shape[1:]))[:] = values


def read_in_rows(group: Any, name: str, out: Floats) -> None:
    """Read an array into its place chunk by chunk: a second copy of a large one would not fit."""
    stored = open_array(group, name)
    if stored.shape != out.shape:
        raise ValueError(f"{name} has the shape {stored.shape} instead of {out.shape}")
    for block in blocks(len(out), stored.chunks[0]):
        out[block] = read_selection(stored, (block, slice(None)))


def write_sparse(group: Any, name: str, matrix: sparse.csr_array) -> None:
    """Write a sparse matrix as the arrays NAME-data, NAME-indices and NAME-starts."""
    write_sparse_data(group, name, matrix)
    write_padded(group, f"{name}-indices", matrix.indices)
    write_padded(group, f"{name}-starts", matrix.indptr)


def write_sparse_data(group: Any, name: str, matrix: sparse.csr_array) -> None:
    """Write the entries alone, of a matrix that shares its indices with another."""
    write_padded(group, f"{name}-data", matrix.data.astype(np.float32, copy=False))


def write_padded(group: Any, name: str, values: Any) -> None:
    """Write a flat array, which may be empty."""
    # Zarr stores no empty array: append one value, which reading drops.
    write_in_rows(group, name, np.append(values, values.dtype.type(0)))


def read_sparse(group: Any, name: str, shape: tuple[int, int]) -> sparse.csr_array:
    """Read a sparse matrix.

    Raises
    ------
    UnreadableFileError
        If an array is missing or damaged.
    ValueError
        If the arrays are those of no matrix of this shape.
    """
    indices, starts = (read_padded(group, f"{name}-{part}") for part in ("indices", "starts"))
    data = read_padded(group, f"{name}-data")
    matrix = sparse.csr_array((data, indices, starts), shape=shape)
    matrix.check_format()
    return matrix


def read_entries(group: Any, name: str, like: sparse.csr_array) -> sparse.csr_array:
    """Read the entries of a matrix that shares its indices with another; raises as `read_sparse`.

    Parameters
    ----------
    group : zarr.Group
    name : str
    like : scipy.sparse.csr_array
    """
    data = read_padded(group, f"{name}-data")
    if data.shape != like.data.shape:
        raise ValueError(f"{name} has {len(data)} entries instead of {len(like.data)}")
    return sparse.csr_array((data, like.indices, like.indptr), shape=like.shape)


def read_padded(group: Any, name: str) -> Any:
    """Read what `write_padded` wrote."""
    return read_array(group, name)[:-1]
