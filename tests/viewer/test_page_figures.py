"""The viewer's page in a real browser: figures in false colour, their ranges and colour maps."""

import re

import matplotlib as mpl
import numpy as np
import pytest

from nearfar.estimate.error_bars import ErrorBars
from nearfar.markup import false_colour
from nearfar.report.maps import maps_of
from nearfar.viewer.colour_maps import COLOUR_MAPS
from tests.viewer.asking import CAMERA, PROJECTOR
from tests.viewer.browsing import contrast, pictures, seen, settled, slide
from tests.waiting import wait_until

pytestmark = pytest.mark.slow

WHITE = np.ones(PROJECTOR, np.float32)


def _type(page, place, end, text):
    """Type an end of a range by the keyboard alone, once its fields are open."""
    page.focus(f"{place} [data-end={end}]")
    page.keyboard.press("Control+a")
    page.keyboard.press("Backspace")
    page.keyboard.type(text)
    page.keyboard.press("Enter")


def _open(page, place):
    page.focus(f"{place} summary")
    page.keyboard.press("Enter")


def _ticks(page, figure):
    return page.locator(f"{figure} .scale span").all_inner_texts()


def _close(shown, expected, off=3):
    """Tell whether two pictures agree, up to the colours' rounding."""
    return np.abs(shown.astype(int) - expected).max() <= off


def test_the_range_of_a_map_is_typed_and_its_ticks_follow(open_page, address, transport):
    page = open_page(address, {"tab": "map", "map": "picture-error", "kind": "spot"})
    page.wait_for_selector("#map-range:not([hidden])")
    values = maps_of(transport)["picture-error"]()
    assert _close(seen(page, "map"), false_colour(values.values, values.low, values.high))
    _open(page, "#map-range")
    _type(page, "#map-range", "low", "10")
    _type(page, "#map-range", "high", "30")
    # The digits chose no other light.
    assert page.get_attribute("[data-kind=spot]", "aria-pressed") == "true"
    assert _close(seen(page, "map"), false_colour(values.values, 10, 30))
    assert _ticks(page, "#panel-map") == ["10", "20", "30 dB"]
    # What cannot be a range says so, and changes nothing.
    for text, why in (("5", "below the second"), ("much", "Type a number")):
        _type(page, "#map-range", "high", text)
        assert why in page.inner_text("#map-range [role=status]")
        assert page.get_attribute("#map-range [data-end=high]", "aria-invalid") == "true"
        assert _ticks(page, "#panel-map")[-1] == "30 dB"
    page.focus("#map-range button")
    page.keyboard.press("Enter")
    assert _close(seen(page, "map"), false_colour(values.values, values.low, values.high))
    assert page.input_value("#map-range [data-end=low]") == ""
    # An automatic end gives way to one that was typed beyond it.
    _type(page, "#map-range", "low", "900")
    assert _ticks(page, "#panel-map")[0] == "900"
    _type(page, "#map-range", "low", "")
    _type(page, "#map-range", "high", "-900")
    assert _ticks(page, "#panel-map")[-1] == "-900 dB"


def test_a_map_on_a_logarithmic_scale(open_page, address, transport):
    ranges = {"map-far-share": {"low": 0.5, "high": 50, "isLog": True}}
    page = open_page(address, {"tab": "map", "map": "far-share", "ranges": ranges})
    page.wait_for_selector("#map-range:not([hidden])")
    values = np.asarray(maps_of(transport)["far-share"]().values, dtype=np.float64)
    with np.errstate(invalid="ignore", divide="ignore"):
        logarithms = np.log10(np.where(values > 0, values, np.nan))
    assert _close(seen(page, "map"), false_colour(logarithms, np.log10(0.5), np.log10(50)))
    assert _ticks(page, "#panel-map") == ["0.5", "5", "50 %"]
    # Zero has no place on it: it is refused, and chosen by the scale it gives way.
    _open(page, "#map-range")
    _type(page, "#map-range", "low", "0")
    assert "above 0" in page.inner_text("#map-range [role=status]")
    page.select_option("#map-range [data-scale]", "false")
    _type(page, "#map-range", "low", "-5")
    page.select_option("#map-range [data-scale]", "true")
    assert page.input_value("#map-range [data-end=low]") == ""
    assert float(_ticks(page, "#panel-map")[0]) > 0


