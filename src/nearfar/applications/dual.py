"""Dual photography: the scene as the projector sees it, lit from the camera.

Light travels both ways alike (Helmholtz), so that T^T relates a light on the camera's side to a
picture on the projector's: Sen et al., "Dual photography", SIGGRAPH 2005.

A lens dims light towards the corners. With the flat fields v of the camera and w of the projector,
T is V T_0 W, and the view without both is T_0^T l = W^-1 T^T V^-1 l.

Measured far-range light is blurred on the projector's side: `nearfar.applications.reciprocity` has
what sharpens it.
"""

from collections.abc import Iterator, Mapping

import numpy as np

from nearfar.applications.flat_fields import flat_fields
from nearfar.applications.reciprocity import Blocks, ByReciprocity, Reciprocity, blocks_of
from nearfar.arrays import Floats, Size
from nearfar.checks import as_light
from nearfar.errors import InputError
from nearfar.transport.exact import ExactTransport
from nearfar.transport.exact_operator import ExactOperator
from nearfar.transport.model import Transport
from nearfar.transport.parts import require_parts
from nearfar.transport.stored import StoredTransport


def dual_view(
    transport: Transport | ExactTransport | ExactOperator,
    picture: Floats | None = None,
    *,
    camera_flat: Floats | None = None,
    projector_flat: Floats | None = None,
    reciprocity: Reciprocity | None = None,
) -> Floats:
    """Return the scene as the projector sees it, lit from the camera: T^T by a picture.

    Parameters
    ----------
    transport : Transport, ExactTransport or ExactOperator
    picture : ndarray, shape (Cy, Cx) or (Cy, Cx, channels), optional
        Light at each camera pixel, grey for all channels or channel by channel; white if left out.
    camera_flat : ndarray, shape (Cy, Cx) or (Cy, Cx, channels), optional
        Flat field of the camera, in any unit: its photo of an evenly bright surface. The light is
        divided by it over its mean.
    projector_flat : ndarray, shape (Py, Px) or (Py, Px, channels), optional
        That of the projector: the light of each of its pixels under white on an even surface. The
        view is divided by it over its mean.
    reciprocity : Reciprocity, optional
        Of a measured transport, by `nearfar.find_reciprocity`: if it holds, far-range light and
        near-range light away from q follow from it, as sharp as in a relit picture.

    Returns
    -------
    ndarray, shape (Py, Px) or (Py, Px, channels), float32
        (Py, Px) for one channel. A projector pixel adds up the camera pixels that see its light: a
        camera finer than the projector makes it brighter, in proportion to its pixels.

    Raises
    ------
    InputError
        If the picture does not hold finite numbers, or has another size than the camera or other
        channels; the same of the flat fields, which must be above 0. If reciprocity is given for
        a transport that was not measured.

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
    camera, projector, channels = transport.camera, transport.projector, transport.channels
    flats = flat_fields(camera_flat, projector_flat, camera, projector, channels)
    image = _image(picture, camera, channels) / flats.camera
    if reciprocity is None:
        seen = np.reshape(transport.adjoint(image), (*projector, channels))
    elif isinstance(transport, Transport):
        seen = _sent_back(transport, image, {}, reciprocity)
    else:
        raise InputError(
            "reciprocity sharpens the far-range light of a measured transport, and this one is "
            "known: leave reciprocity out."
        )
    return _shaped(seen / flats.projector)


def dual_view_of_stored(
    stored: StoredTransport,
    picture: Floats | None,
    gains: dict[str, float],
    *,
    camera_flat: Floats | None = None,
    projector_flat: Floats | None = None,
    reciprocity: Reciprocity | None = None,
) -> Floats:
    """Return the dual view of a transport in a file, some rows of the camera at a time.

    Parameters
    ----------
    stored : StoredTransport
    picture : ndarray or None
        As `dual_view` takes it.
    gains : dict of str to float
        Gain of each part, ``"direct"``, ``"near"``, ``"far"`` or ``"free"``; 1 where left out.
    camera_flat, projector_flat, reciprocity : optional
        As `dual_view` takes them.

    Raises
    ------
    InputError
        As `dual_view`; if the transport does not have a part.
    """
    require_parts(stored.parts, gains)
    camera, projector, channels = stored.camera, stored.projector, stored.channels
    flats = flat_fields(camera_flat, projector_flat, camera, projector, channels)
    image = _image(picture, camera, channels) / flats.camera
    return _shaped(_sent_back(stored, image, gains, reciprocity) / flats.projector)


def _sent_back(
    transport: Transport | StoredTransport,
    image: Floats,
    gains: dict[str, float],
    reciprocity: Reciprocity | None,
) -> Floats:
    """Send an image back; see `sent_back_in_steps`."""
    total = np.zeros((*transport.projector, transport.channels))
    for _ in sent_back_in_steps(blocks_of(transport), image, gains, reciprocity, total):
        pass
    return total


def sent_back_in_steps(
    blocks: Blocks,
    image: Floats,
    gains: Mapping[str, float],
    reciprocity: Reciprocity | None,
    total: Floats,
) -> Iterator[None]:
    """Send an image back to the projector, one block of camera rows in each step.

    Parameters
    ----------
    blocks : callable
        Yields the transport in blocks of camera rows; called a second time for reciprocity.
    image : ndarray, shape (Cy, Cx, channels)
    gains : mapping of str to float
        Gain of each part; 1 where left out.
    reciprocity : Reciprocity, optional
        Used if it holds.
    total : ndarray, shape (Py, Px, channels)
        Zeros, to which the view is added.
    """
    changed = {part: gain for part, gain in gains.items() if gain != 1}

    def weighed() -> Iterator[Transport]:
        return (block.with_gains(**changed) if changed else block for block in blocks())

    sharper = None
    if reciprocity is not None and reciprocity.holds:
        sharper = ByReciprocity(reciprocity, total.shape[-1])
    first = 0
    for block in weighed():
        lit = image[first : first + block.camera.height]
        if lit.any():
            total += block.adjoint(lit).reshape(total.shape)
        if sharper is not None:
            sharper.send(block, lit)
        first += block.camera.height
        yield
    if sharper is not None:
        for block in weighed():
            sharper.see(block)
            yield
        total += sharper.correction()


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
