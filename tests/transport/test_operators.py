"""Every operator against its adjoint, and every way to apply a transport against the others."""

import json
from dataclasses import replace

import numpy as np
import pytest
from scipy import sparse

from nearfar.arrays import Size
from nearfar.errors import InputError
from nearfar.estimate.matrices import build_matrices
from nearfar.illumination.frequencies import (
    CHECKERBOARD,
    DC,
    default_dropped,
    far_frequencies,
    near_frequencies,
    representatives,
    wrap,
)
from nearfar.illumination.real_basis import real_basis
from nearfar.transport import direct, near
from nearfar.transport.exact import ExactTransport
from nearfar.transport.gains import Gains, with_gains
from nearfar.transport.model import Transport
from tests.worlds import ideal_measurements, model_transport

PROJECTOR = Size(13, 18)
CAMERA = Size(9, 7)


@pytest.fixture
def generator():
    return np.random.default_rng(3)


def _places(generator, unlit: bool = True):
    """Correspondence with corners, borders, whole and fractional q, and unlit camera pixels."""
    q = generator.uniform(0, 1, size=(*CAMERA, 2)) * (np.array(PROJECTOR) - 1)
    q[0, 0] = (0, 0)
    q[0, 1] = np.array(PROJECTOR) - 1
    q[0, 2] = (PROJECTOR.height - 1, 3.5)
    q[0, 3] = (4, 4)
    q[0, 4] = (0.5, 0.5)
    if unlit:
        q[3, :3] = np.nan
    return q.astype(np.float32)


def _transport(generator, window=5, channels=2, far=Size(3, 4)):
    q = _places(generator)
    shape = (*CAMERA, channels)
    basis = real_basis(representatives(far_frequencies(far, PROJECTOR)), PROJECTOR)
    lit = np.isfinite(q[..., :1])
    n = generator.normal(size=(*shape, window, window)) * lit[..., None, None]
    inside = near.inside(near.centre(q, PROJECTOR), window, PROJECTOR)
    n = n * inside.reshape(*CAMERA, 1, window, window)
    return Transport(
        projector=PROJECTOR,
        correspondence=q,
        direct=(generator.normal(size=shape) * lit).astype(np.float32),
        near=n.astype(np.float32),
        far=generator.normal(size=(*shape, basis.count)).astype(np.float32),
        far_basis=basis,
        black=np.zeros(shape, np.float32),
        noise=np.zeros(shape, np.float32),
    )


def _exact(generator, channels=1):
    pixels = (CAMERA.pixels, PROJECTOR.pixels)

    def thin():
        return tuple(
            sparse.random_array(pixels, density=0.05, rng=generator, format="csr")
            for _ in range(channels)
        )

    return ExactTransport(
        PROJECTOR, CAMERA, thin(), thin(), generator.random((channels, *pixels), dtype=np.float32)
    )


def _direct_operator(generator):
    where = direct.footprint(_places(generator), PROJECTOR)
    return (
        (PROJECTOR.pixels,),
        (CAMERA.pixels,),
        lambda light: direct.look_up(light, where),
        lambda image: direct.spread(image, where, PROJECTOR),
    )


def _near_operator(window):
    def operator(generator):
        centres = near.centre(_places(generator), PROJECTOR)
        return (
            tuple(PROJECTOR),
            (CAMERA.pixels, window**2),
            lambda light: near.look_up(light, centres, window, PROJECTOR),
            lambda values: near.spread(values, centres, window, PROJECTOR),
        )

    return operator


def _far_operator(generator):
    # Frequencies of all kinds: their own negatives, pairs, off the DFT grid.
    frequencies = [DC, CHECKERBOARD, *near_frequencies(7, Size(1, 1)), wrap(*CHECKERBOARD)]
    basis = real_basis(representatives(frequencies), PROJECTOR)
    return (PROJECTOR.pixels,), (basis.count,), basis.analyse, basis.synthesise


def _recentre_operator(generator):
    world = model_transport(PROJECTOR, CAMERA, window=5, far=Size(3, 4))
    dropped = default_dropped(5, Size(3, 4), PROJECTOR)
    measurements = ideal_measurements(world, 5, Size(3, 4), dropped)
    band = build_matrices(measurements, 5, Size(3, 4), dropped).near
    centres = near.centre(_places(generator), PROJECTOR)
    shape = (CAMERA.pixels, 1, band.basis.count)
    # Turning is orthogonal: its adjoint is its inverse.
    return (
        shape,
        shape,
        lambda b: band.recentre(b.astype(np.float32), centres),
        lambda b: band.uncentre(b.astype(np.float32), centres),
    )


