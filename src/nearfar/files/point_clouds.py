"""Point clouds: binary little-endian PLY, and .npy of (Cy, Cx, 3)."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Floats
from nearfar.errors import InputError
from nearfar.files.arrays import write_array
from nearfar.files.output import new_output

ENDINGS = (".ply", ".npy")
PROPERTIES = np.dtype(
    [
        ("x", "<f4"),
        ("y", "<f4"),
        ("z", "<f4"),
        ("red", "u1"),
        ("green", "u1"),
        ("blue", "u1"),
        ("confidence", "<f4"),
        ("standard_deviation", "<f4"),
    ]
)
# What PLY calls the types.
TYPES = {"<f4": "float", "|u1": "uchar"}


def check_cloud_ending(path: Path) -> None:
    """Refuse a name that no point cloud can be written under.

    Raises
    ------
    InputError
    """
    if path.suffix.lower() not in ENDINGS:
        raise InputError(f"{path} ends in neither .ply nor .npy: choose a name that does.")


def write_cloud(
    path: Path,
    points: Floats,
    colours: NDArray[np.uint8],
    confidence: Floats,
    deviation: Floats,
    *,
    force: bool = False,
) -> None:
    """Write points by camera pixel, whole or not at all.

    Parameters
    ----------
    path : Path
        A .ply gets the points there are, with colour, confidence and standard deviation; an .npy
        all camera pixels, (Cy, Cx, 3) float32, NaN where there is no point.
    points : ndarray, shape (Cy, Cx, 3)
    colours : ndarray, shape (Cy, Cx, 3), uint8
        sRGB.
    confidence, deviation : ndarray, shape (Cy, Cx)
    force : bool
        Replace a file that is there.

    Raises
    ------
    InputError
        If the name has another ending.
    ExistingOutputError, MissingFileError, StorageError
        As `nearfar.files.new_output`.
    """
    check_cloud_ending(path)
    if path.suffix.lower() == ".npy":
        write_array(path, points.astype(np.float32), force=force)
        return
    kept = np.isfinite(points).all(axis=-1)
    vertices = np.empty(int(kept.sum()), dtype=PROPERTIES)
    for axis, name in enumerate("xyz"):
        vertices[name] = points[kept, axis]
    for channel, name in enumerate(("red", "green", "blue")):
        vertices[name] = colours[kept, channel]
    vertices["confidence"], vertices["standard_deviation"] = confidence[kept], deviation[kept]
    lines = ["ply", "format binary_little_endian 1.0", "comment nearfar"]
    lines.append(f"element vertex {len(vertices)}")
    lines += [f"property {TYPES[PROPERTIES[name].str]} {name}" for name in PROPERTIES.names or ()]
    with new_output(path, force=force) as partial, partial.open("wb") as file:
        file.write("\n".join([*lines, "end_header", ""]).encode("ascii"))
        file.write(vertices.data)
