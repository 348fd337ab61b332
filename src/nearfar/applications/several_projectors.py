"""Several projectors before one camera: T = [T_1 | T_2 | ...], as light adds up.

Each projector has a transport of its own, measured while the others were dark. The picture under
lights of all is the sum of the pictures under the light of each, and variances of independent
photos add.

Photos by several projectors at once, for which only this sum is needed: Gu, Kobayashi, Gupta and
Nayar, "Multiplexed Illumination for Scene Recovery in the Presence of Global Illumination",
ICCV 2011.
"""

from collections.abc import Mapping, Sequence
from typing import Any, Protocol

import numpy as np

from nearfar.arrays import Floats, Size
from nearfar.checks import require_instance
from nearfar.errors import InputError
from nearfar.transport.model import Transport

# Share by which exposures may differ: whole refreshes of two projectors are not quite the same.
LARGEST_EXPOSURE_DIFFERENCE = 0.005


class OfACamera(Protocol):
    """A transport, in memory or in a file, as far as its camera is concerned."""

    @property
    def camera(self) -> Size:
        """Height and width of the photos."""
        ...

    @property
    def channels(self) -> int:
        """Number of camera channels."""
        ...

    @property
    def provenance(self) -> Mapping[str, Any]:
        """How it was made."""
        ...


def relight_together(
    transports: Sequence[Transport], lights: Sequence[Floats], **gains: float
) -> Floats:
    """Relight the scene by several projectors: the sum of what each adds.

    Parameters
    ----------
    transports : sequence of Transport
        Of the same camera at the same place and exposure; one for each projector.
    lights : sequence of ndarray, shape (Py, Px) or (Py, Px, channels)
        A light for each.
    **gains : float
        Gains of the parts of all transports, as `Transport.relight` takes them.

    Returns
    -------
    ndarray, shape (Cy, Cx) or (Cy, Cx, channels), float32
        Photo units.

    Raises
    ------
    InputError
        If the cameras, their channels or exposures differ, if there is not a light for each
        transport, or as `Transport.relight`.

    Examples
    --------
    >>> both = nearfar.relight_together([transport, transport], [light, 0.5 * light])
    >>> bool(np.allclose(both, 1.5 * (transport @ light), atol=1e-6))
    True
    """
    require_transports(transports)
    if len(lights) != len(transports):
        raise InputError(
            f"there are {len(lights)} lights for {len(transports)} transports: give one for each."
        )
    pictures = [
        transport.relight(light, **gains)
        for transport, light in zip(transports, lights, strict=True)
    ]
    return added_pictures(pictures)


def added_pictures(pictures: Sequence[Floats]) -> Floats:
    """Return the picture under all lights, by those under each."""
    return np.asarray(sum(pictures[1:], start=pictures[0]))


def added_deviations(deviations: Sequence[Floats]) -> Floats:
    """Return the standard deviation of a sum of independent pictures, by those of each."""
    if len(deviations) == 1:
        return deviations[0]
    variance = np.sum(np.square(deviations, dtype=np.float64), axis=0)
    return np.asarray(np.sqrt(variance).astype(np.float32))


def require_transports(transports: Sequence[Transport]) -> None:
    """Refuse what are no transports, and transports whose pictures cannot be added.

    Raises
    ------
    InputError
    """
    for transport in transports:
        require_instance(transport, Transport, "transports", "nearfar.load_transport")
    require_same_camera(
        transports, [f"transport {number}" for number in range(1, len(transports) + 1)]
    )


def require_same_camera(transports: Sequence[OfACamera], names: Sequence[str]) -> None:
    """Refuse transports whose pictures cannot be added, by their names.

    Raises
    ------
    InputError
        If there are none, or cameras, channels or exposures differ.
    """
    if not transports:
        raise InputError("no transport was given: give one for each projector.")
    first = transports[0]
    for transport, name in zip(transports[1:], names[1:], strict=True):
        for what, one, other in (
            ("a camera of", first.camera, transport.camera),
            ("this number of camera channels:", first.channels, transport.channels),
        ):
            if one != other:
                raise InputError(
                    f"{names[0]} has {what} {one}, and {name} {other}: what several projectors "
                    f"light adds up in the photos of one camera, so give transports of the same."
                )
        exposures = [_exposure_of(each) for each in (first, transport)]
        if exposures_differ(*exposures):
            raise InputError(
                f"{names[0]} was photographed at {exposures[0]:g} s and {name} at "
                f"{exposures[1]:g} s, and light adds up at one exposure: write the same exposure "
                f"under [camera] of both rigs, and photograph again."
            )


def _exposure_of(transport: OfACamera) -> Any:
    """Return the exposure of a transport's photos in seconds, where its rig tells it."""
    rig = transport.provenance.get("rig")
    return rig.get("exposure") if isinstance(rig, Mapping) else None


def exposures_differ(one: Any, other: Any) -> bool:
    """Return whether two exposures in seconds are known and not the same."""
    known = all(isinstance(value, int | float) for value in (one, other))
    return known and bool(abs(one - other) > LARGEST_EXPOSURE_DIFFERENCE * max(one, other))
