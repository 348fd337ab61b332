"""Films for a page: it sends light after light, and gets them back as one file of exact pictures.

A page opens a socket and sends the film's header as JSON, then the first light. After each picture
the server says how many are done, and the page sends the next light; at the end the file comes. So
nothing is queued, and a page that is gone ends its film.
"""

import asyncio
import tempfile
import zipfile
from collections.abc import Awaitable, Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Annotated, Any, Literal, Protocol

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from nearfar.arrays import Floats
from nearfar.errors import InputError, NearfarError
from nearfar.files import developed, encode_png, to_srgb
from nearfar.files.video import new_film
from nearfar.packages import needed
from nearfar.viewer.interactive import GREY, InteractiveTransport
from nearfar.viewer.jobs import JobQueue
from nearfar.viewer.live import close_for
from nearfar.viewer.messages import WHITE_LEVEL, Gains, Light, Split, unpack_light
from nearfar.viewer.metering import exposure_for
from nearfar.viewer.uploads import UPLOAD_TIMEOUT_SECONDS

with needed(extra="viewer", what="a page in the browser"):
    from starlette.websockets import WebSocket, WebSocketDisconnect

MAXIMUM_PICTURES = 3600
MAXIMUM_FILM_BYTES = 2**29
MAXIMUM_NAME_CHARACTERS = 120
MAXIMUM_HEADER_CHARACTERS = 4096

Relight = Callable[[Light, Gains], Floats]


class FilmHeader(BaseModel):
    """What a page says of a film before its lights.

    Attributes
    ----------
    format : {"pictures", "mp4"}
        A ZIP of PNG pictures and their lights, or a film.
    name : str
        What the names of the pictures begin with.
    rate : float
        Pictures a second.
    count : int
        How many pictures there will be.
    split : {"model", "physical"}
        Which components the gains of the lights are of.
    metering : {"fixed", "auto"}
        Whether all pictures have one exposure, or each the one that suits it.
    exposure : float
        That of all pictures, in stops; not heeded where each has its own.
    gamma : float
    channel : int or None
        The only colour that is shown, in grey.
    """

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False, frozen=True)

    format: Literal["pictures", "mp4"]
    name: str = Field(max_length=MAXIMUM_NAME_CHARACTERS, pattern=r"^[\w.-]+$")
    rate: Annotated[float, Field(ge=1.0, le=60.0)]
    count: int = Field(ge=1, le=MAXIMUM_PICTURES)
    split: Split = "model"
    metering: Literal["fixed", "auto"] = "fixed"
    exposure: float = Field(default=0.0, ge=-6.0, le=12.0)
    gamma: float = Field(default=1.0, ge=0.5, le=3.0)
    channel: Literal[0, 1, 2] | None = None


class AddFrame(Protocol):
    """What adds a picture, 8-bit sRGB, and the light of it to a file."""

    def __call__(self, picture: NDArray[np.uint8], light: Light, /) -> None:
        """Add them."""
        ...


@contextmanager
def _zip_of_pictures(path: Path, header: FilmHeader) -> Iterator[AddFrame]:
    """Write pictures and lights as PNG files; lights are linear, of 16 bits."""
    digits = len(str(header.count - 1))
    # PNG files do not shrink.
    with zipfile.ZipFile(path, "w", zipfile.ZIP_STORED) as archive:
        count = 0

        def add(picture: NDArray[np.uint8], light: Light) -> None:
            nonlocal count
            number = f"{count:0{digits}d}"
            levels = np.rint(light.as_array() * np.float32(WHITE_LEVEL)).astype(np.uint16)
            archive.writestr(f"{header.name}-{number}.png", encode_png(picture))
            archive.writestr(f"lights/{header.name}-{number}.png", encode_png(levels))
            count += 1

        yield add


@contextmanager
def _mp4(path: Path, header: FilmHeader) -> Iterator[AddFrame]:
    with new_film(path, header.rate) as add_picture:
        yield lambda picture, _light: add_picture(picture)


_FORMATS = {"pictures": (_zip_of_pictures, ".zip"), "mp4": (_mp4, ".mp4")}


def _picture(
    transport: InteractiveTransport, relight: Relight, light: Light, gains: Gains, film: FilmHeader
) -> NDArray[np.uint8]:
    """Relight every camera pixel, and return the picture as the page shows it."""
    picture = relight(light, gains)
    colours = transport.to_colours(picture.reshape(*picture.shape[:2], -1))
    grey_or_rgb = colours[..., 0] if colours.shape[2] == GREY else colours
    exposure = exposure_for(colours) if film.metering == "auto" else film.exposure
    shown = developed(grey_or_rgb, exposure=exposure, gamma=film.gamma, channel=film.channel)
    return np.rint(255 * to_srgb(shown)).astype(np.uint8)


async def run_film(
    transport: InteractiveTransport,
    relight_by: Callable[[Split], Awaitable[Relight]],
    jobs: JobQueue,
    socket: WebSocket,
) -> None:
    """Make one film for a page, until it is done or the page disconnects.

    An error's message is sent as a fault, and closes the socket.

    Parameters
    ----------
    transport : InteractiveTransport
    relight_by : callable
        Returns what relights by a split, which is made if need be.
    jobs : JobQueue
        Relights, and writes the film.
    socket : WebSocket
        Accepted already.
    """
    try:
        header = _read_header(await _receive(socket, "text"))
        relight = await relight_by(header.split)
        write, ending = _FORMATS[header.format]
        with tempfile.TemporaryDirectory(prefix="nearfar-film-") as folder:
            path = Path(folder) / f"film{ending}"
            with write(path, header) as add:

                def add_next(message: bytes) -> None:
                    sent, light = unpack_light(message, transport.projector)
                    add(_picture(transport, relight, light, sent.gains, header), light)

                for done in range(1, header.count + 1):
                    await jobs.run(add_next, await _receive(socket, "bytes") or b"")
                    _require_room(path)
                    await socket.send_json({"done": done})
            await socket.send_bytes(await jobs.run(path.read_bytes))
        await socket.close()
    except WebSocketDisconnect:
        pass
    except NearfarError as error:
        # The reason of a closed socket has room for a few words only.
        with suppress(RuntimeError, WebSocketDisconnect):
            await socket.send_json({"fault": str(error)})
        await close_for(error, socket)


async def _receive(socket: WebSocket, kind: str) -> Any:
    """Receive a message, text or bytes; None for one of the other kind."""
    try:
        async with asyncio.timeout(UPLOAD_TIMEOUT_SECONDS):
            message = await socket.receive()
    except TimeoutError:
        raise InputError(f"no light came within {UPLOAD_TIMEOUT_SECONDS:g} s.") from None
    if message["type"] == "websocket.disconnect":
        raise WebSocketDisconnect
    return message.get(kind)


def _require_room(path: Path) -> None:
    if path.exists() and path.stat().st_size > MAXIMUM_FILM_BYTES:
        raise InputError(
            f"the film takes more than {MAXIMUM_FILM_BYTES // 2**20} MiB: make a shorter one."
        )


def _read_header(text: str | None) -> FilmHeader:
    if text is None or len(text) > MAXIMUM_HEADER_CHARACTERS:
        raise InputError("the message is no header of a film: send one first.")
    try:
        return FilmHeader.model_validate_json(text)
    except ValidationError as error:
        fault = error.errors(include_url=False, include_input=False)[0]
        where = ".".join(map(str, fault["loc"]))
        raise InputError(f"the film's header is wrong ({where}: {fault['msg']}).") from None
