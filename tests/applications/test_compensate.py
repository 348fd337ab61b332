"""Compensation beside bounded least squares with dense matrices, and lights that are known."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import ndimage, optimize

from nearfar import compensate
from nearfar.applications.compensation_problem import camera_weights, compensation_problem
from nearfar.applications.least_squares import roughness
from nearfar.arrays import Size
from nearfar.errors import InputError
from nearfar.transport.colour import as_channels_see
from tests.worlds import model_transport

PROJECTOR, CAMERA = Size(10, 12), Size(14, 15)
MIXING = [[0.8, 0.15, 0.05], [0.1, 0.7, 0.2], [0.0, 0.2, 0.8]]


def world(channels=1, **changes):
    made = model_transport(
        PROJECTOR, CAMERA, window=5, far=Size(3, 3), channels=channels, fractional=True
    )
    return replace(made, **changes)


def smooth(channels=1, seed=3):
    drawn = np.random.default_rng(seed).random((*PROJECTOR, channels))
    light = ndimage.gaussian_filter(drawn, (1.5, 1.5, 0))
    light = 0.2 + 0.6 * (light - light.min()) / np.ptp(light)
    return light[..., 0] if channels == 1 else light


@pytest.mark.parametrize("channels", [1, 3])
def test_a_picture_that_a_light_makes_is_made_again(channels):
    transport = world(channels)
    wanted = transport @ smooth(channels)
    found = compensate(transport, wanted, 1.0)
    assert np.abs(transport @ found.light - wanted).max() < 0.02 * wanted.max()
    assert found.psnr > 40
    assert found.psnr > found.psnr_of_direct + 6
    assert not found.out_of_reach[transport.lit].any()


def test_the_light_is_that_of_bounded_least_squares():
    """Some of the wanted picture is brighter than white makes it, some darker than light gets."""
    transport = world()
    wanted = np.random.default_rng(1).random(CAMERA) * (transport @ np.ones(PROJECTOR)) * 1.5
    problem = compensation_problem(transport, camera_weights(transport))
    gradient = np.zeros((PROJECTOR.pixels,) * 2)
    for i, one in enumerate(np.eye(PROJECTOR.pixels)):
        gradient[:, i] = roughness(one.reshape(PROJECTOR)).ravel()
    values, vectors = np.linalg.eigh(gradient)
    root = np.sqrt(np.maximum(problem.smoothness * values, 0))[:, None] * vectors.T
    matrix = np.concatenate([transport.dense()[:, 0], root]).astype(np.float64)
    right = np.concatenate([wanted.ravel(), np.zeros(len(root))])
    best = optimize.lsq_linear(matrix, right, (0, 1), method="bvls")

    def cost(light):
        return float(np.sum((matrix @ light.ravel() - right) ** 2))

    found = compensate(transport, wanted, 1.0).light
    assert found.min() >= 0
    assert found.max() <= 1
    assert (found == 1).any()
    assert (found == 0).any()
    assert cost(found) < 1.002 * cost(best.x)


def test_a_scale_of_its_own_does_not_depend_on_the_unit_of_the_picture():
    transport = world(3)
    wanted = np.random.default_rng(2).uniform(0.2, 1.0, (*CAMERA, 3))
    found, in_other_units = (compensate(transport, k * wanted) for k in (1.0, 255.0))
    assert found.scale == pytest.approx(255 * in_other_units.scale, rel=1e-3)
    np.testing.assert_allclose(found.light, in_other_units.light, atol=2e-3)
    assert found.light.max() > 0.9


def test_colours_that_mix_are_told_apart():
    transport = world(3, provenance={"rig": {"colour_mixing": MIXING}})
    light = smooth(3)
    wanted = transport @ as_channels_see(light, 3, transport.provenance)
    found = compensate(transport, wanted, 1.0)
    seen = as_channels_see(found.light, 3, transport.provenance)
    assert np.abs(transport @ seen - wanted).max() < 0.03 * wanted.max()


def test_camera_pixels_without_direct_light_are_out_of_reach_and_do_not_count():
    transport = world()
    q, direct, near = (
        value.copy() for value in (transport.correspondence, transport.direct, transport.near)
    )
    q[:3], direct[:3], near[:3] = np.nan, 0, 0
    transport = replace(transport, correspondence=q, direct=direct, near=near)
    wanted = transport @ smooth()
    changed = wanted.copy()
    changed[:3] = 7.0
    found, beside = compensate(transport, wanted, 1.0), compensate(transport, changed, 1.0)
    np.testing.assert_array_equal(found.light, beside.light)
    assert found.out_of_reach[:3].all()


@pytest.mark.parametrize(
    ("wanted", "scale", "words"),
    [
        (np.ones((3, 3)), None, "3x3"),
        (np.full(CAMERA, -1.0), None, "negative"),
        (np.zeros(CAMERA), None, "black"),
        (np.full(CAMERA, np.nan), None, "finite"),
        (np.ones(CAMERA), 0.0, "above 0"),
        (np.ones(CAMERA), float("inf"), "finite"),
    ],
)
def test_what_does_not_fit_gets_a_sentence(wanted, scale, words):
    with pytest.raises(InputError, match=words):
        compensate(world(), wanted, scale)


def test_a_photo_that_ambient_light_alone_outshines_gets_a_sentence():
    wanted, black = np.full(CAMERA, 0.1), np.full(CAMERA, 0.2)
    with pytest.raises(InputError, match="brighter than the wanted picture everywhere"):
        compensate(world(), wanted, 1.0, black=black)


def test_other_objects_are_refused():
    with pytest.raises(InputError, match="load_transport"):
        compensate(np.ones((3, 3)), np.ones(CAMERA))
