"""Probing beside T's dense rows, masked one projector pixel after another by distances."""

from dataclasses import replace

import numpy as np
import pytest

import nearfar
from nearfar.applications import run_loops
from nearfar.applications.probe import probe_stored
from nearfar.applications.summed_light import SPACING_OF_RADIUS, grid_of_places, summed_lights
from nearfar.arrays import Size
from nearfar.errors import InputError
from nearfar.transport.half import in_half
from nearfar.transport.rows import of_rows
from nearfar.transport.store import save_transport
from nearfar.transport.stored import open_transport
from tests.worlds import model_transport

PROJECTOR, CAMERA = Size(18, 24), Size(9, 11)
MASK = nearfar.ProbingMask


def world(channels=2, **changes):
    """A transport with fractional q, some camera pixels without q."""
    transport = model_transport(
        PROJECTOR, CAMERA, window=7, far=Size(5, 5), channels=channels, fractional=True
    )
    q = transport.correspondence + np.float32(0.137)
    q = np.minimum(q, np.array(PROJECTOR) - 1).astype(np.float32)
    unlit = np.zeros(CAMERA, dtype=bool)
    unlit[2:4, 3:6] = True
    q[unlit] = np.nan
    direct, near = transport.direct.copy(), transport.near.copy()
    direct[unlit], near[unlit] = 0, 0
    return replace(transport, correspondence=q, direct=direct, near=near, **changes)


def blurred_world():
    """A transport whose near-range light is of hats, and whose direct light of boxes."""
    base, generator = world(), np.random.default_rng(5)
    near = generator.uniform(0, 0.01, (*CAMERA, 2, 25 + 16))
    footprint = np.tile(np.array([1.7, 2.2, 0.3, -0.4]), (*CAMERA, 1))
    near[~base.lit] = 0
    return replace(
        base,
        near=near.astype(np.float32),
        pitch=4,
        footprint=footprint.astype(np.float32),
    )


def a_light(channels=None):
    shape = PROJECTOR if channels is None else (*PROJECTOR, channels)
    return np.random.default_rng(3).uniform(0, 1, shape).astype(np.float32)


def distances(transport):
    """Distance of every projector pixel from every q, (C, Py, Px); infinite without q."""
    q = transport.correspondence.reshape(-1, 2).astype(np.float64)
    places = np.moveaxis(np.indices(PROJECTOR), 0, -1)
    return np.nan_to_num(np.linalg.norm(places - q[:, None, None], axis=-1), nan=np.inf)


def masked(transport, light, allowed):
    """Sum T's dense rows over what is allowed, (C, Py, Px)."""
    rows = transport.rows(slice(None)).astype(np.float64).reshape(-1, 2, *PROJECTOR)
    shaped = light[..., None] if light.ndim == 2 else light
    lit = np.broadcast_to(np.moveaxis(shaped, 2, 0), (2, *PROJECTOR))
    return np.einsum("ciyx,iyx,cyx->ci", rows, lit, allowed.astype(float)).reshape(*CAMERA, 2)


WORLDS = {"single pixels": world, "hats and boxes": blurred_world}
EDGES = [(0, 0.8), (0, 3), (0, 5.5), (0, 40), (2, 5), (0.5, 9.3)]


@pytest.mark.parametrize("make", WORLDS.values(), ids=WORLDS)
@pytest.mark.parametrize("channels", [None, 2])
@pytest.mark.parametrize(("inner", "outer"), EDGES)
def test_rings_are_the_dense_rows_masked_by_distance(make, channels, inner, outer):
    transport, light = make(), a_light(channels)
    apart = distances(transport)
    expected = masked(transport, light, (apart >= inner) & (apart < outer))
    found = nearfar.probe(transport, light, MASK.ring(inner, outer))
    np.testing.assert_allclose(found, expected, atol=3e-6)
    assert np.abs(expected).max() > 0.01


def test_far_range_light_summed_some_functions_at_a_time_is_the_same(monkeypatch):
    """As at projectors whose sums along rows do not fit into memory."""
    transport, light = world(), a_light(2)
    whole = nearfar.probe(transport, light, MASK.ring(2, 5))
    monkeypatch.setattr("nearfar.applications.summed_light.FUNCTIONS_TOGETHER", 3)
    monkeypatch.setattr("nearfar.applications.summed_light.TABLE_BYTES", 12 * 18 * 25 * 7)
    monkeypatch.setattr("nearfar.applications.by_runs.BATCH_PIXELS", 10)
    found = nearfar.probe(transport, light, MASK.ring(2, 5))
    np.testing.assert_allclose(found, whole, atol=1e-6)


