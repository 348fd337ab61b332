"""``nearfar view``: a transport under any light, in the browser."""

import asyncio
import threading
from collections.abc import Awaitable, Callable
from contextlib import suppress
from functools import partial
from typing import Any

import numpy as np

from nearfar.arrays import Size
from nearfar.errors import InputError, NearfarError
from nearfar.files import encode_png
from nearfar.packages import needed
from nearfar.report.maps import maps_of
from nearfar.viewer.decoding import LARGEST
from nearfar.viewer.following import BusyError, Newest, Work, answer_lights, take_lights
from nearfar.viewer.messages import WHITE, largest_light, unpack_light
from nearfar.viewer.payloads import (
    READERS,
    answer_column,
    answer_exr,
    answer_map,
    answer_row,
    read_asset,
    tell_scene,
)
from nearfar.viewer.serving import Place, serve
from nearfar.viewer.viewed import ViewedTransport

with needed(extra="viewer", what="a page in the browser"):
    from fastapi import FastAPI, Request, WebSocket
    from fastapi.responses import JSONResponse, Response
    from starlette.requests import ClientDisconnect
    from starlette.websockets import WebSocketDisconnect

# Seconds in which what a page sends is here.
SENDING = 60.0
# Pages that may be open at once.
PAGES = 8
# Bytes of the reason for which a socket is closed, of the 123 that there may be.
LONGEST = 120
# What the page is made of; nothing else is read from the disk for it.
ASSETS = {
    "index.html": "text/html",
    "style.css": "text/css",
    "main.js": "text/javascript",
    "state.js": "text/javascript",
    "light.js": "text/javascript",
    "link.js": "text/javascript",
    "picture.js": "text/javascript",
    "plots.js": "text/javascript",
}
# Nothing from elsewhere is loaded, run or told, whatever a file that is dropped holds.
POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; "
    "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)


def run_view(
    viewed: ViewedTransport,
    place: Place,
    started: Callable[[str], None],
    ended: threading.Event | None = None,
) -> None:
    """Serve the page of a transport until an interrupt, or `ended`.

    Parameters
    ----------
    viewed : ViewedTransport
    place : Place
    started : callable
        Called with the address to open.
    ended : Event, optional
        Ends it.

    Raises
    ------
    MissingPackageError, InputError
        As `nearfar.viewer.serving.serve`.
    """
    over = ended or threading.Event()
    largest = largest_light(viewed.projector)
    with serve(application(viewed), place, largest=largest) as address:
        started(address)
        try:
            over.wait()
        finally:
            viewed.give_up()


