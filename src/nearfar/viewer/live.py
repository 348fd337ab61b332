"""A live session: a page sends lights over a WebSocket, and frames of the relit scene come back.

While the light moves, only the newest light is relit, coarsely if the scene is large; once it
rests, exactly.
"""

import asyncio
import time
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, field

from nearfar.errors import InputError, NearfarError
from nearfar.packages import needed
from nearfar.parallel import single_threaded_products
from nearfar.viewer.interactive import Frame, InteractiveTransport, Relighting
from nearfar.viewer.jobs import ExhaustedError, JobQueue, next_of
from nearfar.viewer.messages import Light, Split, pack, unpack_light
from nearfar.viewer.pace import Pace
from nearfar.viewer.physical import PhysicalRelighting

with needed(extra="viewer", what="a page in the browser"):
    from starlette.websockets import WebSocket, WebSocketDisconnect

# A light that has not changed for so long is at rest; longer by what a page takes for a picture,
# which sends the next light after it.
REST_SECONDS = 0.12
LONGEST_REST_SECONDS = 1.0
# WebSocket close codes: what the page sent is wrong, or the server failed.
POLICY_VIOLATION, SERVER_ERROR = 1008, 1011
# The protocol allows a close reason of 123 bytes.
MAXIMUM_REASON_BYTES = 120


@dataclass
class _NewestLight:
    """The newest light of one page; `arrived` is set until it is taken to be relit."""

    arrived: asyncio.Event = field(default_factory=asyncio.Event)
    number: int = 0
    light: Light | None = None
    split: Split = "model"
    took: float | None = None
    level: int = 0


async def run_session(
    transport: InteractiveTransport, physical: PhysicalRelighting, jobs: JobQueue, socket: WebSocket
) -> None:
    """Send frames for the lights that a page sends, until it disconnects.

    An error closes the socket, with the error's message as the reason.

    Parameters
    ----------
    transport : InteractiveTransport
    physical : PhysicalRelighting
        Of the same transport; until it is prepared, frames are of the model's split.
    jobs : JobQueue
        Relights for all pages.
    socket : WebSocket
        Accepted already.
    """
    newest = _NewestLight()
    tasks = [
        asyncio.create_task(_receive_lights(transport, newest, socket)),
        asyncio.create_task(_send_frames(transport, physical, jobs, newest, socket)),
    ]
    try:
        done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        for task in done:
            task.result()
    except WebSocketDisconnect:
        pass
    except NearfarError as error:
        await close_for(error, socket)
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)


async def close_for(error: NearfarError, socket: WebSocket) -> None:
    """Close a page's socket, with the error's message as the reason."""
    code = POLICY_VIOLATION if isinstance(error, InputError) else SERVER_ERROR
    reason = str(error).encode()[:MAXIMUM_REASON_BYTES].decode(errors="ignore")
    with suppress(RuntimeError, WebSocketDisconnect):
        await socket.close(code, reason)


async def _receive_lights(
    transport: InteractiveTransport, newest: _NewestLight, socket: WebSocket
) -> None:
    """Receive lights; each replaces the one before, relit or not."""
    while True:
        message = await socket.receive()
        if message["type"] == "websocket.disconnect":
            raise WebSocketDisconnect
        data = message.get("bytes") or b""
        header, light = unpack_light(data, transport.projector, transport.light_block)
        newest.number, newest.light, newest.split = header.number, light, header.split
        newest.took, newest.level = header.took, header.level
        newest.arrived.set()


async def _send_frames(
    transport: InteractiveTransport,
    physical: PhysicalRelighting,
    jobs: JobQueue,
    newest: _NewestLight,
    socket: WebSocket,
) -> None:
    """Send a coarse frame of each newest light, and an exact one once it rests."""
    pace = Pace(transport.levels)
    while True:
        await newest.arrived.wait()
        newest.arrived.clear()
        number, light = newest.number, newest.light
        assert light is not None
        is_physical = newest.split == "physical" and physical.is_prepared
        relighting: Relighting = physical if is_physical else transport
        began, level = time.perf_counter(), pace.level
        took, is_of_this_level = newest.took, newest.level == level
        frame = await jobs.run(_relight_moving, relighting, light, level)
        await socket.send_bytes(_pack_frame(number, frame, level))
        if took is None or is_of_this_level:
            # The server's own time is not yet all that the page waits for.
            pace.took(max(took or 0.0, time.perf_counter() - began))
        # A page sends the light of blocks while it moves, and the whole light once it rests.
        if frame.exact or light.block > 1:
            continue
        rest = min(REST_SECONDS + (took or 0.0), LONGEST_REST_SECONDS)
        if transport.light_block == 1 and await _arrives_within(newest, rest):
            continue
        steps = relighting.relight_exactly(light)
        # Pictures are coarse where others are at work.
        step = _next_on_one_processor if level else next_of
        while not newest.arrived.is_set():
            try:
                exact = await jobs.run(step, steps)
            except ExhaustedError:
                break
            if exact is not None:
                await socket.send_bytes(_pack_frame(number, exact, level))


def _relight_moving(relighting: Relighting, light: Light, level: int) -> Frame:
    """Relight coarsely on one processor.

    Where others are at work, threads of one product wait for one another longer than they compute.
    """
    with single_threaded_products():
        return relighting.relight_coarsely(light, level)


def _next_on_one_processor(steps: Iterator[Frame | None]) -> Frame | None:
    with single_threaded_products():
        return next_of(steps)


def _pack_frame(number: int, frame: Frame, level: int) -> bytes:
    header = {name: getattr(frame, name) for name in ("exact", "stride", "scale", "split")}
    return pack({"number": number, "level": level, **header}, frame.parts)


async def _arrives_within(newest: _NewestLight, seconds: float) -> bool:
    try:
        await asyncio.wait_for(newest.arrived.wait(), seconds)
    except TimeoutError:
        return False
    return True
