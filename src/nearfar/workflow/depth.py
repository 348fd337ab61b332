"""From a capture or a transport to depth."""

from collections.abc import Mapping
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from nearfar.applications.depth import Depth, triangulate
from nearfar.arrays import Floats, Size
from nearfar.capture import Capture
from nearfar.capture.store import white_and_black
from nearfar.correspondence import Correspondence
from nearfar.errors import InputError
from nearfar.files import to_srgb
from nearfar.progress import Report, ignore_progress
from nearfar.stereo import StereoCalibration
from nearfar.transport.model import Transport
from nearfar.transport.stored import StoredTransport
from nearfar.workflow.by_codes import correspond_by_codes
from nearfar.workflow.steps import correspond

# Photos read at once.
PHOTOS_AT_ONCE = 16
# Share of values that are at most white in the colours of a point cloud.
BELOW_WHITE = 0.995
Colour = Literal["direct", "white"]


class Seen(NamedTuple):
    """What depth is found from.

    Attributes
    ----------
    correspondence : Correspondence
    projector : Size
        Pattern grid.
    colour : ndarray, shape (Cy, Cx, channels)
        Direct light, or the picture under white; linear.
    rig : mapping
        What took the photos.
    warnings : tuple of str
        What is wrong with the photos, a sentence each.
    """

    correspondence: Correspondence
    projector: Size
    colour: Floats
    rig: Mapping[str, Any]
    warnings: tuple[str, ...] = ()

    def depth(
        self,
        stereo: StereoCalibration,
        scale: int | None = None,
        least_confidence: float = 0.0,
    ) -> Depth:
        """Triangulate; see `nearfar.depth`."""
        shown = scale_of_rig(self.rig, stereo) if scale is None else scale
        return triangulate(
            self.correspondence,
            stereo,
            self.projector,
            scale=shown,
            least_confidence=least_confidence,
        )

    def colours(self) -> NDArray[np.uint8]:
        """Return sRGB colours, (Cy, Cx, 3), of which the brightest are white."""
        light = np.maximum(self.colour, 0.0)
        full = max(float(np.quantile(light, BELOW_WHITE)), np.finfo(np.float32).tiny)
        grey_or_rgb = light if light.shape[-1] == 3 else light.mean(axis=-1, keepdims=True)
        drawn = np.rint(255 * to_srgb(grey_or_rgb / full)).astype(np.uint8)
        return np.broadcast_to(drawn, (*drawn.shape[:2], 3))


def depth(
    source: Capture | Transport,
    stereo: StereoCalibration,
    *,
    scale: int | None = None,
    least_confidence: float = 0.0,
    progress: Report | None = None,
) -> Depth:
    """Find where the light of projector pixels meets the surfaces that the camera sees.

    Parameters
    ----------
    source : Capture or Transport
    stereo : StereoCalibration
    scale, least_confidence
        As `nearfar.triangulate` takes them; a real rig tells its own scale.
    progress : callable, optional
        Called with the step and the share of it that is done, 0 to 1.

    Returns
    -------
    Depth

    Raises
    ------
    InputError
        If the sizes do not fit the calibration, or no camera pixel has q.

    Examples
    --------
    >>> matrix = np.array([[8, 0, 3.5], [0, 8, 3.5], [0, 0, 1]])
    >>> shifted = matrix - [[0, 0, 1], [0, 0, 0], [0, 0, 0]]
    >>> stereo = nearfar.StereoCalibration.from_opencv(
    ...     (8, 8), matrix, None, (8, 8), shifted, None, np.eye(3), [0.25, 0, 0]
    ... )
    >>> found = nearfar.depth(capture, stereo)
    >>> float(np.nanmedian(found.points[..., 2]).round(1))  # a wall at a distance of 2
    2.0
    """
    if isinstance(source, Capture):
        seen = seen_in_capture(source, progress or ignore_progress)
    elif isinstance(source, Transport):
        seen = seen_in_transport(source)
    else:
        raise InputError(
            f"depth of a {type(source).__name__} was asked for: give what nearfar.open_capture or "
            f"nearfar.load_transport returns."
        )
    return seen.depth(stereo, scale, least_confidence)


