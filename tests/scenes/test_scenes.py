import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from scipy import sparse

from nearfar import scenes
from nearfar.arrays import Size
from nearfar.errors import InputError
from nearfar.scenes.cornell import WAX as CANDLE_WAX
from nearfar.scenes.description import ByRadiosity
from nearfar.scenes.dipole import dipole, subsurface
from nearfar.scenes.form_factors import exchange
from nearfar.scenes.geometry import Scene, View, quadrilateral
from nearfar.scenes.optics import pinhole, sub_rays
from nearfar.scenes.patches import albedo, build_patches, with_medium
from nearfar.scenes.radiosity import ReflectionFactor, bounced, reflection_factor
from nearfar.scenes.rays import surface
from nearfar.scenes.render import body_of, patched, subsurface_of

TINY = Size(16, 16)


def total(transport):
    """T as a dense array (channels, C, P), in float64."""
    return np.stack(
        [
            d.toarray().astype(float) + n.toarray() + f
            for d, n, f in zip(transport.direct, transport.near, transport.far, strict=True)
        ]
    )


@pytest.fixture(scope="module")
def box():
    return scenes.build("cornell", TINY)


@pytest.fixture(scope="module")
def niche():
    return scenes.build("alcove", TINY)


@pytest.fixture(scope="module")
def beside():
    return scenes.build("cornell-aside", TINY)


@pytest.fixture(scope="module")
def case():
    return scenes.build("shelf", Size(16, 24))


@pytest.fixture(scope="module")
def wax_hand():
    return scenes.build("hand", Size(20, 20))


@pytest.fixture(scope="module")
def flight():
    return scenes.build("marble", TINY)


def surfaces(name):
    """Surfaces and views of a built-in scene."""
    return scenes.SCENES[name].compute.surfaces()


def described(name, size):
    """Parts, patches and exchange of a scene."""
    scene = surfaces(name)
    parts = scene.parts
    everything = surface(parts, range(len(parts)))
    occluders = surface(parts, [i for i, part in enumerate(parts) if part.occludes])
    patches = build_patches(everything, parts, pinhole(scene.projector_view, size), size)
    return parts, patches, exchange(patches, parts, occluders)


