"""Correspondence: where each camera pixel's direct light comes from."""

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from nearfar.arrays import AnyPath, AnySize, Booleans, Floats, as_size
from nearfar.checks import real_numbers
from nearfar.errors import InputError, MissingFileError, UnreadableFileError


@dataclass(frozen=True, eq=False)
class Correspondence:
    """The projector pixel q(c) that lights each camera pixel directly.

    Attributes
    ----------
    q : ndarray, shape (Cy, Cx, 2), float32
        (y, x) of the direct light's centroid, projector pixels; NaN where there is none.
    confidence : ndarray, shape (Cy, Cx), float32
        Between 0 and 1: probability that direct light was seen where there is q, and the evidence
        for direct light all the same where there is none.

    Examples
    --------
    >>> correspondence.q.shape
    (8, 8, 2)
    >>> bool(np.allclose(correspondence.q[3, 5], (3, 5), atol=0.1))
    True
    """

    q: Floats
    confidence: Floats

    @property
    def pixels(self) -> Floats:
        """Former name of `q`."""
        warnings.warn("Correspondence.pixels is now called q", DeprecationWarning, stacklevel=2)
        return self.q

    @property
    def lit(self) -> Booleans:
        """Camera pixels with direct light, shape (Cy, Cx)."""
        return np.isfinite(self.q[..., 0])

    def of_rows(self, rows: slice) -> "Correspondence":
        """Return the correspondence of some rows of the camera, as views."""
        return Correspondence(self.q[rows], self.confidence[rows])


def joined(parts: Sequence[Correspondence]) -> Correspondence:
    """Join the correspondence of tiles of camera rows, in order."""
    return Correspondence(
        np.concatenate([part.q for part in parts]),
        np.concatenate([part.confidence for part in parts]),
    )


def given_correspondence(
    q: ArrayLike, camera: AnySize, projector: AnySize, *, source: str = "correspondence"
) -> Correspondence:
    """Take correspondence from outside.

    Parameters
    ----------
    q : ndarray, shape (Cy, Cx, 2)
        (y, x) in projector pixels; NaN where there is no direct light.
    camera, projector : Size or (height, width)
    source : str
        For the message.

    Returns
    -------
    Correspondence
        With confidence 1 at lit camera pixels.

    Raises
    ------
    InputError
        If the shape does not fit the photos, or q lies off the projector.

    Examples
    --------
    >>> q = np.stack(np.indices((8, 8)), axis=-1)  # each camera pixel sees its own
    >>> given = nearfar.given_correspondence(q, camera=(8, 8), projector=(8, 8))
    >>> given.lit.all()
    np.True_
    """
    camera, projector = as_size(camera, "camera"), as_size(projector, "projector")
    array = real_numbers(q, source)
    if array.shape != (*camera, 2):
        raise InputError(
            f"{source} is an array of {'x'.join(map(str, array.shape))}, the photos need "
            f"{camera}x2: give (y, x) for each camera pixel, NaN where there is no direct light."
        )
    if np.isinf(array).any():
        raise InputError(f"{source} holds infinite values: give NaN where no direct light is.")
    given: Floats = np.array(array, dtype=np.float32)
    lit = np.isfinite(given).all(axis=-1)
    if not lit.any():
        raise InputError(f"{source} has no camera pixel with direct light: all of it is NaN.")
    limit = np.array(projector, dtype=np.float32) - 1
    if np.any((given[lit] < -0.5) | (given[lit] > limit + 0.5)):
        raise InputError(
            f"{source} points off the projector of {projector}: q is (y, x) from (0, 0) to "
            f"({projector.height - 1}, {projector.width - 1})."
        )
    on_projector: Floats = np.asarray(np.clip(given, 0, limit))
    on_projector[~lit] = np.nan
    return Correspondence(on_projector, np.where(lit, np.float32(1), np.float32(0)))


def read_correspondence(path: AnyPath, camera: AnySize, projector: AnySize) -> Correspondence:
    """Read correspondence from a .npy file; see `given_correspondence`.

    Raises
    ------
    MissingFileError, UnreadableFileError, InputError

    Examples
    --------
    >>> np.save("q.npy", correspondence.q)
    >>> read = nearfar.read_correspondence("q.npy", camera=(8, 8), projector=(8, 8))
    >>> bool(np.array_equal(read.q, correspondence.q))
    True
    """
    path = Path(path)
    try:
        q = np.load(path, allow_pickle=False)
    except FileNotFoundError:
        raise MissingFileError(f"{path} is not there: name a .npy of H x W x 2.") from None
    except (OSError, ValueError, EOFError) as error:
        raise UnreadableFileError(
            f"{path} cannot be read as correspondence ({error}): save an H x W x 2 array with "
            f"numpy.save."
        ) from None
    if not isinstance(q, np.ndarray):
        raise UnreadableFileError(f"{path} is no .npy array: save q with numpy.save.")
    return given_correspondence(q, camera, projector, source=str(path))
