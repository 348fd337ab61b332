"""Dual photography: the scene as the projector sees it, lit from the camera.

Light travels both ways alike (Helmholtz), so that T^T relates a light on the camera's side to a
picture on the projector's: Sen et al., "Dual photography", SIGGRAPH 2005.
"""

import numpy as np

from nearfar.arrays import Floats, Size
from nearfar.checks import as_light
from nearfar.transport.exact import ExactTransport
from nearfar.transport.exact_operator import ExactOperator
from nearfar.transport.model import Transport
from nearfar.transport.parts import require_parts
from nearfar.transport.stored import StoredTransport


def dual_view(
    transport: Transport | ExactTransport | ExactOperator, picture: Floats | None = None
) -> Floats:
    """Return the scene as the projector sees it, lit from the camera: T^T by a picture.

    Parameters
    ----------
    transport : Transport, ExactTransport or ExactOperator
    picture : ndarray, shape (Cy, Cx) or (Cy, Cx, channels), optional
        Light at each camera pixel, grey for all channels or channel by channel; white if left out.

    Returns
    -------
    ndarray, shape (Py, Px) or (Py, Px, channels), float32
        (Py, Px) for one channel. A projector pixel adds up the camera pixels that see its light: a
        camera finer than the projector makes it brighter, in proportion to its pixels.

    Raises
    ------
    InputError
        If the picture does not hold finite numbers, or has another size than the camera or other
        channels.

    Examples
    --------
    >>> dual = nearfar.dual_view(transport)
    >>> dual.shape
    (8, 8)

    Reciprocity: what one side sends and the other sees is the same either way.

    >>> picture = nearfar.white(transport.camera)
    >>> bool(np.isclose(np.vdot(transport @ light, picture), np.vdot(light, dual), rtol=1e-4))
    True
    """
    image = _image(picture, transport.camera, transport.channels)
    return _shaped(transport.adjoint(image))


def dual_view_of_stored(
    stored: StoredTransport, picture: Floats | None, gains: dict[str, float]
) -> Floats:
    """Return the dual view of a transport in a file, some rows of the camera at a time.

    Parameters
    ----------
    stored : StoredTransport
    picture : ndarray or None
        As `dual_view` takes it.
    gains : dict of str to float
        Gain of each part, ``"direct"``, ``"near"``, ``"far"`` or ``"free"``; 1 where left out.

    Raises
    ------
    InputError
        As `dual_view`; if the transport does not have a part.
    """
    require_parts(stored.parts, gains)
    image = _image(picture, stored.camera, stored.channels)
    total, first = np.zeros((*stored.projector, stored.channels)), 0
    for rows in stored.blocks():
        lit = image[first : first + rows.camera.height]
        block = rows.with_gains(**gains) if gains else rows
        total += block.adjoint(lit).reshape(total.shape)
        first += rows.camera.height
    return _shaped(total)


def _image(picture: Floats | None, camera: Size, channels: int) -> Floats:
    """Return a light at the camera as (Cy, Cx, channels)."""
    if picture is None:
        return np.ones((*camera, channels), dtype=np.float32)
    image = as_light(picture, camera, channels, name="picture", side="camera")
    return np.broadcast_to(image.reshape(*camera, -1), (*camera, channels))


def _shaped(dual: Floats) -> Floats:
    """Return a dual view as float32, (Py, Px) for one channel."""
    found = dual.astype(np.float32)
    return found[..., 0] if found.ndim == 3 and found.shape[2] == 1 else found
