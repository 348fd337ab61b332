"""Edited transports beside dense rows, and bodies of wax whose kernel is known."""

from dataclasses import replace

import numpy as np
import pytest

import nearfar
from nearfar.applications.editing import recoloured_under_surfaces, widened
from nearfar.arrays import Size
from nearfar.errors import InputError
from nearfar.estimate.physical import PhysicalSplit
from nearfar.estimate.physical.elsewhere import nowhere
from nearfar.estimate.physical.kernels import kernel, source_at
from nearfar.estimate.physical.split import Translucent
from nearfar.estimate.physical.subsurface import near_functions_of
from nearfar.illumination.near_basis import NearBasis, window_offsets
from nearfar.transport.dipole import diffuse_profile
from nearfar.transport.gains import why_unjudgeable
from tests.estimate.physical.test_split import (
    AMPLITUDE,
    ATTENUATION,
    DEPTH,
    PROJECTOR,
    WINDOW,
    transport_of,
    window_light,
)
from tests.worlds import model_transport

SMALL, CAMERA = Size(16, 20), Size(9, 11)


def world(channels=3):
    return model_transport(
        SMALL, CAMERA, window=5, far=Size(5, 5), channels=channels, fractional=True
    )


def masks():
    """Of the camera and the projector, with shares between 0 and 1."""
    of_camera, of_projector = np.zeros(CAMERA), np.zeros(SMALL)
    of_camera[2:6, :5], of_camera[7] = 1.0, 0.5
    of_projector[:, 12:], of_projector[3] = 1.0, 0.3
    return of_camera, of_projector


@pytest.fixture(scope="module")
def waxen():
    """A disc of wax with specks of paint, split: light under its surface is known."""
    y, x = np.mgrid[: PROJECTOR.height, : PROJECTOR.width]
    coverage = (np.hypot(y - 15, x - 16) < 10).astype(float)
    direct = np.random.default_rng(4).uniform(0.05, 0.3, (*PROJECTOR, 1)).repeat(2, axis=2)
    near = window_light(coverage, attenuations=(ATTENUATION, 1.5 * ATTENUATION))
    split = nearfar.split_physically(transport_of(near, direct))
    assert split.bodies
    return split


@pytest.mark.parametrize("factor", [0.6, 1.5])
def test_light_under_a_surface_reaches_as_far_as_was_asked_for(waxen, factor):
    edited = widened(waxen, factor)
    # Well inside of the disc no window reaches beyond it.
    inner = (slice(13, 18), slice(14, 19))
    middle = WINDOW // 2
    found = (edited.near - waxen.transport.near)[inner]
    for channel, attenuation in enumerate((ATTENUATION, 1.5 * ATTENUATION)):
        before, after = (
            AMPLITUDE * kernel(source_at(f * DEPTH, attenuation / f), middle) for f in (1, factor)
        )
        after *= before.sum() / after.sum()
        known = np.hypot(*window_offsets(WINDOW).reshape(WINDOW, WINDOW, 2).T) < 5
        error = np.sqrt(np.mean((found[:, :, channel] - (after - before))[..., known] ** 2))
        assert error < 0.25 * np.sqrt(np.mean((after - before)[known] ** 2))


@pytest.mark.parametrize("factor", [0.6, 1.5])
def test_wider_or_narrower_light_is_as_much_and_elsewhere_nothing_changes(waxen, factor):
    transport, edited = waxen.transport, widened(waxen, factor)
    white = np.ones(PROJECTOR, np.float32)
    np.testing.assert_allclose(edited @ white, transport @ white, atol=1e-6)
    opaque = np.ones(PROJECTOR, bool)
    opaque[3:28, 4:29] = False
    np.testing.assert_array_equal(edited.near[opaque], transport.near[opaque])
    assert np.abs(edited.near - transport.near).max() > 0.01
    for name in ("direct", "far", "correspondence", "black"):
        assert getattr(edited, name) is getattr(transport, name)


