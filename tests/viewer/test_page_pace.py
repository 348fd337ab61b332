"""The viewer's page in a browser: pictures come as well as time allows, and lights never queue."""

import json
import time

import pytest

from nearfar.viewer.interactive import InteractiveTransport
from tests.viewer.asking import CAMERA
from tests.viewer.browsing import drag, pictures, settled
from tests.waiting import wait_until

pytestmark = pytest.mark.slow

# The page draws slowly, as one whose machine is busy.
BUSY = """
    const draw = CanvasRenderingContext2D.prototype.putImageData;
    CanvasRenderingContext2D.prototype.putImageData = function (...given) {
      const end = performance.now() + 1.2 * this.canvas.width;
      while (performance.now() < end) {}
      draw.apply(this, given);
    };
"""


def _columns(page):
    return page.evaluate("document.getElementById('picture').width")


def test_pictures_are_coarser_where_the_page_is_late_and_whole_at_rest(open_page, address):
    # Four pictures of 42 columns take 200 ms.
    page = open_page(address, script=BUSY)
    page.click("#play")
    wait_until(lambda: _columns(page) < CAMERA.width)
    # Said of three pictures within a second, which may take some seconds to come.
    wait_until(lambda: "ms after the light" in page.inner_text("#frame-status"))
    # Another page is not late: its pictures are whole while they play, and not for the rest alone.
    other = open_page(address)
    other.click("#play")
    count = pictures(other)["count"]
    wait_until(lambda: pictures(other)["count"] > count and _columns(other) == CAMERA.width)
    for one in (other, page):
        one.click("#play")
        settled(one)
        assert _columns(one) == CAMERA.width


def _number(message):
    """Return the number of a light or of a frame."""
    length = int.from_bytes(message[:4], "little")
    return json.loads(message[4 : 4 + length])["number"]


def test_lights_never_queue_before_a_slow_server(open_page, serve_it, monkeypatch):
    relight_coarsely = InteractiveTransport.relight_coarsely

    def slowly(self, *given):
        time.sleep(0.1)
        return relight_coarsely(self, *given)

    monkeypatch.setattr(InteractiveTransport, "relight_coarsely", slowly)
    page = open_page(serve_it())
    sent, received, waiting = [], [0], []

    def on_sent(message):
        sent.append(_number(message))
        waiting.append(sent[-1] - received[-1])

    def listen(socket):
        socket.on("framesent", on_sent)
        socket.on("framereceived", lambda message: received.append(_number(message)))

    page.on("websocket", listen)
    page.reload()
    settled(page)
    for _ in range(3):
        drag(page, (3, 3), (15, 20), (3, 20), (15, 3))
    assert len(sent) > 3
    assert max(waiting) <= 3
    # The picture of the newest light is there, whatever came before it.
    assert received[-1] == sent[-1]
