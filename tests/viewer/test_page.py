"""The viewer's page in a real browser: Debian's Chromium, driven by Playwright."""

import json
import re
import time
from dataclasses import replace

import numpy as np
import pytest

from nearfar.files import read_light, to_srgb
from nearfar.files.codecs import decode_png, encode_png
from nearfar.illumination.pictures import natural_picture
from nearfar.transport.store import save_transport
from nearfar.transport.verdict import KeptVerdict, Reason
from nearfar.viewer import interactive
from nearfar.viewer.interactive import InteractiveTransport
from tests.viewer.asking import CAMERA, PROJECTOR
from tests.viewer.browsing import contrast, drag, drop, pictures, saved, seen, settled, slide, tone
from tests.viewer.conftest import served_view
from tests.waiting import LONGEST_WAIT

pytestmark = pytest.mark.slow


def test_the_address_brings_everything_back(open_page, address):
    page = open_page(address)
    page.click("[data-kind=paint]")
    drag(page, (3, 3), (9, 15))
    slide(page, "near", 2)
    slide(page, "exposure", -0.5)
    page.click("#tab-map")
    page.select_option("#maps", "near-share")
    page.keyboard.press("Escape")
    page.click("#theme")
    time.sleep(0.5)
    before, light, at = seen(page), seen(page, "light"), page.url
    again = open_page(
        at.split("/#")[0], json.loads(page.evaluate("decodeURIComponent(location.hash.slice(1))"))
    )
    np.testing.assert_array_equal(seen(again), before)
    np.testing.assert_array_equal(seen(again, "light"), light)
    assert again.input_value("#maps") == "near-share"
    assert again.evaluate("document.documentElement.dataset.theme") == page.evaluate(
        "document.documentElement.dataset.theme"
    )
    page.reload()
    settled(page)
    np.testing.assert_array_equal(seen(page), before)


def test_a_dropped_picture_comes_back(open_page, address):
    page = open_page(address)
    picture = tone(natural_picture(PROJECTOR, 1, colour=True)).astype(np.uint8)
    drop(page, "body", "leaves.png", encode_png(picture))
    settled(page)
    time.sleep(0.5)
    before = seen(page)
    page.reload()
    settled(page)
    np.testing.assert_array_equal(seen(page), before)


@pytest.mark.parametrize(
    ("verdict", "leads", "follows"),
    [
        (None, "Not judged. Nothing is known", "nearfar info"),
        (KeptVerdict("good", (), 41.0, 42.0), "Good. Relit pictures are off by 0.89 %", "nothing"),
        (
            KeptVerdict("wrong", (Reason("order", "<b>photo 3</b> is rotated."),), 9.0),
            "Wrong. <b>photo 3</b> is rotated. Relit pictures are off by 35 %",
            "Do not rely on it",
        ),
        (
            KeptVerdict("doubtful", (Reason("unchecked", "nothing was checked."),)),
            "Doubtful. Nothing was checked.",
            "Look at what follows",
        ),
    ],
)
def test_the_page_leads_with_the_verdict(
    open_page, serve, transport, tmp_path, verdict, leads, follows
):
    save_transport(replace(transport, verdict=verdict), tmp_path / "t.zarr")
    address = serve(InteractiveTransport(tmp_path / "t.zarr"))
    page = open_page(address)
    assert page.inner_text("#verdict").startswith(leads)
    assert not page.is_visible("#meaning")
    # By the keyboard, and without starting what the space plays.
    page.focus("#verdict summary")
    page.keyboard.press("Space")
    page.wait_for_selector("#meaning", state="visible")
    assert follows in page.inner_text("#verdict")
    assert page.inner_text("#play") == "animate"


def test_what_gains_changed_cannot_be_judged(open_page, serve, transport, tmp_path):
    save_transport(transport.with_gains(near=2.5), tmp_path / "t.zarr")
    address = serve(InteractiveTransport(tmp_path / "t.zarr"))
    page = open_page(address)
    assert page.inner_text("#verdict").startswith("Not judged.")
    meaning = page.text_content("#meaning")
    assert meaning.startswith("It was multiplied by the gains direct 1, near 2.5 and far 1 ")


