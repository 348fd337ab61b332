"""The viewer's web application: its requests and their responses."""

from collections.abc import Mapping, Sequence
from functools import partial
from types import MappingProxyType
from typing import Any

import numpy as np

from nearfar.arrays import Size
from nearfar.errors import InputError, NearfarError
from nearfar.files import encode_png
from nearfar.packages import needed
from nearfar.report.maps import TITLES, Map, maps_of
from nearfar.viewer.assets import read_page, with_security_headers
from nearfar.viewer.beside import Beside
from nearfar.viewer.decoding import MAXIMUM_FILE_BYTES
from nearfar.viewer.film import Relight, run_film
from nearfar.viewer.interactive import InteractiveTransport
from nearfar.viewer.jobs import BusyError, JobQueue, next_of
from nearfar.viewer.live import run_session
from nearfar.viewer.messages import (
    WHITE_LEVEL,
    Split,
    maximum_light_bytes,
    unpack_levels,
    unpack_light,
)
from nearfar.viewer.numbers import PixelHeader, numbers_at
from nearfar.viewer.payloads import (
    FILE_READERS,
    ProjectorLink,
    describe_scene,
    encode_relit_exr,
    pack_column,
    pack_map,
    pack_row,
)
from nearfar.viewer.photo_series import PhotoSeries
from nearfar.viewer.physical import PhysicalRelighting
from nearfar.viewer.tools import tools_of
from nearfar.viewer.uploads import read_body

with needed(extra="viewer", what="a page in the browser"):
    from fastapi import FastAPI, Request, WebSocket
    from fastapi.responses import JSONResponse, Response

MAXIMUM_SESSIONS = 8
MAXIMUM_FILMS = 2
# WebSocket close code for a session too many.
TRY_AGAIN_LATER = 1013
MAXIMUM_NAME_CHARACTERS = 255
# Nobody reads the response; not of the standard, but known by this number.
CLIENT_CLOSED_REQUEST = 499


class _Handlers:
    """Handlers of the viewer's requests, one method for each path."""

    def __init__(
        self,
        transport: InteractiveTransport,
        beside: Beside | None,
        photo_maps: Mapping[str, Map],
        photo_series: PhotoSeries | None,
        projectors: Sequence[ProjectorLink],
    ) -> None:
        self._photo_series = photo_series
        self._transport, self._physical = transport, PhysicalRelighting(transport)
        # A light moves on while pixels are inspected, both while a map or an exact picture is
        # computed, and all of them while a file is decoded.
        self._relighting, self._pixels = JobQueue(), JobQueue()
        self._whole_pictures, self._files = JobQueue(), JobQueue()
        self._splitting = JobQueue()
        self._tools = tools_of(self._physical, beside)
        self._queues = {name: JobQueue() for name in self._tools}
        self._maps = {
            **maps_of(transport.coarse),
            **{name: partial(_given, found) for name, found in photo_maps.items()},
        }
        self._packed_maps: dict[str, bytes] = {}
        self._assets = read_page("view")
        self._maximum_light_bytes = maximum_light_bytes(transport.projector)
        self._maximum_picture_bytes = maximum_light_bytes(transport.stored.camera)
        titles = {**TITLES, **{name: found.title for name, found in photo_maps.items()}}
        shown = {name: titles[name] for name in self._maps}
        photos = [] if photo_series is None else photo_series.describe()
        self._scene = {**describe_scene(transport, shown, beside, projectors), "photos": photos}
        self._sessions = self._films = 0

    async def asset(self, name: str) -> Response:
        """Return a file of the page."""
        asset = self._assets.get(name)
        if asset is None:
            return Response("There is no such page.", 404, media_type="text/plain")
        return Response(asset.content, media_type=asset.media_type)

    async def scene(self) -> dict[str, Any]:
        """Return the sizes of the transport, its plan, and the maps there are."""
        return self._scene

    async def row(self, y: int, x: int) -> Response:
        """Return the row of the transport of one camera pixel."""
        _require_pixel("camera", self._transport.stored.camera, y, x)
        return _bytes_response(await self._pixels.run(pack_row, self._transport, y, x))

    async def numbers(self, request: Request) -> dict[str, Any]:
        """Return the numbers of one camera pixel under the light of the request."""
        body = await read_body(request, self._maximum_light_bytes)
        header, light = unpack_levels(PixelHeader, body, self._transport.projector)
        _require_pixel("camera", self._transport.stored.camera, header.y, header.x)
        arguments = self._transport, self._physical, header, light
        return await self._pixels.run(numbers_at, *arguments)

    async def column(self, y: int, x: int) -> Response:
        """Return the column of the transport of one projector pixel."""
        _require_pixel("projector", self._transport.projector, y, x)
        return _bytes_response(await self._pixels.run(pack_column, self._transport, y, x))

    async def map(self, name: str) -> Response:
        """Return a map; it is computed once."""
        if name not in self._packed_maps:
            self._packed_maps[name] = await self._whole_pictures.run(pack_map, self._maps, name)
        return _bytes_response(self._packed_maps[name])

    async def photo(self, number: int) -> Response:
        """Return a photo of the capture and its light."""
        if self._photo_series is None:
            raise InputError("there are no photos here: give their capture to view.")
        return _bytes_response(await self._whole_pictures.run(self._photo_series.photo, number))

    async def picture(self, request: Request) -> Response:
        """Return every camera pixel under the light of the request, as OpenEXR."""
        body = await read_body(request, self._maximum_light_bytes)
        header, light = unpack_light(body, self._transport.projector)
        relight = await self._relight_by(header.split)
        arguments = self._transport, relight, light, header.gains
        exr = await self._whole_pictures.run(encode_relit_exr, *arguments)
        return _bytes_response(exr, "image/x-exr")

    async def split(self) -> dict[str, int]:
        """Split the transport physically, once; respond when that is done."""
        return {"bodies": await self._splitting.run(self._physical.prepare)}

    async def tool(self, name: str, request: Request) -> Response:
        """Return the result of a tool for a light; it is given up once the page is gone."""
        if name not in self._tools:
            known = ", ".join(self._tools)
            raise InputError(f"there is no tool {name!r}: choose one of {known}.")
        largest = max(self._maximum_light_bytes, self._maximum_picture_bytes)
        steps = self._tools[name](self._transport, await read_body(request, largest))
        while (found := await self._queues[name].run(next_of, steps)) is None:
            if await request.is_disconnected():
                return Response(status_code=CLIENT_CLOSED_REQUEST)
        return _bytes_response(found)

    async def light(self, request: Request) -> Response:
        """Return the light of the request as a 16-bit PNG, linear, for ``nearfar relight``."""
        body = await read_body(request, self._maximum_light_bytes)
        _, light = unpack_light(body, self._transport.projector)
        levels = np.rint(light.as_array() * np.float32(WHITE_LEVEL)).astype(np.uint16)
        return _bytes_response(await self._pixels.run(encode_png, levels), "image/png")

    async def read(self, kind: str, request: Request, name: str = "") -> Response:
        """Return the pixels of an uploaded light or photo in a format that browsers lack."""
        if kind not in FILE_READERS:
            raise InputError(f"there is nothing to read as {kind!r}: send a light or a photo.")
        data = await read_body(request, MAXIMUM_FILE_BYTES)
        name = name[:MAXIMUM_NAME_CHARACTERS]
        return _bytes_response(
            await self._files.run(FILE_READERS[kind], self._transport, data, name)
        )

    async def relight(self, socket: WebSocket) -> None:
        """Run a live session, unless `MAXIMUM_SESSIONS` run already."""
        await socket.accept()
        if self._sessions >= MAXIMUM_SESSIONS:
            reason = f"{MAXIMUM_SESSIONS} pages are open: close one of them."
            await socket.close(TRY_AGAIN_LATER, reason)
            return
        self._sessions += 1
        try:
            await run_session(self._transport, self._physical, self._relighting, socket)
        finally:
            self._sessions -= 1

    async def film(self, socket: WebSocket) -> None:
        """Make a film, unless `MAXIMUM_FILMS` are made already."""
        await socket.accept()
        if self._films >= MAXIMUM_FILMS:
            await socket.close(TRY_AGAIN_LATER, f"{MAXIMUM_FILMS} films are being made: wait.")
            return
        self._films += 1
        try:
            await run_film(self._transport, self._relight_by, self._whole_pictures, socket)
        finally:
            self._films -= 1

    async def _relight_by(self, split: Split) -> Relight:
        """Return the function that relights every camera pixel; make the physical split first."""
        if split == "physical":
            await self._splitting.run(self._physical.prepare)
            return self._physical.relight
        return self._transport.relight