def _transport_operator(generator):
    transport = _transport(generator, channels=2)
    shape = (*PROJECTOR, 2)
    return shape, (*CAMERA, 2), lambda light: transport @ light, transport.adjoint


def _linear_operator(channel):
    def operator(generator):
        made = _transport(generator, window=4).as_linear_operator(channel)
        return (PROJECTOR.pixels,), (CAMERA.pixels,), made.matvec, made.rmatvec

    return operator


OPERATORS = {
    "direct": _direct_operator,
    "near, odd window": _near_operator(5),
    "near, even window": _near_operator(6),
    "near, window of one": _near_operator(1),
    "far": _far_operator,
    "recentre": _recentre_operator,
    "transport": _transport_operator,
    "linear operator, channel 0": _linear_operator(0),
    "linear operator, channel 1": _linear_operator(1),
}


@pytest.mark.parametrize("name", OPERATORS)
def test_adjoint(name, generator):
    domain, image, forward, adjoint = OPERATORS[name](generator)
    x = generator.normal(size=domain)
    y = generator.normal(size=image)
    one = np.vdot(forward(x), y)
    other = np.vdot(x, adjoint(y))
    scale = np.linalg.norm(forward(x)) * np.linalg.norm(y)
    assert abs(one - other) <= 2e-6 * scale
    assert scale > 0


@pytest.mark.parametrize("window", [1, 4, 5])
def test_a_transport_is_its_dense_rows(window, generator):
    transport = _transport(generator, window=window)
    light = generator.random((*PROJECTOR, 2))
    dense = transport.dense().astype(np.float64)
    expected = np.einsum("cip,pi->ci", dense, light.reshape(-1, 2)).reshape(*CAMERA, 2)
    np.testing.assert_allclose(transport @ light, expected, rtol=0, atol=2e-5)


def test_components_sum_and_gains_scale_them(generator):
    transport = _transport(generator)
    light = generator.random(PROJECTOR)
    parts = transport.components(light)
    expected = 2 * parts.direct - 0.5 * parts.near
    np.testing.assert_allclose(
        transport.relight(light, direct=2, near=-0.5, far=0), expected, atol=1e-6
    )
    scaled = transport.with_gains(direct=2, near=-0.5, far=0)
    np.testing.assert_allclose(scaled @ light, expected, atol=2e-5)


def test_the_provenance_keeps_the_product_of_all_gains(generator):
    transport = replace(_transport(generator), provenance={"method": "joint"})
    twice = transport.with_gains(direct=2, near=np.float32(0.5), far=0)
    assert twice.provenance == {
        "method": "joint",
        "gains": {"direct": 2.0, "near": 0.5, "far": 0.0},
    }
    assert json.loads(json.dumps(twice.provenance)) == twice.provenance
    kept = (-3 * twice).provenance["gains"]
    assert kept == {"direct": -6.0, "near": -1.5, "far": 0.0}
    for same in (1 * transport, transport.with_gains(), 0.25 * (4 * transport)):
        assert same.provenance == transport.provenance
    huge = Gains(near=1e200)
    with pytest.raises(InputError, match="the gain of near is inf"):
        with_gains(with_gains({}, huge), huge)


def test_a_column_is_the_picture_of_one_projector_pixel(generator):
    transport = _transport(generator)
    dense = transport.dense()
    expected = dense[:, :, 4 * PROJECTOR.width + 6].reshape(*CAMERA, 2)
    np.testing.assert_allclose(transport.column(4, 6), expected, atol=1e-5)


def test_a_grey_light_is_an_equal_light_for_every_channel(generator):
    transport = _transport(generator)
    grey = generator.random(PROJECTOR)
    np.testing.assert_allclose(
        transport @ grey, transport @ np.repeat(grey[..., None], 2, axis=2), atol=1e-6
    )


def test_one_channel_gives_flat_pictures(generator):
    transport = _transport(generator, channels=1)
    assert (transport @ np.ones(PROJECTOR)).shape == CAMERA
    assert transport.adjoint(np.ones(CAMERA)).shape == PROJECTOR


def test_unlit_camera_pixels_answer_through_f_alone(generator):
    transport = _transport(generator)
    light = generator.random(PROJECTOR)
    parts = transport.components(light)
    dark = ~transport.lit
    assert dark.sum() == 3
    assert np.all(parts.direct[dark] == 0)
    assert np.all(parts.near[dark] == 0)
    assert np.all(np.isfinite(transport @ light))
    np.testing.assert_allclose((transport @ light)[dark], parts.far[dark])


