"""A transport that is known exactly: its components as dense or sparse matrices per channel."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from scipy import sparse

from nearfar.arrays import Booleans, Floats, Size, as_size
from nearfar.checks import (
    NoArray,
    as_image,
    as_light,
    as_lights,
    as_number,
    as_pixels,
    finite_numbers,
    real_numbers,
)
from nearfar.errors import InputError
from nearfar.transport.adjoint import AdjointTransport


@dataclass(frozen=True, eq=False)
class ExactTransport(NoArray):
    """Transport T = D + N + F of a scene, each component a C x P matrix per channel.

    Index convention: c is a camera pixel and p a projector pixel, both flattened row by row.

    Attributes
    ----------
    projector, camera : Size or (height, width)
        Sizes of the pattern grid and of the photo.
    direct, near : tuple of scipy.sparse.csr_array, one per channel
        D and N, shape (C, P), float32. Empty tuples if the components are not known separately;
        then `far` is all of T.
    far : ndarray, shape (channels, C, P), float32
        F, or all of T.
    name : str
        Scene or file.

    Raises
    ------
    InputError
        If the matrices do not fit the sizes or each other, or do not hold finite numbers.

    Examples
    --------
    >>> matrix = 0.5 * np.eye(64, dtype=np.float32)
    >>> mirror = nearfar.ExactTransport((8, 8), (8, 8), (), (), matrix[None], "a mirror")
    >>> bool(np.allclose((mirror @ light)[..., 0], 0.5 * light))
    True
    """

    projector: Size
    camera: Size
    direct: tuple[sparse.csr_array, ...]
    near: tuple[sparse.csr_array, ...]
    far: Floats
    name: str = field(default="transport")

    def __post_init__(self) -> None:
        for name in ("projector", "camera"):
            object.__setattr__(self, name, as_size(getattr(self, name), name))
        far = real_numbers(self.far, f"{self.name}: far")
        if far.ndim != 3:
            raise InputError(f"{self.name}: far has shape {far.shape}: give (channels, C, P).")
        object.__setattr__(self, "far", far)
        channels, rows, columns = far.shape
        if (rows, columns) != (self.camera.pixels, self.projector.pixels):
            raise InputError(
                f"{self.name}: a matrix of {rows} x {columns} does not fit a camera of "
                f"{self.camera} and a projector of {self.projector}."
            )
        if len(self.direct) != len(self.near):
            raise InputError(
                f"{self.name}: direct and near must both be given, a matrix for each channel, or "
                f"neither."
            )
        for part in (self.direct, self.near):
            if len(part) not in (0, channels):
                raise InputError(f"{self.name}: its components differ in their channels.")
            for matrix in part:
                if matrix.shape != (rows, columns):
                    raise InputError(f"{self.name}: its components differ in their sizes.")
                finite_numbers(matrix.data, f"{self.name}: its components")
        # Row by row: checking all of it at once would take another fourth of its memory.
        for row in far.reshape(-1, columns):
            finite_numbers(row, f"{self.name}: far")

    @property
    def channels(self) -> int:
        """Number of camera channels."""
        return int(self.far.shape[0])

    @property
    def is_apart(self) -> bool:
        """Whether direct, near and far are known separately."""
        return bool(self.direct)

    @cached_property
    def correspondence(self) -> Floats:
        """Centroid of the direct light, shape (Cy, Cx, 2) as (y, x); NaN where there is none."""
        self._require_apart()
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
        """Return dense rows t of chosen camera pixels.

        Parameters
        ----------
        pixels : slice
            Camera pixels, flattened row by row.

        Returns
        -------
        ndarray, shape (n, channels, P), float32

        Raises
        ------
        InputError
            If `pixels` is not a slice.
        """
        return sum_rows(self._parts, as_pixels(pixels, self.camera.pixels))

    @property
    def _parts(self) -> tuple[tuple[sparse.csr_array, ...] | Floats, ...]:
        return (self.direct, self.near, self.far) if self.is_apart else (self.far,)

    def component_rows(self, pixels: slice) -> tuple[Floats, Floats, Floats]:
        """Return dense rows of D, N and F of chosen camera pixels; see `rows`.

        Raises
        ------
        InputError
            As `rows`; if the components are not known apart.
        """
        self._require_apart()
        pixels = as_pixels(pixels, self.camera.pixels)
        d, n = (sum_rows((part,), pixels) for part in (self.direct, self.near))
        return d, n, sum_rows((self.far,), pixels)

    def _require_apart(self) -> None:
        if not self.is_apart:
            raise InputError(
                f"the components of {self.name} are not known apart: give direct and near, one "
                f"matrix for each channel."
            )

    def __matmul__(self, light: Floats) -> Floats:
        light = as_light(light, self.projector, self.channels)
        return np.asarray(self.pictures(light[None])[0])

    def __mul__(self, factor: float) -> "ExactTransport":
        scale = np.float32(as_number(factor, "the factor"))
        direct, near = (
            tuple(matrix * scale for matrix in part) for part in (self.direct, self.near)
        )
        return replace(self, direct=direct, near=near, far=self.far * scale)

    __rmul__ = __mul__

    @property
    def H(self) -> "AdjointTransport[ExactTransport]":  # noqa: N802
        """The adjoint T^T, an operator that takes images of the camera."""
        return AdjointTransport(self)

    def adjoint(self, image: Floats) -> Floats:
        """Send an image back: T^T per channel.

        Parameters
        ----------
        image : ndarray, shape (Cy, Cx) for one channel or (Cy, Cx, channels)

        Returns
        -------
        ndarray, shape (Py, Px, channels)

        Raises
        ------
        InputError
            If the image does not hold finite numbers, or is of another shape.
        """
        flat = as_image(image, self.camera, self.channels)
        back = [sum(part[i].T @ flat[:, i] for part in self._parts) for i in range(self.channels)]
        return np.stack(back, axis=-1).reshape(*self.projector, self.channels)

    def pictures(self, lights: Floats) -> Floats:
        """Light the scene with many lights at once.

        Parameters
        ----------
        lights : ndarray, shape (n, Py, Px) or (n, Py, Px, channels)

        Returns
        -------
        ndarray, shape (n, Cy, Cx, channels), float32

        Raises
        ------
        InputError
            If the lights do not hold finite numbers, or have another size than the pattern grid
            or other channels.
        """
        checked = as_lights(lights, self.projector, self.channels).astype(np.float32, copy=False)
        # F first, as the last digit of a sum depends on the order.
        return self._pictures(checked, (self.far, *self._parts[:-1]))

    def _pictures(
        self, lights: Floats, parts: Sequence[tuple[sparse.csr_array, ...] | Floats]
    ) -> Floats:
        """Add the pictures of some components, (n, Cy, Cx, channels)."""
        pictures = np.empty((len(lights), self.camera.pixels, self.channels), dtype=np.float32)
        for i in range(self.channels):
            chosen = lights if lights.ndim == 3 else lights[..., min(i, lights.shape[3] - 1)]
            columns = np.ascontiguousarray(chosen.reshape(len(lights), -1).T)
            total = parts[0][i] @ columns
            for part in parts[1:]:
                total += part[i] @ columns
            pictures[..., i] = total.T
        return pictures.reshape(len(lights), *self.camera, self.channels)

    def component_pictures(self, light: Floats) -> tuple[Floats, Floats, Floats]:
        """Return the direct, near and far pictures under one light, each (Cy, Cx, channels).

        Raises
        ------
        InputError
            As `pictures`; if the components are not known apart.
        """
        self._require_apart()
        checked = as_light(light, self.projector, self.channels)[None].astype(np.float32)
        direct, near, far = (self._pictures(checked, (part,))[0] for part in self._parts)
        return direct, near, far


def sum_rows(parts: Sequence[tuple[sparse.csr_array, ...] | Floats], pixels: slice) -> Floats:
    """Add rows of matrices given per channel, dense or sparse: (n, channels, P), float32."""
    channels = len(parts[0])
    count, columns = parts[0][0][pixels].shape
    total = np.zeros((count, channels, columns), dtype=np.float32)
    for part in parts:
        for channel, matrix in enumerate(part):
            rows = matrix[pixels]
            # Most scenes have no near light by itself: nothing to add.
            if isinstance(rows, np.ndarray) or rows.nnz:
                total[:, channel] += _dense(rows)
    return total


def _dense(rows: sparse.csr_array | Floats) -> Floats:
    dense = rows if isinstance(rows, np.ndarray) else rows.toarray()
    return np.asarray(dense, dtype=np.float32)
