"""The files that the pages in the browser are made of, and the headers they are served with."""

from importlib.resources import files
from typing import Any, NamedTuple

from nearfar.errors import MissingFileError
from nearfar.report.page import STYLE
from nearfar.viewer.access_control import Application, Receive, Scope, Send

MEDIA_TYPES = {".html": "text/html", ".css": "text/css", ".js": "text/javascript"}
# Scripts, styles and requests are those of this server alone, whatever a dropped file contains.
CONTENT_SECURITY_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; "
    "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
SECURITY_HEADERS = {
    "Content-Security-Policy": CONTENT_SECURITY_POLICY,
    "X-Content-Type-Options": "nosniff",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "Cache-Control": "no-store",
}


class Asset(NamedTuple):
    """One file of a page.

    Attributes
    ----------
    content : bytes
    media_type : str
        For the response's Content-Type.
    """

    content: bytes
    media_type: str


def read_page(page: str) -> dict[str, Asset]:
    """Read all files of a page into memory, so that requests never reach the disk.

    Parameters
    ----------
    page : {"view", "preview"}

    Returns
    -------
    dict of str to Asset
        By file name. ``style.css`` begins with the style of reports.

    Raises
    ------
    MissingFileError
        If the package was installed without the page.
    """
    folder = files("nearfar.viewer") / "pages" / page
    assets = {}
    for file in folder.iterdir() if folder.is_dir() else ():
        media_type = MEDIA_TYPES.get(file.name[file.name.rfind(".") :])
        if media_type is not None:
            text = file.read_text(encoding="utf-8")
            text = STYLE + text if file.name == "style.css" else text
            assets[file.name] = Asset(text.encode(), f"{media_type}; charset=utf-8")
    if "index.html" not in assets:
        raise MissingFileError(f"{folder} has no page: install nearfar again.")
    return assets


def with_security_headers(application: Application) -> Application:
    """Add `SECURITY_HEADERS` to each response of an ASGI application.

    Requests pass through as they are, so that handlers are told of clients that are gone.
    """
    headers = [(name.lower().encode(), value.encode()) for name, value in SECURITY_HEADERS.items()]

    async def secured(scope: Scope, receive: Receive, send: Send) -> None:
        async def send_secured(message: dict[str, Any]) -> None:
            if message["type"] == "http.response.start":
                message = {**message, "headers": [*message.get("headers", ()), *headers]}
            await send(message)

        await application(scope, receive, send_secured)

    return secured
