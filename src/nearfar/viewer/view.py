"""``nearfar view``: a transport under any light, in the browser."""

import threading
from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType

from nearfar.report.maps import Map
from nearfar.viewer.beside import Beside
from nearfar.viewer.interactive import InteractiveTransport
from nearfar.viewer.messages import maximum_light_bytes
from nearfar.viewer.photo_series import PhotoSeries
from nearfar.viewer.server import ListeningAddress, serve
from nearfar.viewer.several_projectors import application_of_projectors


def run_view(
    transport: InteractiveTransport,
    listening: ListeningAddress,
    on_start: Callable[[str], None],
    stop: threading.Event | None = None,
    *,
    beside: Beside | None = None,
    photo_maps: Mapping[str, Map] = MappingProxyType({}),
    photo_series: PhotoSeries | None = None,
    others: Sequence[InteractiveTransport] = (),
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
    others : sequence of InteractiveTransport, optional
        Of further projectors before the same camera.

    Raises
    ------
    MissingPackageError, InputError
        As `nearfar.viewer.server.serve`.
    """
    stop = stop or threading.Event()
    transports = [transport, *others]
    largest = max(maximum_light_bytes(each.projector) for each in transports)
    page = application_of_projectors(transports, beside, photo_maps, photo_series)
    with serve(page, listening, maximum_message_bytes=largest) as url:
        on_start(url)
        try:
            stop.wait()
        finally:
            for each in transports:
                each.stop()