@pytest.mark.parametrize(
    "hash_",
    [
        "#%",
        "#null",
        "#[]",
        '#{"kind":5,"x":"a","strokes":[1,{}],"pixel":[1e9,"<"]}',
        '#{"colour":"red;<script>"}',
        '#{"strokes":[{"colour":"#ffffff","radius":1e-9,"points":[0,0,100,100]}]}',
        '#{"strokes":[{"colour":"#ffffff","radius":1,"points":[0,0,1e300,0]}]}',
    ],
)
def test_an_address_that_was_tampered_with_shows_the_start(open_page, address, browser, hash_):
    page = open_page(address)
    start = seen(page)
    page.goto("about:blank")
    page.goto(address + "/" + hash_)
    settled(page)
    np.testing.assert_array_equal(seen(page), start)


def test_pictures_that_the_address_does_not_hold_are_named(open_page, address):
    for given in (["javascript:alert(1)", 7], ["data:image/png;base64,A"]):
        page = open_page(address, {"kind": "picture", "pictures": given, "shown": 9})
        assert "not in the address" in page.inner_text("#fault")
        assert seen(page, "light").max() == 0
        assert page.inner_text("[data-for=picture] output") == f"{len(given)} of {len(given)}"
    # A linear picture is more than an address holds; the others are found where they were.
    page = open_page(address)
    drop(page, "#light", "l.png", encode_png(np.full((*PROJECTOR, 3), 40000, np.uint16)))
    page.wait_for_selector("output:has-text('1 of 1')")
    drop(page, "#light", "e.png", encode_png(np.full((*PROJECTOR, 3), 60, np.uint8)))
    page.wait_for_selector("output:has-text('2 of 2')")
    settled(page)
    time.sleep(0.5)
    page.reload()
    settled(page)
    assert "1 of the pictures is not in the address" in page.inner_text("#fault")
    assert (seen(page, "light") == 60).all()


# Frames reach the page late, as from a busy server.
SLOWLY = """
    const Prompt = WebSocket;
    window.WebSocket = class extends Prompt {
      set onmessage(receive) { super.onmessage = event => setTimeout(() => receive(event), 400); }
    };
"""


def test_the_picture_that_is_saved_is_of_the_light_that_is_shown(open_page, address, tmp_path):
    page = open_page(address, {"kind": "white"}, script=SLOWLY)
    white = decode_png(saved(page, "#save-png", tmp_path).read_bytes())
    with page.expect_download() as download:
        page.evaluate("""() => { document.querySelector('[data-kind=pixel]').click();
            document.getElementById('save-png').click(); }""")
    download.value.save_as(tmp_path / "pixel.png")
    assert decode_png((tmp_path / "pixel.png").read_bytes()).sum() < white.sum() / 2


@pytest.mark.parametrize("gamma", [1, 2, 3])
def test_dark_light_is_shown_in_all_its_steps(open_page, address, transport, gamma):
    page = open_page(address, {"kind": "pixel", "x": 7, "y": 3, "gamma": gamma, "exposure": 5})
    column = transport.column(3, 7)
    expected = np.rint(255 * to_srgb(np.clip(32 * column, 0, 1)) ** (1 / gamma))
    assert np.abs(seen(page) - expected).max() <= 1


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [390, 1300])
def test_it_is_readable_by_day_and_night_and_on_a_phone(
    open_page, address, scheme, width, tmp_path
):
    page = open_page(
        address, {"pixel": [10, 10], "map": "error", "tab": "map"}, color_scheme=scheme
    )
    page.set_viewport_size({"width": width, "height": 844})
    page.wait_for_selector("#map-caption:has-text('grey')")
    back = page.evaluate("getComputedStyle(document.body).backgroundColor")
    assert (sum(map(int, re.findall(r"\d+", back)[:3])) < 200) == (scheme == "dark")
    texts = "h1, #about, #frame-status, [data-kind=spot], [data-kind=stripe], .card p, .card small"
    for selector in f"{texts}, output, figcaption, .k-far, .k-near, .keys".split(", "):
        assert contrast(page, selector) >= 4.5, selector
    if width == 390:
        # Light and scene on one screen.
        boxes = [page.locator(part).bounding_box() for part in ("#picture", "#light")]
        assert max(box["y"] + box["height"] for box in boxes) <= 844
    # Nothing sticks out to the side.
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    page.screenshot(path=tmp_path / "page.png", full_page=True)
    page.click("#theme")
    flipped = page.evaluate("getComputedStyle(document.body).backgroundColor")
    assert flipped != back
    assert contrast(page, "#about") >= 4.5


