"""A measured transport T = D + N + F, kept as factors and applied as a linear operator."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from scipy.sparse.linalg import LinearOperator

from nearfar.arrays import Booleans, Floats, Size
from nearfar.checks import (
    NoArray,
    as_count,
    as_image,
    as_light,
    as_lights,
    as_number,
    as_pixels,
    as_place,
)
from nearfar.errors import InputError
from nearfar.illumination.near_basis import NearBasis, basis_of
from nearfar.illumination.real_basis import RealBasis
from nearfar.transport.adjoint import AdjointTransport
from nearfar.transport.analysed import AnalysedLight
from nearfar.transport.boxes import BoxAxes
from nearfar.transport.components import Components
from nearfar.transport.factors import Factors
from nearfar.transport.gains import gains_on, with_gains
from nearfar.transport.linear_operator import linear_operator
from nearfar.transport.parts import PLACES, USUAL_PARTS, Parts
from nearfar.transport.plots import Plots
from nearfar.transport.posterior import AnyPosterior
from nearfar.transport.pyramid import Pyramid
from nearfar.transport.quality import Quality
from nearfar.transport.second_light import SecondLight, second_light
from nearfar.transport.summary_card import summary_card
from nearfar.transport.verdict import KeptVerdict


@dataclass(frozen=True, repr=False, eq=False)
class Transport(NoArray):
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
        n over the window around the rounded q; 0 beyond the projector's border. Where `pitch` is
        over 1, (Cy, Cx, channels, J): light under white of each function of `near_basis`. W = 0
        where `parts` has no near-range light.
    far : ndarray, shape (Cy, Cx, channels, M), float32
        Responses of F to the cosines and sines of `far_basis`; M = 0 where `parts` has no
        far-range light. Free rows are kept here, as responses to all frequencies of the projector.
    far_basis : RealBasis
        Frequencies of F: of a joint estimate, those of the far band and all others that were
        measured on the DFT grid of the projector.
    pitch : int
        Projector pixels between the coarsest functions that near-range light is made of, a power of
        two; 1 for single pixels.
    footprint : ndarray, shape (Cy, Cx, 4), float32, or None
        Where `pitch` is over 1, the two boxes of projector pixels about q over which d is spread:
        height and width of each, and how far down and across their middles are from q.
    second_place : ndarray, shape (Cy, Cx, 2), float32, or None
        Where a camera pixel at an outline sees a second surface beyond its window, the place (y, x)
        that lights it there; NaN at all others. None where the estimate looks for none.
    second_direct : ndarray, shape (Cy, Cx, channels), float32, or None
        Direct light from the second place, over the 2 x 2 projector pixels around it; a part of D.
    black : ndarray, shape (Cy, Cx, channels), float32
        The photo under black: ambient light and black level.
    noise : ndarray, shape (Cy, Cx, channels), float32
        Standard deviation of one response to a cosine or sine.
    parts : tuple of {"direct", "near", "far", "free"}
        What T is split into; see `nearfar.transport.parts`.
    provenance : mapping
        How it was made: plan, estimator, exposure, version. Of JSON types.
    posterior : Posterior, PatternPosterior or FreePosterior, optional
        State of the estimate from which `nearfar.ErrorBars` follow, if the estimator gives it: of a
        joint estimate, of one from any patterns, or of free rows.
    quality : Quality, optional
        Confidence in q and saturation of each camera pixel, where the photos show them.
    verdict : KeptVerdict, optional
        Whether it can be trusted, and why not, once it was judged: ``grade``, ``reasons``,
        ``held_out_snr`` and more; see `nearfar.judge_transport`.

    Examples
    --------
    >>> relit = transport @ light  # photo(light) - photo(black)
    >>> direct, near, far = transport.components(light)  # the same, taken apart
    >>> bool(np.allclose(direct + near + far, relit))
    True
    >>> soft = transport.relight(light, direct=0.5, near=3.0)  # a gain for each component
    >>> one_pixel = transport.column(4, 2)  # lit by one projector pixel alone
    >>> twice = 2 * transport  # as lit by a lamp of twice the power
    >>> bool(np.allclose(twice @ light, 2 * relit))
    True
    >>> dual = transport.H @ relit  # the adjoint: back to the projector
    >>> dual.shape
    (8, 8)
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
    pitch: int = 1
    footprint: Floats | None = None
    second_place: Floats | None = None
    second_direct: Floats | None = None
    posterior: AnyPosterior | None = None
    quality: Quality | None = None
    verdict: KeptVerdict | None = None
    parts: Parts = USUAL_PARTS

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
        return self.near_basis.window

    @cached_property
    def near_basis(self) -> NearBasis:
        """The functions that near-range light is made of."""
        return basis_of(self.near.shape[3:], self.pitch)

    @cached_property
    def factors(self) -> Factors:
        """d, n and f by camera pixel."""
        shape = (self.camera.pixels, self.channels)
        near, far = (
            factor.reshape(*shape, math.prod(factor.shape[3:])) for factor in (self.near, self.far)
        )
        return Factors(
            projector=self.projector,
            q=self.correspondence.reshape(-1, 2),
            direct=self.direct.reshape(shape),
            near=near,
            far=far,
            far_basis=self.far_basis,
            near_basis=self.near_basis,
            boxes=self.boxes,
            second=self._second,
        )

    @property
    def _second(self) -> SecondLight | None:
        if self.second_place is None or self.second_direct is None:
            return None
        found = second_light(self.second_place, self.second_direct, self.projector)
        return found if len(found.pixels) else None

    @property
    def pyramid(self) -> Pyramid:
        """Where functions of several projector pixels read blurred lights."""
        return self.factors.pyramid

    @property
    def box_axes(self) -> BoxAxes:
        """Where boxes about q read a summed-area table, where `pitch` is over 1."""
        return self.factors.box_axes

    @property
    def boxes(self) -> Floats:
        """Direct light's footprints, shape (C, 4); see `footprint`."""
        if self.footprint is None:
            return np.zeros((self.camera.pixels, 4), dtype=np.float32)
        return self.footprint.reshape(-1, 4)

    @property
    def has_error_bars(self) -> bool:
        """Whether error bars follow from its estimate."""
        return self.posterior is not None

    @property
    def lit(self) -> Booleans:
        """Camera pixels with direct light, shape (Cy, Cx)."""
        return np.isfinite(self.correspondence[..., 0])

    @property
    def plot(self) -> Plots:
        """Drawings of the transport, as matplotlib axes; see `nearfar.transport.plots`."""
        return Plots(self)

    def __repr__(self) -> str:
        return (
            f"<nearfar transport: projector {self.projector}, camera {self.camera}, channels "
            f"{self.channels}, W = {self.window}>"
        )

    def _repr_html_(self) -> str:
        """Show the transport in a notebook, floodlit and taken apart."""
        return summary_card(self)

    def __matmul__(self, light: Floats) -> Floats:
        return np.asarray(sum(self.components(light)))

    def named(self, components: Components) -> dict[str, Floats]:
        """Return the components that the transport has, by the names of its `parts`."""
        return {part: components[PLACES[part]] for part in self.parts}

    def __mul__(self, factor: float) -> "Transport":
        scale = as_number(factor, "the factor")
        scaled = self.with_gains(**dict.fromkeys(self.parts, scale))
        return replace(scaled, noise=self.noise * np.float32(abs(scale)))

    __rmul__ = __mul__

    @property
    def H(self) -> "AdjointTransport[Transport]":  # noqa: N802
        """The adjoint T^T, an operator that takes images of the camera."""
        return AdjointTransport(self)

    def analyse(self, light: Floats) -> AnalysedLight:
        """Analyse a light once, to relight several blocks of camera pixels under it.

        Transports of other rows of the same camera take it in place of the light.

        Parameters
        ----------
        light : ndarray, shape (Py, Px) or (Py, Px, channels)

        Raises
        ------
        InputError
            As `components`.
        """
        return self.factors.analyse(self.lights(light))

    def components(self, light: Floats | AnalysedLight) -> Components:
        """Relight each component by itself.

        Parameters
        ----------
        light : ndarray, shape (Py, Px) or (Py, Px, channels); or AnalysedLight

        Returns
        -------
        Components
            Three pictures in photo units, (Cy, Cx) for one channel, else (Cy, Cx, channels).

        Raises
        ------
        InputError
            If the light has another size than the pattern grid, or other channels.
        """
        analysed = light if isinstance(light, AnalysedLight) else self.analyse(light)
        return Components(*(self.picture(flat) for flat in self.factors.relit(analysed)))

    def relight(
        self,
        light: Floats | AnalysedLight,
        *,
        direct: float = 1.0,
        near: float = 1.0,
        far: float = 1.0,
        free: float = 1.0,
    ) -> Floats:
        """Relight with a gain for each component.

        Parameters
        ----------
        light : ndarray, shape (Py, Px) or (Py, Px, channels); or AnalysedLight
        direct, near, far, free : float
            `free` is for transports of free rows.

        Returns
        -------
        ndarray, shape (Cy, Cx) or (Cy, Cx, channels)
            Photo units.

        Raises
        ------
        InputError
            As `components`; if a gain is not a finite number, or of a part that is absent.
        """
        direct, near, far = gains_on(self.parts, direct, near, far, free)
        parts = self.components(light)
        return np.asarray(direct * parts.direct + near * parts.near + far * parts.far)

    def with_gains(
        self, *, direct: float = 1.0, near: float = 1.0, far: float = 1.0, free: float = 1.0
    ) -> "Transport":
        """Return the transport with its components scaled, without error bars or a verdict.

        Its provenance has, as ``gains``, what the components were multiplied by in all.

        Parameters
        ----------
        direct, near, far, free : float
            `free` is for transports of free rows.

        Returns
        -------
        Transport

        Raises
        ------
        InputError
            If a gain is not a finite number, or of a part that is absent.
        """
        gains = gains_on(self.parts, direct, near, far, free)
        return replace(
            self,
            provenance=with_gains(self.provenance, gains),
            posterior=None,
            verdict=None,
            direct=self.direct * np.float32(gains.direct),
            second_direct=_times(self.second_direct, gains.direct),
            near=self.near * np.float32(gains.near),
            far=self.far * np.float32(gains.far),
        )

    def pictures(self, lights: Floats) -> Floats:
        """Relight under many lights at once: several times as fast as one by one at a `pitch` of 1.

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
        checked: Floats = as_lights(lights, self.projector, self.channels)
        if not len(checked):
            return np.zeros((0, *self.camera, self.channels), dtype=np.float32)
        flat = np.stack([self._flat(light) for light in checked])
        direct, near, far = self.factors.pictures(flat)
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

        Raises
        ------
        InputError
            If the image does not hold finite numbers, or is of another shape.
        """
        flat = as_image(image, self.camera, self.channels)
        back = [self.factors.back(flat[:, i], i) for i in range(self.channels)]
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

        Raises
        ------
        InputError
            If `pixels` is not a slice.
        """
        return np.asarray(sum(self.component_rows(pixels)))

    def component_rows(self, pixels: slice) -> Components:
        """Return dense rows of D, N and F of chosen camera pixels; see `rows`."""
        return self.factors.rows(as_pixels(pixels, self.camera.pixels))

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
        light = np.zeros(self.projector, dtype=np.float32)
        light[as_place(y, x, self.projector, "projector")] = 1.0
        return self @ light

    def as_linear_operator(self, channel: int = 0) -> LinearOperator:
        """Return one channel of T as a SciPy operator of shape (C, P).

        Parameters
        ----------
        channel : int

        Raises
        ------
        InputError
            If there is no such channel.
        """
        channel = as_count(channel, "the channel")
        if not 0 <= channel < self.channels:
            raise InputError(
                f"channel {channel} is not one of this transport's: give one from 0 to "
                f"{self.channels - 1}."
            )
        return linear_operator(self.factors.of_channel(channel))

    def lights(self, light: Floats) -> Floats:
        """Check a light and flatten it to (1, P) for all channels, or (channels, P).

        Raises
        ------
        InputError
            As `components`.
        """
        return self._flat(as_light(light, self.projector, self.channels))

    @staticmethod
    def _flat(light: Floats) -> Floats:
        """Flatten a light to (1, P) for all channels, or (channels, P)."""
        if light.ndim == 2:
            return light.reshape(1, -1)
        return np.moveaxis(light, 2, 0).reshape(light.shape[2], -1)

    def picture(self, flat: Floats) -> Floats:
        """Shape values (C, channels) as a picture: (Cy, Cx), or (Cy, Cx, channels)."""
        picture = flat.reshape(*self.camera, self.channels)
        return picture[..., 0] if self.channels == 1 else picture


def _times(values: Floats | None, gain: float) -> Floats | None:
    return None if values is None else values * np.float32(gain)