def seen_in_capture(capture: Capture, progress: Report = ignore_progress) -> Seen:
    """Find q in the photos of a capture, and the picture under white.

    Raises
    ------
    InputError
        If the photos do not settle q.
    """
    warnings: tuple[str, ...] = ()
    if capture.plan.offset == "shown":
        by_codes = correspond_by_codes(capture, progress)
        found, warnings = by_codes.correspondence, tuple(by_codes.warnings())
    else:
        found = correspond(capture, progress=progress)
    return Seen(found, capture.plan.projector, white_picture(capture), capture.rig, warnings)


def seen_in_transport(transport: Transport, colour: Colour = "direct") -> Seen:
    """Take q from a transport, and direct light or the picture under white.

    Raises
    ------
    InputError
        If the transport has no direct light, and so no q.
    """
    return Seen(
        _correspondence(transport), transport.projector, _colour(transport, colour), _rig(transport)
    )


def seen_in_stored(stored: StoredTransport, colour: Colour = "direct") -> Seen:
    """Take the same from a transport in a file, some rows of the camera at a time."""
    parts = [seen_in_transport(rows, colour) for rows in stored.blocks()]
    return Seen(
        Correspondence(
            np.concatenate([part.correspondence.q for part in parts]),
            np.concatenate([part.correspondence.confidence for part in parts]),
        ),
        stored.projector,
        np.concatenate([part.colour for part in parts]),
        parts[0].rig,
    )


def white_picture(capture: Capture) -> Floats:
    """Return the photo under white less that under black, or the mean of all photos.

    Returns
    -------
    ndarray, shape (Cy, Cx, channels), float32
    """
    uniform = white_and_black(capture.plan)
    if uniform is not None:
        white, black = capture.read(list(uniform))
        return np.asarray(white - black)
    count = len(capture.plan.patterns)
    total = np.zeros((*capture.camera, capture.channels), dtype=np.float64)
    for first in range(0, count, PHOTOS_AT_ONCE):
        total += capture.read(slice(first, first + PHOTOS_AT_ONCE)).sum(axis=0)
    return np.asarray(total / count, dtype=np.float32)


def scale_of_rig(rig: Mapping[str, Any], stereo: StereoCalibration) -> int | None:
    """Return the side of a pattern pixel on a real rig's projector; None if it is not told.

    Raises
    ------
    InputError
        If the calibration is of a projector of another size.
    """
    screen = rig.get("projector")
    if rig.get("kind") != "real" or not isinstance(screen, dict):
        return None
    size, scale = screen.get("size"), screen.get("scale")
    if size is not None and tuple(size) != tuple(stereo.projector.size):
        raise InputError(
            f"the photos were taken with a projector of {Size(*size)}, the calibration is of one "
            f"of {stereo.projector.size}: calibrate this rig."
        )
    return scale if isinstance(scale, int) else None


def _correspondence(transport: Transport) -> Correspondence:
    if "direct" not in transport.parts:
        raise InputError(
            "this transport has no direct light, so that no projector pixel is known to light a "
            "camera pixel: give the capture, or reconstruct with near- and far-range light."
        )
    q = transport.correspondence
    if transport.quality is not None:
        return Correspondence(q, transport.quality.confidence)
    return Correspondence(q, np.isfinite(q[..., 0]).astype(np.float32))


def _colour(transport: Transport, colour: Colour) -> Floats:
    if colour == "direct":
        return transport.direct
    white = np.ones(transport.projector, dtype=np.float32)
    return np.asarray(transport @ white).reshape(*transport.camera, transport.channels)


def _rig(transport: Transport) -> Mapping[str, Any]:
    rig = transport.provenance.get("rig", {})
    return rig if isinstance(rig, dict) else {}
