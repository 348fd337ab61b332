"""Serving pages to a browser: a thread of its own, and who may ask.

Pages go to this machine alone unless told otherwise; beyond it whoever asks needs a token. On this
machine a page from elsewhere is kept out: by the host that it names, and by its origin.
"""

import hmac
import logging
import secrets
import socket
import threading
from collections.abc import Awaitable, Callable, Iterator, MutableMapping
from contextlib import contextmanager
from typing import Any, NamedTuple
from urllib.parse import parse_qs, urlencode, urlsplit

from nearfar.errors import InputError
from nearfar.packages import needed

HERE = "127.0.0.1"
# What a browser on this machine may call it.
LOCAL = ("127.0.0.1", "localhost", "::1")
# Characters of a token, 6 bits each.
TOKEN = 32
# Seconds in which a server that is told to end does so.
PATIENCE = 5.0
# Connections at once: beyond them the answer is 503, and those that are open go on.
CONNECTIONS = 512

Scope = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[Any]]
Send = Callable[[Any], Awaitable[None]]
Application = Callable[[Scope, Receive, Send], Awaitable[None]]


class Place(NamedTuple):
    """Where a page is served.

    Attributes
    ----------
    host : str
        Address to listen at.
    port : int
        0 for any that is free.
    """

    host: str
    port: int

    @property
    def is_local(self) -> bool:
        """Whether this machine alone is served."""
        return self.host in LOCAL


@contextmanager
def serve(application: Application, place: Place, *, largest: int = 2**16) -> Iterator[str]:
    """Serve an application from a thread of its own, to those who may ask.

    Parameters
    ----------
    application : ASGI application
    place : Place
        Beyond this machine a token is asked for.
    largest : int
        Bytes of a WebSocket's message.

    Yields
    ------
    str
        The address to open, with the token where there is one.

    Raises
    ------
    MissingPackageError
        If the server's packages are not installed.
    InputError
        If the place cannot be served at.
    """
    with needed(extra="viewer", what="a page in the browser"):
        import uvicorn

        from nearfar.viewer.connections import Connection
    listening = _listen(place)
    port = listening.getsockname()[1]
    token = "" if place.is_local else secrets.token_urlsafe(TOKEN)
    settings = uvicorn.Config(
        guarded(application, port, token),
        log_level="error",
        access_log=False,
        lifespan="off",
        http=Connection,
        ws="websockets-sansio",
        ws_max_size=largest,
        # Numbers hardly shrink, and trying takes as long as relighting.
        ws_per_message_deflate=False,
        limit_concurrency=CONNECTIONS,
        timeout_graceful_shutdown=1,
    )
    server = uvicorn.Server(settings)
    thread = threading.Thread(target=server.run, kwargs={"sockets": [listening]}, daemon=True)
    thread.start()
    named = f"[{place.host}]" if ":" in place.host else place.host
    query = f"/?{urlencode({'token': token})}" if token else ""
    try:
        yield f"http://{named}:{port}{query}"
    finally:
        # What was under way is given up: nobody waits for it any more.
        logging.getLogger("uvicorn.error").setLevel(logging.CRITICAL)
        server.should_exit = True
        thread.join(timeout=PATIENCE)
        listening.close()


def _listen(place: Place) -> socket.socket:
    family = socket.AF_INET6 if ":" in place.host else socket.AF_INET
    listening = socket.socket(family)
    try:
        # A server that has just ended has left the port waiting.
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listening.bind(tuple(place))
        # From here on who asks waits, and is not turned away.
        listening.listen()
    except OSError as error:
        listening.close()
        if isinstance(error, socket.gaierror):
            raise InputError(
                f"{place.host} is no address of this machine ({error.strerror}): give {HERE}, or "
                f"0.0.0.0 for all that it has."
            ) from None
        raise InputError(
            f"port {place.port} at {place.host} cannot be served on ({error.strerror}): give "
            f"another by `port`, or 0 for any that is free."
        ) from None
    return listening


def guarded(application: Application, port: int, token: str = "") -> Application:
    """Let only those ask who may.

    Parameters
    ----------
    application : ASGI application
    port : int
        That it is served on, for the name of the cookie: those of one host share them.
    token : str
        To be known; without one only a browser on this machine is answered.

    Returns
    -------
    ASGI application
        Answers 403 to the rest.
    """
    cookie = f"nearfar-{port}"

    async def guard(scope: Scope, receive: Receive, send: Send) -> None:
        headers = {name.decode("latin-1"): value for name, value in scope["headers"]}
        host = headers.get("host", b"").decode("latin-1")
        origin = headers.get("origin", b"").decode("latin-1")
        allowed = token or _hostname(host) in LOCAL
        # What a page elsewhere embeds or asks for; a link that is clicked there is another matter.
        embedded = (
            headers.get("sec-fetch-site") == b"cross-site"
            and headers.get("sec-fetch-mode") != b"navigate"
        )
        here = {"", f"http://{host}", f"https://{host}"}
        if not allowed or embedded or origin not in here:
            await _refuse(scope, send, b"This page is for a browser on the same machine.")
        elif not token or _same(_kept(headers.get("cookie", b""), cookie), token):
            await application(scope, receive, send)
        elif scope["type"] == "http" and _same(_asked(scope), token):
            # From here on the cookie tells, and the token is in no address that is passed on.
            kept = f"{cookie}={token}; HttpOnly; SameSite=Lax; Path=/"
            headers_back = [(b"location", b"/"), (b"set-cookie", kept.encode())]
            await _answer(send, 303, headers_back, b"")
        else:
            await _refuse(scope, send, b"Open the address that nearfar printed, token and all.")

    return guard


def _hostname(host: str) -> str:
    try:
        return urlsplit(f"//{host}").hostname or ""
    except ValueError:
        return ""


def _kept(header: bytes, name: str) -> str:
    # By hand: other applications on the host may have set what a strict parser stumbles over.
    for part in header.decode("latin-1").split(";"):
        given, _, value = part.strip().partition("=")
        if given == name:
            return value
    return ""


def _asked(scope: Scope) -> str:
    query: str = scope["query_string"].decode("latin-1")
    return parse_qs(query).get("token", [""])[0]


def _same(given: str, token: str) -> bool:
    return hmac.compare_digest(given.encode(), token.encode())


async def _refuse(scope: Scope, send: Send, why: bytes) -> None:
    if scope["type"] == "websocket":
        # Before it is accepted, closing it is the answer 403.
        await send({"type": "websocket.close", "code": 1008})
    else:
        await _answer(send, 403, [(b"content-type", b"text/plain; charset=utf-8")], why)


async def _answer(send: Send, status: int, headers: list[tuple[bytes, bytes]], body: bytes) -> None:
    await send({"type": "http.response.start", "status": status, "headers": headers})
    await send({"type": "http.response.body", "body": body})
