"""A transport split as physics does: direct light, subsurface light and inter-reflection.

The model's near-range light is all that lies about q: light under a surface, and light of creases
and contacts. Here light under a surface has the shape of a dipole that the camera pixels of a body
share, what it adds at q is taken from direct light, and all the rest is inter-reflection. The sum
is the transport as it was.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy import fft

from nearfar.arrays import Booleans, Floats, Integers, Size
from nearfar.checks import as_number
from nearfar.estimate.physical.elsewhere import Elsewhere
from nearfar.estimate.physical.kernels import SAMPLES, kernel
from nearfar.estimate.physical.medium import SLOPES
from nearfar.markup import card
from nearfar.transport.boxes import box_axes, summed_area
from nearfar.transport.dipole import Dipole
from nearfar.transport.direct import Footprint, footprint, look_up
from nearfar.transport.model import Transport
from nearfar.transport.summary_card import floodlit_and_apart

# Kernels end where the light is down by exp(-FADED), or at the size of the projector.
FADED = 7.0
# Samples on each side of a projector pixel, those of wide kernels fewer: these are smooth. The most
# samples on each side of q.
ODD_SAMPLES = (SAMPLES, 3, 1)
LARGEST_REACH = 1000
# In photo units: light under white by which components are divided, at least.
DARK = 1e-6


class PhysicalComponents(NamedTuple):
    """Pictures under one light, each (Cy, Cx) or (Cy, Cx, channels)."""

    direct: Floats
    subsurface: Floats
    interreflection: Floats


class Translucent(NamedTuple):
    """A translucent body of a transport.

    Attributes
    ----------
    pixels : ndarray of int, shape (n,)
        Its camera pixels, flattened row by row.
    places : ndarray, shape (n, 2)
        Where on the projector each sees it: q, but at outlines where q lies on something else.
    coverage : ndarray, shape (Py, Px)
        Share of each projector pixel that lights it.
    sources : tuple of Dipole
        The medium in each channel; lengths in projector pixels.
    slope : ndarray of int, shape (n,)
        Which of `SLOPES` each camera pixel sees.
    amplitude : ndarray, shape (n, channels)
        Of a kernel of unit albedo.
    explained : ndarray, shape (n,)
        Share that the kernels explain of what direct light leaves, 1 at best.
    """

    pixels: Integers
    places: Floats
    coverage: Floats
    sources: tuple[Dipole, ...]
    slope: Integers
    amplitude: Floats
    explained: Floats

    def under(self, lights: Floats, projector: Size) -> Floats:
        """Return subsurface light for unit amplitude, shape (n, channels).

        Parameters
        ----------
        lights : ndarray, shape (1 or channels, P)
            Flat, of each channel or of all.
        projector : Size
        """
        if not len(self.pixels):
            return np.empty((0, len(self.sources)))
        down, across, where = self._seen(projector)
        coverage = self.coverage[down, across]
        found = np.empty((len(self.pixels), len(self.sources)))
        for channel, source in enumerate(self.sources):
            picture = lights[min(channel, len(lights) - 1)].reshape(projector)
            lit = picture[down, across] * coverage
            found[:, channel] = _spread(source, self.slope, lit, where)
        return found

    def without(self, left: Booleans) -> "Translucent":
        """Return the body without some camera pixels.

        Parameters
        ----------
        left : ndarray of bool, shape (C,)
            Which of all camera pixels are not the body's.
        """
        kept = ~left[self.pixels]
        return self._replace(
            pixels=self.pixels[kept],
            places=self.places[kept],
            slope=self.slope[kept],
            amplitude=self.amplitude[kept],
            explained=self.explained[kept],
        )

    def _seen(self, projector: Size) -> tuple[slice, slice, Footprint]:
        """Return rows and columns that hold the body's light, and its footprint in them."""
        pixels, weights = footprint(self.places, projector)
        y, x = np.divmod(pixels, projector.width)
        sides = []
        for axis, places in enumerate((y, x)):
            both = np.append(places, np.flatnonzero(self.coverage.any(axis=1 - axis)))
            sides.append(slice(int(both.min()), int(both.max()) + 1))
        down, across = sides
        width = across.stop - across.start
        return down, across, Footprint((y - down.start) * width + x - across.start, weights)


