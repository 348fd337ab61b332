"""A transport that is known exactly and too large for a matrix: an operator of thin factors."""

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from scipy import sparse

from nearfar.arrays import Booleans, Floats, Size, as_size, blocks
from nearfar.checks import NoArray, as_image, as_light, as_lights, as_number, as_pixels
from nearfar.errors import InputError
from nearfar.transport.adjoint import AdjointTransport
from nearfar.transport.mediated import Mediated
from nearfar.transport.sparse_products import scaled, times, transposed_times

# Lights that a product takes at once.
LIGHTS_AT_ONCE = 4


@dataclass(frozen=True, eq=False)
class ExactOperator(NoArray):
    """Transport T = D + N + F of a scene at native size; nothing of it is of size C x P.

    It answers as `ExactTransport` does.

    Index convention: c is a camera pixel and p a projector pixel, both flattened row by row.

    Attributes
    ----------
    projector, camera : Size or (height, width)
        Sizes of the projector and of the photo.
    direct : tuple of scipy.sparse.csr_array, one per channel
        D, shape (C, P), float32; a few entries a row.
    near : Mediated or None
        N; None where there is no light under a surface.
    far : Mediated
        F.
    name : str
        Scene.

    Raises
    ------
    InputError
        If the factors do not fit the sizes or each other.

    Examples
    --------
    A mirror, in haze that sends a thousandth of all light to every camera pixel:

    >>> from scipy import sparse
    >>> from nearfar.transport.mediated import DenseBetween, Mediated
    >>> mirror = sparse.eye_array(64, format="csr", dtype=np.float32)
    >>> one = sparse.csr_array(np.ones((64, 1), dtype=np.float32))
    >>> haze = Mediated(one, one, DenseBetween(np.full((1, 1, 1), 0.001, dtype=np.float32)))
    >>> hazy = nearfar.ExactOperator((8, 8), (8, 8), (mirror,), None, haze, "a mirror in haze")
    >>> bool(np.allclose((hazy @ light)[..., 0], light + 0.001 * light.sum(), atol=1e-4))
    True
    """

    projector: Size
    camera: Size
    direct: tuple[sparse.csr_array, ...]
    near: Mediated | None
    far: Mediated
    name: str = field(default="transport")

    def __post_init__(self) -> None:
        for name in ("projector", "camera"):
            object.__setattr__(self, name, as_size(getattr(self, name), name))
        shape = (self.camera.pixels, self.projector.pixels)
        mediated = [part for part in (self.near, self.far) if part is not None]
        shapes = {matrix.shape for matrix in self.direct}
        shapes |= {(part.camera.shape[0], part.projector.shape[0]) for part in mediated}
        if shapes != {shape}:
            raise InputError(
                f"{self.name}: its components do not fit a camera of {self.camera} and a projector "
                f"of {self.projector}: give those of these sizes."
            )
        if {len(self.direct)} != {part.between.channels for part in mediated}:
            raise InputError(
                f"{self.name}: its components differ in their channels: give all of them for each."
            )

    @property
    def channels(self) -> int:
        """Number of camera channels."""
        return len(self.direct)

    @property
    def is_apart(self) -> bool:
        """Whether direct, near and far are known separately: they are."""
        return True

    @cached_property
    def correspondence(self) -> Floats:
        """Centroid of the direct light, shape (Cy, Cx, 2) as (y, x); NaN where there is none."""
        y, x = np.divmod(np.arange(self.projector.pixels), self.projector.width)
        columns = np.stack([np.ones_like(y), y, x], axis=-1).astype(float)
        moments = sum(matrix @ columns for matrix in self.direct)
        with np.errstate(invalid="ignore", divide="ignore"):
            q = moments[:, 1:] / moments[:, :1]
        q[moments[:, 0] <= 0] = np.nan
        return np.asarray(q.reshape(*self.camera, 2))

    @cached_property
    def lit(self) -> Booleans:
        """Camera pixels with direct light, shape (Cy, Cx)."""
        return np.isfinite(self.correspondence[..., 0])

    def rows(self, pixels: slice) -> Floats:
        """Return dense rows t of chosen camera pixels; see `ExactTransport.rows`."""
        direct, near, far = self.component_rows(pixels)
        direct += near
        direct += far
        return direct

    def component_rows(self, pixels: slice) -> tuple[Floats, Floats, Floats]:
        """Return dense rows of D, N and F of chosen camera pixels; see `rows`."""
        pixels = as_pixels(pixels, self.camera.pixels)
        direct = np.stack([part[pixels].toarray() for part in self.direct], axis=1)
        near = np.zeros_like(direct) if self.near is None else self.near.rows(pixels)
        return direct, near, self.far.rows(pixels)

    def __matmul__(self, light: Floats) -> Floats:
        light = as_light(light, self.projector, self.channels)
        return np.asarray(self.pictures(light[None])[0])

    def __mul__(self, factor: float) -> "ExactOperator":
        scale = as_number(factor, "the factor")
        return replace(
            self,
            direct=tuple(scaled(matrix, scale) for matrix in self.direct),
            near=None if self.near is None else self.near.scaled(scale),
            far=self.far.scaled(scale),
        )

    __rmul__ = __mul__

    @property
    def H(self) -> "AdjointTransport[ExactOperator]":  # noqa: N802
        """The adjoint T^T, an operator that takes images of the camera."""
        return AdjointTransport(self)

    def adjoint(self, image: Floats) -> Floats:
        """Send an image back: T^T per channel; see `ExactTransport.adjoint`."""
        flat = as_image(image, self.camera, self.channels).astype(np.float32, copy=False).T
        back = np.stack(
            [
                transposed_times(matrix, np.ascontiguousarray(flat[i, :, None]))[:, 0]
                for i, matrix in enumerate(self.direct)
            ]
        )
        for part in self._mediated:
            back += part.reversed.pictures(np.ascontiguousarray(flat)[None])[0]
        return np.ascontiguousarray(back.T).reshape(*self.projector, self.channels)

    @property
    def _mediated(self) -> tuple[Mediated, ...]:
        return tuple(part for part in (self.near, self.far) if part is not None)

    def pictures(self, lights: Floats) -> Floats:
        """Light the scene with many lights at once; see `ExactTransport.pictures`."""
        checked = as_lights(lights, self.projector, self.channels)
        pictures = np.empty((len(checked), *self.camera, self.channels), dtype=np.float32)
        for some in blocks(len(checked), LIGHTS_AT_ONCE):
            flat = self._flattened(checked[some])
            total = self._direct_pictures(flat)
            for part in self._mediated:
                total += part.pictures(flat)
            pictures[some] = self._as_images(total)
        return pictures

    def component_pictures(self, light: Floats) -> tuple[Floats, Floats, Floats]:
        """Return the direct, near and far pictures under one light, each (Cy, Cx, channels)."""
        flat = self._flattened(as_light(light, self.projector, self.channels)[None])
        direct = self._direct_pictures(flat)
        near = np.zeros_like(direct) if self.near is None else self.near.pictures(flat)
        direct, near, far = (
            self._as_images(part)[0] for part in (direct, near, self.far.pictures(flat))
        )
        return direct, near, far

    def _flattened(self, lights: Floats) -> Floats:
        """Return lights as (n, channels or 1, P), float32."""
        flat = lights.reshape(len(lights), self.projector.pixels, -1)
        return np.ascontiguousarray(np.moveaxis(flat, 2, 1), dtype=np.float32)

    def _as_images(self, values: Floats) -> Floats:
        return np.ascontiguousarray(np.moveaxis(values, 1, 2)).reshape(
            len(values), *self.camera, self.channels
        )

    def _direct_pictures(self, lights: Floats) -> Floats:
        pictures = np.empty((len(lights), self.channels, self.camera.pixels), dtype=np.float32)
        for channel, matrix in enumerate(self.direct):
            columns = lights[:, min(channel, lights.shape[1] - 1)].T
            pictures[:, channel] = times(matrix, np.ascontiguousarray(columns)).T
        return pictures
