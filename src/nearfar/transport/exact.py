"""A transport that is known: dense or sparse components, per channel, without a model."""

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from scipy import sparse

from nearfar.arrays import Booleans, Floats, Size
from nearfar.errors import InputError


@dataclass(frozen=True)
class ExactTransport:
    """Transport T = D + N + F of a scene, each component a C x P matrix per channel.

    Index convention: c is a camera pixel and p a projector pixel, both flattened row by row.

    Attributes
    ----------
    projector, camera : Size
        Sizes of the pattern grid and of the photo.
    direct, near : tuple of scipy.sparse.csr_array, one per channel
        D and N, shape (C, P), float32. Empty tuples where the components are not known apart;
        then `far` holds all of T.
    far : ndarray, shape (channels, C, P), float32
        F, or all of T.
    name : str
        What scene or file this is.
    """

    projector: Size
    camera: Size
    direct: tuple[sparse.csr_array, ...]
    near: tuple[sparse.csr_array, ...]
    far: Floats
    name: str = field(default="transport")

    def __post_init__(self) -> None:
        channels, rows, columns = self.far.shape
        if (rows, columns) != (self.camera.pixels, self.projector.pixels):
            raise InputError(
                f"{self.name}: a matrix of {rows} x {columns} does not fit a camera of "
                f"{self.camera} and a projector of {self.projector}."
            )
        for part in (self.direct, self.near):
            if len(part) not in (0, channels):
                raise InputError(f"{self.name}: its components differ in their channels.")

    @property
    def channels(self) -> int:
        """Number of camera channels."""
        return int(self.far.shape[0])

    @property
    def is_apart(self) -> bool:
        """Whether direct, near and far are known apart."""
        return bool(self.direct)

    @cached_property
    def correspondence(self) -> Floats:
        """Centroid of the direct light, shape (Cy, Cx, 2) as (y, x); NaN where there is none."""
        y, x = np.divmod(np.arange(self.projector.pixels), self.projector.width)
        total = sum((part for part in self.direct[1:]), start=self.direct[0])
        weight = total @ np.ones(self.projector.pixels)
        with np.errstate(invalid="ignore", divide="ignore"):
            q = np.stack([total @ y / weight, total @ x / weight], axis=-1)
        q[weight <= 0] = np.nan
        return q.reshape(*self.camera, 2)

    @cached_property
    def lit(self) -> Booleans:
        """Camera pixels with direct light, shape (Cy, Cx)."""
        return np.isfinite(self.correspondence[..., 0])

    def rows(self, pixels: slice) -> Floats:
        """Dense rows t of camera pixels, flattened row by row: (n, channels, P), float32."""
        return sum_rows((*self._sparse_parts(), self.far), pixels)

    def _sparse_parts(self) -> tuple[tuple[sparse.csr_array, ...], ...]:
        return (self.direct, self.near) if self.is_apart else ()

    def component_rows(self, pixels: slice) -> tuple[Floats, Floats, Floats]:
        """Dense rows of D, N and F, each (n, channels, P), float32."""
        d, n = (sum_rows((part,), pixels) for part in (self.direct, self.near))
        return d, n, sum_rows((self.far,), pixels)

    def __matmul__(self, light: Floats) -> Floats:
        return np.asarray(self.pictures(np.asarray(light)[None])[0])

    def pictures(self, lights: Floats) -> Floats:
        """Light the scene with many lights at once.

        Parameters
        ----------
        lights : ndarray, shape (n, Py, Px) or (n, Py, Px, channels)

        Returns
        -------
        ndarray, shape (n, Cy, Cx, channels), float32
        """
        lights = np.asarray(lights, dtype=np.float32)
        if lights.shape[1:3] != self.projector:
            raise InputError(
                f"the light is {'x'.join(map(str, lights.shape[1:]))}, the projector of "
                f"{self.name} is {self.projector}: resize the light to {self.projector}."
            )
        pictures = np.empty((len(lights), self.camera.pixels, self.channels), dtype=np.float32)
        for i in range(self.channels):
            chosen = lights if lights.ndim == 3 else lights[..., min(i, lights.shape[3] - 1)]
            columns = np.ascontiguousarray(chosen.reshape(len(lights), -1).T)
            total = self.far[i] @ columns
            for part in (self.direct, self.near):
                if part:
                    total += part[i] @ columns
            pictures[..., i] = total.T
        return pictures.reshape(len(lights), *self.camera, self.channels)

    def component_pictures(self, light: Floats) -> tuple[Floats, Floats, Floats]:
        """Direct, near and far pictures under one light, each (Cy, Cx, channels)."""
        empty = tuple(0 * self.direct[i] for i in range(self.channels))
        nothing = np.zeros((self.channels, 1, 1), dtype=np.float32)
        parts = (
            replace(self, near=empty, far=np.broadcast_to(nothing, self.far.shape)),
            replace(self, direct=empty, far=np.broadcast_to(nothing, self.far.shape)),
            replace(self, direct=(), near=()),
        )
        first, second, third = (part @ light for part in parts)
        return first, second, third


def sum_rows(parts: Iterable[tuple[sparse.csr_array, ...] | Floats], pixels: slice) -> Floats:
    """Add rows of matrices given per channel, dense or sparse: (n, channels, P), float32."""
    return np.asarray(
        sum(np.stack([_dense_rows(matrix, pixels) for matrix in part], axis=1) for part in parts)
    )


def _dense_rows(matrix: sparse.csr_array | Floats, pixels: slice) -> Floats:
    cut = matrix[pixels]
    return np.asarray(cut if isinstance(cut, np.ndarray) else cut.toarray(), dtype=np.float32)
