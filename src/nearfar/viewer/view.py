"""``nearfar view``: a transport under any light, in the browser."""

import asyncio
import threading
from collections.abc import Awaitable, Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from functools import partial
from importlib.resources import files
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Size
from nearfar.errors import InputError, NearfarError
from nearfar.files import encode_png, from_srgb, full_scale_of
from nearfar.files.codecs import encode_exr
from nearfar.markup import SCALE
from nearfar.packages import needed
from nearfar.report.maps import Map, map_named, maps_of
from nearfar.report.page import STYLE
from nearfar.version import version
from nearfar.viewer.decoding import LARGEST, decode_apart
from nearfar.viewer.inspecting import inspect_row
from nearfar.viewer.messages import WHITE, Gains, Light, largest_light, pack, unpack_light
from nearfar.viewer.serving import Place, serve
from nearfar.viewer.viewed import ViewedTransport

with needed(extra="viewer", what="a page in the browser"):
    from fastapi import FastAPI, Request, WebSocket
    from fastapi.responses import JSONResponse, Response
    from starlette.websockets import WebSocketDisconnect

# Pages that may be open at once.
PAGES = 8
# Seconds after which a light counts as at rest.
REST = 0.12
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

R = TypeVar("R")


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
        over.wait()


@dataclass
class _Light:
    """The newest light of one page, and whether it was answered."""

    waiting: asyncio.Event = field(default_factory=asyncio.Event)
    number: int = 0
    light: Light | None = None


class _Work:
    """One piece of work at a time, in a thread beside the server's."""

    def __init__(self) -> None:
        self._one = asyncio.Lock()

    async def do(self, work: Callable[..., R], *given: Any) -> R:
        async with self._one:
            return await asyncio.to_thread(work, *given)