@dataclass(frozen=True, eq=False)
class PhysicalSplit:
    """A transport split into direct light, subsurface light and inter-reflection.

    Attributes
    ----------
    transport : Transport
    direct : ndarray, shape (Cy, Cx, channels), float32
        Direct light under white from q, less what subsurface light adds at q.
    bodies : tuple of Translucent
        Empty where nothing is translucent.
    elsewhere : Elsewhere
        Direct light from other places than q.
    footprint : ndarray, shape (Cy, Cx, 4), or None
        Direct light's footprint, as `Transport.footprint`. At translucent surfaces it may be
        narrower than the transport's, which takes light under the surface for blur.
    own_share : ndarray, shape (Cy, Cx), or None
        Weight of each camera pixel's own inter-reflection, where those around it tell the rest;
        also the share of its error's variance that this leaves. None: 1 everywhere.

    Examples
    --------
    >>> split = nearfar.split_physically(transport)
    >>> direct, subsurface, interreflection = split.components(light)
    >>> bool(np.allclose(direct + subsurface + interreflection, transport @ light, atol=1e-6))
    True
    >>> glowing = split.relight(light, subsurface=2.0)  # a gain for each component
    """

    transport: Transport
    direct: Floats
    bodies: tuple[Translucent, ...]
    elsewhere: Elsewhere
    footprint: Floats | None
    own_share: Floats | None = None

    def components(self, light: Floats) -> PhysicalComponents:
        """Relight each component by itself.

        Parameters
        ----------
        light : ndarray, shape (Py, Px) or (Py, Px, channels)

        Returns
        -------
        PhysicalComponents
            Photo units. They sum to ``transport @ light`` to rounding.

        Raises
        ------
        InputError
            As `Transport.components`.
        """
        transport = self.transport
        model = transport.components(light)
        flat = np.asarray(transport.lights(light), dtype=np.float64)
        subsurface = np.zeros((transport.camera.pixels, transport.channels))
        of_second = np.zeros_like(subsurface)
        if (second := transport.factors.second) is not None:
            second.add_pictures(flat[None], of_second[None])
        for body in self.bodies:
            subsurface[body.pixels] = body.amplitude * body.under(flat, transport.projector)
        # Elsewhere than where it is relit anew, direct light is a part of D.
        with np.errstate(divide="ignore", invalid="ignore"):
            kept = np.where(transport.direct != 0, self.direct / transport.direct, 0.0)
        direct = (model.direct - transport.picture(of_second)) * transport.picture(kept)
        elsewhere = np.zeros_like(subsurface)
        elsewhere[self.elsewhere.pixels] = self.elsewhere.under(flat, transport.projector)
        direct = self._relit_anew(direct, flat) + transport.picture(elsewhere)
        under = transport.picture(subsurface)
        rest = model.direct + model.near + model.far - direct - under
        return PhysicalComponents(direct, under, rest)

    def _relit_anew(self, direct: Floats, lights: Floats) -> Floats:
        """Return direct light's picture, relit anew where it is no part of the transport's.

        That is where its footprint is another, or where the transport has no direct light.
        """
        transport = self.transport
        lacking = (transport.direct == 0) & (self.direct != 0)
        chosen = lacking.reshape(transport.camera.pixels, -1).any(axis=1)
        if self.footprint is not None and transport.footprint is not None:
            chosen |= (self.footprint != transport.footprint).any(axis=-1).ravel()
        others = np.flatnonzero(chosen)
        if not len(others):
            return direct
        flat, d = (v.reshape(transport.camera.pixels, -1).copy() for v in (direct, self.direct))
        units = self._of_unit_direct(others, lights)
        for channel in range(transport.channels):
            flat[others, channel] = d[others, channel] * units[min(channel, len(units) - 1)]
        return transport.picture(flat)

    def _of_unit_direct(self, pixels: Integers, lights: Floats) -> Floats:
        """Return unit direct light of some camera pixels under lights, shape (lights, n)."""
        projector, q = self.transport.projector, self.transport.correspondence.reshape(-1, 2)
        if self.footprint is None:
            return look_up(lights, footprint(q[pixels], projector))
        where = box_axes(q[pixels], self.footprint.reshape(-1, 4)[pixels], projector)
        summed = (summed_area(light.reshape(projector)) for light in lights)
        return np.stack([where.means(each, projector) for each in summed])

    def _repr_html_(self) -> str:
        """Show the split in a notebook: the scene floodlit, and its physical components."""
        white = np.ones(self.transport.projector, dtype=np.float32)
        names = ("direct", "subsurface", "inter-reflection")
        parts = dict(zip(names, self.components(white), strict=True))
        floodlit = sum(part.sum() for part in parts.values())
        rows = [
            ("translucent bodies", str(len(self.bodies))),
            *((name, f"{part.sum() / floodlit:.1%} of the light") for name, part in parts.items()),
        ]
        return card("physical split", rows, floodlit_and_apart(parts))

    def relight(
        self,
        light: Floats,
        *,
        direct: float = 1.0,
        subsurface: float = 1.0,
        interreflection: float = 1.0,
    ) -> Floats:
        """Relight with a gain for each component.

        Parameters
        ----------
        light : ndarray, shape (Py, Px) or (Py, Px, channels)
        direct, subsurface, interreflection : float

        Returns
        -------
        ndarray, shape (Cy, Cx) or (Cy, Cx, channels)
            Photo units.

        Raises
        ------
        InputError
            As `components`; if a gain is not a finite number.
        """
        given = {"direct": direct, "subsurface": subsurface, "interreflection": interreflection}
        gains = [as_number(gain, f"the gain of {name}") for name, gain in given.items()]
        parts = self.components(light)
        return np.asarray(sum(gain * part for gain, part in zip(gains, parts, strict=True)))


