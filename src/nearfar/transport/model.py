"""The transport that was measured: T = D + N + F as factors, a linear operator."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.sparse.linalg import LinearOperator

from nearfar.arrays import Booleans, Floats, Size, blocks
from nearfar.errors import InputError
from nearfar.illumination.real_basis import RealBasis
from nearfar.markup import card, picture
from nearfar.transport import direct as footprints
from nearfar.transport import near as windows
from nearfar.transport.pictures import direct_pictures, far_pictures, near_pictures
from nearfar.transport.plots import Plots, colours
from nearfar.transport.posterior import Posterior
from nearfar.transport.quality import Quality

# Camera pixels whose windows are gathered at once: some tens of megabytes at W = 19.
BLOCK = 8192
# Pixels along the longer side of a picture that a notebook shows.
THUMBNAIL = 256


class Components(NamedTuple):
    """Pictures under one light, each (Cy, Cx) or (Cy, Cx, channels)."""

    direct: Floats
    near: Floats
    far: Floats


@dataclass(frozen=True, repr=False)
class Transport:
    """Light transport between a projector and a camera, in photo units.

    ``transport @ light`` is the photo under `light` less the photo under black. Index
    convention: camera pixels are [y, x]; a light is (Py, Px) for all channels, or
    (Py, Px, channels) channel by channel.

    Attributes
    ----------
    projector : Size
        Pattern grid.
    correspondence : ndarray, shape (Cy, Cx, 2), float32
        q as (y, x); NaN at camera pixels without direct light, where D = N = 0.
    direct : ndarray, shape (Cy, Cx, channels), float32
        d, spread over the 2 x 2 projector pixels around q.
    near : ndarray, shape (Cy, Cx, channels, W, W), float32
        n over the window around the rounded q; 0 beyond the projector's border.
    far : ndarray, shape (Cy, Cx, channels, M), float32
        Responses of F to the cosines and sines of `far_basis`.
    far_basis : RealBasis
    black : ndarray, shape (Cy, Cx, channels), float32
        The photo under black: ambient light and black level.
    noise : ndarray, shape (Cy, Cx, channels), float32
        Standard deviation of one real measurement (a cosine's or sine's answer).
    provenance : mapping
        Plan, estimator, exposure and version: whatever JSON holds.
    posterior : Posterior, optional
        What error bars follow from, where the estimate can tell them.
    quality : Quality, optional
        How far each camera pixel is to be trusted, where photos told.
    """

    projector: Size
    correspondence: Floats
    direct: Floats
    near: Floats
    far: Floats
    far_basis: RealBasis
    black: Floats
    noise: Floats
    provenance: Mapping[str, Any] = field(default_factory=dict)
    posterior: Posterior | None = None
    quality: Quality | None = None

    @property
    def camera(self) -> Size:
        """Height and width of the photos."""
        return Size(*self.direct.shape[:2])

    @property
    def channels(self) -> int:
        """Number of camera channels."""
        return int(self.direct.shape[2])

    @property
    def window(self) -> int:
        """W."""
        return int(self.near.shape[-1])

    @property
    def lit(self) -> Booleans:
        """Camera pixels with direct light, shape (Cy, Cx)."""
        return np.isfinite(self.correspondence[..., 0])

    @cached_property
    def _footprint(self) -> footprints.Footprint:
        return footprints.footprint(self.correspondence, self.projector)

    @cached_property
    def _centres(self) -> NDArray[np.int64]:
        return windows.centre(self.correspondence, self.projector)

    @property
    def plot(self) -> Plots:
        """Drawings of it, as matplotlib axes; see `nearfar.transport.plots`."""
        return Plots(self)

    def __repr__(self) -> str:
        return (
            f"<nearfar transport: projector {self.projector}, camera {self.camera}, channels "
            f"{self.channels}, W = {self.window}>"
        )

    def _repr_html_(self) -> str:
        """Show the transport in a notebook, floodlit and taken apart."""
        step = -(-max(self.camera) // THUMBNAIL)
        parts = self.components(np.ones(self.projector, dtype=np.float32))
        pictures = {"floodlit": np.asarray(sum(parts)), **parts._asdict()}
        brightest = float(np.percentile(pictures["floodlit"], 99.5))
        images = [
            (name, picture(colours(part)[::step, ::step] / max(brightest, 1e-9), name))
            for name, part in pictures.items()
        ]
        rows = [
            ("projector", str(self.projector)),
            ("camera", f"{self.camera}, {self.channels} channels"),
            ("window W, far coefficients", f"{self.window}, {self.far_basis.count}"),
            ("directly lit", f"{self.lit.mean():.1%} of the camera"),
            ("error bars", "yes" if self.posterior is not None else "no"),
            ("method", str(self.provenance.get("method", "unknown"))),
        ]
        return card("transport", rows, images)

    def __matmul__(self, light: Floats) -> Floats:
        return np.asarray(sum(self.components(light)))

    def components(self, light: Floats) -> Components:
        """Relight each component apart.

        Parameters
        ----------
        light : ndarray, shape (Py, Px) or (Py, Px, channels)

        Returns
        -------
        Components
            Three pictures in photo units, (Cy, Cx) for one channel, else (Cy, Cx, channels).

        Raises
        ------
        InputError
            If the light has another size than the pattern grid, or other channels.
        """
        return Components(
            *(self.picture(flat[0]) for flat in self._components(self.lights(light)[None]))
        )

    def relight(
        self, light: Floats, *, direct: float = 1.0, near: float = 1.0, far: float = 1.0
    ) -> Floats:
        """Relight with a gain for each component.

        Parameters
        ----------
        light : ndarray, shape (Py, Px) or (Py, Px, channels)
        direct, near, far : float

        Returns
        -------
        ndarray, shape (Cy, Cx) or (Cy, Cx, channels)
            Photo units.

        Raises
        ------
        InputError
            As `components`; if a gain is no finite number.
        """
        if not np.isfinite([direct, near, far]).all():
            raise InputError(f"the gains {direct}, {near}, {far} are no finite numbers.")
        parts = self.components(light)
        return np.asarray(direct * parts.direct + near * parts.near + far * parts.far)

    def with_gains(
        self, *, direct: float = 1.0, near: float = 1.0, far: float = 1.0
    ) -> "Transport":
        """Return the transport with its components scaled, without error bars."""
        return replace(
            self,
            posterior=None,
            direct=self.direct * np.float32(direct),
            near=self.near * np.float32(near),
            far=self.far * np.float32(far),
        )

    def pictures(self, lights: Floats) -> Floats:
        """Relight under many lights at once, several times as fast as one by one.

        Parameters
        ----------
        lights : ndarray, shape (n, Py, Px) or (n, Py, Px, channels)
            float32 takes half the time of float64.

        Returns
        -------
        ndarray, shape (n, Cy, Cx, channels)

        Raises
        ------
        InputError
            As `components`.
        """
        if not len(lights):
            return np.zeros((0, *self.camera, self.channels), dtype=np.float32)
        flat = np.stack([self.lights(light) for light in lights])
        direct, near, far = self._components(flat)
        direct += near
        direct += far
        return direct.reshape(len(flat), *self.camera, self.channels)

    def adjoint(self, image: Floats) -> Floats:
        """Send an image back: T^T per channel.

        Parameters
        ----------
        image : ndarray, shape (Cy, Cx) for one channel or (Cy, Cx, channels)

        Returns
        -------
        ndarray, shape (Py, Px) or (Py, Px, channels)
        """
        expected = (*self.camera, self.channels)
        if image.shape != expected and not (self.channels == 1 and image.shape == self.camera):
            raise InputError(f"the image is {image.shape}, this transport's photos are {expected}.")
        flat = image.reshape(-1, self.channels)
        back = [self._adjoint_channel(flat[:, i], i) for i in range(self.channels)]
        stacked = np.stack(back, axis=-1)
        return stacked[..., 0] if self.channels == 1 else stacked

    def rows(self, pixels: slice) -> Floats:
        """Return dense rows t of chosen camera pixels.

        Parameters
        ----------
        pixels : slice
            Camera pixels, flattened row by row.

        Returns
        -------
        ndarray, shape (n, channels, P), float32
        """
        return np.asarray(sum(self.component_rows(pixels)))

    def component_rows(self, pixels: slice) -> Components:
        """Return dense rows of D, N and F of chosen camera pixels; see `rows`."""
        flat_far = self.far.reshape(-1, self.channels, self.far_basis.count)[pixels]
        f = self.far_basis.synthesise(flat_far).astype(np.float32, copy=False)
        number = np.arange(len(f))[:, None]
        corners = self._footprint.pixels[pixels]
        weights = self._footprint.weights[pixels]
        centres = self._centres[pixels]
        inside = windows.inside(centres, self.window, self.projector)
        # Entries beyond the border go to a column of their own, which is cut off.
        beyond = self.projector.pixels
        flat = np.where(inside, windows.places_on(centres, self.window, self.projector), beyond)
        direct_values = self.direct.reshape(-1, self.channels)[pixels]
        near_values = self.near.reshape(-1, self.channels, self.window**2)[pixels]
        d = np.zeros_like(f)
        n = np.zeros((*f.shape[:2], beyond + 1), dtype=np.float32)
        for i in range(self.channels):
            # Corners may coincide at the border: add each on its own.
            np.add.at(d[:, i], (number, corners), weights * direct_values[:, i, None])
            n[number, i, flat] = near_values[:, i]
        return Components(d, n[..., :beyond], f)

    def dense(self) -> Floats:
        """Return all of T, shape (C, channels, P), float32: for small transports."""
        return self.rows(slice(None))

    def column(self, y: int, x: int) -> Floats:
        """Return the picture under one projector pixel at full white.

        Parameters
        ----------
        y, x : int
            Projector pixel.

        Returns
        -------
        ndarray, shape (Cy, Cx) or (Cy, Cx, channels)

        Raises
        ------
        InputError
            If there is no such projector pixel.
        """
        if not (0 <= y < self.projector.height and 0 <= x < self.projector.width):
            raise InputError(f"({y}, {x}) is no pixel of the projector of {self.projector}.")
        light = np.zeros(self.projector, dtype=np.float32)
        light[y, x] = 1.0
        return self @ light

    def as_linear_operator(self, channel: int = 0) -> LinearOperator:
        """Return one channel of T as a SciPy operator of shape (C, P)."""
        if not 0 <= channel < self.channels:
            raise InputError(f"channel {channel} is not one of this transport's {self.channels}.")

        one = replace(
            self,
            posterior=None,
            **{
                name: getattr(self, name)[:, :, channel : channel + 1]
                for name in ("direct", "near", "far", "black", "noise")
            },
        )

        def matvec(light: Floats) -> Floats:
            lights = np.reshape(light, (1, 1, -1)).astype(np.float64)
            return np.asarray(sum(one._components(lights)))[0, :, 0]

        def rmatvec(image: Floats) -> Floats:
            return self._adjoint_channel(np.ravel(image), channel).ravel()

        shape = (self.camera.pixels, self.projector.pixels)
        return LinearOperator(shape, matvec=matvec, rmatvec=rmatvec, dtype=np.float64)

    def lights(self, light: Floats) -> Floats:
        """Check a light and lay it flat: (1, P) for all channels, or (channels, P)."""
        light = np.asarray(light)
        if light.dtype.kind in "biu":
            light = light.astype(np.float32)
        if light.dtype.kind != "f" or not np.isfinite(light).all():
            raise InputError("the light holds values that are no finite numbers: mend it first.")
        if light.shape[:2] != self.projector or light.ndim not in (2, 3):
            raise InputError(
                f"the light is {'x'.join(map(str, light.shape))}, this transport's projector is "
                f"{self.projector}: resize the light to {self.projector}."
            )
        if light.ndim == 2:
            return light.reshape(1, -1)
        if light.shape[2] not in (1, self.channels):
            raise InputError(
                f"the light has {light.shape[2]} channels, this transport {self.channels}: "
                f"give a grey light, or one with {self.channels} channels."
            )
        return np.moveaxis(light, 2, 0).reshape(light.shape[2], -1)

    def picture(self, flat: Floats) -> Floats:
        """Shape values (C, channels) as a picture: (Cy, Cx), or (Cy, Cx, channels)."""
        picture = flat.reshape(*self.camera, self.channels)
        return picture[..., 0] if self.channels == 1 else picture

    def _components(self, lights: Floats) -> Components:
        """Pictures (L, C, channels) under lights (L, 1 or channels, P)."""
        count, channels = self.camera.pixels, self.channels
        return Components(
            direct_pictures(self.direct.reshape(count, channels), self._footprint, lights),
            near_pictures(
                self.near.reshape(count, channels, -1), self._centres, self.projector, lights
            ),
            far_pictures(self.far.reshape(count, channels, -1), self.far_basis, lights),
        )

    def _adjoint_channel(self, image: Floats, channel: int) -> Floats:
        d = self.direct.reshape(-1, self.channels)[:, channel]
        n = self.near.reshape(-1, self.channels, self.window**2)[:, channel]
        f = self.far.reshape(-1, self.channels, self.far_basis.count)[:, channel]
        back = footprints.spread(d * image, self._footprint, self.projector).reshape(self.projector)
        back = back + self.far_basis.synthesise(image @ f).reshape(self.projector)
        for block in blocks(self.camera.pixels, BLOCK):
            values = n[block] * image[block, None]
            back += windows.spread(values, self._centres[block], self.window, self.projector)
        return np.asarray(back)
