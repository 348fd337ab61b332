"""Several projectors beside one matrix of all of them, and edges where two overlap."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import optimize

from nearfar import compensate, compensate_together, relight_together
from nearfar.applications.compensate_together import joint_problem
from nearfar.applications.least_squares import roughness
from nearfar.applications.several_projectors import added_deviations
from nearfar.arrays import Size
from nearfar.errors import InputError
from nearfar.illumination.frequencies import DC
from nearfar.illumination.near_basis import NearBasis
from nearfar.illumination.real_basis import real_basis
from nearfar.transport.model import Transport
from tests.worlds import model_transport

CAMERA = Size(11, 16)
GRIDS = Size(8, 9), Size(6, 10)
# Camera columns that each of two projectors lights directly.
REACHES = slice(0, 10), slice(6, 16)


def lighting(transport: Transport, columns: slice) -> Transport:
    """Return a transport without direct and near-range light outside some camera columns."""
    dark = np.ones(transport.camera, dtype=bool)
    dark[:, columns] = False
    q, direct, near = (
        value.copy() for value in (transport.correspondence, transport.direct, transport.near)
    )
    q[dark], direct[dark], near[dark] = np.nan, 0, 0
    return replace(transport, correspondence=q, direct=direct, near=near)


def two(channels=1):
    """Two projectors of different grids that overlap in the middle of the camera."""
    return [
        lighting(
            model_transport(grid, CAMERA, window=5, far=Size(3, 3), channels=channels, seed=seed),
            columns,
        )
        for seed, (grid, columns) in enumerate(zip(GRIDS, REACHES, strict=True))
    ]


def of_rows(left: float, right: float, moved: float = 0.0) -> list[Transport]:
    """Two projectors on a white wall: the same rows, and columns that overlap by a third.

    The right one may stand some of its pixels aside.
    """
    camera, grid = Size(6, 24), Size(6, 16)
    found = []
    for first, brightness in ((0.0, left), (8.0 - moved, right)):
        transport = model_transport(grid, camera, window=3, far=Size(1, 1))
        y, x = np.mgrid[: camera.height, : camera.width].astype(np.float32)
        q = np.stack([y, x - first], axis=-1)
        q[(q[..., 1] < -0.5) | (q[..., 1] > grid.width - 0.5)] = np.nan
        found.append(
            replace(
                transport,
                correspondence=q,
                direct=np.where(np.isnan(q[..., :1]), 0, brightness).astype(np.float32),
                near=np.zeros_like(transport.near),
                far=np.zeros_like(transport.far),
            )
        )
    return found


@pytest.mark.parametrize("channels", [1, 2])
def test_the_picture_of_all_is_that_of_one_matrix(channels):
    transports = two(channels)
    lights = [np.random.default_rng(3).random(grid).astype(np.float32) for grid in GRIDS]
    matrix = np.concatenate([transport.dense() for transport in transports], axis=2)
    expected = matrix @ np.concatenate([light.ravel() for light in lights])
    found = relight_together(transports, lights)
    np.testing.assert_allclose(found.reshape(expected.shape), expected, atol=1e-5)
    dark = relight_together(transports, [lights[0], np.zeros(GRIDS[1])], far=0.5)
    np.testing.assert_allclose(dark, transports[0].relight(lights[0], far=0.5), atol=1e-6)


def test_the_lights_are_those_of_bounded_least_squares():
    """Some of the wanted picture is brighter than both whites make it, some darker than light."""
    transports = two()
    white = sum(transport @ np.ones(transport.projector) for transport in transports)
    wanted = np.random.default_rng(1).random(CAMERA) * white * 1.5
    problem = joint_problem(transports, np.ones((*CAMERA, 1)))
    rows = []
    for number, each in enumerate(problem.problems):
        gradient = np.stack(
            [roughness(one.reshape(GRIDS[number])).ravel() for one in np.eye(GRIDS[number].pixels)]
        )
        values, vectors = np.linalg.eigh(gradient)
        rows.append(np.sqrt(np.maximum(each.smoothness * values, 0))[:, None] * vectors.T)
    dense = np.concatenate([transport.dense()[:, 0] for transport in transports], axis=1)
    smooth = np.zeros((len(rows[0]) + len(rows[1]), dense.shape[1]))
    smooth[: len(rows[0]), : len(rows[0])], smooth[len(rows[0]) :, len(rows[0]) :] = rows
    matrix = np.concatenate([dense, smooth]).astype(np.float64)
    right = np.concatenate([wanted.ravel(), np.zeros(len(smooth))])
    best = optimize.lsq_linear(matrix, right, (0, 1), method="bvls")

    def cost(light):
        return float(np.sum((matrix @ light - right) ** 2))

    found = compensate_together(transports, wanted, 1.0)
    flat = np.concatenate([light.ravel() for light in found.lights])
    assert flat.min() >= 0
    assert flat.max() <= 1
    assert (flat == 1).any()
    assert (flat == 0).any()
    assert cost(flat) < 1.005 * cost(best.x)


@pytest.mark.parametrize("channels", [1, 3])
def test_both_make_a_picture_that_neither_makes_alone(channels):
    transports = two(channels)
    drawn = [np.random.default_rng(4).uniform(0.3, 0.9, grid) for grid in GRIDS]
    wanted = relight_together(transports, drawn)
    found = compensate_together(transports, wanted, 1.0)
    np.testing.assert_allclose(
        found.expected, relight_together(transports, found.lights), atol=1e-5
    )
    assert found.psnr > max(found.psnr_alone) + 10
    assert not found.out_of_reach.any()
    for transport, alone in zip(transports, found.psnr_alone, strict=True):
        # What a projector is said to do alone, it does by a computation of its own; over the camera
        # pixels of both it cannot do better than there.
        assert alone < compensate(transport, wanted, 1.0).psnr


def test_where_one_is_too_dim_both_together_are_bright_enough():
    transports = of_rows(0.4, 0.4)
    wanted = np.zeros((6, 24))
    wanted[:, 9:15] = 0.7
    found = compensate_together(transports, wanted, 1.0)
    assert found.psnr > 40
    assert max(found.psnr_alone) < 14


@pytest.mark.parametrize("right", [0.6, 0.3])
def test_light_is_handed_over_without_a_seam(right):
    """The edge of either projector lies within the other's light."""
    transports = of_rows(0.6, right)
    found = compensate_together(transports, np.full((6, 24), 0.25), 1.0)
    np.testing.assert_allclose(found.expected, 0.25, atol=0.0025)
    left = found.lights[0].mean(axis=0)[8:]
    # From all of the light to little of it over the eight shared columns, in no sudden step.
    assert left[0] > 0.7 * 0.25 / 0.6
    assert left[-1] < 0.3 * 0.25 / 0.6
    assert np.diff(left).max() < 0.01
    assert -np.diff(left).min() < 0.3 * 0.25 / 0.6
    # So that half a pixel aside is no edge.
    photo = relight_together(of_rows(0.6, right, moved=0.5), found.lights)
    np.testing.assert_allclose(photo, 0.25, atol=0.15 * 0.25)


