"""``nearfar view``: a transport under any light, in the browser."""

import threading
from collections.abc import Callable

from nearfar.viewer.application import application
from nearfar.viewer.interactive import InteractiveTransport
from nearfar.viewer.messages import maximum_light_bytes
from nearfar.viewer.server import ListeningAddress, serve


def run_view(
    transport: InteractiveTransport,
    listening: ListeningAddress,
    on_start: Callable[[str], None],
    stop: threading.Event | None = None,
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

    Raises
    ------
    MissingPackageError, InputError
        As `nearfar.viewer.server.serve`.
    """
    stop = stop or threading.Event()
    largest = maximum_light_bytes(transport.projector)
    with serve(application(transport), listening, maximum_message_bytes=largest) as url:
        on_start(url)
        try:
            stop.wait()
        finally:
            transport.stop()
