"""Connections to a server of pages: nobody who asks is kept out, whatever others do."""

import socket
import time
import urllib.request
from contextlib import ExitStack, suppress

import pytest

from nearfar.viewer import server
from nearfar.viewer.connections import MAXIMUM_WAITING_CONNECTIONS as WAITING
from nearfar.viewer.server import ListeningAddress, serve
from tests.waiting import LONGEST_WAIT, wait_until

# More than the system keeps for who does not read, where it keeps so little.
LONG, KEPT = 300_000, 2048
MANY = 600


async def _answer(scope, receive, send):
    body = bytes(LONG) if scope["path"] == "/long" else b"here"
    await send({"type": "http.response.start", "status": 200, "headers": []})
    await send({"type": "http.response.body", "body": body})


@pytest.fixture
def address():
    with serve(_answer, ListeningAddress("127.0.0.1", 0)) as address:
        yield address


def _opened(address, **settings):
    opened = socket.socket()
    for name, value in settings.items():
        opened.setsockopt(socket.SOL_SOCKET, getattr(socket, name), value)
    opened.settimeout(LONGEST_WAIT)
    opened.connect(("127.0.0.1", int(address.rsplit(":", 1)[1])))
    return opened


def _asking(address, path, **settings):
    """A connection that has asked and not read."""
    opened = _opened(address, **settings)
    opened.sendall(f"GET {path} HTTP/1.1\r\nHost: {address[7:]}\r\n\r\n".encode())
    return opened


def _is_answered(address):
    # Until those that are too many are given up, the server is busy.
    with suppress(OSError), urllib.request.urlopen(address, timeout=LONGEST_WAIT) as answer:
        return answer.read() == b"here"
    return False


def test_all_who_ask_at_once_are_answered(address):
    with ExitStack() as stack:
        asking = [stack.enter_context(_asking(address, "/")) for _ in range(4 * WAITING)]
        for one in asking:
            assert b" 200 " in one.recv(4096)


@pytest.fixture
def keeping_little(monkeypatch):
    """The system keeps little of what a server sends."""

    def listen(listening):
        listener = listen_as_it_does(listening)
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, KEPT)
        return listener

    listen_as_it_does = server._listen
    monkeypatch.setattr(server, "_listen", listen)


@pytest.mark.parametrize("times", [1, 3])
def test_those_who_do_not_read_their_answers_keep_nobody_out(keeping_little, address, times):
    asked = f"GET /long HTTP/1.1\r\nHost: {address[7:]}\r\n\r\n".encode()
    with ExitStack() as stack:
        for _ in range(2):
            for _ in range(MANY):
                one = stack.enter_context(_asking(address, "/long", SO_RCVBUF=KEPT))
                for _ in range(times - 1):
                    # Of so many at once some are turned away.
                    with suppress(ConnectionError):
                        one.sendall(asked)
            wait_until(lambda: _is_answered(address))
        # Longer than connections are kept that ask nothing more.
        time.sleep(6)
        assert _is_answered(address)


def _is_closed(connection):
    connection.setblocking(False)
    try:
        return connection.recv(4096) == b""
    except BlockingIOError:
        return False
    except ConnectionResetError:
        return True


def test_the_newest_of_those_that_wait_are_kept(address):
    with ExitStack() as stack:
        asking = []
        for _ in range(2 * WAITING):
            asking.append(stack.enter_context(_asking(address, "/")))
            assert b" 200 " in asking[-1].recv(4096)
        stack.enter_context(_asking(address, "/"))
        first, last = asking[: WAITING + 1], asking[WAITING + 1 :]
        wait_until(lambda: all(map(_is_closed, first)))
        assert not any(map(_is_closed, last))


def test_a_request_on_its_way_outlives_answered_connections(address):
    with ExitStack() as stack:
        silent = stack.enter_context(_opened(address))
        asking = [stack.enter_context(_asking(address, "/")) for _ in range(2 * WAITING)]
        wait_until(lambda: sum(map(_is_closed, asking)) > WAITING)
        silent.sendall(f"GET / HTTP/1.1\r\nHost: {address[7:]}\r\n\r\n".encode())
        assert b" 200 " in silent.recv(4096)
