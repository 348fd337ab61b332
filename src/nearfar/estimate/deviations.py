"""Standard deviations of relit pictures, of whichever estimate a transport is."""

from collections.abc import Mapping

from nearfar.arrays import Floats
from nearfar.estimate.error_bars import ErrorBars
from nearfar.estimate.free_rows.error_bars import FreeErrorBars
from nearfar.transport.model import Transport
from nearfar.transport.parts import require_parts


def deviation_of_picture(
    transport: Transport, light: Floats, gains: Mapping[str, float] | None = None
) -> Floats:
    """Return the standard deviation of a relit picture.

    Parameters
    ----------
    transport : Transport
    light : ndarray, shape (Py, Px) or (Py, Px, channels)
    gains : mapping of str to float, optional
        Gain of each part; 1 where left out.

    Returns
    -------
    ndarray, shape (Cy, Cx) or (Cy, Cx, channels), float32
        Photo units; infinite at saturated camera pixels.

    Raises
    ------
    InputError
        If the transport holds no error bars, or does not have a part.

    Examples
    --------
    >>> nearfar.deviation_of_picture(transport, light).shape
    (8, 8)
    """
    given = dict(gains or {})
    require_parts(transport.parts, given)
    bars = FreeErrorBars if "free" in transport.parts else ErrorBars
    return bars(transport).picture(light, **given)
