import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.scenes.form_factors import crosses_any, exchange
from nearfar.scenes.geometry import Material, View, ball, quadrilateral, solid
from nearfar.scenes.optics import pinhole
from nearfar.scenes.patches import build_patches
from nearfar.scenes.rays import surface

GREY = Material((0.5, 0.5, 0.5))
X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)


def minus(vector):
    return tuple(-value for value in vector)


def cube():
    far = (1.0, 1.0, 1.0)
    return [
        quadrilateral("floor", (0.0, 0.0, 0.0), Z, X, GREY),
        quadrilateral("left", (0.0, 0.0, 0.0), Y, Z, GREY),
        quadrilateral("back", (0.0, 0.0, 0.0), X, Y, GREY),
        quadrilateral("ceiling", far, minus(X), minus(Z), GREY),
        quadrilateral("right", far, minus(Z), minus(Y), GREY),
        quadrilateral("front", far, minus(Y), minus(X), GREY),
    ]


def patches_and_form(parts, view):
    size = Size(12, 12)
    everything = surface(parts, range(len(parts)))
    occluders = surface(parts, [i for i, part in enumerate(parts) if part.occludes])
    patches = build_patches(everything, parts, pinhole(view, size), size)
    return patches, exchange(patches, parts, occluders)


@pytest.fixture(scope="module")
def closed():
    return patches_and_form(cube(), View((0.5, 0.5, 0.95), (0.5, 0.45, 0.0), 0.4))


def test_walls_of_a_room_face_inwards():
    middle = np.full(3, 0.5)
    for part in cube():
        where = surface([part], [0])
        towards = middle - where.triangles[0].mean(axis=0)
        assert where.normals[0] @ towards > 0


def test_exchange_is_symmetric_and_areas_add_up(closed):
    patches, form = closed
    np.testing.assert_array_equal(form, form.T)
    assert patches.area.sum() == pytest.approx(6, rel=0.01)


def test_all_light_arrives_in_a_closed_box(closed):
    patches, form = closed
    arriving = form.sum(axis=1) / patches.area
    assert arriving.max() < 1
    assert np.average(arriving, weights=patches.area) == pytest.approx(1, abs=0.03)


@pytest.mark.parametrize(("pair", "known"), [((0, 3), 0.19982), ((0, 1), 0.20004)])
def test_unit_squares_exchange_the_known_share(closed, pair, known):
    """Opposite and adjacent faces of a cube; Howell's catalogue, C-11 and C-14."""
    patches, form = closed
    first, second = (patches.part == part for part in pair)
    assert form[np.ix_(first, second)].sum() == pytest.approx(known, rel=0.03)


def test_seams_are_right_row_by_row(closed):
    """Near the edge where two unit squares meet, one sees the other under nearly half its sky."""
    patches, form = closed
    floor, back = patches.part == 0, patches.part == 2
    share = form[np.ix_(floor, back)].sum(axis=1) / patches.area[floor]
    x, _, z = patches.centre[floor].T
    # Point to a perpendicular unit square of which it lies at distance z (Howell's C-3, twice).
    known = sum(
        (np.arctan(w / z) - z / np.hypot(1, z) * np.arctan(w / np.hypot(1, z))) / (2 * np.pi)
        for w in (x, 1 - x)
    )
    assert np.median(np.abs(share / known - 1)) < 0.03
    assert np.average(np.abs(share - known), weights=patches.area[floor]) < 0.01


def test_a_ball_between_hides_walls_from_each_other():
    parts = [*cube(), solid("ball", ball(0.3, subdivisions=2), GREY, move=(0.5, 0.5, 0.5))]
    patches, form = patches_and_form(parts, View((0.5, 0.5, 0.97), (0.5, 0.5, 0.0), 0.5))
    arriving = form.sum(axis=1) / patches.area
    sphere = patches.part == 6
    assert patches.area[sphere].sum() == pytest.approx(4 * np.pi * 0.09, rel=0.05)
    assert np.average(arriving, weights=patches.area) == pytest.approx(1, abs=0.04)
    assert form[np.ix_(sphere, sphere)].sum() < 1e-3
    low = form[np.ix_(patches.part == 0, patches.part == 3)].sum()
    assert low < 0.13


def test_segments_against_a_box():
    box = [(np.zeros(3), np.ones(3))]
    start = np.array([[-1.0, 0.5, 0.5], [-1.0, 3.0, 0.5]])
    end = np.array([[2.0, 0.5, 0.5], [2.0, 3.0, 0.5], [-0.5, 0.5, 0.5]])
    hits = crosses_any(start, end, box)
    np.testing.assert_array_equal(hits, [[True, False, False], [False, False, False]])
