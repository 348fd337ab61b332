"""``nearfar view``: a transport under any light, in the browser."""

import threading
from collections.abc import Callable, Mapping
from types import MappingProxyType

from nearfar.report.maps import Map
from nearfar.viewer.application import application
from nearfar.viewer.beside import Beside
from nearfar.viewer.interactive import InteractiveTransport
from nearfar.viewer.messages import maximum_light_bytes
from nearfar.viewer.photo_series import PhotoSeries
from nearfar.viewer.server import ListeningAddress, serve


def run_view(
    transport: InteractiveTransport,
    listening: ListeningAddress,
    on_start: Callable[[str], None],
    stop: threading.Event | None = None,
    *,
    beside: Beside | None = None,
    photo_maps: Mapping[str, Map] = MappingProxyType({}),
    photo_series: PhotoSeries | None = None,
) -> None:
    """Serve the page of a transport until an interrupt, or until `stop` is set.

    Parameters
    ----------
    transport : InteractiveTransport
    listening : ListeningAddress
    on_start : callable
        Called with the URL to open.
    stop : Event, optional
        Ends the server once it is set.
    beside : Beside, optional
        A second transport, under the same light.
    photo_maps : mapping of str to Map, optional
        Maps by photos, as `nearfar.viewer.held_out.photo_maps` makes them.
    photo_series : PhotoSeries, optional
        Photos to compare the scene with, each under its light.

    Raises
    ------
    MissingPackageError, InputError
        As `nearfar.viewer.server.serve`.
    """
    stop = stop or threading.Event()
    largest = maximum_light_bytes(transport.projector)
    page = application(transport, beside, photo_maps, photo_series)
    with serve(page, listening, maximum_message_bytes=largest) as url:
        on_start(url)
        try:
            stop.wait()
        finally:
            transport.stop()
