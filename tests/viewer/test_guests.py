"""Misuse of the viewer's server: hostile requests are refused, and the server goes on."""

import json
import shutil
import struct
import time
import urllib.error
import urllib.request
from contextlib import ExitStack
from socket import create_connection

import numpy as np
import pytest
import websockets.exceptions

from nearfar.viewer import application, interactive, uploads
from nearfar.viewer.interactive import InteractiveTransport
from nearfar.viewer.server import ListeningAddress
from tests.viewer.asking import PROJECTOR, ask, message, refused, relit, socket_of
from tests.viewer.conftest import served_view
from tests.waiting import LONGEST_WAIT, wait_until


@pytest.mark.parametrize(
    "sent",
    [
        b"",
        b"\xff\xff\xff\xff",
        b"\x04\0\0\0null",
        struct.pack("<I", 40) + b"{" * 40,
        "text where a light was to be",
        message(np.ones((3, 4))),
        message(np.ones((3, 4)), shape=[20, 24, 1]),
        message(np.ones(PROJECTOR), number=-1),
        message(np.ones(PROJECTOR), gains={"direct": 1e9}),
        message(np.ones(PROJECTOR), colour=[2, 0, 0]),
        message(np.ones(PROJECTOR), colour=["NaN", 0, 0]),
        message(np.ones(PROJECTOR), evil=True),
        message(np.ones(PROJECTOR))[:-1],
        message(np.ones(PROJECTOR)) + b"more",
    ],
)
def test_messages_that_are_no_light_are_refused(address, lights, sent):
    with socket_of(address) as socket:
        socket.send(sent)
        with pytest.raises(websockets.exceptions.ConnectionClosedError) as closed:
            socket.recv(timeout=LONGEST_WAIT)
    assert closed.value.rcvd.code == 1008
    assert closed.value.rcvd.reason
    relit(address, lights["spot"])


def test_messages_that_are_too_large_are_refused(address, lights):
    closed = pytest.raises(websockets.exceptions.ConnectionClosedError)
    with socket_of(address) as socket, closed as gone:
        socket.send(bytes(10**6))
        socket.recv(timeout=LONGEST_WAIT)
    # The server does not wait for the rest, so its reason may be lost on the way.
    assert gone.value.rcvd is None or gone.value.rcvd.code == 1009
    status, said = refused(address, "/picture.exr", bytes(10**6))
    assert status == 400
    assert "send a smaller file" in said
    relit(address, lights["spot"])


def _is_refused(socket):
    try:
        socket.recv(timeout=0.01)
    except websockets.exceptions.ConnectionClosed as gone:
        assert gone.rcvd.code == 1013
        assert "close one of them" in gone.rcvd.reason
        return True
    except TimeoutError:
        return False
    return False


def test_hundreds_of_sockets_are_refused_and_the_first_go_on(serve_it, lights):
    address = serve_it()
    with ExitStack() as stack:
        first = stack.enter_context(socket_of(address))
        first.send(message(lights["spot"]))
        first.recv(timeout=LONGEST_WAIT)
        others = []
        for _ in range(300):
            socket = stack.enter_context(socket_of(address))
            if not _is_refused(socket):
                others.append(socket)

        def most_are_refused():
            # On a busy machine a refusal comes late.
            others[:] = [socket for socket in others if not _is_refused(socket)]
            return len(others) <= 2 * application.MAXIMUM_SESSIONS

        wait_until(most_are_refused)
        first.send(message(lights["random"]))
        first.recv(timeout=LONGEST_WAIT)
    # Those that went made room.
    relit(address, lights["spot"])


def _opened(stack, address, said):
    place = ("127.0.0.1", int(address.rsplit(":", 1)[1]))
    opened = stack.enter_context(create_connection(place, timeout=LONGEST_WAIT))
    opened.sendall(said.encode())
    return opened


def test_hundreds_of_connections_that_say_nothing_or_do_not_end_keep_nobody_out(serve_it, lights):
    address = serve_it()
    head = f"POST /light.png HTTP/1.1\r\nHost: {address[7:]}\r\nContent-Length: 99\r\n"
    with socket_of(address) as first:
        for said in ("", "GET / HTTP/1.1\r\nHost:", head, head + "\r\n{"):
            with ExitStack() as stack:
                for _ in range(600):
                    _opened(stack, address, said)
                # Until those that are too many are given up.
                time.sleep(1)
                relit(address, lights["spot"])
                assert ask(address, "/main.js")
                first.send(message(lights["random"]))
                first.recv(timeout=LONGEST_WAIT)


def test_an_upload_that_takes_too_long_is_refused(serve_it, monkeypatch):
    monkeypatch.setattr(uploads, "UPLOAD_TIMEOUT_SECONDS", 0.3)
    address = serve_it()
    head = f"POST /light.png HTTP/1.1\r\nHost: {address[7:]}\r\nContent-Length: 99\r\n\r\n"
    with ExitStack() as stack:
        slow = _opened(stack, address, head + "{")
        answer = slow.recv(65536)
        while chunk := slow.recv(65536):
            answer += chunk
    assert b" 400 " in answer
    assert b"did not arrive within 0.3 s" in answer