def fine_world(*, hats):
    """A transport of so many pixels that sums over large discs are interpolated."""
    projector, camera = Size(80, 100), Size(66, 76)
    transport = model_transport(
        projector, camera, window=7, far=Size(5, 5), channels=2, fractional=True
    )
    generator = np.random.default_rng(8)
    q = transport.correspondence + generator.uniform(-0.4, 0.4, (*camera, 2))
    q = np.clip(q, 0, np.array(projector) - 1).astype(np.float32)
    q[2:4, 3:6] = np.nan
    direct, near = transport.direct.copy(), transport.near.copy()
    changes = {}
    if hats:
        near = generator.uniform(0, 0.01, (*camera, 2, 49 + 16)).astype(np.float32)
        footprint = np.tile(np.array([1.7, 2.2, 0.3, -0.4], np.float32), (*camera, 1))
        changes = {"pitch": 4, "footprint": footprint}
    direct[2:4, 3:6], near[2:4, 3:6] = 0, 0
    return replace(transport, correspondence=q, direct=direct, near=near, **changes)


@pytest.mark.parametrize("hats", [False, True])
@pytest.mark.parametrize(("inner", "outer"), [(0, 33), (33, 50), (10, 300)])
def test_large_discs_are_interpolated_between_few_places(hats, inner, outer, monkeypatch):
    """Far-range light's discs are blurred about their edges, and all else is exact."""
    transport = fine_world(hats=hats)
    light = np.random.default_rng(3).uniform(0, 1, (*transport.projector, 2)).astype(np.float32)
    asked = []
    interpolate = run_loops.add_between
    monkeypatch.setattr(run_loops, "add_between", lambda *a: asked.append(interpolate(*a)))
    found = nearfar.probe(transport, light, MASK.ring(inner, outer))
    assert asked
    rest = nearfar.probe(transport, light, MASK.beyond(outer))
    within = nearfar.probe(transport, light, MASK.within(outer))
    np.testing.assert_allclose(rest + within, transport @ light, atol=3e-6)
    assert not found[~transport.lit].any()
    monkeypatch.setattr("nearfar.applications.by_runs.MOST_PLACES_OF_PIXEL", 0.0)
    exact = nearfar.probe(transport, light, MASK.ring(inner, outer))
    error = np.sqrt(np.mean((found - exact) ** 2) / np.mean((transport @ light) ** 2))
    assert error < 10 ** (-65 / 20)


@pytest.mark.parametrize("make", WORLDS.values(), ids=WORLDS)
def test_factors_in_half_precision_are_probed(make):
    transport, light = make(), a_light()
    found = nearfar.probe(in_half(transport), light, MASK.ring(2, 5))
    np.testing.assert_allclose(found, nearfar.probe(transport, light, MASK.ring(2, 5)), atol=2e-4)


@pytest.mark.parametrize("make", WORLDS.values(), ids=WORLDS)
def test_rings_that_meet_add_up_to_the_relit_picture(make):
    transport, light = make(), a_light()
    masks = [MASK.within(1), MASK.ring(1, 4), MASK.ring(4, 11), MASK.beyond(11)]
    total = sum(nearfar.probe(transport, light, mask) for mask in masks)
    np.testing.assert_allclose(total, transport @ light, atol=3e-6)


def test_without_q_all_light_comes_from_beyond():
    transport, light = world(), a_light()
    unlit = ~transport.lit
    assert not nearfar.probe(transport, light, MASK.within(30))[unlit].any()
    found = nearfar.probe(transport, light, MASK.beyond(30))
    np.testing.assert_allclose(found[unlit], (transport @ light)[unlit], atol=1e-6)
    # A ring without an outer edge is all that is beyond its inner one.
    open_ring = nearfar.probe(transport, light, MASK.ring(30, np.inf))
    np.testing.assert_allclose(open_ring, found, atol=1e-6)


def test_a_projector_pixel_on_the_edge_belongs_to_the_outer_ring():
    base = world()
    transport = replace(base, correspondence=np.rint(base.correspondence))
    apart, light = distances(transport), a_light()
    assert (apart == 5).any()
    found = nearfar.probe(transport, light, MASK.within(5))
    np.testing.assert_allclose(found, masked(transport, light, apart < 5), atol=3e-6)