class Desk:
    """What a page may ask of a transport; each method answers one kind of question."""

    def __init__(self, viewed: ViewedTransport) -> None:
        self._viewed, self._work = viewed, _Work()
        self._maps = maps_of(viewed.quick)
        self._mapped: dict[str, bytes] = {}
        self._assets = {name: _asset(name) for name in ASSETS}
        self._largest = largest_light(viewed.projector)
        self._about = _about(viewed, list(self._maps))
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
        return _packed(await self._work.do(_row, self._viewed, y, x))

    async def column(self, y: int, x: int) -> Response:
        """Answer what a projector pixel lights."""
        _require_within("projector", self._viewed.projector, y, x)
        return _packed(await self._work.do(_column, self._viewed, y, x))

    async def map(self, name: str) -> Response:
        """Answer a map."""
        if name not in self._mapped:
            self._mapped[name] = await self._work.do(_map, self._maps, name)
        return _packed(self._mapped[name])

    async def picture(self, request: Request) -> Response:
        """Answer the picture under a light, every camera pixel of it, as OpenEXR."""
        words, light = unpack_light(await _body(request, self._largest), self._viewed.projector)
        return _packed(await self._work.do(_exr, self._viewed, light, words.gains), "image/x-exr")

    async def light(self, request: Request) -> Response:
        """Answer a light as a PNG of 16 bits, which ``nearfar relight`` reads as it is."""
        _, light = unpack_light(await _body(request, self._largest), self._viewed.projector)
        levels = np.rint(light.whole() * np.float32(WHITE)).astype(np.uint16)
        return _packed(await self._work.do(encode_png, levels), "image/png")

    async def read(self, kind: str, request: Request, name: str = "") -> Response:
        """Read a light or a photo that a browser cannot."""
        if kind not in _READERS:
            raise InputError(f"there is nothing to read as {kind!r}: send a light or a photo.")
        data = await _body(request, LARGEST)
        return _packed(await self._work.do(_READERS[kind], self._viewed, data, name[:255]))

    async def relight(self, socket: WebSocket) -> None:
        """Answer each light that a page sends by the picture under it."""
        await socket.accept()
        if self._pages >= PAGES:
            await socket.close(1013, f"{PAGES} pages are open: close one of them.")
            return
        self._pages += 1
        newest = _Light()
        both = [
            asyncio.create_task(_take(self._viewed, newest, socket)),
            asyncio.create_task(_answer(self._viewed, self._work, newest, socket)),
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
    return JSONResponse({"fault": str(error)}, status_code=400)


async def _careful(request: Request, answer: Callable[[Request], Awaitable[Response]]) -> Response:
    response = await answer(request)
    response.headers["Content-Security-Policy"] = POLICY
    response.headers["X-Content-Type-Options"] = "nosniff"
    response.headers["Referrer-Policy"] = "no-referrer"
    response.headers["Cache-Control"] = "no-store"
    return response


def _packed(data: bytes, kind: str = "application/octet-stream") -> Response:
    return Response(data, media_type=kind)


def _require_within(what: str, size: Size, y: int, x: int) -> None:
    if not (0 <= y < size.height and 0 <= x < size.width):
        raise InputError(f"({y}, {x}) is no pixel of the {what} of {size}: choose one that is.")


async def _body(request: Request, most: int) -> bytes:
    """Read what is sent, but no more than so many bytes."""
    parts, size = [], 0
    async for part in request.stream():
        size += len(part)
        if size > most:
            raise InputError(f"more than {most} bytes were sent: send a smaller file.")
        parts.append(part)
    return b"".join(parts)


async def _take(viewed: ViewedTransport, newest: _Light, socket: WebSocket) -> None:
    """Take in the lights of a page, the newest in place of those before."""
    while True:
        message = await socket.receive()
        if message["type"] == "websocket.disconnect":
            raise WebSocketDisconnect
        words, light = unpack_light(message.get("bytes") or b"", viewed.projector)
        newest.number, newest.light = words.number, light
        newest.waiting.set()


async def _answer(viewed: ViewedTransport, work: _Work, newest: _Light, socket: WebSocket) -> None:
    """Answer the newest light at once, and exactly once it rests."""
    while True:
        await newest.waiting.wait()
        newest.waiting.clear()
        number, light = newest.number, newest.light
        assert light is not None
        shown = await work.do(viewed.at_once, light)
        words = {"number": number, "exact": viewed.is_quick, "step": shown.step}
        await socket.send_bytes(pack(words, shown.parts))
        if viewed.is_quick or await _moves_on(newest, REST):
            continue
        steps = viewed.at_rest(light)
        while not newest.waiting.is_set():
            try:
                exact = await work.do(_next, steps)
            except _EndedError:
                break
            if exact is not None:
                words = {"number": number, "exact": True, "step": exact.step}
                await socket.send_bytes(pack(words, exact.parts))


class _EndedError(Exception):
    """There is nothing more; StopIteration does not come out of a thread."""


def _next(steps: Iterator[R]) -> R:
    for step in steps:
        return step
    raise _EndedError


async def _moves_on(newest: _Light, seconds: float) -> bool:
    try:
        await asyncio.wait_for(newest.waiting.wait(), seconds)
    except TimeoutError:
        return False
    return True


def _asset(name: str) -> bytes:
    text = (files("nearfar.viewer") / "page" / name).read_text(encoding="utf-8")
    return (STYLE + text if name == "style.css" else text).encode()


def _about(viewed: ViewedTransport, maps: list[str]) -> dict[str, Any]:
    """Tell the page what it shows."""
    stored = viewed.stored
    plan = stored.provenance.get("plan")
    return {
        "name": viewed.path.name,
        "nearfar": version(),
        "projector": list(stored.projector),
        "camera": list(stored.camera),
        "channels": stored.channels,
        "window": viewed.quick.window,
        "method": stored.provenance.get("method"),
        "plan": plan if isinstance(plan, dict) else None,
        "maps": maps,
        "scale": SCALE.tolist(),
        "step": viewed.step,
        "exact_step": viewed.shown_step,
    }


def _row(viewed: ViewedTransport, y: int, x: int) -> bytes:
    found = inspect_row(viewed.row_of_camera(y), x)
    return pack({"y": y, "x": x, **found.words}, *found[1:])


def _column(viewed: ViewedTransport, y: int, x: int) -> bytes:
    answered = viewed.quick.column(y, x).reshape(*viewed.quick.camera, -1).mean(axis=-1)
    return pack({"y": y, "x": x, "step": viewed.step}, answered.astype(np.float32))


def _map(maps: Mapping[str, Callable[[], Map]], name: str) -> bytes:
    found = map_named(maps, name)
    words = {name: getattr(found, name) for name in ("title", "unit", "low", "high")}
    return pack(words, np.asarray(found.values, dtype=np.float32))


def _exr(viewed: ViewedTransport, light: Light, gains: Gains) -> bytes:
    picture = viewed.relight(light, **gains.model_dump())
    return encode_exr(viewed.in_colours(picture.reshape(*picture.shape[:2], -1)).squeeze())


def _read_light(viewed: ViewedTransport, data: bytes, name: str) -> bytes:
    pixels = decode_apart(data, name)
    light = pixels.astype(np.float32) / np.float32(full_scale_of(pixels.dtype))
    if light.shape[:2] != viewed.projector:
        raise InputError(
            f"the light is {Size(*light.shape[:2])}, the projector {viewed.projector}: resize it."
        )
    levels = np.rint(np.clip(_coloured(light), 0, 1) * np.float32(WHITE)).astype(np.uint16)
    return pack({}, levels)


def _read_photo(viewed: ViewedTransport, data: bytes, name: str) -> bytes:
    """Read a photo to compare with, in photo units and without the black that was measured."""
    pixels = decode_apart(data, name)
    size, camera = Size(*pixels.shape[:2]), viewed.stored.camera
    if size != camera:
        raise InputError(f"the photo is {size}, the camera {camera}: take it with that camera.")
    taken = viewed.stored.provenance.get("photos")
    photo = pixels.astype(np.float32)
    if isinstance(taken, dict) and taken.get("dtype") == str(pixels.dtype):
        photo /= np.float32(taken["full_scale"])
        is_linear = True
    else:
        photo /= np.float32(full_scale_of(pixels.dtype))
        # Eight bits are a picture for looking, unless the capture's photos are such.
        is_linear = pixels.dtype != np.uint8
    if is_linear:
        step = viewed.shown_step
        black = viewed.black[::step, ::step]
        photo = _coloured(photo)[::step, ::step] - viewed.in_colours(black)
    else:
        photo = _coloured(from_srgb(photo))[:: viewed.shown_step, :: viewed.shown_step]
    return pack({}, photo.astype(np.float16))


_READERS: dict[str, Callable[[ViewedTransport, bytes, str], bytes]] = {
    "light": _read_light,
    "photo": _read_photo,
}


def _coloured(picture: NDArray[Any]) -> NDArray[Any]:
    if picture.ndim == 2:
        picture = picture[..., None]
    return np.broadcast_to(picture, (*picture.shape[:2], 3))
