"""The factors of a transport, camera pixel by camera pixel, and products with them.

Index convention: camera pixels c are flattened row by row; lights are (1, P) for all channels, or
(channels, P).
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Floats, Size, blocks
from nearfar.illumination.near_basis import NearBasis
from nearfar.illumination.real_basis import RealBasis
from nearfar.transport import direct as footprints
from nearfar.transport import near as windows
from nearfar.transport.analysed import AnalysedLight, analysed_light, overlaps_of
from nearfar.transport.blurred import blurred_adjoint, blurred_pictures, blurred_rows
from nearfar.transport.boxes import BoxAxes, box_axes, boxes_adjoint
from nearfar.transport.components import Components
from nearfar.transport.pictures import direct_pictures, far_pictures, near_pictures
from nearfar.transport.pyramid import Pyramid
from nearfar.transport.second_light import SecondLight

# Camera pixels of a batch: their windows take some tens of megabytes at W = 19.
BATCH_PIXELS = 8192


@dataclass(frozen=True, eq=False)
class Factors:
    """d, n and f of C camera pixels, as `nearfar.Transport` has them.

    Attributes
    ----------
    projector : Size
    q : ndarray, shape (C, 2)
        Correspondence; NaN without direct light.
    direct : ndarray, shape (C, channels)
    near : ndarray, shape (C, channels, J)
    far : ndarray, shape (C, channels, M)
    far_basis : RealBasis
    near_basis : NearBasis
    boxes : ndarray, shape (C, 4)
        Footprints of direct light, where functions of near-range light are of several projector
        pixels.
    second : SecondLight or None
        Direct light from second places, where functions are of single pixels.
    """

    projector: Size
    q: Floats
    direct: Floats
    near: Floats
    far: Floats
    far_basis: RealBasis
    near_basis: NearBasis
    boxes: Floats
    second: SecondLight | None = None

    @property
    def of_single_pixels(self) -> bool:
        """Whether near-range light is made of single projector pixels."""
        return self.near_basis.pitch == 1

    @cached_property
    def pyramid(self) -> Pyramid:
        """Where functions of several projector pixels read blurred lights."""
        return Pyramid(self.near_basis, self.projector)

    @cached_property
    def box_axes(self) -> BoxAxes:
        """Where boxes about q read a summed-area table."""
        return box_axes(self.q, self.boxes, self.projector)

    @cached_property
    def footprint(self) -> footprints.Footprint:
        """Where direct light comes from, where near-range light is of single pixels."""
        return footprints.footprint(self.q, self.projector)

    @cached_property
    def centres(self) -> NDArray[np.int64]:
        """The rounded q, shape (C, 2); see `nearfar.transport.near.centre`."""
        return windows.centre(self.q, self.projector)

    def of_channel(self, channel: int) -> "Factors":
        """Return the factors of one channel."""
        one = slice(channel, channel + 1)
        return replace(
            self,
            direct=self.direct[:, one],
            near=self.near[:, one],
            far=self.far[:, one],
            second=None if self.second is None else self.second.of_channel(channel),
        )

    def analyse(self, light: Floats) -> AnalysedLight:
        """Analyse a light."""
        pyramid = None if self.of_single_pixels else self.pyramid
        return analysed_light(light, self.far_basis, pyramid)

    def relit(self, light: AnalysedLight) -> Components:
        """Return pictures (C, channels) under a light."""
        (of_far,) = far_pictures(self.far, light.overlaps[None])
        if self.of_single_pixels:
            lights = light.flat[None]
            (of_direct,) = self._direct_pictures(lights)
            (of_near,) = near_pictures(self.near, self.centres, self.projector, lights)
        else:
            of_direct, of_near = blurred_pictures(
                self.direct, self.near, self.pyramid, self.centres, self.box_axes, light.blurred
            )
        return Components(of_direct, of_near, of_far)

    def pictures(self, lights: Floats) -> Components:
        """Return pictures (L, C, channels) under lights (L, 1 or channels, P)."""
        if not self.of_single_pixels:
            pictures = [self.relit(self.analyse(light)) for light in lights]
            return Components(*(np.stack(parts) for parts in zip(*pictures, strict=True)))
        return Components(
            self._direct_pictures(lights),
            near_pictures(self.near, self.centres, self.projector, lights),
            far_pictures(self.far, overlaps_of(lights, self.far_basis)),
        )

    def _direct_pictures(self, lights: Floats) -> Floats:
        """Return pictures (L, C, channels) of direct light, of single pixels."""
        found = direct_pictures(self.direct, self.footprint, lights)
        if self.second is not None:
            self.second.add_pictures(lights, found)
        return found

    def back(self, image: Floats, channel: int) -> Floats:
        """Send one channel of an image (C,) back to the projector, (Py, Px)."""
        of_far, d = self.far_back(image, channel), self.direct[:, channel]
        if not self.of_single_pixels:
            n = self.near[:, channel]
            return of_far + blurred_adjoint(d, n, image, self.pyramid, self.centres, self.box_axes)
        of_direct = self.spread_directly(d * image)
        if self.second is not None:
            of_direct = of_direct + self.second.back(image, channel, self.projector)
        return of_direct + of_far + self.near_back(image, channel)

    def far_back(self, image: Floats, channel: int) -> Floats:
        """Send one channel of an image (C,) back by f alone, (Py, Px)."""
        of_far = self.far_basis.synthesise(image @ self.far[:, channel])
        return of_far.reshape(self.projector)

    def near_back(self, image: Floats, channel: int) -> Floats:
        """Send one channel of an image (C,) back by n alone, (Py, Px)."""
        n, window = self.near[:, channel], self.near_basis.window
        if not self.of_single_pixels:
            d = np.zeros(len(image), dtype=np.float32)
            return blurred_adjoint(d, n, image, self.pyramid, self.centres, self.box_axes)
        back = np.zeros(self.projector)
        for batch in blocks(len(image), BATCH_PIXELS) if window else ():
            values = n[batch] * image[batch, None]
            back += windows.spread(values, self.centres[batch], window, self.projector)
        return back

    def spread_directly(self, image: Floats) -> Floats:
        """Send an image (C,) back to where direct light comes from, as if d were 1: (Py, Px)."""
        if self.of_single_pixels:
            return footprints.spread(image, self.footprint, self.projector).reshape(self.projector)
        return boxes_adjoint(image, self.box_axes, self.projector)

    def rows(self, pixels: slice) -> Components:
        """Return dense rows of D, N and F of camera pixels, (n, channels, P)."""
        direct, near, far = (part[pixels] for part in (self.direct, self.near, self.far))
        f = self.far_basis.synthesise(far).astype(np.float32, copy=False)
        if not self.of_single_pixels:
            centres, axes = self.centres[pixels], self.box_axes.of(pixels)
            return Components(*blurred_rows(direct, near, self.pyramid, centres, axes), f)
        number = np.arange(len(f))[:, None]
        corners, weights = self.footprint.pixels[pixels], self.footprint.weights[pixels]
        centres, window = self.centres[pixels], self.near_basis.window
        inside = windows.inside(centres, window, self.projector)
        # Entries beyond the border go to a column of their own, which is cut off.
        beyond = self.projector.pixels
        flat = np.where(inside, windows.window_pixels(centres, window, self.projector), beyond)
        d = np.zeros_like(f)
        n = np.zeros((*f.shape[:2], beyond + 1), dtype=np.float32)
        for i in range(f.shape[1]):
            # Corners may coincide at the border: add each on its own.
            np.add.at(d[:, i], (number, corners), weights * direct[:, i, None])
            n[number, i, flat] = near[:, i]
        if self.second is not None:
            self.second.of(pixels, len(self.q)).add_rows(d)
        return Components(d, n[..., :beyond], f)