def test_it_is_used_by_the_keyboard(open_page, address, tmp_path):
    page = open_page(address)
    page.keyboard.press("5")
    settled(page)
    assert page.get_attribute("[data-kind=white]", "aria-pressed") == "true"
    page.keyboard.press("f")
    assert page.get_attribute("[data-solo=far]", "aria-pressed") == "true"
    page.keyboard.press("a")
    page.keyboard.press("7")
    page.focus("#light")
    for key in ("ArrowRight", "ArrowRight", "Shift+ArrowUp"):
        page.keyboard.press(key)
    settled(page)
    light = read_light(saved(page, "#save-light", tmp_path), PROJECTOR)
    assert light.argmax() == 2 * 24 + 14
    for name in ("pictures", "photo"):
        page.focus("#" + name)
        assert page.evaluate("document.activeElement.id") == name
    page.focus("#light")
    page.keyboard.press("Enter")
    page.click("#tab-column")
    page.wait_for_selector("#column:has-text('row 2, column 14')")
    # Everything that can be used can be reached, and says what it is.
    for control in page.query_selector_all("button, input, select, canvas[tabindex]"):
        if control.is_visible() and control.get_attribute("type") != "file":
            named = control.evaluate(
                "e => e.ariaLabel || e.innerText || e.closest('label')?.innerText || e.title"
            )
            assert named.strip()


def test_the_page_reports_a_lost_server_and_reconnects(open_page, stored, browser):
    from nearfar.viewer.interactive import InteractiveTransport
    from nearfar.viewer.server import ListeningAddress

    context = browser.new_context()
    context.set_default_timeout(1000 * LONGEST_WAIT)
    with served_view(InteractiveTransport(stored)) as address:
        page = context.new_page()
        page.goto(address)
        settled(page)
    page.wait_for_selector("#fault:has-text('does not answer')")
    page.click("[data-kind=white]")
    port = int(address.rsplit(":", 1)[1])
    with served_view(InteractiveTransport(stored), ListeningAddress("127.0.0.1", port)):
        count = pictures(page)["count"]
        end = time.monotonic() + LONGEST_WAIT
        while pictures(page)["count"] == count and time.monotonic() < end:
            time.sleep(0.1)
        assert pictures(page)["count"] > count
        assert page.inner_text("#fault") == ""
    context.close()


def test_large_scenes_are_coarse_while_dragged(open_page, serve_it, monkeypatch, transport):
    monkeypatch.setattr(interactive, "MAXIMUM_COARSE_BYTES", 60_000)
    page = open_page(serve_it(memory=10**5), {"kind": "white"})
    white = transport @ np.ones(PROJECTOR, np.float32)
    assert np.abs(seen(page) - tone(white)).max() <= 1
    page.click("[data-kind=spot]")
    sizes = set()
    end = time.monotonic() + LONGEST_WAIT
    while time.monotonic() < end and len(sizes) < 2:
        sizes.add(page.evaluate("document.getElementById('picture').width"))
    assert len(sizes) == 2
    settled(page)
    assert page.evaluate("document.getElementById('picture').width") == CAMERA.width
