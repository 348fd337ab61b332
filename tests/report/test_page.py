"""Pages stand on their own."""

import base64
import re

import numpy as np
import pytest

from nearfar.files import encode_png
from nearfar.markup import MARK, card, false_colour, numbers, picture
from nearfar.report.comparison import comparison_page
from nearfar.report.page import STYLE, colour_map, facts, gallery, listed, page
from nearfar.workflow.comparison import Comparison

EVIL = "<img src=x onerror=alert(1)>\"'&"


def test_a_page_fetches_nothing():
    body = gallery(["a"], [("row", [picture(np.ones((3, 4)), "white & bright")])])
    text = page("a < b", body)
    assert "http" not in text
    assert re.findall(r"<script[^>]*>", text) == ['<script type="module">']
    assert "a &lt; b" in text
    assert 'alt="white &amp; bright"' in text


@pytest.mark.parametrize(
    "text",
    [
        page(EVIL, ""),
        picture(np.ones((3, 4)), EVIL),
        gallery([EVIL], [(EVIL, [])]),
        facts([(EVIL, EVIL)]),
        listed([EVIL]),
        numbers([EVIL], [[EVIL]]),
        colour_map(np.ones((2, 2)), 0, 1, "dB", EVIL),
        card(EVIL, [(EVIL, EVIL)], [(EVIL, "")]),
        comparison_page(Comparison(EVIL, (3, 4), (3, 4), (), ())),
    ],
    ids=["page", "picture", "gallery", "facts", "listed", "numbers", "map", "card", "comparison"],
)
def test_a_name_is_no_part_of_a_page(text):
    assert "&lt;img src=x onerror=alert(1)&gt;&quot;&#x27;&amp;" in text
    assert "<img src=x" not in text


def test_pictures_are_srgb():
    text = picture(np.full((2, 3), 0.2), "grey")
    data = base64.b64decode(re.search(r"base64,([^\"]+)", text).group(1))
    # sRGB of linear 0.2 is 124.
    assert data == encode_png(np.full((2, 3), 124, np.uint8))


def test_false_colour_is_ordered_and_marks_what_is_not_there():
    colours = false_colour(np.array([[0.0, 0.5, 1.0, np.nan, -5.0, 9.0]]), 0, 1).astype(int)
    lightness = colours[0] @ [0.2126, 0.7152, 0.0722]
    assert lightness[0] < lightness[1] < lightness[2]
    np.testing.assert_array_equal(colours[0, 3], (128, 128, 128))
    np.testing.assert_array_equal(colours[0, 4], colours[0, 0])
    np.testing.assert_array_equal(colours[0, 5], colours[0, 2])
    saturated = np.array([[False, True, False, True, False, False]])
    marked = false_colour(np.array([[0.0, 0.5, 1.0, np.nan, -5.0, 9.0]]), 0, 1, saturated)
    assert {tuple(colour) for colour in marked[saturated].tolist()} == {MARK}
    np.testing.assert_array_equal(marked[~saturated], colours[~saturated])


@pytest.mark.parametrize("number", [0, 3])
def test_marked_pixels_are_explained_where_there_are_some(number):
    saturated = np.arange(6).reshape(2, 3) < number
    text = colour_map(
        np.ones((2, 3)), 0, 1, "dB", "map", reading="Read <it> so.", saturated=saturated
    )
    assert ("saturated: not measured" in text) == (number > 0)
    assert "--saturated: #{:02x}{:02x}{:02x};".format(*MARK) in STYLE
    assert "<b>Map.</b> Read &lt;it&gt; so." in text


def test_the_best_rows_and_cells_of_a_table_are_bold():
    table = numbers(["", "one", "other"], [["a", "1", "2"], ["b", "4", "3"]], [0], {(1, 1)})
    assert table.count('class="best"') == 2
    assert '<tr class="best"><td>a' in table
    assert '<td class="best">4</td>' in table
    assert ".numbers tr.best td, .numbers td.best { font-weight: 650" in STYLE


@pytest.mark.parametrize("low", [3.0, 7.0])
def test_a_map_of_one_value_can_be_drawn(low):
    assert "dB" in colour_map(np.full((2, 2), low), low, low, "dB", "flat")
