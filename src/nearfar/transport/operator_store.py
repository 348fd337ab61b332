"""Exact operators in files: what ``nearfar render`` writes of a scene at native size."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from nearfar.arrays import AnyPath, Floats
from nearfar.checks import require_instance
from nearfar.errors import UnreadableFileError
from nearfar.files import new_output
from nearfar.files.stores import create_store, open_store
from nearfar.transport.exact_operator import ExactOperator
from nearfar.transport.matrix_store import (
    read_entries,
    read_in_rows,
    read_sparse,
    write_in_rows,
    write_sparse,
    write_sparse_data,
)
from nearfar.transport.mediated import Between, ConvolvedBetween, DenseBetween, Mediated
from nearfar.transport.posterior_store import listed
from nearfar.transport.store_format import MAXIMUM_REASON, stored_size

KIND = "nearfar exact operator"
FORMAT_VERSION = 1


def save_operator(operator: ExactOperator, path: AnyPath, *, force: bool = False) -> None:
    """Write an exact operator, factor by factor, as a Zarr group.

    Parameters
    ----------
    operator : ExactOperator
    path : str or Path
        Folder to make, ending in ``.zarr`` by custom.
    force : bool
        Replace a transport that is there.

    Raises
    ------
    ExistingOutputError, MissingFileError, StorageError
        As `nearfar.files.new_output`.
    """
    require_instance(operator, ExactOperator, "operator", "nearfar.scenes.build_operator")
    path = Path(path)
    first, *others = operator.direct
    shared = all(np.may_share_memory(first.indices, other.indices) for other in others)
    parts = {"near": operator.near, "far": operator.far}
    attributes = {
        "name": operator.name,
        "projector": list(operator.projector),
        "camera": list(operator.camera),
        "channels": operator.channels,
        "shared": shared,
        **{name: part and _shape_of(part.between) for name, part in parts.items()},
    }
    with new_output(path, force=force) as partial:
        group = create_store(partial, KIND, FORMAT_VERSION, attributes)
        write_sparse(group, "direct-0", first)
        for i, matrix in enumerate(others, start=1):
            (write_sparse_data if shared else write_sparse)(group, f"direct-{i}", matrix)
        for name, part in parts.items():
            if part is not None:
                write_sparse(group, f"{name}-camera", part.camera)
                write_sparse(group, f"{name}-projector", part.projector)
                for i, values in enumerate(_values_of(part.between)):
                    write_in_rows(group, f"{name}-between-{i}", values)


def _shape_of(between: Between) -> dict[str, list[int]]:
    if isinstance(between, DenseBetween):
        return {"nodes": [between.nodes]}
    return {"lattice": list(between.lattice), "padded": list(between.padded)}


def _values_of(between: Between) -> Floats:
    return between.matrices if isinstance(between, DenseBetween) else between.spectra


def load_operator(path: AnyPath) -> ExactOperator:
    """Read an exact operator that `save_operator` wrote.

    Parameters
    ----------
    path : str or Path

    Raises
    ------
    MissingFileError, UnreadableFileError
        If it is not there, damaged or of another kind.
    """
    path = Path(path)
    group = open_store(path, KIND, FORMAT_VERSION)
    try:
        return _read_factors(group, dict(group.attrs))
    except (KeyError, TypeError, ValueError, IndexError, OverflowError) as error:
        raise UnreadableFileError(
            f"{path} is a damaged exact operator ({str(error)[:MAXIMUM_REASON]}): render it again."
        ) from error


def _read_factors(group: Any, attributes: Mapping[str, Any]) -> ExactOperator:
    projector, camera = (stored_size(attributes[name]) for name in ("projector", "camera"))
    channels = int(str(attributes["channels"]))
    shape = (camera.pixels, projector.pixels)
    first = read_sparse(group, "direct-0", shape)
    names = [f"direct-{i}" for i in range(1, channels)]
    if attributes["shared"]:
        others = [read_entries(group, name, first) for name in names]
    else:
        others = [read_sparse(group, name, shape) for name in names]

    def mediated(name: str) -> Mediated:
        between = _read_between(group, name, attributes[name], channels)
        nodes = between.nodes
        on_camera = read_sparse(group, f"{name}-camera", (camera.pixels, nodes))
        on_projector = read_sparse(group, f"{name}-projector", (projector.pixels, nodes))
        return Mediated(on_camera, on_projector, between)

    return ExactOperator(
        projector,
        camera,
        (first, *others),
        None if attributes["near"] is None else mediated("near"),
        mediated("far"),
        str(attributes["name"]),
    )


def _read_between(group: Any, name: str, form: Any, channels: int) -> Between:
    if "nodes" in form:
        (nodes,) = map(int, listed(form["nodes"]))
        return DenseBetween(_read_values(group, name, channels, (nodes, nodes)))
    lattice, padded = (_three(form[key]) for key in ("lattice", "padded"))
    if any(whole < 2 * part for whole, part in zip(padded, lattice, strict=True)):
        raise ValueError(f"a lattice of {lattice} in {padded}")
    half = (padded[0], padded[1], padded[2] // 2 + 1)
    return ConvolvedBetween(lattice, _read_values(group, name, channels, half), padded)


def _read_values(group: Any, name: str, channels: int, shape: tuple[int, ...]) -> Floats:
    """Read an array per channel into its place: a second copy of a large one would not fit."""
    values = np.empty((channels, *shape), dtype=np.float32)
    for i in range(channels):
        read_in_rows(group, f"{name}-between-{i}", values[i])
    if not np.isfinite(values.sum()):
        raise ValueError(f"{name}-between holds NaN or infinite values")
    return values


def _three(value: Any) -> tuple[int, int, int]:
    deep, high, wide = map(int, listed(value))
    return deep, high, wide
