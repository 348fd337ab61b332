"""Error bars of transports from any patterns: dense Gaussian algebra, and coverage."""

import json
from shutil import rmtree

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.errors import UnreadableFileError
from nearfar.estimate.any_patterns.covariance import near_root, pattern_model
from nearfar.estimate.any_patterns.estimate import estimate_from_patterns
from nearfar.estimate.error_bars import ErrorBars
from nearfar.illumination.near_basis import window_offsets
from nearfar.priors.component import PriorComponent
from nearfar.priors.covariance import far_variance, near_covariance
from nearfar.transport.model import Transport
from nearfar.transport.posterior import PatternPosterior
from nearfar.transport.store import load_transport, save_transport
from tests.estimate.lights_together import assert_each_light_has_its_own_errors
from tests.metadata import change_attributes

PROJECTOR = Size(8, 10)
WINDOW, PHOTOS = 5, 30
COMPONENTS = (PriorComponent(1.5, 8.0, 2.0), PriorComponent(0.0, 8.0, 2.0))
NOISE, RATIO = 2e-3, 16.0
# q of four camera pixels: two of one rounded q, one whose window the border cuts, and none.
PLACES = np.array([[3.0, 4.0], [3.25, 4.0], [0.0, 8.5], [np.nan, np.nan]], dtype=np.float32)
# Of black before any photo: nothing is known of the last.
BLACK_DEVIATIONS = np.array([1e-3, 2e-3, 0.5, np.inf], dtype=np.float32)


@pytest.fixture(scope="module")
def patterns():
    generator = np.random.default_rng(0)
    return generator.random((PHOTOS, PROJECTOR.pixels)).astype(np.float32)


@pytest.fixture(scope="module")
def transport(patterns):
    model = pattern_model(patterns, PROJECTOR, WINDOW)
    shape = (1, len(PLACES), 1)
    return Transport(
        projector=PROJECTOR,
        correspondence=PLACES[None],
        direct=np.zeros(shape, np.float32),
        near=np.zeros((*shape, WINDOW, WINDOW), np.float32),
        far=np.zeros((*shape, model.far_basis.count), np.float32),
        far_basis=model.far_basis,
        black=np.zeros(shape, np.float32),
        noise=np.full(shape, NOISE, np.float32),
        posterior=PatternPosterior(
            COMPONENTS,
            patterns,
            np.array([[0, 0, 0, 1]], np.uint8),
            np.full(shape[:2], RATIO, np.float32),
            BLACK_DEVIATIONS[None, :, None],
        ),
    )


def _parts(transport, c, lights):
    """Pictures of one camera pixel under lights, by unit b, d, window entries and responses."""
    q = PLACES[c]
    lit = bool(np.isfinite(q).all())
    centre = np.rint(np.nan_to_num(q)).astype(int)
    low, across = np.floor(np.nan_to_num(q)).astype(int), np.nan_to_num(q) % 1
    square = lights.reshape(-1, *PROJECTOR)
    direct = np.zeros(len(lights))
    for step in np.ndindex(2, 2):
        weight = np.prod(np.where(step, across, 1 - across))
        if weight:
            direct += weight * square[:, low[0] + step[0], low[1] + step[1]]
    window = np.zeros((len(lights), WINDOW**2))
    for entry, (y, x) in enumerate(window_offsets(WINDOW) + centre):
        if 0 <= y < PROJECTOR.height and 0 <= x < PROJECTOR.width:
            window[:, entry] = square[:, y, x]
    far = transport.far_basis.analyse(lights.astype(np.float64))
    return np.concatenate([np.ones((len(lights), 1)), lit * direct[:, None], lit * window, far], 1)


def _posterior(transport, c, patterns):
    """Covariance of b, d, n and F given the photos, by plain linear algebra."""
    component = COMPONENTS[transport.posterior.prior_component[0, c]]
    scale = RATIO * NOISE**2
    near = near_covariance(component, WINDOW, PROJECTOR)
    far = far_variance(transport.far_basis, component)
    prior = np.zeros((2 + len(near) + len(far),) * 2)
    # Nothing is known of d before.
    prior[[0, 1], [0, 1]] = min(BLACK_DEVIATIONS[c] ** 2, 10.0), 10.0
    prior[2 : 2 + len(near), 2 : 2 + len(near)] = scale * near
    prior[2 + len(near) :, 2 + len(near) :] = scale * np.diag(far)
    seen = _parts(transport, c, patterns)
    gain = prior @ seen.T @ np.linalg.inv(seen @ prior @ seen.T + NOISE**2 * np.eye(PHOTOS))
    return prior - gain @ seen @ prior