@pytest.mark.parametrize("make", WORLDS.values(), ids=WORLDS)
@pytest.mark.parametrize("width", [0.9, 4.1])
@pytest.mark.parametrize("lines", ["rows", "columns", "slanted", "with an epipole"])
def test_a_band_is_the_dense_rows_masked_by_distance_from_the_line(make, width, lines):
    matrices = {
        "rows": [[0, 0, 0], [0, 0, -1], [0, 2, 0.3]],
        "columns": [[0, 0, -1], [0, 0, 0], [2, 0, 0.3]],
        "slanted": [[0.01, 0.02, -1], [0.03, -0.01, 1.7], [2, -1.5, 0.3]],
        # (a, b) vanish at camera pixel x = 4, y = 3.
        "with an epipole": [[0, 1, -3], [-1, 0, 4], [0.5, 0.7, -6]],
    }
    fundamental = np.array(matrices[lines])
    transport, light = make(), a_light()
    y, x = np.indices(PROJECTOR)
    allowed = np.zeros((CAMERA.pixels, *PROJECTOR), dtype=bool)
    for c in range(CAMERA.pixels):
        down, across = divmod(c, CAMERA.width)
        a, b, off = fundamental @ [across, down, 1]
        if a or b:
            allowed[c] = np.abs(a * x + b * y + off) / np.hypot(a, b) <= width / 2
    assert allowed.any()
    found = nearfar.probe(transport, light, MASK.epipolar(fundamental, width))
    np.testing.assert_allclose(found, masked(transport, light, allowed), atol=3e-6)


def test_any_mask_multiplies_t_entry_by_entry():
    transport, light = world(), a_light()
    generator = np.random.default_rng(8)
    each = generator.uniform(-1, 1, (CAMERA.pixels, *PROJECTOR))
    expected = masked(transport, light, each)
    for shape in ((*CAMERA, *PROJECTOR), (CAMERA.pixels, PROJECTOR.pixels)):
        found = nearfar.probe(transport, light, MASK.of_matrix(each.reshape(shape)))
        np.testing.assert_allclose(found, expected, atol=3e-6)
    found = nearfar.probe(transport, light, MASK.of_matrix(each[0]))
    np.testing.assert_allclose(found, transport @ (light * each[0]), atol=3e-6)


def test_an_exact_transport_is_probed_as_a_measured_one():
    transport, light = world(), a_light()
    exact = nearfar.ExactTransport(
        PROJECTOR, CAMERA, (), (), np.moveaxis(transport.dense(), 1, 0), "dense"
    )
    fundamental = np.array([[0.01, 0.02, -1], [0.03, -0.01, 1.7], [2, -1.5, 0.3]])
    mask = MASK.epipolar(fundamental, 3)
    found = nearfar.probe(exact, light, mask)
    np.testing.assert_allclose(found, nearfar.probe(transport, light, mask), atol=3e-6)


@pytest.mark.parametrize("table_bytes", [0, 2**27])
@pytest.mark.parametrize("make", WORLDS.values(), ids=WORLDS)
def test_blocks_of_a_stored_transport_give_the_same(make, table_bytes, tmp_path, monkeypatch):
    """Also where sums along rows are made for the rows that a block needs."""
    transport, light = make(), a_light()
    monkeypatch.setattr("nearfar.applications.summed_light.TABLE_BYTES", table_bytes)
    save_transport(transport, tmp_path / "t.zarr")
    stored = open_transport(tmp_path / "t.zarr")
    monkeypatch.setattr("nearfar.transport.stored.StoredTransport.blocks", three_rows)
    each = np.random.default_rng(8).uniform(0, 1, (*CAMERA, *PROJECTOR))
    lines = np.array([[0.01, 0.02, -1], [0.03, -0.01, 1.7], [2, -1.5, 0.3]])
    for mask in (MASK.ring(1, 4), MASK.beyond(3), MASK.epipolar(lines, 3), MASK.of_matrix(each)):
        found = probe_stored(stored, light, mask)
        np.testing.assert_allclose(found, nearfar.probe(transport, light, mask), atol=1e-6)


