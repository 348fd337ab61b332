"""The standard deviation of the relit picture at every camera pixel, for a page."""

from collections.abc import Iterable, Iterator

import numpy as np

from nearfar.arrays import Floats, Size
from nearfar.errors import InputError
from nearfar.estimate.error_bars import ErrorBars
from nearfar.estimate.physical import PhysicalErrorBars
from nearfar.estimate.physical.split import PhysicalComponents
from nearfar.transport.model import Transport
from nearfar.transport.rows import of_rows, thinned_blocks
from nearfar.viewer.interactive import InteractiveTransport
from nearfar.viewer.messages import Gains, LightHeader, pack, unpack_levels
from nearfar.viewer.physical import PhysicalRelighting
from nearfar.viewer.tools.few_pixels import few_pixels

# Camera pixels times channels of one step, some tenths of a second, and of a whole picture while
# the light or a gain moves.
STEP_VALUES = 2**14
COARSE_VALUES = 2**11


class ErrorBarsHeader(LightHeader):
    """The header of a light whose picture's standard deviation is wanted.

    Attributes
    ----------
    coarse : bool
        Whether a few camera pixels suffice.
    """

    coarse: bool = False


def error_bars_of_picture(
    physical: PhysicalRelighting, transport: InteractiveTransport, message: bytes
) -> Iterator[bytes | None]:
    """Make the map of the relit picture's standard deviation, with the header's gains.

    Its result has, for each camera pixel, the mean over channels of the standard deviation, NaN
    where it is unknown, and of the light.

    Raises
    ------
    InputError
        If the message is wrong, or the transport has no error bars.
    """
    header, light = unpack_levels(ErrorBarsHeader, message, transport.projector)
    if not transport.stored.has_error_bars:
        raise InputError("this transport has no error bars, so that there is no map of them.")
    levels, maps = transport.for_channels(light.as_array()), []
    if header.split == "physical" and physical.is_prepared and not header.coarse:
        maps.append(_of_physical(physical, levels, header.gains))
        yield None
    else:
        parts: Iterable[Transport]
        if header.coarse:
            parts = [few_pixels(transport, max(1, COARSE_VALUES // transport.stored.channels))]
        else:
            stride = transport.display_stride
            parts = thinned_blocks(transport.blocks(), transport.stored.camera.height, stride)
        for part in parts:
            for some in _steps(part):
                maps.append(_of_model(some, levels, header.gains))
                yield None
    sigma, relit = (np.concatenate([each[i] for each in maps]) for i in range(2))
    sigma[~np.isfinite(sigma)] = np.nan
    yield pack({"coarse": header.coarse}, sigma, relit)


def _steps(part: Transport) -> Iterator[Transport]:
    rows = max(1, STEP_VALUES // max(1, part.camera.width * part.channels))
    for first in range(0, part.camera.height, rows):
        yield of_rows(part, slice(first, first + rows))


def _of_model(part: Transport, levels: Floats, gains: Gains) -> tuple[Floats, Floats]:
    given = gains.of_parts(part.parts)
    sigma = ErrorBars(part).picture(levels, **given)
    return _mean(sigma, part.camera), _mean(part.relight(levels, **given), part.camera)


def _of_physical(
    physical: PhysicalRelighting, levels: Floats, gains: Gains
) -> tuple[Floats, Floats]:
    split = physical.displayed
    given, camera = gains.of(PhysicalComponents._fields), split.transport.camera
    sigma = PhysicalErrorBars(split).picture(levels, **given)
    return _mean(sigma, camera), _mean(split.relight(levels, **given), camera)


def _mean(picture: Floats, camera: Size) -> Floats:
    """Return the mean over channels, (y, x), float32."""
    return np.asarray(picture.reshape(*camera, -1).mean(axis=-1, dtype=np.float32))