@pytest.mark.parametrize(
    "component",
    [
        COMPONENTS[0],
        COMPONENTS[1],
        PriorComponent(2.2, 16.0, 1.5, direct_spread=3.0),
        PriorComponent(6.0, 1.0, 3.0, roughness=1.0),
    ],
)
def test_roots_of_covariances(patterns, component):
    root = near_root(pattern_model(patterns, PROJECTOR, WINDOW), component)
    full = near_covariance(component, WINDOW, PROJECTOR)
    found = np.zeros_like(full)
    found[np.ix_(root.entries, root.entries)] = root.root @ root.root.T
    np.testing.assert_allclose(found, full, atol=1e-5)
    over_window = np.random.default_rng(3).random((4, WINDOW**2))
    seen = root.seen(over_window)
    np.testing.assert_allclose(seen @ seen.T, over_window @ full @ over_window.T, rtol=1e-4)


def test_error_bars_are_those_of_plain_linear_algebra(transport, patterns):
    light = np.random.default_rng(1).random(PROJECTOR).astype(np.float32)
    bars = ErrorBars(transport)
    found = bars.picture(light, direct=2.0, far=0.5)[0]
    of_direct = bars.direct()[0, :, 0]
    for c in range(len(PLACES)):
        covariance = _posterior(transport, c, patterns)
        (ask,) = _parts(transport, c, light.reshape(1, -1))
        ask[0] = 0.0
        ask[1] *= 2.0
        ask[2 + WINDOW**2 :] *= 0.5
        assert found[c] == pytest.approx(np.sqrt(ask @ covariance @ ask), rel=1e-3)
        lit = np.isfinite(PLACES[c, 0])
        known = np.sqrt(covariance[1, 1]) if lit else 0.0
        assert of_direct[c] == pytest.approx(known, rel=1e-3)


def test_each_of_several_lights_has_its_own_errors(transport):
    assert_each_light_has_its_own_errors(transport)


def test_error_bars_of_rows_are_those_of_plain_linear_algebra(transport, patterns):
    rows = ErrorBars(transport).component_rows(slice(1, 2))
    covariance = _posterior(transport, 1, patterns)
    deviation = np.sqrt(np.diag(covariance))
    entries = _parts(transport, 1, np.eye(PROJECTOR.pixels))
    near, far = entries[:, 2 : 2 + WINDOW**2], entries[:, 2 + WINDOW**2 :]
    of_far = covariance[2 + WINDOW**2 :, 2 + WINDOW**2 :]
    np.testing.assert_allclose(rows.direct[0, 0], entries[:, 1] * deviation[1], rtol=1e-3)
    np.testing.assert_allclose(rows.near[0, 0], near @ deviation[2 : 2 + WINDOW**2], rtol=1e-3)
    known = np.sqrt(np.einsum("pr,rs,ps->p", far, of_far, far))
    np.testing.assert_allclose(rows.far[0, 0], known, rtol=1e-3)


def test_what_error_bars_follow_from_comes_back(transport, tmp_path):
    save_transport(transport, tmp_path / "t.zarr")
    kept = load_transport(tmp_path / "t.zarr")
    light = np.random.default_rng(2).random(PROJECTOR).astype(np.float32)
    np.testing.assert_array_equal(
        ErrorBars(kept).picture(light), ErrorBars(transport).picture(light)
    )


def test_a_damaged_posterior_gets_a_sentence(transport, tmp_path):
    path = tmp_path / "t.zarr"
    save_transport(transport, path)
    kept = json.loads((path / "zarr.json").read_text())["attributes"]["belief"]
    for change, message in (
        ({"kinds": kept["kinds"][:1]}, "error bars"),
        ({"of": "light"}, "does not describe a transport"),
    ):
        change_attributes(path, belief={**kept, **change})
        with pytest.raises(UnreadableFileError, match=message):
            load_transport(path)
    change_attributes(path, belief=kept)
    rmtree(path / "belief_patterns")
    with pytest.raises(UnreadableFileError, match="belief_patterns"):
        load_transport(path)


def test_camera_pixels_without_direct_light_get_none(patterns):
    generator = np.random.default_rng(4)
    camera = Size(6, 10)
    places = np.indices(camera).reshape(2, -1).T.astype(np.float32)
    # The right half of the camera sees smooth light alone.
    lit = places[:, 1] < 5
    y, x = (np.indices(PROJECTOR) / np.array(PROJECTOR).reshape(2, 1, 1)).reshape(2, -1)
    far = 0.01 * (1 + 0.5 * np.cos(np.pi * y) + 0.3 * np.cos(np.pi * x))
    pixel = (places @ [PROJECTOR.width, 1]).astype(int)
    light = patterns @ far + np.where(lit[:, None], 0.4 * patterns[:, pixel].T, 0.0)
    photos = light + 1e-3 * generator.standard_normal(light.shape)
    photos = photos[:, None].astype(np.float32)
    model, rows = estimate_from_patterns(photos, patterns, places, camera, PROJECTOR, WINDOW)
    np.testing.assert_array_equal(rows.lit, lit)
    assert not rows.direct[~lit].any()
    assert not rows.near[~lit].any()
    assert (rows.direct[lit] > 0.2).all()
    assert model.far_basis.count == rows.far.shape[2]
