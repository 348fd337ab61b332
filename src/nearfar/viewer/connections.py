"""Connections that have asked for nothing: they give way to those that may."""

import asyncio

from nearfar.packages import needed

with needed(extra="viewer", what="a page in the browser"):
    from uvicorn.protocols.http.h11_impl import H11Protocol

# Connections that wait for a request at once, of the six or so that a browser opens.
WAITING = 64


class Connection(H11Protocol):
    """A connection that is closed when `WAITING` newer ones wait for a request, as it does.

    Whoever opens many and says nothing, or never ends what it says, keeps nobody out.
    """

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Take a connection; the one that has waited longest goes, if there are too many."""
        super().connection_made(transport)
        self._waits_since = self.loop.time()
        waiting = [one for one in self.connections if isinstance(one, Connection) and one._waits]
        if len(waiting) > WAITING:
            min(waiting, key=lambda one: one._waits_since).transport.close()

    def on_response_complete(self) -> None:
        """Wait for the next request."""
        self._waits_since = self.loop.time()
        super().on_response_complete()

    @property
    def _waits(self) -> bool:
        asked = self.cycle is not None and not self.cycle.response_complete
        return not asked and not self.transport.is_closing()