def test_light_narrowed_after_it_was_widened_is_nearly_as_it_was(waxen):
    before, there = waxen.transport, widened(waxen, 1.4)
    back = nearfar.widen_subsurface(there, 1 / 1.4)
    off, moved = (np.abs(one.near - before.near).mean() for one in (back, there))
    assert off < 0.4 * moved
    assert [list(edit) for edit in back.provenance["edits"]] == [["widen_subsurface"]] * 2


def test_subsurface_light_alone_is_recoloured(waxen):
    transport = waxen.transport
    edited = recoloured_under_surfaces(waxen, np.diag([1.0, 0.25]))
    white = np.ones(PROJECTOR, np.float32)
    under = waxen.components(white).subsurface
    changed = transport @ white - edited @ white
    np.testing.assert_allclose(changed[..., 0], 0, atol=1e-6)
    expected = 0.75 * under[..., 1]
    assert np.abs(changed[..., 1] - expected).max() < 0.05 * expected.max()


@pytest.mark.parametrize(("pitch", "share"), [(1, 0.04), (4, 0.1)])
def test_light_under_a_surface_in_functions_of_near_light_is_its_kernel(pitch, share):
    """A flat body over all of the projector, broad beside the finest functions."""
    size, depth, attenuation = Size(64, 64), 4.0, 0.15
    base = model_transport(size, Size(12, 12), window=5, far=Size(3, 3), fractional=True)
    basis = NearBasis(29, 1) if pitch == 1 else NearBasis(9, pitch)
    near = np.zeros((*base.camera, 1, *basis.shape), np.float32)
    boxes = np.zeros((*base.camera, 4), np.float32) if pitch > 1 else None
    transport = replace(base, near=near, pitch=pitch, footprint=boxes)
    pixels = np.arange(144)
    source = source_at(depth, attenuation)
    body = Translucent(
        pixels,
        transport.correspondence.reshape(-1, 2),
        np.ones(size),
        (source,),
        np.zeros(144, int),
        np.full((144, 1), 2.0),
        np.ones(144),
    )
    split = PhysicalSplit(transport, transport.direct, (body,), nowhere(1), transport.footprint)
    found = near_functions_of(split)
    # A camera pixel in the middle, whose window lies on the projector.
    pixel = 5 * 12 + 5
    drawn = basis.drawn(found[pixel])[0]
    around = basis.reach
    q = transport.correspondence.reshape(-1, 2)[pixel].astype(float)
    off = q - np.rint(q)
    steps = np.arange(-around, around + 1)
    square = (steps[:, None] - off[0]) ** 2 + (steps - off[1]) ** 2
    expected = 2.0 * diffuse_profile(source, square)
    inside = square < 12**2
    error = np.sqrt(np.mean((drawn - expected)[inside] ** 2))
    assert error < share * np.sqrt(np.mean(expected[inside] ** 2))


@pytest.mark.parametrize("component", ["direct", "near", "far"])
def test_a_matrix_mixes_the_channels_of_one_component(component):
    transport = world()
    matrix = np.array([[0.5, 0.2, 0.0], [0.0, 1.0, 0.1], [0.3, 0.0, 2.0]])
    edited = nearfar.recolour(transport, component, matrix)
    light = nearfar.random_pattern(SMALL, 3)
    before, after = (t.components(light)._asdict() for t in (transport, edited))
    for name, picture in before.items():
        expected = picture @ matrix.T if name == component else picture
        np.testing.assert_allclose(after[name], expected, rtol=1e-4, atol=1e-6)


def test_a_factor_for_each_channel_is_a_matrix_without_mixing():
    transport, factors = world(), [0.5, 1.0, 2.0]
    one, other = (nearfar.recolour(transport, "near", c) for c in (factors, np.diag(factors)))
    np.testing.assert_array_equal(one.near, other.near)
    np.testing.assert_allclose(one.near, transport.near * np.reshape(factors, (3, 1, 1)))