def test_names_are_light_to_import_and_a_wrong_one_is_told():
    names = (
        "cornell, cornell-aside, cornell-left, cornell-right, wedge, corner, alcove, shelf, "
        "hand, marble"
    )
    with pytest.raises(InputError, match=names):
        scenes.build("teapot")
    code = (
        "import nearfar.scenes as s, sys; [s.SCENES[name] for name in s.SCENES.own]; "
        "sys.exit('trimesh' in sys.modules)"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


@pytest.mark.parametrize(
    ("name", "projector", "camera"),
    [
        ("cornell", Size(13, 17), None),
        ("cornell-aside", Size(12, 9), Size(15, 20)),
        ("cornell-left", Size(9, 12), Size(10, 11)),
        ("wedge", Size(12, 20), None),
        ("wedge", Size(9, 8), Size(5, 31)),
        ("corner", Size(16, 16), Size(32, 32)),
        ("corner", Size(1, 2), Size(3, 1)),
        ("alcove", Size(13, 17), None),
        ("shelf", Size(12, 18), None),
        # So coarse that some sides of books have no patch of their own.
        ("shelf", Size(2, 1), Size(11, 8)),
        ("hand", Size(9, 14), Size(12, 11)),
        ("marble", Size(13, 10), None),
    ],
)
def test_any_size_is_whole_exposed_and_not_negative(name, projector, camera):
    seen = []
    transport = scenes.build(
        name, projector, camera, progress=lambda what, share: seen.append((what, share))
    )
    assert transport.projector == projector
    if camera is not None:
        assert transport.camera == camera
    values = total(transport)
    assert np.isfinite(values).all()
    assert values.min() > -1e-6
    assert values.sum(axis=2).max() == pytest.approx(0.9, rel=1e-4)
    assert seen[-1][1] == 1.0


def test_two_projectors_light_a_part_of_the_box_each_before_one_camera():
    camera = Size(16, 16)
    left, right = (scenes.build(f"cornell-{side}", TINY, camera) for side in ("left", "right"))
    lit = [np.isfinite(each.correspondence[..., 0]) for each in (left, right)]
    # The walls and the sides of the back wall by one of them, its middle by both.
    row = camera.height // 3
    assert [one[row, 0] for one in lit] == [True, False]
    assert [one[row, -1] for one in lit] == [False, True]
    assert [one[row, camera.width // 2] for one in lit] == [True, True]


def test_the_same_again(box):
    again = scenes.build("cornell", TINY)
    np.testing.assert_array_equal(again.far, box.far)
    assert (again.direct[0] != box.direct[0]).nnz == 0


@pytest.mark.parametrize(
    ("name", "least", "most", "largest_body"),
    [
        ("box", (0.6, 0.03, 0.1), (0.85, 0.15, 0.3), 0.4),
        ("niche", (0.6, 0.03, 0.1), (0.85, 0.15, 0.3), 0.4),
        ("flight", (0.4, 0.2, 0.1), (0.7, 0.4, 0.3), 0.45),
    ],
)
def test_components_have_their_place(name, least, most, largest_body, request):
    """Direct light on the diagonal, near-range on one body alone, far-range everywhere."""
    box = request.getfixturevalue(name)
    lit = sparse.coo_array(box.direct[0])
    shares = [sum(part.sum() for part in parts) for parts in (box.direct, box.near)]
    found = np.array([*shares, box.far.sum()]) / (sum(shares) + box.far.sum())
    assert (found > least).all()
    assert (found < most).all()
    np.testing.assert_array_equal(lit.coords[0], lit.coords[1])
    y, x = np.indices(TINY)
    np.testing.assert_allclose(box.correspondence[box.lit], np.stack([y, x], -1)[box.lit])
    assert box.lit.all()
    body = box.near[0].sum(axis=1) > 0
    assert 0.05 < body.mean() < largest_body
    assert (box.far.sum(axis=2) > 0).all()


@pytest.mark.parametrize("name", ["cornell", "corner", "alcove", "marble"])
def test_coaxial_transport_is_reciprocal(name, box, niche, flight):
    """T(c, p) / T(p, c) is the ratio of the fluxes of p and c, solid angles in the image plane."""
    known = {"cornell": box, "alcove": niche, "marble": flight}
    transport = known.get(name) or scenes.build(name, TINY)
    _, solid_angle, pixel = sub_rays(pinhole(surfaces(name).projector_view, TINY), TINY, 4)
    even = total(transport) / np.bincount(pixel, solid_angle)
    np.testing.assert_allclose(even, np.swapaxes(even, 1, 2), atol=1e-6 * even.max())


@pytest.mark.parametrize("name", ["beside", "case", "wax_hand"])
def test_shadows_hold_only_indirect_light(name, request):
    transport = request.getfixturevalue(name)
    dark = ~transport.lit
    assert 0.005 < dark.mean() < 0.12
    rows = dark.ravel()
    assert all(part[rows].nnz == 0 for part in transport.direct)
    far = transport.far.sum(axis=(0, 2))[rows]
    assert (far > 0).mean() > 0.98


def test_camera_aside_sees_each_point_lit_by_its_own_pixel(beside):
    """The correspondence of the back wall is a projective map, to a fraction of a pixel."""
    height, width = beside.camera
    y, x = np.indices(beside.camera).reshape(2, -1).astype(float)
    q = beside.correspondence.reshape(-1, 2)
    wall = (y > 0.1 * height) & (y < 0.4 * height) & (x > 0.25 * width) & (x < 0.9 * width)
    wall &= np.isfinite(q[:, 0])
    design = np.stack([np.ones_like(x), x, y, x * y, x**2, y**2], axis=-1)[wall]
    fit, *_ = np.linalg.lstsq(design, q[wall], rcond=None)
    assert np.abs(design @ fit - q[wall]).mean() < 0.3


def test_camera_aside_sees_what_the_projector_lights(case):
    """All lit points of the bookcase lie in the field of the pattern, the duck at the lower left.

    Red light goes furthest in the soap.
    """
    q = case.correspondence[case.lit]
    assert (q >= 0).all()
    assert (q <= np.array(case.projector) - 1).all()
    near = np.stack([part.sum(axis=1) for part in case.near]).reshape(3, *case.camera)
    red, green, blue = near.sum(axis=(1, 2))
    assert red > green > blue > 0
    assert near[:, :16].sum() == 0
    assert near[:, :, 24:].sum() == 0


def test_light_under_wax_is_red_in_the_hand_and_nowhere_else(wax_hand):
    """Blue light is absorbed the most; the wall above the fingers has none."""
    near = np.stack([part.sum(axis=1) for part in wax_hand.near]).reshape(3, *wax_hand.camera)
    red, green, blue = near.sum(axis=(1, 2))
    assert red > green > blue > 0
    assert 0.1 < (near[0] > 0).mean() < 0.4
    assert near[:, 0].sum() == 0
    assert near[:, :, -3:].sum() == 0


@pytest.mark.parametrize("name", ["cornell", "corner", "shelf"])
def test_finer_camera_averages_to_the_coarser(name, box):
    coarse = box if name == "cornell" else scenes.build(name, TINY, TINY)
    fine = scenes.build(name, TINY, Size(32, 32))
    mean = total(fine).reshape(3, 16, 2, 16, 2, -1).mean(axis=(2, 4)).reshape(3, 256, 256)
    expected = total(coarse)
    # One exposure each: compare up to that number.
    mean *= expected.sum() / mean.sum()
    np.testing.assert_allclose(mean, expected, atol=1e-5)


@pytest.mark.parametrize("name", scenes.SCENES.own)
def test_nothing_reflects_more_than_falls(name):
    """No patch of any scene sends out more than arrives, nor reflects more than falls on it."""
    parts, patches, form = described(name, Size(12, 15))
    assert (form.sum(axis=1) / patches.area).max() < 1
    values = albedo(patches, parts)
    body = np.flatnonzero(with_medium(patches, parts))
    for channel, inside in enumerate(subsurface_of(patches, parts, body)):
        values[body, channel] += inside @ patches.area[body]
    assert values.min() > 0
    assert values.max() < 1


@pytest.mark.parametrize("name", ["cornell", "alcove", "shelf", "hand", "marble"])
def test_transport_is_the_sum_of_all_bounces(name):
    """Against the Neumann series, bounce by bounce, in float64 and with R and F themselves."""
    parts, patches, form = described(name, Size(10, 10))
    candle = np.flatnonzero(with_medium(patches, parts))
    medium = parts[patches.part[candle[0]]].material.medium
    assert medium is not None
    inside = 0.8 * subsurface(body_of(patches, candle), dipole(medium, 0))
    values = albedo(patches, parts)[:, 0]

    reflection = np.diag(values)
    reflection[np.ix_(candle, candle)] += inside * patches.area[candle]
    transfer = form.astype(float) / patches.area[:, None]
    once = reflection @ (patches.flux / patches.area)
    bounce, known = once, np.zeros(len(patches))
    for _ in range(200):
        bounce = reflection @ (transfer @ bounce)
        known += bounce

    factor = reflection_factor(values, patches, candle, inside)
    far = bounced(form, factor) @ patches.flux.astype(np.float32)
    np.testing.assert_allclose(far, known, rtol=1e-4, atol=1e-5 * known.max())


@pytest.mark.parametrize("hidden", [0, 1, 40])
def test_patches_that_are_left_out_reflect_all_the_same(hidden):
    rng = np.random.default_rng(hidden)
    body = np.array([60, 61, 70])
    form = rng.random((90, 90), dtype=np.float32)
    form = 0.4 / 90 * (form + form.T)
    scale = rng.uniform(0.5, 1.0, 90).astype(np.float32)
    scale[body] = 0.0
    block = np.tril(rng.uniform(0.1, 0.6, (3, 3))).astype(np.float32)
    factor = ReflectionFactor(scale, body, block)
    whole = bounced(form.copy(), factor)
    some = bounced(form.copy(), factor, hidden)
    np.testing.assert_allclose(some, whole[hidden:, hidden:], rtol=1e-4, atol=1e-5 * whole.max())


@pytest.mark.parametrize("name", ["cornell-aside", "wedge"])
def test_patches_that_are_left_out_are_neither_lit_nor_seen(name):
    compute = scenes.SCENES[name].compute
    assert isinstance(compute, ByRadiosity)
    found = patched(compute.surfaces(), TINY, TINY, progress=lambda *_: None)
    seen = found.gathered.radiosity.sum(axis=0) > 0
    out = np.arange(len(found.patches)) < found.hidden
    of_body = np.isin(np.arange(len(out)), found.translucent)
    assert out.any()
    np.testing.assert_array_equal(out, ~(seen | (found.patches.pixel >= 0) | of_body))
    # Highlights are on lit patches.
    highlights = found.gathered.gloss.indices
    assert len(highlights) > 0 or name == "wedge"
    assert (found.patches.pixel[highlights] >= 0).all()
    # Each has kept its samples.
    own = found.patches
    shares = own.areas / own.areas.sum(axis=1, keepdims=True)
    middle = (shares[..., None] * own.positions).sum(axis=1)
    np.testing.assert_allclose(middle, own.centre, atol=1e-9)


def slab(tone):
    """A flat piece of wax whose texture is that factor of the place, seen from the front."""
    wax = replace(CANDLE_WAX, gloss=None, texture=tone)
    wall = quadrilateral("slab", (-1.0, -1.0, 0.0), (2.0, 0.0, 0.0), (0.0, 2.0, 0.0), wax)
    return Scene("slab", (wall,), View((0.0, 0.0, 2.0), (0.0, 0.0, 0.0), 0.1), None)


def under(tone):
    """Light under a slab from patch to patch, and where the patches lie."""
    found = patched(slab(tone), Size(12, 12), Size(12, 12), progress=lambda *_: None)
    return found.inside[0], found.patches.centre[found.translucent], found.albedo


def test_an_even_texture_dims_all_that_wax_sends_back_alike():
    (bright, _, albedo_of_bright), (dim, _, albedo_of_dim) = (
        under(lambda place, t=t: np.full(place.shape[:-1], t)) for t in (1.0, 0.5)
    )
    np.testing.assert_allclose(dim, 0.5 * bright)
    np.testing.assert_allclose(albedo_of_dim, 0.5 * albedo_of_bright)


def test_a_texture_dims_light_under_wax_where_it_enters_and_where_it_leaves():
    bright, place, _ = under(lambda place: np.ones(place.shape[:-1]))
    half, _, _ = under(lambda place: np.where(place[..., 0] > 0, 0.25, 1.0))
    # Patches at the border have both.
    inner = np.abs(place[:, 0]) > 0.1
    dark = place[inner, 0] > 0
    ratio = (half / bright)[np.ix_(inner, inner)]
    np.testing.assert_allclose(ratio, 0.5 ** np.add.outer(dark.astype(int), dark))