def test_a_page_that_disconnects_during_an_upload_is_no_fault(serve_it, capfd):
    address = serve_it()
    head = f"POST /light.png HTTP/1.1\r\nHost: {address[7:]}\r\nContent-Length: 99\r\n\r\n"
    with ExitStack() as stack:
        _opened(stack, address, head + "{")
        time.sleep(0.3)
    assert ask(address, "/main.js")
    time.sleep(0.3)
    assert not "".join(capfd.readouterr())


@pytest.mark.parametrize(
    "path",
    [
        "/../view.py",
        "/..%2fview.py",
        "/%2e%2e/view.py",
        "/pages/view/main.js",
        "/view/main.js",
        "//etc/passwd",
        "/main.py",
        "/main.js%00.py",
        "/map/../../etc/passwd",
        "/static/..%5c..%5cx",
    ],
)
def test_there_is_nothing_but_the_page(address, path):
    status, said = refused(address, path)
    assert status in {400, 404}
    assert "import" not in said


@pytest.mark.parametrize(
    ("path", "status"),
    [
        ("/row?y=30&x=0", 400),
        ("/row?y=0&x=42", 400),
        ("/row?y=-1&x=0", 400),
        ("/row?y=a&x=0", 422),
        ("/row", 422),
        ("/column?y=20&x=0", 400),
        ("/column?y=1e3&x=0", 422),
        ("/map/none", 400),
    ],
)
def test_pixels_and_maps_that_are_not_there(address, path, status):
    assert refused(address, path)[0] == status


def test_a_page_from_elsewhere_is_kept_out(address):
    assert refused(address, "/scene", Host="evil.example")[0] == 403
    for origin in (
        "http://evil.example",
        "null",
        "http://[::1",
        "https://" + address[7:] + ".evil",
    ):
        assert refused(address, "/scene", Origin=origin)[0] == 403
    # Embedded in a page elsewhere; a link that is clicked there opens it.
    cross = {"Sec-Fetch-Site": "cross-site", "Sec-Fetch-Mode": "no-cors"}
    assert refused(address, "/map/error", **cross)[0] == 403
    assert b"nearfar view" in ask(address, "/", **{**cross, "Sec-Fetch-Mode": "navigate"})
    with pytest.raises(websockets.exceptions.InvalidStatus) as closed:
        socket_of(address, origin="http://evil.example")
    assert closed.value.response.status_code == 403
    with socket_of(address, origin=address) as socket:
        socket.close()
    policy = urllib.request.urlopen(address + "/", timeout=LONGEST_WAIT)
    with policy:
        header = policy.headers["Content-Security-Policy"]
    assert "default-src 'none'" in header
    assert "unsafe" not in header


def test_elsewhere_a_token_is_asked_for(serve_it):
    address = serve_it(ListeningAddress("0.0.0.0", 0))
    base, _, token = address.partition("/?token=")
    assert len(token) >= 40
    assert refused(base, "/scene")[0] == 403
    assert refused(base, "/?token=wrong")[0] == 403
    assert refused(base, f"/scene?token={token[:-1]}")[0] == 403
    assert refused(base, "/scene", Cookie="nearfar-1=x; =; a=\x01")[0] == 403
    with pytest.raises(websockets.exceptions.InvalidStatus):
        socket_of(base)
    jar = urllib.request.HTTPCookieProcessor()
    browser = urllib.request.build_opener(jar)
    with browser.open(address, timeout=LONGEST_WAIT) as page:
        # The token is in no address that is passed on.
        assert page.url == base + "/"
        assert b"nearfar view" in page.read()
    with browser.open(base + "/scene", timeout=LONGEST_WAIT) as scene:
        assert json.load(scene)["projector"] == list(PROJECTOR)
    (cookie,) = jar.cookiejar
    assert cookie.has_nonstandard_attr("HttpOnly")
    # Other applications on the host have cookies of their own.
    kept = f"{cookie.name}={cookie.value}"
    for header in (
        f"x; {kept}",
        f'j={{"a":1}}; {kept}',
        f"{kept}; k[0]=1",
        f"_ga=1; theme; {kept}",
    ):
        assert ask(base, "/scene", Cookie=header)
    assert refused(base, "/scene", Cookie=f"{kept}x")[0] == 403
    with socket_of(base, additional_headers={"Cookie": f"{cookie.name}={cookie.value}"}) as socket:
        socket.send(message(np.ones(PROJECTOR)))
        socket.recv(timeout=LONGEST_WAIT)


def test_damage_to_a_transport_on_display_is_reported(stored, tmp_path, monkeypatch):
    path = tmp_path / "t.zarr"
    shutil.copytree(stored, path)
    monkeypatch.setattr(interactive, "MAXIMUM_COARSE_BYTES", 60_000)
    with served_view(InteractiveTransport(path, memory=1)) as address:
        for chunk in (path / "near").glob("c*"):
            chunk.unlink()
        with socket_of(address) as socket:
            socket.send(message(np.ones(PROJECTOR)))
            socket.recv(timeout=LONGEST_WAIT)
            with pytest.raises(websockets.exceptions.ConnectionClosedError) as closed:
                socket.recv(timeout=LONGEST_WAIT)
        assert closed.value.rcvd.code == 1011
        assert "is damaged" in closed.value.rcvd.reason
        status, said = refused(address, "/row?y=1&x=1")
        assert (status, "is damaged" in said) == (400, True)
