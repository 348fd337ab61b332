"""HTTP connections that the server waits for: beyond a number of them, the oldest are closed.

A server waits for a connection that has sent no request yet, or part of one, and for a client that
does not read its response.
"""

import asyncio

from nearfar.packages import needed

with needed(extra="viewer", what="a page in the browser"):
    from uvicorn.protocols.http.h11_impl import H11Protocol

# A browser opens about six.
MAXIMUM_WAITING_CONNECTIONS = 64
# A request that is sent at once with the connection has been read by then.
REQUEST_SECONDS = 0.1


class Connection(H11Protocol):
    """A connection that is closed once `MAXIMUM_WAITING_CONNECTIONS` newer ones wait like it.

    So no client can keep others out by opening many connections and sending nothing, sending
    requests without an end, or not reading the responses.
    """

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Accept the connection, and soon close those that are too many."""
        super().connection_made(transport)
        self._waiting_since = self.loop.time()
        # Later, so that a request that has arrived already is read first.
        self.loop.call_later(REQUEST_SECONDS, self._close_oldest)

    def on_response_complete(self) -> None:
        """Wait for the client to read the response, and for its next request."""
        self._waiting_since = self.loop.time()
        super().on_response_complete()

    @property
    def _is_waiting(self) -> bool:
        has_request = self.cycle is not None and not self.cycle.more_body
        return not has_request or self.cycle.response_complete or self.flow.write_paused

    def _close_oldest(self) -> None:
        waiting = [
            connection
            for connection in self.connections
            if isinstance(connection, Connection) and connection._is_waiting
        ]
        waiting.sort(key=lambda connection: connection._waiting_since)
        for connection in waiting[:-MAXIMUM_WAITING_CONNECTIONS]:
            connection.transport.abort()