def on_bodies(split: PhysicalSplit) -> Booleans:
    """Return camera pixels that see a translucent body, (Cy, Cx)."""
    found = np.zeros(split.transport.camera, dtype=bool)
    for body in split.bodies:
        found.ravel()[body.pixels] = True
    return found


def opaque(split: PhysicalSplit) -> Booleans:
    """Return camera pixels with direct light at which nothing is translucent, (Cy, Cx)."""
    return np.asarray(split.transport.lit & ~on_bodies(split))


def with_more_direct(split: PhysicalSplit, change: Floats) -> PhysicalSplit:
    """Return a split with more direct light, and as much less inter-reflection.

    Parameters
    ----------
    split : PhysicalSplit
    change : ndarray, shape (Cy, Cx, channels)
        Under white. It goes where the direct light of a camera pixel comes from: to q, but
        elsewhere if none comes from q. No direct light becomes negative.

    Returns
    -------
    PhysicalSplit
    """
    channels = split.transport.channels
    direct, flat = split.direct.reshape(-1, channels), change.reshape(-1, channels)
    pixels, _, from_elsewhere = split.elsewhere
    only = ~direct[pixels].any(axis=1)
    of_elsewhere = from_elsewhere.copy()
    of_elsewhere[only] = _no_less(of_elsewhere[only], flat[pixels[only]])
    others = np.ones(len(direct), dtype=bool)
    others[pixels[only]] = False
    at_q = np.where(others[:, None], _no_less(direct, flat), direct).astype(np.float32)
    return replace(
        split,
        direct=at_q.reshape(split.direct.shape),
        elsewhere=split.elsewhere._replace(direct=of_elsewhere),
    )


def with_more_subsurface(split: PhysicalSplit, change: Floats, under: Floats) -> PhysicalSplit:
    """Return a split with more subsurface light on bodies, and as much less inter-reflection.

    Parameters
    ----------
    split : PhysicalSplit
    change, under : ndarray, shape (C, channels)
        Under white: how much more there is to be, and what there is. None becomes negative.

    Returns
    -------
    PhysicalSplit
    """
    factor = np.maximum(1 + change / np.maximum(under, DARK), 0.0)
    bodies = (
        body._replace(amplitude=body.amplitude * factor[body.pixels]) for body in split.bodies
    )
    return replace(split, bodies=tuple(bodies))


def _no_less(direct: Floats, change: Floats) -> Floats:
    """Return direct light with a change, which makes none negative."""
    return np.asarray(np.maximum(direct + change, np.minimum(direct, 0.0)))


def _spread(source: Dipole, slope: Integers, lit: Floats, where: Footprint) -> Floats:
    """Return light under a surface at a body's camera pixels for unit amplitude, shape (n,)."""
    found = np.zeros(len(slope))
    radius = _radius(source, max(lit.shape))
    samples = next(n for n in ODD_SAMPLES if n * radius < LARGEST_REACH or n == 1)
    # Room for light that leaves the projector's grid. `scipy.signal.fftconvolve` would do the same,
    # but half a second is a long time for its import in every command that relights.
    shape = tuple(fft.next_fast_len(length + 2 * radius, real=True) for length in lit.shape)
    waves = fft.rfft2(lit, shape)
    for number in np.unique(slope):
        seen = slope == number
        drawn = kernel(source, radius, SLOPES[number], samples)
        spread = fft.irfft2(waves * fft.rfft2(drawn, shape), shape)
        middle = spread[radius:, radius:][: lit.shape[0], : lit.shape[1]]
        found[seen] = look_up(middle.ravel(), Footprint(where.pixels[seen], where.weights[seen]))
    return found


def _radius(source: Dipole, longest: int) -> int:
    """Return the projector pixels after which a kernel ends."""
    return int(min(longest, np.ceil(source.virtual + FADED / source.attenuation)))
