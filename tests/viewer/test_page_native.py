"""The viewer's page, in a real browser, of every pixel of a projector."""

import json

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.files import read_light
from nearfar.files.codecs import encode_png
from nearfar.illumination.frequencies import far_frequencies, representatives
from nearfar.illumination.near_basis import NearBasis
from nearfar.illumination.real_basis import real_basis
from nearfar.transport.coarse import block_means
from nearfar.transport.model import Transport
from nearfar.transport.store import save_transport
from nearfar.viewer import interactive
from nearfar.viewer.interactive import InteractiveTransport
from tests.viewer.asking import ask, frame, message, refused, socket_of, unpack
from tests.viewer.browsing import drop, saved, seen, settled, slide, tone
from tests.viewer.conftest import served_view

pytestmark = pytest.mark.slow

PROJECTOR, CAMERA = Size(144, 256), Size(30, 40)
BASIS = NearBasis(5, 8)


@pytest.fixture(scope="module")
def native() -> Transport:
    """Return a transport of every projector pixel, without photos."""
    draw = np.random.default_rng(0)
    y, x = np.meshgrid(np.linspace(10, 130, 30), np.linspace(10, 240, 40), indexing="ij")
    far = real_basis(representatives(far_frequencies(Size(3, 5), PROJECTOR)), PROJECTOR)
    shape = (*CAMERA, 1)
    nothing = np.zeros(shape, dtype=np.float32)
    return Transport(
        projector=PROJECTOR,
        correspondence=np.stack([y, x], axis=-1).astype(np.float32),
        direct=draw.uniform(0.3, 0.6, size=shape).astype(np.float32),
        near=draw.uniform(0, 0.02, size=(*shape, BASIS.count)).astype(np.float32),
        far=(0.01 * draw.normal(size=(*shape, far.count))).astype(np.float32),
        far_basis=far,
        black=nothing,
        noise=nothing,
        pitch=BASIS.pitch,
        footprint=np.full((*CAMERA, 4), [4.0, 6.0, 1.0, 0.5], dtype=np.float32),
    )


@pytest.fixture(scope="module")
def page_of_native(native, tmp_path_factory):
    path = tmp_path_factory.mktemp("native") / "native.zarr"
    save_transport(native, path)
    with pytest.MonkeyPatch.context() as patch:
        # As a projector of millions of pixels: moving lights are of blocks of 4 x 4 pixels.
        patch.setattr(interactive, "MAXIMUM_MOVING_LIGHT_PIXELS", 2**12)
        # A busy machine leaves out no camera pixels.
        patch.setattr(interactive, "PACES", 1)
        transport = InteractiveTransport(path)
    assert transport.light_block == 4
    with served_view(transport) as address:
        yield address


def _stroke(page, *places):
    """Drag the mouse over the pane of the light, by places (y, x) from its corner, CSS pixels."""
    box = page.locator("#pane").bounding_box()
    page.mouse.move(box["x"] + places[0][1], box["y"] + places[0][0])
    page.mouse.down()
    for y, x in places[1:]:
        page.mouse.move(box["x"] + x, box["y"] + y, steps=3)
    page.mouse.up()
    settled(page)


def test_a_stroke_is_as_thin_as_a_projector_pixel(open_page, page_of_native, native, tmp_path):
    page = open_page(page_of_native, {"kind": "paint", "brush": 0.5})
    _stroke(page, (20, 30), (60, 200), (110, 250))
    light = read_light(saved(page, "#save-light", tmp_path), PROJECTOR)
    assert set(np.unique(light)) == {0.0, 1.0}
    columns = np.flatnonzero(light.any(axis=0))
    np.testing.assert_array_equal(columns, np.arange(columns[0], columns[-1] + 1))
    # Flat to begin with: one pixel in each column. Each is next to the one before.
    assert (light[:, columns[:100]].sum(axis=0) == 1).all()
    assert np.abs(np.diff(light[:, columns[:100]].argmax(axis=0))).max() == 1
    assert light.sum() < 2 * len(columns)
    assert np.abs(seen(page)[..., :1] - tone(native @ light)[..., None]).max() <= 1


def test_what_is_zoomed_into_is_painted_where_the_pointer_is(open_page, page_of_native, tmp_path):
    page = open_page(page_of_native, {"kind": "paint", "brush": 0.5})
    slide(page, "zoom", 6)
    pane = page.locator("#pane")
    whole = page.locator("#light").bounding_box()
    assert whole["width"] == pytest.approx(6 * pane.bounding_box()["width"], rel=0.01)
    # The middle stays in the middle.
    side = whole["width"] / PROJECTOR.width
    _stroke(page, (pane.bounding_box()["height"] / 2, pane.bounding_box()["width"] / 2))
    light = read_light(saved(page, "#save-light", tmp_path), PROJECTOR)
    ((y, x),) = np.argwhere(light)
    assert abs(y - 71.5) <= 1.5
    assert abs(x - 127.5) <= 1.5
    # The pixel that was painted is white on the screen, a square of several screen pixels.
    assert side > 5
    shown = page.locator("#light").bounding_box()
    middle = [shown["y"] + (y + 0.5) * side, shown["x"] + (x + 0.5) * side]
    corner = pane.bounding_box()
    assert 0 < middle[0] - corner["y"] < corner["height"]
    assert 0 < middle[1] - corner["x"] < corner["width"]
    # A neighbouring pixel is painted by a click a pixel's side away.
    _stroke(page, (middle[0] - corner["y"], middle[1] - corner["x"] + side))
    light = read_light(saved(page, "#save-light", tmp_path), PROJECTOR)
    np.testing.assert_array_equal(np.argwhere(light), [[y, x], [y, x + 1]])


