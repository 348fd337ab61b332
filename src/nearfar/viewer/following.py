"""A light that moves: the newest is answered at once, and exactly once it rests."""

import asyncio
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any, TypeVar

from nearfar.packages import needed
from nearfar.viewer.messages import Light, pack, unpack_light
from nearfar.viewer.viewed import ViewedTransport

with needed(extra="viewer", what="a page in the browser"):
    from starlette.websockets import WebSocket, WebSocketDisconnect

# Seconds after which a light counts as at rest.
REST = 0.12

R = TypeVar("R")


@dataclass
class Newest:
    """The newest light of one page, and whether it was answered."""

    waiting: asyncio.Event = field(default_factory=asyncio.Event)
    number: int = 0
    light: Light | None = None


class Work:
    """One piece of work at a time, in a thread beside the server's."""

    def __init__(self) -> None:
        self._one = asyncio.Lock()

    async def do(self, work: Callable[..., R], *given: Any) -> R:
        """Do it once what is under way is done."""
        async with self._one:
            return await asyncio.to_thread(work, *given)


async def take_lights(viewed: ViewedTransport, newest: Newest, socket: WebSocket) -> None:
    """Take in the lights of a page, the newest in place of those before."""
    while True:
        message = await socket.receive()
        if message["type"] == "websocket.disconnect":
            raise WebSocketDisconnect
        words, light = unpack_light(message.get("bytes") or b"", viewed.projector)
        newest.number, newest.light = words.number, light
        newest.waiting.set()


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


async def _moves_on(newest: Newest, seconds: float) -> bool:
    try:
        await asyncio.wait_for(newest.waiting.wait(), seconds)
    except TimeoutError:
        return False
    return True
