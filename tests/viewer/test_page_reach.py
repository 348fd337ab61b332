"""The viewer's page in a real browser: light by how far from q it comes."""

import json
import re
import socket
import threading
import time

import numpy as np
import pytest

from nearfar.arrays import middles
from nearfar.files import from_srgb
from nearfar.viewer.interactive import InteractiveTransport
from nearfar.viewer.tools import reach
from tests.viewer.asking import CAMERA, PROJECTOR, ask, message, refused, unpack
from tests.viewer.browsing import pictures, seen, settled, slide, tone
from tests.viewer.conftest import served_view
from tests.waiting import LONGEST_WAIT, wait_until

pytestmark = pytest.mark.slow

WHITE = np.ones(PROJECTOR, np.float32)


def _masked(transport, light, allows):
    """Relight by dense rows, entry by entry: allows(distance to q) for each of them."""
    rows = transport.rows(slice(None))
    y, x = np.mgrid[: PROJECTOR.height, : PROJECTOR.width]
    q = transport.correspondence.reshape(-1, 1, 1, 2)
    distance = np.hypot(y - q[..., 0], x - q[..., 1])
    # Camera pixels without q are infinitely far from all projector pixels.
    allowed = allows(np.nan_to_num(distance, nan=np.inf)).reshape(len(rows), 1, -1)
    flat = np.atleast_3d(light).reshape(1, PROJECTOR.pixels, -1).transpose(0, 2, 1)
    return (rows * allowed * flat).sum(axis=-1).reshape(*CAMERA, 3)


def _staged(page):
    """Wait until the tool's picture is there, and nothing finer will follow."""
    wait_until(lambda: pictures(page).get("stage") is True)


RANGES = {
    "within": ({"range": "within", "reach": 2.5}, lambda r: r < 2.5),
    "ring": ({"range": "ring", "reach": 2, "broad": 3}, lambda r: (r >= 2) & (r < 5)),
    "beyond": ({"range": "beyond", "reach": 4}, lambda r: r >= 4),
}


@pytest.mark.parametrize("name", RANGES)
def test_the_scene_by_light_from_a_range_of_distances(open_page, address, transport, name):
    state, allows = RANGES[name]
    light = {"kind": "spot", "x": 9, "y": 8, "radius": 6, "colour": "#ffc080", "exposure": 1}
    page = open_page(address, {**light, **state, "tool": "reach"})
    _staged(page)
    shown = page.inner_text("#stage-label")
    assert {"within": "less than 2.5 px", "ring": "2 px to 5 px", "beyond": "4 px or more"}[
        name
    ] in shown
    sent = _light(page)
    assert np.abs(seen(page) - tone(2 * _masked(transport, sent, allows))).max() <= 1


def _light(page):
    """Return the light as it is shown, linear, to the steps of the screen."""
    return from_srgb(seen(page, "light") / np.float32(255))


def test_a_slider_and_a_strip_choose_the_distance(open_page, address, transport):
    page = open_page(address, {"kind": "white"})
    relit = seen(page)
    page.click("[data-tool=reach]")
    page.wait_for_selector("#strip figure >> nth=4")
    _staged(page)
    assert not page.is_visible("#components")
    slide(page, "reach", 6)
    _staged(page)
    wait_until(
        lambda: np.abs(seen(page) - tone(_masked(transport, WHITE, lambda r: r >= 6))).max() <= 1
    )
    shares = [
        float(text.split()[0]) for text in page.locator("#strip figcaption").all_inner_texts()
    ]
    assert sum(shares) == pytest.approx(100, abs=0.3)
    whole = transport @ WHITE
    expected = [
        _masked(transport, WHITE, lambda r, a=a, b=b: (r >= a) & (r < b)).sum() / whole.sum()
        for a, b in ((0, 1), (1, 2), (2, 4), (4, 8), (8, np.inf))
    ]
    np.testing.assert_allclose(shares[:4], 100 * np.array(expected[:4]), atol=0.1)
    # By the keyboard: a picture of the strip chooses its ring.
    page.focus("#strip figure >> nth=2 >> button")
    page.keyboard.press("Enter")
    wait_until(lambda: "2 px to 4 px" in page.inner_text("#stage-label"))
    _staged(page)
    ring = tone(_masked(transport, WHITE, lambda r: (r >= 2) & (r < 4)))
    wait_until(lambda: np.abs(seen(page) - ring).max() <= 1)
    assert page.get_attribute("#strip figure >> nth=2 >> button", "aria-pressed") == "true"
    # The address keeps it, and the relit scene is there again.
    wait_until(lambda: '"ring"' in page.evaluate("decodeURIComponent(location.hash)"))
    state = json.loads(page.evaluate("decodeURIComponent(location.hash.slice(1))"))
    chosen = [state[name] for name in ("tool", "range", "reach", "broad")]
    assert chosen == ["reach", "ring", 2, 2]
    page.click("[data-tool=relit]")
    settled(page)
    np.testing.assert_array_equal(seen(page), relit)
    assert page.inner_text("#stage-label") == "relit"
    assert page.inner_text("#strip") == ""


