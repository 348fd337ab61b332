"""A transport prepared on a device for relighting under many lights.

The projector pixels of all window entries are computed once. n and f are float16 where the rounding
error is well below their noise, so that an accelerator reads half the bytes for each light. On the
processor `Transport` itself is as fast as memory allows, and NumPy is faster with float32 than with
float16.

Index convention: c runs over camera pixels, i over channels, l over lights, w over window entries;
lights are (P + 1, L, 1 or channels), whose last projector pixel is dark.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

import numpy as np
from array_api_compat import device as device_of
from array_api_compat import is_array_api_obj, is_numpy_array

from nearfar.arrays import Floats, Integers, Size, beside, blocks, fetch, namespace
from nearfar.checks import NoArray, as_light, as_lights, require_instance
from nearfar.devices import Device, mover
from nearfar.illumination.real_basis import RealBasis
from nearfar.transport import near as windows
from nearfar.transport.boxes import summed_area
from nearfar.transport.direct import footprint
from nearfar.transport.gains import as_gains
from nearfar.transport.half import rounding_over_noise
from nearfar.transport.model import Transport
from nearfar.transport.pyramid import Pyramid

# Values gathered at once: on a processor as many as its cache holds, on an accelerator enough to
# outweigh the time that a call takes.
GATHERED_VALUES: dict[Device, int] = {"cpu": 2**19, "torch": 2**19, "cuda": 2**26}
# A rounding error of less than this share of the noise is negligible.
NEGLIGIBLE_ROUNDING = 0.25


class PreparedSecondLight(NamedTuple):
    """Direct light from second places on a device.

    Attributes
    ----------
    pixels : array of int, shape (n,)
        Camera pixels.
    direct : array, shape (n, channels)
    corners, shares : array, shape (n, 4)
        Projector pixels that it comes from, and their weights.
    """

    pixels: Integers
    direct: Floats
    corners: Integers
    shares: Floats


@dataclass(frozen=True, eq=False)
class PreparedTransport(NoArray):
    """A transport prepared for relighting; make one by `prepare_transport`.

    Attributes
    ----------
    projector, camera : Size
    channels : int
    direct : array, shape (C, channels)
    corners, shares : arrays
        Projector pixels that direct light comes from, and their weights, (C, 4). With a pyramid,
        (C, 2, 2, 4): for rows and columns, those of a summed-area table that each box reads.
    near : array, shape (C, channels, W^2)
    entries : array of int, shape (C, W^2)
        Projector pixels of the window entries; P for those beyond the border. With a pyramid,
        (C, 1), q rounded: `steps` lead from it to each function.
    steps : array of int, shape (1, J), or None
    far : array, shape (C, channels, M)
    far_basis : RealBasis
    patterns : array, shape (M, P), or None
        The far basis, times its weights; None with a pyramid, whose lights are analysed on the
        processor.
    pyramid : Pyramid or None
        Where near-range light is made of functions of several projector pixels, lights are blurred
        and summed on the processor first; `entries` are places in flat levels.
    held : int
        How many values are gathered at once.
    second : PreparedSecondLight or None
    """

    _instead: ClassVar[str] = "multiply it with a light"

    projector: Size
    camera: Size
    channels: int
    direct: Floats
    corners: Integers
    shares: Floats
    near: Floats
    entries: Integers
    steps: Integers | None
    far: Floats
    far_basis: RealBasis
    patterns: Floats | None
    pyramid: Pyramid | None
    held: int
    second: PreparedSecondLight | None

    @property
    def nbytes(self) -> int:
        """Bytes that the prepared transport takes on its device."""
        arrays = (self.direct, self.corners, self.shares, self.near, self.entries, self.far)
        optional = [self.patterns, self.steps, *(self.second or ())]
        return sum(int(a.nbytes) for a in (*arrays, *optional) if a is not None)

    def pictures(
        self, lights: Any, *, direct: float = 1.0, near: float = 1.0, far: float = 1.0
    ) -> Any:
        """Relight under many lights, with a gain for each component.

        Parameters
        ----------
        lights : array, shape (L, Py, Px) or (L, Py, Px, channels), float32
            Of NumPy, or of the device's library and already on the device, which saves a copy.

        Returns
        -------
        array, shape (L, Cy, Cx, channels), float32
            On the device.

        Raises
        ------
        InputError
            If the lights do not hold finite numbers, have another size than the pattern grid, or
            other channels; if a gain is not a finite number.
        """
        direct, near, far = as_gains(direct, near, far)
        lights = self._on_device(lights)
        xp, count = namespace(lights), len(lights)
        light_channels = lights.shape[3] if lights.ndim == 4 else 1
        flat = lights.reshape((count, self.projector.pixels, light_channels))
        if self.pyramid is None:
            overlaps = xp.permute_dims(self.patterns @ flat, (1, 0, 2))
            padded = xp.permute_dims(flat, (1, 0, 2))
            dark = xp.zeros((1, *padded.shape[1:]), dtype=xp.float32, device=device_of(lights))
            padded = at_direct = xp.concat([padded, dark], axis=0)
        else:
            overlaps, padded, at_direct = self._blurred(flat, self.pyramid)
        found = xp.empty(
            (self.camera.pixels, self.channels, count),
            dtype=xp.float32,
            device=device_of(lights),
        )
        length = self.held // max(1, self.near.shape[2] * count * light_channels)
        for batch in blocks(self.camera.pixels, length):
            corners, shares = self._direct_places(batch)
            at_q = at_direct[corners] * shares[..., None, None]
            lit = xp.permute_dims(xp.sum(at_q, axis=1), (0, 2, 1))
            part = direct * self.direct[batch][..., None] * lit
            part = part + near * _weighted_sums(self.near[batch], padded[self._entries(batch)])
            part = part + far * _weighted_sums(self.far[batch], overlaps)
            found[batch] = part
        if self.second is not None:
            pixels, light, corners, shares = self.second
            at_place = xp.sum(at_direct[corners] * shares[..., None, None], axis=1)
            found[pixels] = found[pixels] + direct * light[..., None] * xp.permute_dims(
                at_place, (0, 2, 1)
            )
        return xp.permute_dims(found, (2, 0, 1)).reshape((count, *self.camera, self.channels))

    def _entries(self, batch: slice) -> Integers:
        """Return where camera pixels read a light for each function, (n, J)."""
        return self.entries[batch] if self.steps is None else self.entries[batch] + self.steps

    def _direct_places(self, batch: slice) -> tuple[Integers, Floats]:
        """Return where camera pixels read a light for direct light, and weights, (n, places)."""
        corners, shares = self.corners[batch], self.shares[batch]
        if self.pyramid is None:
            return corners, shares
        xp = namespace(corners)
        corners = xp.astype(corners, xp.int64)
        # Of each box, four rows times four columns.
        flat = corners[:, 0, ..., None] * (self.projector.width + 1) + corners[:, 1, :, None]
        weights = shares[:, 0, ..., None] * shares[:, 1, :, None]
        return tuple(xp.reshape(part, (part.shape[0], 32)) for part in (flat, weights))

    def _blurred(self, lights: Any, pyramid: Pyramid) -> tuple[Any, Any, Any]:
        """Return overlaps with the far basis, levels and summed-area tables of lights.

        Lights are (L, P, 1 or channels), the others (M, ...), (levels, ...) and (table, ...) times
        L times 1 or channels. The tables are float64, as their values are large.
        """
        host = np.moveaxis(fetch(lights), 2, 1)
        overlaps = np.moveaxis(self.far_basis.analyse(host), (0, 1, 2), (1, 2, 0))
        apart = [[own.reshape(self.projector) for own in light] for light in host]
        levels, tables = (
            np.moveaxis(np.array([[of(own) for own in light] for light in apart]), 2, 0)
            for of in (pyramid.levels, summed_area)
        )
        prepared = (overlaps.astype(np.float32), levels, tables)
        return tuple(beside(np.ascontiguousarray(part), lights) for part in prepared)

    def __matmul__(self, light: Any) -> Floats:
        """Relight under one light, (Py, Px) or (Py, Px, channels), as `Transport` does."""
        if is_array_api_obj(light):
            lights = light[None]
        else:
            lights = as_light(light, self.projector, self.channels)[None]
        picture: Floats = fetch(self.pictures(lights)[0])
        return picture[..., 0] if self.channels == 1 else picture

    def _on_device(self, lights: Any) -> Any:
        checked = as_lights(lights, self.projector, self.channels)
        if is_numpy_array(checked):
            return beside(np.ascontiguousarray(checked, dtype=np.float32), self.direct)
        xp = namespace(checked)
        return xp.astype(checked, xp.float32, copy=False)


def _weighted_sums(values: Any, lights: Any) -> Any:
    """Return sums of values (n, channels, w) times lights ((n,) w, L, 1 or channels) over w."""
    xp = namespace(values)
    values = xp.astype(values, xp.float32)
    if lights.shape[-1] == 1:
        return values @ lights[..., 0]
    # Each channel its own light: (n, channels, 1, w) times (channels, w, L).
    own = xp.moveaxis(lights, -1, -3)
    return (values[:, :, None, :] @ own)[:, :, 0]


def prepare_transport(
    transport: Transport, device: Device = "cpu", *, half: bool | None = None
) -> PreparedTransport:
    """Prepare a transport on a device for relighting under many lights.

    Parameters
    ----------
    transport : Transport
    device : {"cpu", "cuda", "torch"}
    half : bool, optional
        Whether n and f are float16. By default they are on an accelerator, if the rounding error is
        well below their noise.

    Raises
    ------
    InputError, MissingPackageError
        As `nearfar.devices.mover`.

    Examples
    --------
    >>> prepared = nearfar.prepare_transport(transport)
    >>> lights = np.stack([nearfar.white(size), light])
    >>> prepared.pictures(lights).shape
    (2, 8, 8, 1)
    """
    require_instance(transport, Transport, "transport", "nearfar.load_transport")
    move = mover(device)
    if half is None:
        half = device == "cuda" and rounding_over_noise(transport) < NEGLIGIBLE_ROUNDING
    dtype = np.float16 if half else np.float32
    count, channels = transport.camera.pixels, transport.channels
    corners, shares, entries, pyramid = _places(transport)
    basis = transport.far_basis
    patterns = None
    if pyramid is None:
        patterns = move(basis.patterns * basis.weights[:, None].astype(np.float32))
    return PreparedTransport(
        projector=transport.projector,
        camera=transport.camera,
        channels=channels,
        direct=move(transport.direct.reshape(count, channels)),
        corners=move(corners),
        shares=move(shares),
        near=move(transport.near.reshape(count, channels, -1).astype(dtype, copy=False)),
        entries=move(entries.astype(np.int32)),
        steps=None if pyramid is None else move(pyramid.steps[None].astype(np.int32)),
        far=move(transport.far.reshape(count, channels, -1).astype(dtype, copy=False)),
        far_basis=basis,
        patterns=patterns,
        pyramid=pyramid,
        held=GATHERED_VALUES[device],
        second=_prepared_second(transport, move),
    )


def _prepared_second(
    transport: Transport, move: Callable[[Any], Any]
) -> PreparedSecondLight | None:
    """Put direct light from second places onto a device."""
    second = transport.factors.second
    if second is None:
        return None
    where = second.where.pixels.astype(np.int32), second.where.weights
    return PreparedSecondLight(*map(move, (second.pixels, second.direct, *where)))


def _places(transport: Transport) -> tuple[Integers, Floats, Integers, Pyramid | None]:
    """Return where direct light reads a light, with its weights, and where near-range light does.

    Both are of the light's pixels, or of a pyramid.
    """
    projector = transport.projector
    centres = windows.centre(transport.correspondence, projector)
    if transport.pitch == 1:
        where = footprint(transport.correspondence, projector)
        inside = windows.inside(centres, transport.window, projector)
        pixels = windows.window_pixels(centres, transport.window, projector)
        entries = np.where(inside, pixels, projector.pixels)
        return where.pixels.astype(np.int32), where.weights, entries, None
    pyramid, axes = transport.pyramid, transport.box_axes
    corners, shares = (
        np.ascontiguousarray(np.stack(both, axis=1).transpose(2, 1, 0, 3))
        for both in ((axes.rows, axes.columns), (axes.of_rows, axes.of_columns))
    )
    return corners, shares, pyramid.places(centres)[:, None], pyramid
