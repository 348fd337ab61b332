"""HTTP connections that the server waits for: beyond a number of them, some are closed.

A server waits for a connection that has sent no request yet, or part of one, for a client that
does not read its response, and for the next request of a connection that was answered. The last
are closed first, then the others; of each, those that have waited longest.
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
    """A connection that may be closed once more than `MAXIMUM_WAITING_CONNECTIONS` wait.

    So no client can keep others out by opening many connections and sending nothing, sending
    requests without an end, or not reading the responses.
    """

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Accept the connection, and soon close those that are too many."""
        super().connection_made(transport)
        self._waiting_since = self.loop.time()
        self._had_time = False
        self.loop.call_later(REQUEST_SECONDS, self._expect_request)

    def _expect_request(self) -> None:
        # By now the loop has read what had arrived when the connection was accepted.
        self._had_time = True
        self._close_too_many()

    def on_response_complete(self) -> None:
        """Wait for the client to read the response, and for its next request."""
        self._waiting_since = self.loop.time()
        super().on_response_complete()

    @property
    def _is_waiting(self) -> bool:
        has_request = self.cycle is not None and not self.cycle.more_body
        return not has_request or self.cycle.response_complete or self.flow.write_paused

    @property
    def _is_answered(self) -> bool:
        """Whether nothing but the client's next request is waited for."""
        answered = self.cycle is not None and self.cycle.response_complete
        return answered and not self.transport.get_write_buffer_size()

    def _close_too_many(self) -> None:
        waiting = [
            connection
            for connection in self.connections
            if isinstance(connection, Connection)
            and connection._had_time
            and connection._is_waiting
        ]
        # A client whose request is on its way loses more than one that has its answer.
        waiting.sort(key=lambda other: (not other._is_answered, other._waiting_since))
        for connection in waiting[:-MAXIMUM_WAITING_CONNECTIONS]:
            connection.transport.abort()
