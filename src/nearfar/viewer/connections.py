"""Connections that are waited for, for a request, its rest or a reader: the oldest give way."""

import asyncio

from nearfar.packages import needed

with needed(extra="viewer", what="a page in the browser"):
    from uvicorn.protocols.http.h11_impl import H11Protocol

# Connections that are waited for at once, of the six or so that a browser opens.
WAITING = 64
# Seconds in which what was sent with a connection is read.
READING = 0.1


class Connection(H11Protocol):
    """A connection that is given up when `WAITING` newer ones are waited for, as it is.

    Whoever opens many and says nothing, never ends what it says, or does not read what it is
    answered keeps nobody out.
    """

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Take a connection, and soon give up those that are too many."""
        super().connection_made(transport)
        self._waits_since = self.loop.time()
        # What it asks may lie there already: it is read before this is called.
        self.loop.call_later(READING, self._make_room)

    def on_response_complete(self) -> None:
        """Wait for the answer to be read, and for the next request."""
        self._waits_since = self.loop.time()
        super().on_response_complete()

    @property
    def _waits(self) -> bool:
        asked = self.cycle is not None and not self.cycle.more_body
        return not asked or self.cycle.response_complete or self.flow.write_paused

    def _make_room(self) -> None:
        waiting = [one for one in self.connections if isinstance(one, Connection) and one._waits]
        waiting.sort(key=lambda one: one._waits_since)
        for one in waiting[:-WAITING]:
            one.transport.abort()
