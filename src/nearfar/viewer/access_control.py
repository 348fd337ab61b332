"""Who may use a server: browsers on this machine, or whoever has its token.

Without a token, a web page from elsewhere is refused by the host name and the origin that the
browser sends with its requests (DNS rebinding and cross-site requests).
"""

import hmac
from collections.abc import Awaitable, Callable, MutableMapping
from typing import Any
from urllib.parse import parse_qs, urlsplit

# Names that a browser on this machine may use for it.
LOOPBACK_HOSTS = ("127.0.0.1", "localhost", "::1")

Scope = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[Any]]
Send = Callable[[Any], Awaitable[None]]
Application = Callable[[Scope, Receive, Send], Awaitable[None]]


def with_access_control(application: Application, port: int, token: str = "") -> Application:
    """Pass on only the requests of those who may use an application.

    A first request with the token in its query is redirected to the same page without it, and
    gets a cookie that later requests are recognised by.

    Parameters
    ----------
    application : ASGI application
    port : int
        The port it is served on: part of the cookie's name, because a browser sends cookies to
        all ports of a host.
    token : str
        Without a token, requests must come from this machine.

    Returns
    -------
    ASGI application
        Responds with status 403 to all others.
    """
    cookie = f"nearfar-{port}"

    async def guard(scope: Scope, receive: Receive, send: Send) -> None:
        headers = {name.decode("latin-1"): value for name, value in scope["headers"]}
        host = headers.get("host", b"").decode("latin-1")
        origin = headers.get("origin", b"").decode("latin-1")
        is_allowed_host = token or _hostname(host) in LOOPBACK_HOSTS
        # A link on another site may open the page; another site may not embed or fetch it.
        is_cross_site = (
            headers.get("sec-fetch-site") == b"cross-site"
            and headers.get("sec-fetch-mode") != b"navigate"
        )
        own_origins = {"", f"http://{host}", f"https://{host}"}
        if not is_allowed_host or is_cross_site or origin not in own_origins:
            await _refuse(scope, send, b"This page is for a browser on the same machine.")
        elif not token or _is_token(_cookie_value(headers.get("cookie", b""), cookie), token):
            await application(scope, receive, send)
        elif scope["type"] == "http" and _is_token(_query_token(scope), token):
            # The redirect keeps the token out of addresses that users share.
            value = f"{cookie}={token}; HttpOnly; SameSite=Lax; Path=/"
            redirect = [(b"location", b"/"), (b"set-cookie", value.encode())]
            await _respond(send, 303, redirect, b"")
        else:
            await _refuse(scope, send, b"Open the address that nearfar printed, token and all.")

    return guard


def _hostname(host: str) -> str:
    try:
        return urlsplit(f"//{host}").hostname or ""
    except ValueError:
        return ""


def _cookie_value(header: bytes, name: str) -> str:
    # http.cookies drops all cookies if another application has set one that it cannot parse.
    for part in header.decode("latin-1").split(";"):
        given, _, value = part.strip().partition("=")
        if given == name:
            return value
    return ""


def _query_token(scope: Scope) -> str:
    query: str = scope["query_string"].decode("latin-1")
    return parse_qs(query).get("token", [""])[0]


def _is_token(given: str, token: str) -> bool:
    return hmac.compare_digest(given.encode(), token.encode())


async def _refuse(scope: Scope, send: Send, reason: bytes) -> None:
    if scope["type"] == "websocket":
        # Closing a socket before it is accepted makes the server respond with status 403.
        await send({"type": "websocket.close", "code": 1008})
    else:
        await _respond(send, 403, [(b"content-type", b"text/plain; charset=utf-8")], reason)


async def _respond(
    send: Send, status: int, headers: list[tuple[bytes, bytes]], body: bytes
) -> None:
    await send({"type": "http.response.start", "status": status, "headers": headers})
    await send({"type": "http.response.body", "body": body})
