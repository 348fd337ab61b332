"""Serving a web application to browsers, from a thread of its own.

Only this machine is served by default; on other addresses a token is required.
"""

import errno
import logging
import secrets
import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import NamedTuple
from urllib.parse import urlencode

from nearfar.errors import InputError
from nearfar.packages import needed
from nearfar.viewer.access_control import LOOPBACK_HOSTS, Application, with_access_control

LOOPBACK = "127.0.0.1"
TOKEN_BYTES = 32
SHUTDOWN_TIMEOUT_SECONDS = 5.0
# Further connections get status 503; those that are open go on.
MAXIMUM_CONNECTIONS = 512
DEFAULT_MESSAGE_BYTES = 2**16


class ListeningAddress(NamedTuple):
    """Where a server listens.

    Attributes
    ----------
    host : str
        Address of this machine, or a name of it.
    port : int
        0 for any that is free.
    """

    host: str
    port: int

    @property
    def is_loopback(self) -> bool:
        """Whether only this machine is served."""
        return self.host in LOOPBACK_HOSTS


@contextmanager
def serve(
    application: Application,
    listening: ListeningAddress,
    *,
    maximum_message_bytes: int = DEFAULT_MESSAGE_BYTES,
) -> Iterator[str]:
    """Serve an application from a thread of its own, to those who may use it.

    Parameters
    ----------
    application : ASGI application
    listening : ListeningAddress
        A token is required unless it is this machine's loopback address.
    maximum_message_bytes : int
        Size of the largest WebSocket message that is accepted.

    Yields
    ------
    str
        The URL to open, with the token if one is required.

    Raises
    ------
    MissingPackageError
        If the server's packages are not installed.
    InputError
        If the server cannot listen there.
    """
    with needed(extra="viewer", what="a page in the browser"):
        import uvicorn

        from nearfar.viewer.connections import Connection
    listener = _listen(listening)
    port = listener.getsockname()[1]
    token = "" if listening.is_loopback else secrets.token_urlsafe(TOKEN_BYTES)
    settings = uvicorn.Config(
        with_access_control(application, port, token),
        log_level="error",
        access_log=False,
        lifespan="off",
        # Of the loops that may be installed, this one reads what has arrived before it runs timers.
        loop="asyncio",
        http=Connection,
        ws="websockets-sansio",
        ws_max_size=maximum_message_bytes,
        # Numbers hardly shrink, and compressing them takes as long as relighting.
        ws_per_message_deflate=False,
        limit_concurrency=MAXIMUM_CONNECTIONS,
        timeout_graceful_shutdown=1,
    )
    server = uvicorn.Server(settings)
    thread = threading.Thread(target=server.run, kwargs={"sockets": [listener]}, daemon=True)
    thread.start()
    host = f"[{listening.host}]" if ":" in listening.host else listening.host
    query = f"/?{urlencode({'token': token})}" if token else ""
    try:
        yield f"http://{host}:{port}{query}"
    finally:
        # Requests that are cut off now are no errors to report.
        logging.getLogger("uvicorn.error").setLevel(logging.CRITICAL)
        server.should_exit = True
        thread.join(timeout=SHUTDOWN_TIMEOUT_SECONDS)
        listener.close()


def _listen(listening: ListeningAddress) -> socket.socket:
    family = socket.AF_INET6 if ":" in listening.host else socket.AF_INET
    listener = socket.socket(family)
    try:
        # So that a port can be reused at once after the server that had it has ended.
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listener.bind(tuple(listening))
        # From here on clients wait until the server runs, and are not refused.
        listener.listen(MAXIMUM_CONNECTIONS)
    except OSError as error:
        listener.close()
        if isinstance(error, socket.gaierror) or error.errno == errno.EADDRNOTAVAIL:
            raise InputError(
                f"{listening.host} is no address of this machine ({error.strerror}): give "
                f"{LOOPBACK}, or 0.0.0.0 for all that it has."
            ) from None
        raise InputError(
            f"port {listening.port} at {listening.host} cannot be served on ({error.strerror}): "
            f"give another by `port`, or 0 for any that is free."
        ) from None
    return listener