def application(
    transport: InteractiveTransport,
    beside: Beside | None = None,
    photo_maps: Mapping[str, Map] = MappingProxyType({}),
    photo_series: PhotoSeries | None = None,
    projectors: Sequence[ProjectorLink] = (),
) -> FastAPI:
    """Return the ASGI application of a transport's page.

    Parameters
    ----------
    transport : InteractiveTransport
    beside : Beside, optional
        What is shown beside it.
    photo_maps : mapping of str to Map, optional
        Maps by photos, as `nearfar.viewer.held_out.photo_maps` makes them.
    photo_series : PhotoSeries, optional
        Photos to compare the scene with, each under its light.
    projectors : sequence of ProjectorLink, optional
        Pages of all projectors before the camera.

    Raises
    ------
    MissingFileError
        If the package was installed without the page.
    """
    handlers = _Handlers(transport, beside, photo_maps, photo_series, projectors)
    routes = FastAPI(docs_url=None, redoc_url=None, openapi_url=None)
    routes.exception_handler(NearfarError)(_error_response)
    routes.add_middleware(with_security_headers)
    # Without a response model: the handlers return responses, not data to be validated.
    for path, get in (
        ("/scene", handlers.scene),
        ("/row", handlers.row),
        ("/column", handlers.column),
        ("/map/{name}", handlers.map),
        ("/photo/{number}", handlers.photo),
        ("/{name}", handlers.asset),
    ):
        routes.get(path, response_model=None)(get)
    routes.get("/", response_model=None)(partial(handlers.asset, "index.html"))
    for path, post in (
        ("/picture.exr", handlers.picture),
        ("/light.png", handlers.light),
        ("/split", handlers.split),
        ("/numbers", handlers.numbers),
        ("/tool/{name}", handlers.tool),
        ("/read/{kind}", handlers.read),
    ):
        routes.post(path, response_model=None)(post)
    routes.websocket("/relight")(handlers.relight)
    routes.websocket("/film")(handlers.film)
    return routes


async def _error_response(_request: Request, error: Exception) -> Response:
    return JSONResponse({"fault": str(error)}, 503 if isinstance(error, BusyError) else 400)


def _given(found: Map) -> Map:
    return found


def _bytes_response(content: bytes, media_type: str = "application/octet-stream") -> Response:
    return Response(content, media_type=media_type)


def _require_pixel(device: str, size: Size, y: int, x: int) -> None:
    if not (0 <= y < size.height and 0 <= x < size.width):
        raise InputError(f"({y}, {x}) is no pixel of the {device} of {size}: choose one that is.")