def test_a_row_and_a_column_are_those_of_the_transport(open_page, page_of_native, native):
    page = open_page(page_of_native, {"kind": "white"})
    box = page.locator("#picture").bounding_box()
    with page.expect_response("**/row?*") as answer:
        page.mouse.click(box["x"] + box["width"] * 0.5, box["y"] + box["height"] * 0.5)
    header, (window, far, *_rest) = unpack(answer.value.body())
    pixel = header["y"] * CAMERA.width + header["x"]
    d, n, f = (
        part[0, 0].reshape(PROJECTOR) for part in native.component_rows(slice(pixel, pixel + 1))
    )
    np.testing.assert_allclose(window, d + n, atol=1e-6)
    np.testing.assert_allclose(far, f, atol=1e-6)
    page.wait_for_selector("#row:not([hidden])")
    # As many screen pixels as projector pixels, or a small multiple.
    assert seen(page, "row-spectrum").shape[:2] == (2 * PROJECTOR.height, 2 * PROJECTOR.width)
    page.click("[data-tab=light]")
    page.click("[data-kind=pixel]")
    box = page.locator("#light").bounding_box()
    with page.expect_response("**/column?*") as answer:
        page.mouse.click(box["x"] + box["width"] * 0.6, box["y"] + box["height"] * 0.3)
    header, (column,) = unpack(answer.value.body())
    np.testing.assert_allclose(column, native.column(header["y"], header["x"]), atol=1e-6)


def test_a_picture_of_another_size_fills_the_projector(open_page, page_of_native, tmp_path):
    # Twice as wide as the projector's shape asks for: the middle is kept, at the projector's size.
    picture = np.zeros((288, 1024, 3), dtype=np.uint8)
    picture[:, 512:] = 255
    page = open_page(page_of_native)
    drop(page, "#light", "wide.png", encode_png(picture))
    settled(page)
    assert json.loads(page.evaluate("document.body.dataset.frame"))["exact"]
    light = read_light(saved(page, "#save-light", tmp_path), PROJECTOR)
    expected = np.zeros(PROJECTOR)
    expected[:, 128:] = 1
    np.testing.assert_allclose(light.reshape(*PROJECTOR, -1)[..., 0], expected, atol=0.01)


# What the page sends, noted before it is sent.
NOTING = """window.sent = []; const send = WebSocket.prototype.send;
WebSocket.prototype.send = function (data) {
  const length = new DataView(data.buffer).getUint32(0, true);
  const levels = new Uint16Array(data.buffer, 4 + length);
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(data.buffer, 4, length)));
  window.sent.push({ ...header, levels: header.block > 1 ? [...levels] : [] });
  return send.call(this, data);
};"""
SHAPES = {
    "spot": {"radius": 30, "x": 100, "y": 60},
    "stripe": {"width": 1, "angle": 30},
    "sinusoid": {"cycles": 60, "angle": 20},
    "checkerboard": {"side": 3},
    "pixel": {"x": 9, "y": 6},
    "white": {},
    "paint": {"strokes": [{"colour": "#ffffff", "radius": 9, "points": [40, 30, 90, 80]}]},
}


@pytest.mark.parametrize("kind", SHAPES)
def test_a_moving_light_is_sent_as_means_over_blocks_and_whole_at_rest(
    open_page, page_of_native, native, tmp_path, kind
):
    page = open_page(page_of_native, {"kind": kind, **SHAPES[kind]}, script=NOTING)
    page.evaluate("window.sent.length = 0")
    # A change that leaves the light as it was.
    slide(page, "soft", 0.5) if kind != "paint" else slide(page, "brush", 7)
    page.wait_for_function("() => window.sent.some(light => light.block === 1)")
    settled(page)
    sent = page.evaluate("window.sent")
    assert [light["block"] for light in sent[-2:]] == [4, 1]
    light = read_light(saved(page, "#save-light", tmp_path), PROJECTOR).reshape(*PROJECTOR, -1)
    moving = np.array(sent[-2]["levels"]).reshape(sent[-2]["shape"]) / 65535
    # Of a spot, four pixels of a block are looked at.
    bound = 0.1 if kind == "spot" else 1e-3
    np.testing.assert_allclose(moving[..., 0], block_means(light[..., 0], 4), atol=bound)
    assert np.abs(seen(page)[..., :1] - tone(native @ light[..., 0])[..., None]).max() <= 1


def test_a_light_of_blocks_gets_a_picture_at_once_and_never_an_exact_one(page_of_native, native):
    light = np.random.default_rng(5).random(PROJECTOR, dtype=np.float32)
    means = block_means(light, 4)
    with socket_of(page_of_native) as socket:
        socket.send(message(means, block=4))
        header, moving = frame(socket)
        assert not header["exact"]
        socket.send(message(light, number=2))
        header, first = frame(socket)
        assert (header["number"], header["exact"]) == (2, False)
        header, exact = frame(socket)
        assert (header["number"], header["exact"]) == (2, True)
    np.testing.assert_allclose(moving, first, atol=2e-3)
    whole = np.stack(native.components(light))[..., None]
    np.testing.assert_allclose(exact, whole, rtol=1e-3, atol=2e-5)
    enlarged = np.repeat(np.repeat(means, 4, axis=0), 4, axis=1)
    of_blocks = np.stack(native.components(enlarged))[..., None]
    np.testing.assert_allclose(moving[[0, 2]], of_blocks[[0, 2]], rtol=1e-2, atol=1e-3)


def test_lights_of_other_blocks_and_sizes_are_refused(page_of_native):
    means = np.ones((72, 128), dtype=np.float32)
    status, said = refused(page_of_native, "/light.png", message(means, block=2))
    assert status == 400
    assert "blocks of 2" in said
    assert "send it whole" in said
    assert json.loads(ask(page_of_native, "/scene"))["light_block"] == 4
