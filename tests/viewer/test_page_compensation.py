"""The viewer's page in a real browser: light under which the scene looks like a picture."""

import numpy as np
import pytest

from nearfar.files import read_light, to_srgb
from nearfar.files.codecs import encode_exr, encode_png
from nearfar.illumination.pictures import natural_picture
from nearfar.viewer.interactive import InteractiveTransport, StoppedError
from nearfar.viewer.tools import compensation
from tests.viewer.asking import CAMERA, PROJECTOR, message, refused
from tests.viewer.browsing import drop, saved, seen, settled, slide, tone

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def wanted(transport):
    """Return a picture that the scene can look like: it is one of it."""
    return transport @ (0.2 + 0.6 * natural_picture(PROJECTOR, 2, colour=True))


def _found(page):
    page.wait_for_selector("#strip figure >> nth=2")
    settled(page)


def test_the_scene_looks_like_a_picture_that_is_dropped_on_it(
    open_page, address, transport, wanted, tmp_path
):
    page = open_page(address, {"kind": "spot", "tool": "compensation"})
    drop(page, "#stage", "wanted.exr", encode_exr(np.maximum(wanted, 0)), "")
    _found(page)
    assert page.get_attribute("[data-kind=picture]", "aria-pressed") == "true"
    assert page.inner_text("#stage-label") == "wanted | relit"
    light = read_light(saved(page, "#save-light", tmp_path), PROJECTOR)
    relit = transport @ light
    # To a scale, which is the page's to choose.
    lit = transport.lit
    scale = (relit[lit] * wanted[lit]).sum() / (wanted[lit] ** 2).sum()
    off = np.sqrt(np.mean((relit - scale * wanted)[lit] ** 2))
    assert off < 0.03 * scale * wanted[lit].max()
    # Light that is right for direct light alone would be further off, and so would white.
    plain = transport @ np.ones(PROJECTOR, np.float32)
    by_white = (plain[lit] * wanted[lit]).sum() / (wanted[lit] ** 2).sum()
    assert off / scale < np.sqrt(np.mean((plain - by_white * wanted)[lit] ** 2)) / by_white / 3
    # It is exposed so that it can be seen, and stays the page's light.
    exposure = float(page.input_value("[data-of=exposure]"))
    page.click("#forget")
    assert page.inner_text("#stage-label") == "relit"
    assert np.abs(seen(page) - tone(2**exposure * relit)).max() <= 1
    texts = page.locator("#strip figcaption").all_inner_texts()
    assert "dB" in texts[1]
    assert "% of the camera pixels" in texts[2]
    # A picture of the strip is shown large, and the scene again by the same button.
    page.focus("#strip figure >> nth=0 >> button")
    page.keyboard.press("Enter")
    assert page.inner_text("#stage-label") == "wanted"
    shown = seen(page).astype(float)
    assert np.abs(shown - tone(2**exposure * scale * np.maximum(wanted, 0)))[lit].mean() < 4
    page.keyboard.press("Enter")
    assert page.inner_text("#stage-label") == "relit"
    page.keyboard.press("Enter")
    slide(page, "shown", 0)
    settled(page)
    assert page.inner_text("#stage-label") == "relit"


def test_an_ordinary_picture_of_any_size_and_what_is_none(open_page, address, wanted):
    page = open_page(address, {"tool": "compensation"})
    large = np.repeat(np.repeat(np.clip(wanted / wanted.max(), 0, 1), 2, axis=0), 2, axis=1)
    eight = np.rint(255 * to_srgb(large)).astype(np.uint8)
    page.set_input_files(
        "#wanted", {"name": "w.png", "mimeType": "image/png", "buffer": encode_png(eight)}
    )
    _found(page)
    page.focus("#strip figure >> nth=0 >> button")
    page.keyboard.press("Enter")
    # What is dropped elsewhere is light, as ever.
    drop(page, "#light", "e.png", encode_png(np.full((*PROJECTOR, 3), 60, np.uint8)))
    page.wait_for_selector("output:has-text('2 of 2')")
    drop(page, "#stage", "x.png", b"no picture")
    page.wait_for_selector("#fault:has-text('x.png is no picture')")
    drop(page, "#stage", "x.exr", encode_exr(np.zeros((*CAMERA, 3), np.float32)), "")
    page.wait_for_selector("#fault:has-text('is not black')")
    drop(page, "#stage", "s.exr", encode_exr(np.ones((3, 3, 3), np.float32)), "")
    page.wait_for_selector("#fault:has-text('s.exr is 3x3')")


def test_what_cannot_be_compensated_gets_a_sentence(open_page, serve, stored, address):
    status, said = refused(address, "/tool/compensation", message(np.zeros(CAMERA)))
    assert status == 400
    assert "the wanted picture is black" in said
    here = serve(InteractiveTransport(stored, memory=10**4))
    page = open_page(here, {"tool": "compensation"})
    drop(page, "#stage", "w.png", encode_png(np.full((9, 9, 3), 90, np.uint8)))
    page.wait_for_selector("#tool-status:has-text('of 1GB')")
    page.goto("about:blank")


def test_a_server_that_stops_gives_it_up(stored, wanted):
    transport = InteractiveTransport(stored)
    given = message(np.clip(wanted / wanted.max(), 0, 1))
    transport.stop()
    with pytest.raises(StoppedError):
        next(compensation.compensating_light(transport, given))
