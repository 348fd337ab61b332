"""The photos of a capture, each compared with the scene under the light that it was taken under."""

import json

import numpy as np
import pytest

from nearfar.capture import open_capture
from nearfar.errors import InputError
from nearfar.transport.stored import open_transport
from nearfar.viewer.interactive import InteractiveTransport
from nearfar.viewer.photo_series import PhotoSeries
from tests.viewer.asking import unpack
from tests.viewer.browsing import seen, settled, tone
from tests.viewer.conftest import served_view
from tests.waiting import wait_until


@pytest.fixture
def capture(stored):
    return open_capture(stored.parent / "capture.zarr")


@pytest.fixture
def series(stored, capture):
    return PhotoSeries(InteractiveTransport(stored), capture)


@pytest.fixture
def address(stored, series):
    """The page of the transport with the photos of its capture."""
    with served_view(InteractiveTransport(stored), photo_series=series) as served:
        yield served


def _less_black(stored, capture, number):
    (taken,) = capture.read([number], slice(None))
    return taken - open_transport(stored).black()


def test_each_photo_comes_with_its_light(stored, capture, series):
    for number in (0, len(capture.plan.patterns) - 1):
        header, (levels, halves) = unpack(series.photo(number))
        light = capture.plan.draw(number) / 255
        np.testing.assert_allclose(levels[..., 0] / 65535, light, atol=1e-5)
        found = halves.astype(np.float32) / header["scale"]
        np.testing.assert_allclose(found, _less_black(stored, capture, number), atol=1e-3)
    for number in (-1, len(capture.plan.patterns)):
        with pytest.raises(InputError, match="there is no photo"):
            series.photo(number)


def test_photos_that_no_estimate_used_are_told(capture, series):
    told = series.describe()
    assert len(told) == len(capture.plan.patterns)
    purposes = [pattern.purpose for pattern in capture.plan.patterns]
    assert [photo["purpose"] for photo in told] == purposes
    assert {purpose for purpose, photo in zip(purposes, told, strict=True) if photo["is_held_out"]}
    assert not any(
        photo["is_held_out"] for photo in told if photo["purpose"] in {"direct", "near", "far"}
    )


def _compared_with(page, number):
    wait_until(lambda: page.inner_text("#photo-output") == str(number))
    wait_until(lambda: page.inner_text("#stage-label") == f"photo {number} | relit")
    settled(page)


@pytest.mark.slow
def test_a_photo_brings_its_light_and_is_compared_with(open_page, address, stored, capture):
    held_out = [p.purpose == "check" for p in capture.plan.patterns].index(True)
    page = open_page(address, {"kind": "white"})
    assert page.inner_text("#photo-output") == "none"
    page.click("#next-held-out")
    _compared_with(page, held_out)
    assert page.inner_text("#photo-purpose") == "taken for check, used by no estimate"
    light = capture.plan.draw(held_out)
    shown = seen(page, "light")[..., 0]
    np.testing.assert_allclose(shown, tone(light / 255.0), atol=1)
    # What is compared with is the photo, and the number is that of the two.
    photo = _less_black(stored, capture, held_out)
    np.testing.assert_allclose(seen(page, "before").astype(int), tone(photo), atol=1)
    assert "dB" in page.inner_text("#snr")
    # Another light has no photo; undone, it is there again.
    page.keyboard.press("5")
    wait_until(lambda: page.inner_text("#stage-label") == "relit")
    assert page.inner_text("#photo-output") == "none"
    page.keyboard.press("Control+z")
    _compared_with(page, held_out)
    # By the slider's keys, and typed, too; the address brings it back.
    page.focus("#photo-number")
    page.keyboard.press("ArrowRight")
    _compared_with(page, held_out + 1)
    page.focus("#photo-output")
    page.keyboard.type("no number")
    page.keyboard.press("Enter")
    wait_until(lambda: page.inner_text("#photo-output") == str(held_out + 1))
    page.focus("#photo-output")
    page.keyboard.type("3")
    page.keyboard.press("Enter")
    _compared_with(page, 3)
    address_of = "decodeURIComponent(location.hash.slice(1))"
    wait_until(lambda: '"photo:3"' in page.evaluate(address_of))
    state = json.loads(page.evaluate(address_of))
    assert state["pictures"] == [f"photo:{n}" for n in (held_out, held_out + 1, 3)]
    page.reload()
    _compared_with(page, 3)
    np.testing.assert_allclose(
        seen(page, "light")[..., 0], tone(capture.plan.draw(3) / 255.0), atol=1
    )


@pytest.mark.slow
def test_an_address_with_a_photo_that_is_not_there_says_so(open_page, address):
    page = open_page(address, {"kind": "picture", "pictures": ["photo:999"], "shown": 0})
    assert "is not in the address" in page.inner_text("#fault")
    assert page.inner_text("#photo-output") == "none"


@pytest.mark.slow
def test_without_a_capture_there_are_no_photos(open_page, serve, stored):
    address = serve(InteractiveTransport(stored))
    page = open_page(address)
    assert not page.is_visible("#photo-series")
    assert not page.is_visible("#next-held-out")
    refused = page.request.get(f"{address}/photo/0")
    assert refused.status == 400
    assert "give their capture" in refused.json()["fault"]