@pytest.mark.parametrize("name", COLOUR_MAPS)
def test_colour_maps_are_even_and_differ_from_what_has_no_value(name):
    stops = np.array(COLOUR_MAPS[name].stops) / 255
    linear = np.where(stops <= 0.04045, stops / 12.92, ((stops + 0.055) / 1.055) ** 2.4)
    luminance = linear @ [0.2126, 0.7152, 0.0722]
    lightness = 116 * np.cbrt(luminance) - 16
    steps = np.diff(lightness[luminance > 0.01])
    assert (steps > 0).all()
    assert steps.max() < 2.5 * steps.min()
    # Along the whole map, whatever lies between its stops.
    fine = np.stack(
        [np.interp(np.linspace(0, 1, 200), np.linspace(0, 1, len(stops)), c) for c in stops.T], -1
    )
    for colour in (COLOUR_MAPS[name].none, COLOUR_MAPS[name].negative[-1]):
        assert np.linalg.norm(255 * fine - colour, axis=1).min() > 40


def test_the_colour_map_is_chosen_for_all_figures(open_page, address, transport):
    page = open_page(address, {"tab": "map", "map": "column", "pixel": [10, 10]})
    page.wait_for_selector("#map-range:not([hidden])")
    found = maps_of(transport)["column"]()
    share = found.values / found.high
    _open(page, "#map-range")
    for name in ("viridis", "grey"):
        page.focus("#map-range [data-colours]")
        page.select_option("#map-range [data-colours]", name)
        colours = mpl.colormaps["gray" if name == "grey" else name](share)[..., :3]
        shown = seen(page, "map")
        lit = np.isfinite(found.values)
        assert np.abs(shown.astype(int) - 255 * colours)[lit].max() <= 4
        assert (shown[~lit] == COLOUR_MAPS[name].none).all()
        assert f"{COLOUR_MAPS[name].none_name} where there is none" in page.inner_text(
            "#map-caption"
        )
        bar = page.evaluate("getComputedStyle(document.getElementById('map-bar')).backgroundImage")
        last = ", ".join(str(int(value)) for value in COLOUR_MAPS[name].stops[-1])
        assert f"rgb({last})" in bar
    # It is kept in the address, and other figures have it.
    wait_until(lambda: "colourMap" in page.evaluate("location.href"))
    page.click("#tab-row")
    page.wait_for_selector("#row:not([hidden])")
    assert page.locator("#row-ranges [data-colours]").first.input_value() == "grey"
    far = seen(page, "row-far").astype(int)
    assert (far.max(axis=-1) - far.min(axis=-1) < 3).mean() > 0.5