@pytest.mark.parametrize("kind", [bool, np.uint8, np.int64, np.float32, np.float64])
def test_a_mask_is_a_light_whatever_its_numbers(kind, generator):
    transport = _transport(generator)
    mask = generator.random(PROJECTOR) > 0.5
    expected = transport @ mask.astype(np.float64)
    np.testing.assert_allclose(transport @ mask.astype(kind), expected, atol=1e-5)
    operator = transport.as_linear_operator(1)
    np.testing.assert_allclose(
        operator @ mask.ravel().astype(kind), expected[..., 1].ravel(), atol=1e-5
    )


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_a_light_of_no_numbers_is_refused(value, generator):
    light = np.ones(PROJECTOR)
    light[2, 3] = value
    with pytest.raises(InputError, match="NaN or infinite"):
        _transport(generator) @ light


def test_single_precision_stays_single(generator):
    transport = _transport(generator)
    assert (transport @ np.ones(PROJECTOR, np.float32)).dtype == np.float32


@pytest.mark.parametrize(
    ("light", "message"),
    [
        (np.ones((18, 13)), "18x13, this transport's projector is 13x18"),
        (np.ones(13 * 18), "resize the light"),
        (np.ones((13, 18, 3)), "3 channels, this transport 2"),
    ],
)
def test_a_light_of_the_wrong_size_is_refused(light, message, generator):
    with pytest.raises(InputError, match=message):
        _transport(generator) @ light


def test_an_image_of_the_wrong_size_is_refused(generator):
    with pytest.raises(InputError, match="photos are"):
        _transport(generator).adjoint(np.ones(CAMERA))
    with pytest.raises(InputError, match="channel 2"):
        _transport(generator).as_linear_operator(2)


def test_an_exact_transport_is_the_sum_of_its_components(generator):
    exact = _exact(generator, channels=2)
    light = generator.random(PROJECTOR, dtype=np.float32)
    np.testing.assert_allclose(sum(exact.component_pictures(light)), exact @ light, atol=1e-4)
    rows = exact.rows(slice(2, 9))
    np.testing.assert_allclose(sum(exact.component_rows(slice(2, 9))), rows, atol=1e-6)
    np.testing.assert_allclose(rows @ light.ravel(), (exact @ light).reshape(-1, 2)[2:9], rtol=1e-4)
    colour = generator.random((*PROJECTOR, 2), dtype=np.float32)
    np.testing.assert_allclose(
        (exact @ colour)[..., 1], (exact @ colour[..., 1])[..., 1], rtol=1e-5
    )


def test_direct_weights_are_the_centroid(generator):
    q = _places(generator)
    where = direct.footprint(q, PROJECTOR)
    y, x = np.divmod(where.pixels, PROJECTOR.width)
    lit = np.isfinite(q[..., 0]).ravel()
    np.testing.assert_allclose(where.weights.sum(axis=1), lit, atol=1e-6)
    centroid = np.stack([(where.weights * y).sum(1), (where.weights * x).sum(1)], axis=1)
    np.testing.assert_allclose(centroid[lit], q.reshape(-1, 2)[lit], atol=2e-4)


@pytest.mark.parametrize("count", [1, 3, 20])
@pytest.mark.parametrize("colours", [(), (2,)])
def test_many_lights_at_once_are_each_by_itself(count, colours, generator):
    transport = _transport(generator)
    lights = generator.random((count, *PROJECTOR, *colours)).astype(np.float32)
    together = transport.pictures(lights)
    assert together.shape == (count, *CAMERA, 2)
    assert together.dtype == np.float32
    for light, picture in zip(lights, together, strict=True):
        np.testing.assert_allclose(picture, transport @ light, atol=1e-5)
    assert transport.pictures(lights[:0]).shape == (0, *CAMERA, 2)
    with pytest.raises(InputError, match="projector"):
        transport.pictures(lights[:, :5])


@pytest.mark.parametrize("window", [1, 4, 5])
@pytest.mark.parametrize("channels", [1, 2])
def test_small_lights_are_relit_as_large_ones(generator, window, channels):
    """Windows that see no light are left out, in every block that has many of them."""
    transport = _transport(generator, window=window, channels=channels)
    dense = transport.dense()
    lights = [np.zeros((*PROJECTOR, 2)[: 1 + channels]) for _ in range(4)]
    lights[1][0, 0] = 1.0
    lights[2][6, 5:8] = 0.5
    lights[3][12, 17] = 0.25
    if channels == 2:
        lights[2][6, 5:8, 0] = 0.0
    for light in lights:
        flat = np.broadcast_to(light.reshape(PROJECTOR.pixels, -1), (PROJECTOR.pixels, channels))
        expected = np.einsum("cip,pi->ci", dense, flat).reshape(*CAMERA, channels)
        found = (transport @ light).reshape(expected.shape)
        np.testing.assert_allclose(found, expected, atol=1e-5)
