"""A light that moves: the newest is answered at once, and exactly once it rests."""

import asyncio
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import Any, TypeVar

from nearfar.errors import NearfarError
from nearfar.packages import needed
from nearfar.viewer.messages import Light, pack, unpack_light
from nearfar.viewer.viewed import Shown, ViewedTransport

with needed(extra="viewer", what="a page in the browser"):
    from starlette.websockets import WebSocket, WebSocketDisconnect

# Pieces of work that wait at once, of one kind.
MOST = 16
# Seconds after which a light counts as at rest.
REST = 0.12

R = TypeVar("R")


@dataclass
class Newest:
    """The newest light of one page, and whether it was answered."""

    waiting: asyncio.Event = field(default_factory=asyncio.Event)
    number: int = 0
    light: Light | None = None


class BusyError(NearfarError):
    """More is asked for at once than is answered."""


class Work:
    """One piece of work at a time, in a thread of its own; those asked for meanwhile wait."""

    def __init__(self) -> None:
        self._thread = ThreadPoolExecutor(max_workers=1)
        self._waiting = 0

    async def do(self, work: Callable[..., R], *given: Any) -> R:
        """Do it once what is under way is done, whoever gave that up.

        Raises
        ------
        BusyError
            If too much waits already.
        """
        if self._waiting >= MOST:
            raise BusyError("too much is asked for at once: wait a moment, and ask again.")
        self._waiting += 1
        try:
            return await asyncio.get_running_loop().run_in_executor(self._thread, work, *given)
        finally:
            self._waiting -= 1


async def take_lights(viewed: ViewedTransport, newest: Newest, socket: WebSocket) -> None:
    """Take in the lights of a page, the newest in place of those before."""
    while True:
        message = await socket.receive()
        if message["type"] == "websocket.disconnect":
            raise WebSocketDisconnect
        words, light = unpack_light(message.get("bytes") or b"", viewed.projector)
        newest.number, newest.light = words.number, light
        newest.waiting.set()


def _packed(number: int, shown: Shown, *, exact: bool) -> bytes:
    words = {"number": number, "exact": exact, "step": shown.step, "scale": shown.scale}
    return pack(words, shown.parts)


async def answer_lights(
    viewed: ViewedTransport, work: Work, newest: Newest, socket: WebSocket
) -> None:
    """Answer the newest light at once, and exactly once it rests."""
    while True:
        await newest.waiting.wait()
        newest.waiting.clear()
        number, light = newest.number, newest.light
        assert light is not None
        shown = await work.do(viewed.at_once, light)
        await socket.send_bytes(_packed(number, shown, exact=viewed.is_quick))
        if viewed.is_quick or await _moves_on(newest, REST):
            continue
        steps = viewed.at_rest(light)
        while not newest.waiting.is_set():
            try:
                exact = await work.do(_next, steps)
            except _EndedError:
                break
            if exact is not None:
                await socket.send_bytes(_packed(number, exact, exact=True))


class _EndedError(Exception):
    """There is nothing more; StopIteration does not come out of a thread."""


def _next(steps: Iterator[R]) -> R:
    for step in steps:
        return step
    raise _EndedError


async def _moves_on(newest: Newest, seconds: float) -> bool:
    try:
        await asyncio.wait_for(newest.waiting.wait(), seconds)
    except TimeoutError:
        return False
    return True