def test_the_line_below_follows_the_distance(open_page, address, transport):
    page = open_page(address, {"kind": "white", "tool": "reach", "reach": 2, "pixel": [12, 20]})
    whole = transport @ WHITE
    for distance in (2, 5):
        slide(page, "reach", distance)
        _staged(page)
        far = _masked(transport, WHITE, lambda r, d=distance: r >= d)[12, 20].mean()
        expected = (far, 100 * far / whole[12, 20].mean(), whole[12, 20].mean())
        told = re.compile(r"column 20: ([\d.e-]+) · ([\d.]+) % of its light, ([\d.]+)")

        def shows(expected=expected, told=told):
            # Frames have 11 bits.
            within = (1e-4, 0.1, 3e-4)
            found = told.search(page.inner_text("#readout"))
            return found and all(
                abs(float(one) - other) <= most
                for one, other, most in zip(found.groups(), expected, within, strict=True)
            )

        wait_until(shows)


# How many requests to probe are under way, how many were at most, and the body of the newest.
COUNTING = """
    const ask = fetch;
    window.probes = { count: 0, now: 0, most: 0 };
    window.fetch = async (...given) => {
      if (!String(given[0]).endsWith('tool/reach')) return ask(...given);
      probes.count += 1;
      probes.now += 1;
      probes.most = Math.max(probes.most, probes.now);
      probes.last = Array.from(new Uint8Array(await new Blob([given[1].body]).arrayBuffer()));
      try { return await ask(...given); } finally { probes.now -= 1; }
    };
"""


def test_a_moving_slider_leaves_no_backlog(open_page, address):
    """However often it moves, one request is under way, and the last of them is of its end."""
    page = open_page(address, {"kind": "white", "tool": "reach"}, script=COUNTING)
    _staged(page)
    for step in range(1, 61):
        slide(page, "reach", step / 4)
    _staged(page)

    def last():
        body = bytes(page.evaluate("probes.last"))
        return json.loads(body[4 : 4 + int.from_bytes(body[:4], "little")])

    wait_until(lambda: not page.evaluate("probes.now") and not last()["coarse"])
    assert last()["inner"] == 15
    assert page.evaluate("probes.most") == 1
    assert page.evaluate("probes.count") < 60


def test_what_nobody_waits_for_is_given_up(stored, monkeypatch):
    monkeypatch.setattr(reach, "STEP_ENTRIES", 1)
    transport = InteractiveTransport(stored)
    steps = reach.by_reach(transport, message(WHITE, inner=0, outer=3))
    assert next(steps) is None
    assert next(steps) is None
    steps.close()
    # A few camera pixels are those of the whole.
    monkeypatch.setattr(reach, "LEAST_PIXELS", 64)
    monkeypatch.setattr(reach, "COARSE_ENTRIES", 1)

    def picture(**header):
        *_, found = reach.by_reach(transport, message(WHITE, inner=0, outer=3, **header))
        got, (halves,) = unpack(found)
        return halves.astype(np.float32) / got["scale"]

    whole, coarse = picture(), picture(coarse=True)
    assert whole.shape[:2] == CAMERA
    stride = int(np.ceil(np.sqrt(CAMERA.pixels / 64)))
    rows, columns = (middles(side, stride) for side in CAMERA)
    np.testing.assert_allclose(coarse, whole[rows][:, columns], rtol=2e-3, atol=1e-4)


def test_a_wrong_question_gets_a_sentence(address):
    for header, said in (
        ({"inner": -1}, "inner"),
        ({"inner": 0, "outer": 0}, "more than 0"),
        ({"inner": 4, "outer": 2}, "more than 4"),
    ):
        status, text = refused(address, "/tool/reach", message(WHITE, **header))
        assert status == 400
        assert said in text
    status, text = refused(address, "/tool/distances", message(WHITE, edges=[]))
    assert (status, "edges" in text) == (400, True)
    status, text = refused(address, "/tool/tarot", message(WHITE))
    assert (status, "there is no tool" in text) == (400, True)
    assert ask(address, "/tool/reach", message(WHITE, outer=3))


def test_the_server_stops_once_nobody_waits(stored, monkeypatch):
    """A step is under way when the page goes away; few follow."""
    steps, second = [], threading.Event()

    def counted(*given):
        steps.append(given)
        if len(steps) == 2:
            second.set()
        if len(steps) > 2:
            time.sleep(0.25)
        return picture(*given)

    picture = reach.ProbedLight.picture
    monkeypatch.setattr(reach, "STEP_ENTRIES", 1)
    monkeypatch.setattr(reach.ProbedLight, "picture", counted)
    with served_view(InteractiveTransport(stored)) as address:
        host, port = address.removeprefix("http://").split(":")
        body = message(WHITE, outer=3)
        with socket.create_connection((host, int(port))) as connection:
            head = (
                f"POST /tool/reach HTTP/1.1\r\nHost: {host}\r\nContent-Length: {len(body)}\r\n\r\n"
            )
            connection.sendall(head.encode() + body)
            assert second.wait(LONGEST_WAIT)
        # One row of the camera is a step: all of them would be 30.
        before = -1
        while before != len(steps):
            before = len(steps)
            time.sleep(1)
    assert len(steps) < CAMERA.height / 2