def test_a_projector_of_another_pitch_takes_part():
    """One of hats of four projector pixels beside one of single pixels."""
    coarse, grid, near = two()[0], Size(20, 24), NearBasis(5, 4)
    fine = replace(
        coarse,
        projector=grid,
        correspondence=coarse.correspondence * np.float32(2.5),
        near=np.full((*CAMERA, 1, near.count), 1e-3, np.float32) * coarse.lit[..., None, None],
        far=coarse.far[..., :1],
        far_basis=real_basis([DC], grid),
        pitch=4,
        footprint=np.full((*CAMERA, 4), 2.0, np.float32),
    )
    transports = [fine, two()[1]]
    lights = [np.full(grid, 0.4, np.float32), np.full(GRIDS[1], 0.6, np.float32)]
    wanted = relight_together(transports, lights)
    np.testing.assert_allclose(wanted, fine @ lights[0] + transports[1] @ lights[1], atol=1e-6)
    found = compensate_together(transports, wanted, 1.0)
    assert [light.shape for light in found.lights] == [grid, GRIDS[1]]
    assert found.psnr > 40


def test_a_scale_of_its_own_does_not_depend_on_the_unit_of_the_picture():
    transports = two()
    wanted = np.random.default_rng(2).uniform(0.2, 1.0, CAMERA)
    found, in_other_units = (compensate_together(transports, k * wanted) for k in (1.0, 255.0))
    assert found.scale == pytest.approx(255 * in_other_units.scale, rel=1e-3)
    assert max(light.max() for light in found.lights) > 0.9


def test_the_same_projector_once_is_compensation():
    transport = two()[0]
    wanted = np.random.default_rng(2).uniform(0.2, 1.0, CAMERA)
    together, alone = compensate_together([transport], wanted), compensate(transport, wanted)
    assert together.scale == pytest.approx(alone.scale, rel=1e-4)
    np.testing.assert_allclose(together.lights[0], alone.light, atol=1e-4)
    assert together.rmse == pytest.approx(alone.rmse, rel=1e-4)


def test_variances_add():
    one, other = np.full((2, 3), 3.0, np.float32), np.full((2, 3), 4.0, np.float32)
    one[0, 0] = np.inf
    found = added_deviations([one, other])
    assert np.isinf(found[0, 0])
    assert found[1, 1] == pytest.approx(5.0)


@pytest.mark.parametrize("function", [relight_together, compensate_together])
@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda: model_transport(GRIDS[1], Size(3, 4), window=3, far=Size(1, 1)), "3x4"),
        (
            lambda: model_transport(GRIDS[1], CAMERA, window=3, far=Size(1, 1), channels=3),
            "channels: 1, and transport 2 3",
        ),
        (lambda: replace(two()[1], provenance={"rig": {"exposure": 0.02}}), "0.01 s"),
        (lambda: np.ones((3, 3)), "load_transport"),
    ],
)
def test_what_does_not_add_up_gets_a_sentence(function, change, words):
    first = replace(two()[0], provenance={"rig": {"exposure": 0.01}})
    given = [np.ones(grid) for grid in GRIDS] if function is relight_together else np.ones(CAMERA)
    with pytest.raises(InputError, match=words):
        function([first, change()], given)


def test_a_light_or_a_projector_too_few_gets_a_sentence():
    transports = two()
    with pytest.raises(InputError, match="1 lights for 2 transports"):
        relight_together(transports, [np.ones(GRIDS[0])])
    with pytest.raises(InputError, match="one for each projector"):
        compensate_together([], np.ones(CAMERA))
    dark = lighting(transports[1], slice(0, 0))
    with pytest.raises(InputError, match="transport 2 has no direct light"):
        compensate_together([transports[0], dark], np.ones(CAMERA))