@pytest.mark.parametrize("name", COLOUR_MAPS)
def test_k_far_is_white_over_black_on_every_colour_map(open_page, address, transport, name):
    page = open_page(address, {"tab": "row", "pixel": [10, 10], "colourMap": name})
    page.wait_for_selector("#row:not([hidden])")
    shown = seen(page, "row-spectrum").astype(int)
    large = shown.shape[1] // PROJECTOR.width
    kx = page.evaluate("fetch('row?y=10&x=10').then(r => r.arrayBuffer()).then(b => new "
        "TextDecoder().decode(b.slice(4, 4 + new DataView(b).getUint32(0, true))))")  # fmt: skip
    far = float(re.search(r'"k_far": \[[^,]+, ([\d.]+)\]', kx)[1])
    # Down the frame's right side, some way from its corners and from DC.
    right = round((PROJECTOR.width // 2 + 0.5 + far * PROJECTOR.width) * large + large / 2)
    beside = shown[shown.shape[0] // 2 + large // 2, right - 4 : right + 5]
    assert beside.min(axis=-1).max() > 200
    assert beside.max(axis=-1).min() < 60


def test_the_rows_plots_have_one_range_that_is_typed(open_page, address, transport):
    page = open_page(address, {"tab": "row", "pixel": [10, 10]})
    page.wait_for_selector("#row:not([hidden])")
    row = transport.component_rows(slice(10 * CAMERA.width + 10, 10 * CAMERA.width + 11))
    far = row.far[0].mean(axis=0).reshape(PROJECTOR)
    before = seen(page, "row-profile")
    place = "#row-ranges [data-range-of=row]"
    _open(page, place)
    _type(page, place, "low", "1e-4")
    _type(page, place, "high", "2e-3")
    positive = far > 1e-5
    logarithms = np.log10(np.where(positive, far, np.nan))
    expected = false_colour(logarithms, -4, np.log10(2e-3))
    assert _close(seen(page, "row-far")[positive], expected[positive])
    figure = "figure:has(#row-far)"
    assert _ticks(page, figure) == ["1.0e-4", "4.5e-4", "0.002"]
    assert not np.array_equal(seen(page, "row-profile"), before)
    page.select_option(f"{place} [data-scale]", "false")
    expected = false_colour(far, 1e-4, 2e-3)
    assert _close(seen(page, "row-far")[positive], expected[positive])
    assert "linear scale" in page.inner_text("figure:has(#row-profile) figcaption")
    # Spectra have a range of their own, in dB.
    _open(page, "#row-ranges [data-range-of=spectrum]")
    _type(page, "#row-ranges [data-range-of=spectrum]", "low", "-40")
    assert _ticks(page, "figure:has(#row-spectrum)") == ["-40 dB", "0 dB"]


def test_an_address_may_hold_what_is_no_range(open_page, address):
    ranges = {"row": {"low": "x"}, "map-column": {"low": 9, "high": 3}, "spectrum": 7}
    state = {"ranges": ranges, "region": [5, 5, 2, 99], "colourMap": "<b>", "map": "column"}
    page = open_page(address, {**state, "tab": "map"})
    page.wait_for_selector("#map-range:not([hidden])")
    low, _, high = (float(tick.split()[0]) for tick in _ticks(page, "#panel-map"))
    assert low < high
    assert not page.is_visible("#region-mark")


# Error bars of the relit picture


def test_the_error_bars_of_the_picture_are_a_map(open_page, address, transport):
    page = open_page(address, {"kind": "white", "far": 0.5})
    page.focus("[data-tool=error-bars]")
    page.keyboard.press("Enter")
    wait_until(lambda: pictures(page).get("stage") is True)
    assert page.inner_text("#stage-label") == "error bars of the relit picture"
    bars = ErrorBars(transport)
    sigma = bars.picture(WHITE, far=0.5).mean(axis=-1)
    _open(page, "#error-bars-range")
    _type(page, "#error-bars-range", "low", "0")
    _type(page, "#error-bars-range", "high", "0.01")
    assert _close(seen(page), false_colour(sigma, 0, 0.01))
    assert _ticks(page, "#error-bars-figure") == ["0", "0.005", "0.01 photo units"]
    page.locator("#picture").scroll_into_view_if_needed()
    box = page.locator("#picture").bounding_box()
    y, x = 12, 33
    page.mouse.move(
        box["x"] + (x + 0.5) / CAMERA.width * box["width"],
        box["y"] + (y + 0.5) / CAMERA.height * box["height"],
    )
    wait_until(lambda: "± " in page.inner_text("#readout"))
    told = float(page.inner_text("#readout").split("± ")[1])
    assert told == pytest.approx(sigma[y, x], abs=1e-4)
    # Under another light, with other gains, and as a share of the light.
    page.mouse.move(2, 2)
    slide(page, "far", 1)
    page.click("[data-error-bars=relative]")
    page.keyboard.press("5")
    page.keyboard.press("1")
    settled(page)
    wait_until(lambda: pictures(page).get("stage") is True)
    assert page.inner_text("#stage-label").endswith("as a share of its light")
    assert _ticks(page, "#error-bars-figure")[-1].endswith(" %")
    page.click("[data-tool=relit]")
    assert page.inner_text("#stage-label") == "relit"


def test_a_share_of_the_light_is_the_error_bar_over_the_light(open_page, address, transport):
    ranges = {"error-bars-share": {"low": 0, "high": 5}}
    page = open_page(
        address,
        {"kind": "white", "tool": "error-bars", "errorBars": "relative", "ranges": ranges},
    )
    wait_until(lambda: pictures(page).get("stage") is True)
    sigma = ErrorBars(transport).picture(WHITE).mean(axis=-1)
    light = (transport @ WHITE).mean(axis=-1)
    assert _close(seen(page), false_colour(100 * sigma / light, 0, 5))


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [390, 1300, 1900])
def test_figures_are_readable_by_day_and_night(open_page, address, scheme, width):
    state = {"tool": "error-bars", "tab": "region", "region": [4, 4, 12, 20]}
    page = open_page(address, state, color_scheme=scheme)
    page.set_viewport_size({"width": width, "height": 900})
    page.wait_for_selector("#region-numbers:not([hidden])")
    page.evaluate("document.querySelectorAll('details').forEach(d => { d.open = true; })")
    texts = (
        "#region-note",
        "#region-numbers th",
        "#region-numbers td",
        "#region-sides label",
        "#region-sides input",
        "#region-about",
        "#region-range summary",
        "#region-range label",
        "#region-range input",
        "#region-range select",
        "#error-bars-caption",
        "#error-bars-figure .scale",
        "#stage-label",
    )
    for selector in texts:
        assert contrast(page, selector) >= 4.5, selector
    assert page.evaluate("document.documentElement.scrollWidth") <= width
