"""Exact transports in files: what ``nearfar render`` writes, and plain arrays."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from nearfar.arrays import AnyPath, AnySize, Floats, Size, as_size
from nearfar.checks import require_instance
from nearfar.deprecation import path_after_content
from nearfar.errors import InputError, UnreadableFileError
from nearfar.files import kind_of_store, new_output, read_arrays
from nearfar.files.stores import (
    create_store,
    is_plain_array,
    open_store,
    read_plain_array,
)
from nearfar.transport.exact import ExactTransport
from nearfar.transport.exact_operator import ExactOperator
from nearfar.transport.known import KnownTransport
from nearfar.transport.matrix_store import (
    read_in_rows,
    read_sparse,
    write_in_rows,
    write_sparse,
)
from nearfar.transport.operator_store import KIND as OPERATOR_KIND
from nearfar.transport.operator_store import load_operator, save_operator
from nearfar.transport.store_format import MAXIMUM_REASON, stored_size

KIND = "nearfar exact transport"
FORMAT_VERSION = 1
# A longer last axis is not one of channels.
MAXIMUM_CHANNELS = 4
# Orders of the axes of a dense T that are read, as messages name them.
ORDERS = "(C, P), (C, P, channels), (Cy, Cx, Py, Px) or (Cy, Cx, Py, Px, channels)"
DENSE_ENDINGS = (".npy", ".npz")
# What an .npz holds beside matrices.
SIZES = ("projector", "camera")


@path_after_content
def save_exact(transport: KnownTransport, path: AnyPath, *, force: bool = False) -> None:
    """Write an exact transport, each component by itself, as a Zarr group.

    Parameters
    ----------
    transport : ExactTransport or ExactOperator
    path : str or Path
        Folder to make, ending in ``.zarr`` by custom.
    force : bool
        Replace a transport that is there.

    Raises
    ------
    ExistingOutputError, MissingFileError, StorageError
        As `nearfar.files.new_output`.

    Examples
    --------
    >>> nearfar.save_exact(truth, "truth.zarr")
    >>> nearfar.load_exact("truth.zarr").projector
    Size(height=8, width=8)
    """
    if isinstance(transport, ExactOperator):
        save_operator(transport, path, force=force)
        return
    require_instance(transport, ExactTransport, "transport", "nearfar.load_exact")
    path = Path(path)
    attributes = {
        "name": transport.name,
        "projector": list(transport.projector),
        "camera": list(transport.camera),
        "channels": transport.channels,
        "apart": transport.is_apart,
    }
    with new_output(path, force=force) as partial:
        group = create_store(partial, KIND, FORMAT_VERSION, attributes)
        for i in range(transport.channels):
            write_in_rows(group, f"far-{i}", transport.far[i])
            if transport.is_apart:
                for name, part in (("direct", transport.direct[i]), ("near", transport.near[i])):
                    write_sparse(group, f"{name}-{i}", part)


def load_exact(
    path: AnyPath, *, projector: AnySize | None = None, camera: AnySize | None = None
) -> KnownTransport:
    """Read an exact transport: a Zarr of `save_exact`, or a dense .npy, .npz or Zarr array.

    That of a scene at native size is an operator, which answers lights as matrices do.

    Parameters
    ----------
    path : str or Path
        A dense T is (C, P) or (C, P, channels), or unflattened (Cy, Cx, Py, Px) or
        (Cy, Cx, Py, Px, channels). An .npz holds it as ``T``, or as its only array, or as
        ``direct``, ``near`` and ``far``, and may hold ``projector`` and ``camera`` as
        (height, width).
    projector, camera : Size or (height, width), optional
        Sizes for a dense T whose file has none. By default the camera has the projector's size
        times the whole number that gives the rows of T.

    Returns
    -------
    ExactTransport or ExactOperator

    Raises
    ------
    MissingFileError, UnreadableFileError
        If it is not there, damaged or of another kind.
    InputError
        If its sizes are not known, or do not fit the matrix.

    Examples
    --------
    >>> nearfar.load_exact("scene.npy", projector=(8, 8)).camera
    Size(height=8, width=8)
    """
    if kind_of_store(Path(path)) == OPERATOR_KIND:
        return load_operator(path)
    return load_matrices(path, projector=projector, camera=camera)


def load_matrices(
    path: AnyPath, *, projector: AnySize | None = None, camera: AnySize | None = None
) -> ExactTransport:
    """Read an exact transport as matrices, an operator refused; otherwise as `load_exact`."""
    path = Path(path)
    sizes = (
        None if projector is None else as_size(projector, "projector"),
        None if camera is None else as_size(camera, "camera"),
    )
    if path.suffix.lower() in DENSE_ENDINGS:
        return _load_dense(path, *sizes)
    if path.is_file():
        raise UnreadableFileError(
            f"{path} is of no kind that transports are read from: save it by numpy.save as "
            f"{' or '.join(DENSE_ENDINGS)}, or as a Zarr array."
        )
    if is_plain_array(path):
        return _as_exact({"T": read_plain_array(path)}, *sizes, path)
    group = open_store(path, KIND, FORMAT_VERSION)
    try:
        attributes = dict(group.attrs)
        stored_projector, stored_camera = (
            stored_size(attributes[name]) for name in ("projector", "camera")
        )
        shape = (stored_camera.pixels, stored_projector.pixels)
        channels = int(str(attributes["channels"]))
        apart = range(channels if attributes["apart"] else 0)
        direct = tuple(read_sparse(group, f"direct-{i}", shape) for i in apart)
        near = tuple(read_sparse(group, f"near-{i}", shape) for i in apart)
        far = np.empty((channels, *shape), dtype=np.float32)
        for i in range(channels):
            read_in_rows(group, f"far-{i}", far[i])
        return ExactTransport(
            stored_projector, stored_camera, direct, near, far, str(attributes["name"])
        )
    except (KeyError, TypeError, ValueError, IndexError, OverflowError) as error:
        raise UnreadableFileError(
            f"{path} is a damaged exact transport ({str(error)[:MAXIMUM_REASON]}): render it again."
        ) from error


def _load_dense(path: Path, projector: Size | None, camera: Size | None) -> ExactTransport:
    arrays = read_arrays(path)
    if path.suffix.lower() == ".npy":
        arrays = {"T": arrays["array"]}
    return _as_exact(arrays, projector, camera, path)


def _as_exact(
    arrays: Mapping[str, NDArray[Any]], projector: Size | None, camera: Size | None, path: Path
) -> ExactTransport:
    matrices = [name for name in arrays if name not in SIZES]
    if len(matrices) == 1 and matrices != ["far"]:
        # Whatever it is called, there is nothing else that could be meant.
        arrays = {**arrays, "T": arrays[matrices[0]]}
    projector = _stored_size(arrays, "projector", path) or projector
    camera = _stored_size(arrays, "camera", path) or camera
    names = ("direct", "near", "far") if "far" in arrays else ("T",)
    missing = [name for name in names if name not in arrays]
    if missing:
        raise InputError(
            f"{path} holds {', '.join(arrays)} but no {missing[0]}: save the dense transport as "
            f"T, or its components as direct, near and far."
        )
    parts: list[Floats] = []
    for name in names:
        matrix, projector, camera = _as_matrices(
            arrays[name], projector, camera, f"{path} ({name})"
        )
        parts.append(matrix)
    assert projector is not None
    assert camera is not None
    *apart, far = parts
    sparse_parts = [tuple(sparse.csr_array(channel) for channel in part) for part in apart]
    direct, near = sparse_parts or ((), ())
    return ExactTransport(projector, camera, direct, near, far, path.name)


def _stored_size(arrays: Mapping[str, NDArray[Any]], name: str, path: Path) -> Size | None:
    if name not in arrays:
        return None
    sides = arrays[name]
    if sides.shape != (2,) or sides.dtype.kind not in "iu" or sides.min() < 1:
        raise InputError(f"{path} has a {name} that is no size: store it as (height, width).")
    return Size(*(int(side) for side in sides))


def _as_matrices(
    dense: Floats, projector: Size | None, camera: Size | None, source: str
) -> tuple[Floats, Size, Size]:
    """Return a dense T as (channels, C, P), with the sizes of projector and camera."""
    dense = np.asarray(dense)
    if dense.dtype.kind not in "fiu":
        raise InputError(f"{source} holds {dense.dtype}, not numbers: save T as floats.")
    if not np.isfinite(dense).all():
        raise InputError(f"{source} holds NaN or infinite values: mend them first.")
    # Before the axes are joined: a message names the shape that the user knows.
    if not 2 <= dense.ndim <= 5 or (dense.ndim in (3, 5) and dense.shape[-1] > MAXIMUM_CHANNELS):
        raise InputError(
            f"{source} has shape {dense.shape}: a dense transport is {ORDERS}, of up to "
            f"{MAXIMUM_CHANNELS} channels; bring its axes into such an order by numpy.moveaxis."
        )
    if dense.ndim in (4, 5):
        camera, projector = Size(*dense.shape[:2]), Size(*dense.shape[2:4])
        dense = dense.reshape(camera.pixels, projector.pixels, *dense.shape[4:])
    if dense.ndim == 2:
        dense = dense[..., None]
    rows, columns = dense.shape[:2]
    if projector is None or projector.pixels != columns:
        raise InputError(
            f"{source} has {columns} columns"
            + (f", the projector of {projector} has {projector.pixels}" if projector else "")
            + ": give `projector`, the size that it is for."
        )
    camera = camera or _finer(projector, rows)
    if camera is None or camera.pixels != rows:
        raise InputError(
            f"{source} has {rows} rows, from which no camera size follows for a projector of "
            f"{projector}: store it in the .npz as camera, set it under [scene] in RIG.toml, or "
            f"give `camera` where it is taken."
        )
    return np.ascontiguousarray(np.moveaxis(dense, 2, 0), dtype=np.float32), projector, camera


def _finer(projector: Size, rows: int) -> Size | None:
    """Return the projector's size times the whole number that gives `rows` camera pixels."""
    factor = round((rows / projector.pixels) ** 0.5)
    size = Size(projector.height * factor, projector.width * factor)
    return size if factor >= 1 and size.pixels == rows else None
