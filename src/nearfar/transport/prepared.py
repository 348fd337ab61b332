"""A transport laid out on a device, to be relit again and again.

Where every window entry lies is looked up once, and n and f are kept in float16 where that strays
by less than their noise: an accelerator then reads half the bytes for each light. On the processor
`Transport` itself is as fast as memory, and NumPy faster with float32 than with float16.

Index convention: c runs over camera pixels, i over channels, l over lights, w over window entries;
a light is a column, its channels side by side: (P + 1, L, 1 or channels), the last pixel dark.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from array_api_compat import device as device_of
from array_api_compat import is_array_api_obj, is_numpy_array

from nearfar.arrays import Floats, Integers, Size, beside, blocks, fetch, namespace
from nearfar.checks import NoArray, as_light, as_lights
from nearfar.devices import Device, mover
from nearfar.transport import near as windows
from nearfar.transport.direct import footprint
from nearfar.transport.half import rounding_over_noise
from nearfar.transport.model import Transport, as_gains

# Values gathered at once: few enough to lie near the processor; many, where each call takes a way.
HELD: dict[Device, int] = {"cpu": 2**19, "torch": 2**19, "cuda": 2**26}
# Rounding of less than this share of the noise does not show.
UNSEEN = 0.25


@dataclass(frozen=True, eq=False)
class PreparedTransport(NoArray):
    """A transport laid out for relighting; make one by `prepare_transport`.

    Attributes
    ----------
    projector, camera : Size
    channels : int
    direct : array, shape (C, channels)
    corners, shares : arrays, shape (C, 4)
        Pixels that direct light comes from, and how much of it.
    near : array, shape (C, channels, W^2)
    entries : array of int, shape (C, W^2)
        Pixels of the window entries; P for those beyond the border.
    far : array, shape (C, channels, M)
    patterns : array, shape (M, P)
        The far basis, weighted.
    held : int
        Values gathered at once.
    """

    projector: Size
    camera: Size
    channels: int
    direct: Floats
    corners: Integers
    shares: Floats
    near: Floats
    entries: Integers
    far: Floats
    patterns: Floats
    held: int

    @property
    def nbytes(self) -> int:
        """Bytes that it takes on its device."""
        arrays = (self.direct, self.corners, self.shares, self.near, self.entries, self.far)
        return sum(int(a.nbytes) for a in (*arrays, self.patterns))

    def pictures(
        self, lights: Any, *, direct: float = 1.0, near: float = 1.0, far: float = 1.0
    ) -> Any:
        """Relight under many lights, with a gain for each component.

        Parameters
        ----------
        lights : array, shape (L, Py, Px) or (L, Py, Px, channels), float32
            NumPy's, or of the device's library and already there, which saves the way.

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
        lights = self._there(lights)
        xp, count = namespace(lights), len(lights)
        kinds = lights.shape[3] if lights.ndim == 4 else 1
        flat = lights.reshape((count, self.projector.pixels, kinds))
        overlaps = xp.permute_dims(self.patterns @ flat, (1, 0, 2))
        columns = xp.permute_dims(flat, (1, 0, 2))
        dark = xp.zeros((1, *columns.shape[1:]), dtype=xp.float32, device=device_of(lights))
        columns = xp.concat([columns, dark], axis=0)
        found = xp.empty(
            (self.camera.pixels, self.channels, count),
            dtype=xp.float32,
            device=device_of(lights),
        )
        length = self.held // max(1, self.entries.shape[1] * count * kinds)
        for block in blocks(self.camera.pixels, length):
            at_q = columns[self.corners[block]] * self.shares[block][..., None, None]
            lit = xp.permute_dims(xp.sum(at_q, axis=1), (0, 2, 1))
            part = direct * self.direct[block][..., None] * lit
            part = part + near * _weighed(self.near[block], columns[self.entries[block]])
            part = part + far * _weighed(self.far[block], overlaps)
            found[block] = part
        return xp.permute_dims(found, (2, 0, 1)).reshape((count, *self.camera, self.channels))

    def __matmul__(self, light: Any) -> Floats:
        """Relight under one light, (Py, Px) or (Py, Px, channels), as `Transport` does."""
        if is_array_api_obj(light):
            lights = light[None]
        else:
            lights = as_light(light, self.projector, self.channels)[None]
        picture: Floats = fetch(self.pictures(lights)[0])
        return picture[..., 0] if self.channels == 1 else picture

    def _there(self, lights: Any) -> Any:
        checked = as_lights(lights, self.projector, self.channels)
        if is_numpy_array(checked):
            return beside(np.ascontiguousarray(checked, dtype=np.float32), self.direct)
        xp = namespace(checked)
        return xp.astype(checked, xp.float32, copy=False)


def _weighed(values: Any, seen: Any) -> Any:
    """Sum values (n, channels, w) times what is seen (w or n w, L, 1 or channels)."""
    xp = namespace(values)
    values = xp.astype(values, xp.float32)
    if seen.shape[-1] == 1:
        return values @ seen[..., 0]
    # Each channel its own light: (n, channels, 1, w) times (channels, w, L).
    own = xp.moveaxis(seen, -1, -3)
    return (values[:, :, None, :] @ own)[:, :, 0]


def prepare_transport(
    transport: Transport, device: Device = "cpu", *, half: bool | None = None
) -> PreparedTransport:
    """Lay a transport out on a device.

    Parameters
    ----------
    transport : Transport
    device : {"cpu", "cuda", "torch"}
    half : bool, optional
        Whether n and f are kept in float16; by default on an accelerator, where the rounding is
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
    move = mover(device)
    if half is None:
        half = device == "cuda" and rounding_over_noise(transport) < UNSEEN
    kind = np.float16 if half else np.float32
    count, channels = transport.camera.pixels, transport.channels
    where = footprint(transport.correspondence, transport.projector)
    centres = windows.centre(transport.correspondence, transport.projector)
    entries = np.where(
        windows.inside(centres, transport.window, transport.projector),
        windows.places_on(centres, transport.window, transport.projector),
        transport.projector.pixels,
    )
    basis = transport.far_basis
    weighted = basis.patterns * basis.weights[:, None].astype(np.float32)
    return PreparedTransport(
        projector=transport.projector,
        camera=transport.camera,
        channels=channels,
        direct=move(transport.direct.reshape(count, channels)),
        corners=move(where.pixels.astype(np.int32)),
        shares=move(where.weights),
        near=move(transport.near.reshape(count, channels, -1).astype(kind, copy=False)),
        entries=move(entries.astype(np.int32)),
        far=move(transport.far.reshape(count, channels, -1).astype(kind, copy=False)),
        patterns=move(weighted),
        held=HELD[device],
    )
