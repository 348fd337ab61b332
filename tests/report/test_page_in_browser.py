"""What a page does in a browser: links to its parts, values under the pointer, large pictures."""

import re

import numpy as np
import pytest

from nearfar.markup import picture
from nearfar.report.page import colour_map, gallery, page
from tests.viewer.conftest import browser

__all__ = ["browser"]

LOW, HIGH = 10.0, 50.0
LIGHTS = ("black", "grey light", "light grey", "white", "blue")
PARTS = ("First part", "Second part", "Third part")


@pytest.fixture(scope="module")
def values():
    """A map of 3x4 values, with one that is not known and one that is saturated."""
    found = np.linspace(LOW, HIGH, 12).reshape(3, 4)
    found[1, 2] = np.nan
    return found


@pytest.fixture
def opened(browser, values, tmp_path):
    saturated = np.zeros(values.shape, dtype=bool)
    saturated[2, 1] = True
    body = "".join(f"<h2>{part}</h2>" for part in PARTS)
    lights = [picture(np.full((4, 4), 0.2 * k), name) for k, name in enumerate(LIGHTS)]
    body += gallery(list(LIGHTS), [("row", lights)])
    body += colour_map(values, LOW, HIGH, "dB", "a map", saturated=saturated, step=3)
    path = tmp_path / "page.html"
    path.write_text(page("a page", body))
    said = []
    shown = browser.new_page(viewport={"width": 900, "height": 700})
    shown.on("console", lambda message: said.append(message.text))
    shown.on("pageerror", lambda error: said.append(str(error)))
    shown.goto(path.as_uri())
    yield shown
    shown.close()
    assert said == []


def under_pointer(shown, y, x, shape):
    """Put the pointer on a value of the map, and return what the page then says."""
    box = shown.locator("figure[data-stops] img").bounding_box()
    across, down = (
        box[side] + box[length] * (place + 0.5) / count
        for side, length, place, count in (
            ("x", "width", x, shape[1]),
            ("y", "height", y, shape[0]),
        )
    )
    shown.mouse.move(across, down)
    return shown.locator(".under-pointer").inner_text()


def test_values_of_a_map_are_shown_under_the_pointer(opened, values):
    opened.locator("figure[data-stops] img").scroll_into_view_if_needed()
    for y, x in np.ndindex(values.shape):
        said = under_pointer(opened, y, x, values.shape)
        place, _, text = said.partition(": ")
        # One value in three of the camera's rows and columns.
        assert place == f"({3 * y}, {3 * x})"
        if (y, x) == (1, 2):
            assert text == "no value"
        elif (y, x) == (2, 1):
            assert text == "saturated"
        else:
            found = float(re.fullmatch(r"([\d.]+) dB", text)[1])
            # Colours have 8 bits.
            assert found == pytest.approx(values[y, x], abs=0.01 * (HIGH - LOW))
    opened.mouse.move(0, 0)
    assert opened.locator(".under-pointer").inner_text() == ""


@pytest.mark.parametrize("way", ["click", "keyboard"])
def test_a_picture_is_enlarged_and_put_back(opened, way):
    image = opened.locator("img[alt='grey light']")
    small = image.bounding_box()["width"]
    if way == "click":
        image.click()
    else:
        image.focus()
        opened.keyboard.press("Enter")
    large = opened.locator("dialog img")
    assert large.bounding_box()["width"] > 2 * small
    assert opened.locator("dialog p").inner_text() == "grey light"
    if way == "click":
        large.click()
    else:
        opened.keyboard.press("Escape")
    assert not opened.locator("dialog").is_visible()


def test_links_lead_to_the_parts(opened):
    links = opened.locator("nav a")
    # The end of every page is a part, too.
    assert links.all_inner_texts() == [*PARTS, "About this page"]
    links.nth(2).click()
    assert opened.evaluate("document.querySelector(location.hash).innerText") == PARTS[2]
