"""What camera pixels share of the posterior of free rows, in a transport's file."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from nearfar.arrays import Size
from nearfar.transport.free_posterior import SHARED, FreePosterior
from nearfar.transport.matrix_store import read_padded, write_padded

PREFIX = "free_posterior"


def write_shared(group: Any, posterior: FreePosterior) -> None:
    """Write what camera pixels share, flat, as arrays of a transport's group."""
    for name in SHARED:
        write_padded(group, f"{PREFIX}_{name}", np.ravel(getattr(posterior, name)))


def shared_of(group: Any, described: Mapping[str, Any], projector: Size) -> dict[str, Any]:
    """Read what camera pixels share of a posterior.

    Raises
    ------
    UnreadableFileError
        If an array is missing or damaged.
    KeyError, TypeError, ValueError
        If it is not that of a transport of the projector.
    """
    found: dict[str, Any] = {
        name: read_padded(group, f"{PREFIX}_{name}").astype(np.float32) for name in SHARED
    }
    for name in ("modes", "gain_errors"):
        found[name] = found[name].reshape(-1, projector.pixels)
    if len(found["modes"]) != len(found["strengths"]) or len(found["mean"]) != projector.pixels:
        raise ValueError("its posterior of free rows is of another projector")
    variance = float(described["mean_variance"])
    if not all(np.isfinite(found[name]).all() for name in SHARED) or not 0 <= variance < np.inf:
        raise ValueError("its posterior of free rows is not finite")
    return {**found, "mean_variance": variance}