def test_far_light_between_regions_is_cut_as_well_as_its_waves_can():
    """Beside least squares on dense rows."""
    transport, (of_camera, of_projector) = world(), masks()
    cut = nearfar.cut_far(transport, of_camera, of_projector)
    before, after = (
        t.component_rows(slice(None)).far.astype(np.float64) for t in (transport, cut.transport)
    )
    exact = before * of_camera.ravel()[:, None, None] * of_projector.ravel()
    waves = transport.far_basis.patterns.astype(np.float64)
    flat = exact.reshape(-1, SMALL.pixels)
    nearest = np.linalg.lstsq(waves.T, flat.T, rcond=None)[0].T @ waves
    np.testing.assert_allclose((before - after).reshape(flat.shape), nearest, atol=1e-7)
    expected = np.sqrt(np.sum((flat - nearest) ** 2) / np.sum(flat**2))
    assert cut.error == pytest.approx(expected, rel=1e-3)
    assert 0.05 < cut.error < 0.9


def test_a_cut_is_exact_under_white_and_leaves_the_rest_alone():
    transport, (of_camera, of_projector) = world(), masks()
    cut = nearfar.cut_far(transport, of_camera, of_projector).transport
    white = np.ones(SMALL, np.float32)
    far = transport.components(white).far
    by_region = transport.components(of_projector.astype(np.float32)).far
    expected = far - of_camera[..., None] * by_region
    np.testing.assert_allclose(cut.components(white).far, expected, atol=2e-6)
    untouched = of_camera == 0
    np.testing.assert_allclose(cut.far[untouched], transport.far[untouched], atol=1e-7)
    assert cut.direct is transport.direct
    assert cut.near is transport.near


def test_an_edited_transport_is_kept_and_says_so(tmp_path):
    transport = world()
    edited = nearfar.recolour(nearfar.recolour(transport, "near", [1, 2, 3]), "far", [1, 1, 0.5])
    nearfar.save_transport(edited, tmp_path / "t.zarr")
    again = nearfar.load_transport(tmp_path / "t.zarr")
    light = nearfar.random_pattern(SMALL, 3)
    np.testing.assert_array_equal(again @ light, edited @ light)
    assert [edit["recolour"] for edit in again.provenance["edits"]] == ["near", "far"]
    assert "was edited" in why_unjudgeable(again.provenance)
    assert why_unjudgeable(transport.provenance) is None
    with pytest.raises(InputError, match="changed after it was reconstructed"):
        nearfar.ErrorBars(again)


@pytest.mark.parametrize(
    ("edit", "words"),
    [
        (lambda t: nearfar.widen_subsurface(t, 0), "above 0"),
        (lambda t: nearfar.widen_subsurface(t, 1e300), "up to 1e"),
        (lambda t: nearfar.widen_subsurface(t, 2), "nothing in the scene is translucent"),
        (lambda t: nearfar.recolour(t, "subsurface", [1, 1, 1]), "is translucent"),
        (lambda t: nearfar.recolour(t, "shadow", [1, 1, 1]), "'shadow' is no component"),
        (lambda t: nearfar.recolour(t, "free", [1, 1, 1]), "'free' is no component"),
        (lambda t: nearfar.recolour(t, "near", [1, 1]), "the colour is 2, .* 3 channels"),
        (lambda t: nearfar.recolour(t, "near", [1, 1, np.nan]), "the colour holds NaN"),
        (lambda t: nearfar.recolour(t, "near", [1, 1, 1e300]), "range of float32"),
        (lambda t: nearfar.cut_far(t, np.ones((3, 3)), np.ones(SMALL)), "camera mask is 3x3"),
        (lambda t: nearfar.cut_far(t, np.ones(CAMERA), np.ones((3, 3))), "projector mask is 3x3"),
        (lambda t: nearfar.cut_far(t, 2 * np.ones(CAMERA), np.ones(SMALL)), "give 0 to 1"),
        (lambda _: nearfar.cut_far(1, np.ones(CAMERA), np.ones(SMALL)), "load_transport"),
    ],
)
def test_what_does_not_fit_gets_a_sentence(edit, words):
    with pytest.raises(InputError, match=words):
        edit(world())