def three_rows(stored):
    """Yield a stored transport in blocks of three camera rows."""
    for first in range(0, CAMERA.height, 3):
        yield stored.rows(slice(first, first + 3))


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: MASK.within(0), "the radius is 0"),
        (lambda: MASK.within(float("nan")), "the radius is nan"),
        (lambda: MASK.beyond(-2), "the radius is -2"),
        (lambda: MASK.ring(3, 3), "the outer radius is 3"),
        (lambda: MASK.ring(-1, 3), "the inner radius is -1"),
        (lambda: MASK.epipolar(np.eye(2), 1), "2x2: give 3x3"),
        (lambda: MASK.epipolar(np.zeros((3, 3)), 1), "makes no lines"),
        (lambda: MASK.epipolar(np.eye(3), 0), "the width is 0"),
        (lambda: MASK.of_matrix(np.zeros(3)), "1 axes"),
        (lambda: MASK.of_matrix(["a"]), "real numbers"),
    ],
)
def test_a_mask_that_cannot_be_is_refused(make, words):
    with pytest.raises(InputError, match=words):
        make()


@pytest.mark.parametrize(
    ("light", "mask", "words"),
    [
        (np.ones((3, 3)), MASK.within(2), "resize the light"),
        (np.ones(PROJECTOR), MASK.of_matrix(np.ones((3, 4))), "the mask is 3x4"),
        (np.ones(PROJECTOR), MASK.of_matrix(np.full(PROJECTOR, np.nan)), "the mask holds NaN"),
        (np.ones(PROJECTOR), 3.0, "float was given for the mask"),
    ],
)
def test_what_does_not_fit_is_refused(light, mask, words):
    with pytest.raises(InputError, match=words):
        nearfar.probe(world(), light, mask)


def test_q_at_the_very_edge_is_between_places():
    """Rounding may put it just beyond them."""
    projector = Size(294, 20)
    for radius in (32.66666666666667, *np.arange(32, 100, 0.1)):
        first, places = grid_of_places(radius, projector)
        spacing = radius * SPACING_OF_RADIUS
        y, x = (first + spacing * np.arange(count) for count in places)
        # Cubic convolution is exact for planes.
        grid = np.ascontiguousarray((y[:, None] + 2 * x)[..., None].astype(np.float32))
        # No q reads the last column, unless an index below the first counts from there.
        grid[:, -1] = np.inf
        q = np.array([[-0.5, -0.5], [293.5, 19.5], [293.5, -0.5], [100.2, 7.9], [np.nan, 3.0]])
        found = np.zeros((len(q), 1), dtype=np.float32)
        run_loops.add_between(grid, first, spacing, 1, q.astype(np.float32), found)
        expected = np.nan_to_num(q[:, 0] + 2 * q[:, 1], nan=0.0)
        np.testing.assert_allclose(found[:, 0], expected, atol=1e-3)


def test_q_beside_the_projector_is_summed_exactly():
    transport = fine_world(hats=False)
    q = transport.correspondence.copy()
    q[10, 10] = (-30.0, 150.0)
    transport = replace(transport, correspondence=q)
    found = nearfar.probe(transport, nearfar.white(transport.projector), MASK.within(40))
    alone = of_rows(transport, slice(10, 11))
    expected = nearfar.probe(alone, nearfar.white(transport.projector), MASK.within(40))
    np.testing.assert_allclose(found[10], expected[0], atol=1e-6)


def test_tables_serve_again_for_rows_that_they_have(monkeypatch):
    """Blocks of camera rows one after the other ask for projector rows that overlap."""
    transport = world()
    monkeypatch.setattr("nearfar.applications.summed_light.TABLE_BYTES", 12 * 25 * 25 * 4)
    (light,) = summed_lights(transport.lights(a_light()), transport.factors)
    asked = [slice(0, 7), slice(2, 9), slice(3, 8), slice(10, 18), slice(0, 18), slice(5, 6)]
    tables = [next(iter(light.tables(lines))) for lines in asked]
    for table, lines in zip(tables, asked, strict=True):
        assert table.has(lines)
        rows = slice(lines.start - table.first, lines.stop - table.first)
        whole = next(iter(light.tables(slice(0, 18))))
        np.testing.assert_array_equal(table.sums[rows, :, :25], whole.sums[lines, :, :25])
    assert tables[0] is tables[1] is tables[2]
    assert tables[3] is not tables[2]
    # Most of the rows: all are made.
    assert tables[4] is tables[5]
    assert len(tables[4].sums) == 18