class Desk:
    """What a page may ask of a transport; each method answers one kind of question."""

    def __init__(self, viewed: ViewedTransport) -> None:
        self._viewed = viewed
        # Lights go on moving while pixels are looked at, both while a map or a whole picture is
        # computed, and all of it while a file is read.
        self._lights, self._pixels, self._wholes, self._files = Work(), Work(), Work(), Work()
        self._maps = maps_of(viewed.quick)
        self._mapped: dict[str, bytes] = {}
        self._assets = {name: read_asset(name) for name in ASSETS}
        self._largest = largest_light(viewed.projector)
        self._about = tell_scene(viewed, self._maps)
        self._pages = 0

    async def asset(self, name: str) -> Response:
        """Answer one of the files that the page is made of."""
        name = name or "index.html"
        if name not in self._assets:
            return Response("There is no such page.", 404, media_type="text/plain")
        return Response(self._assets[name], media_type=f"{ASSETS[name]}; charset=utf-8")

    async def scene(self) -> dict[str, Any]:
        """Tell what is shown."""
        return self._about

    async def row(self, y: int, x: int) -> Response:
        """Answer what a camera pixel sees of each projector pixel."""
        _require_within("camera", self._viewed.stored.camera, y, x)
        return _packed(await self._pixels.do(answer_row, self._viewed, y, x))

    async def column(self, y: int, x: int) -> Response:
        """Answer what a projector pixel lights."""
        _require_within("projector", self._viewed.projector, y, x)
        return _packed(await self._pixels.do(answer_column, self._viewed, y, x))

    async def map(self, name: str) -> Response:
        """Answer a map."""
        if name not in self._mapped:
            self._mapped[name] = await self._wholes.do(answer_map, self._maps, name)
        return _packed(self._mapped[name])

    async def picture(self, request: Request) -> Response:
        """Answer the picture under a light, every camera pixel of it, as OpenEXR."""
        words, light = unpack_light(await _body(request, self._largest), self._viewed.projector)
        return _packed(
            await self._wholes.do(answer_exr, self._viewed, light, words.gains), "image/x-exr"
        )

    async def light(self, request: Request) -> Response:
        """Answer a light as a PNG of 16 bits, which ``nearfar relight`` reads as it is."""
        _, light = unpack_light(await _body(request, self._largest), self._viewed.projector)
        levels = np.rint(light.whole() * np.float32(WHITE)).astype(np.uint16)
        return _packed(await self._pixels.do(encode_png, levels), "image/png")

    async def read(self, kind: str, request: Request, name: str = "") -> Response:
        """Read a light or a photo that a browser cannot."""
        if kind not in READERS:
            raise InputError(f"there is nothing to read as {kind!r}: send a light or a photo.")
        data = await _body(request, LARGEST)
        return _packed(await self._files.do(READERS[kind], self._viewed, data, name[:255]))

    async def relight(self, socket: WebSocket) -> None:
        """Answer each light that a page sends by the picture under it."""
        await socket.accept()
        if self._pages >= PAGES:
            await socket.close(1013, f"{PAGES} pages are open: close one of them.")
            return
        self._pages += 1
        newest = Newest()
        both = [
            asyncio.create_task(take_lights(self._viewed, newest, socket)),
            asyncio.create_task(answer_lights(self._viewed, self._lights, newest, socket)),
        ]
        try:
            done, _ = await asyncio.wait(both, return_when=asyncio.FIRST_COMPLETED)
            for task in done:
                task.result()
        except WebSocketDisconnect:
            pass
        except NearfarError as error:
            # 1008: what was sent is not what it should be; 1011: the server's own trouble.
            code = 1008 if isinstance(error, InputError) else 1011
            with suppress(RuntimeError, WebSocketDisconnect):
                await socket.close(code, str(error).encode()[:LONGEST].decode(errors="ignore"))
        finally:
            for task in both:
                task.cancel()
            await asyncio.gather(*both, return_exceptions=True)
            self._pages -= 1


def application(viewed: ViewedTransport) -> FastAPI:
    """Return the ASGI application of a transport's page."""
    desk = Desk(viewed)
    served = FastAPI(docs_url=None, redoc_url=None, openapi_url=None)
    served.exception_handler(NearfarError)(_told)
    served.middleware("http")(_careful)
    # No model of what is answered is made: it is bytes.
    for path, answer in (
        ("/scene", desk.scene),
        ("/row", desk.row),
        ("/column", desk.column),
        ("/map/{name}", desk.map),
        ("/{name}", desk.asset),
    ):
        served.get(path, response_model=None)(answer)
    served.get("/", response_model=None)(partial(desk.asset, "index.html"))
    for path, take in (
        ("/picture.exr", desk.picture),
        ("/light.png", desk.light),
        ("/read/{kind}", desk.read),
    ):
        served.post(path, response_model=None)(take)
    served.websocket("/relight")(desk.relight)
    return served


async def _told(_request: Request, error: Exception) -> Response:
    return JSONResponse({"fault": str(error)}, 503 if isinstance(error, BusyError) else 400)


async def _careful(request: Request, answer: Callable[[Request], Awaitable[Response]]) -> Response:
    response = await answer(request)
    response.headers["Content-Security-Policy"] = POLICY
    response.headers["X-Content-Type-Options"] = "nosniff"
    response.headers["Cross-Origin-Resource-Policy"] = "same-origin"
    response.headers["Referrer-Policy"] = "no-referrer"
    response.headers["Cache-Control"] = "no-store"
    return response


def _packed(data: bytes, kind: str = "application/octet-stream") -> Response:
    return Response(data, media_type=kind)


def _require_within(what: str, size: Size, y: int, x: int) -> None:
    if not (0 <= y < size.height and 0 <= x < size.width):
        raise InputError(f"({y}, {x}) is no pixel of the {what} of {size}: choose one that is.")


async def _body(request: Request, most: int) -> bytes:
    """Read what is sent, but no more than so many bytes, and within `SENDING`."""
    parts, size = [], 0
    try:
        async with asyncio.timeout(SENDING):
            async for part in request.stream():
                size += len(part)
                if size > most:
                    raise InputError(f"more than {most} bytes were sent: send a smaller file.")
                parts.append(part)
    except TimeoutError:
        raise InputError(f"it did not arrive within {SENDING:g} s: send it again.") from None
    except ClientDisconnect:
        raise InputError("the page went before it had sent all: send it again.") from None
    return b"".join(parts)
