"""Photos that projectors shared, beside photos by one projector after the other."""

from dataclasses import replace

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.errors import InputError
from nearfar.photometry.measure import measure
from nearfar.photometry.noise import NoiseModel
from nearfar.photometry.shared_photos import photos_of_each
from nearfar.photometry.sharing import choose_plan_together, largest_exposures, sharing_gain
from nearfar.plan import choose_plan, paper_plan
from nearfar.plan.sharing import projectors_of, shared_plan
from nearfar.rigs.simulated.camera import SimulatedCamera
from nearfar.rigs.simulated.projector import SimulatedProjector
from nearfar.rigs.simulated.rig import SimulatedRig
from nearfar.rigs.simulated.side_by_side import simulated_side_by_side
from nearfar.workflow.acquire import acquire_in_memory
from tests.conftest import QUIET
from tests.worlds import model_transport

GRID, CAMERA = Size(8, 10), Size(6, 7)


def rigs(count, camera, exposure=0.3):
    """Rigs of several projectors before one camera."""
    return [
        SimulatedRig(
            model_transport(GRID, CAMERA, window=3, far=Size(3, 3), channels=2, seed=seed),
            f"projector {seed}",
            SimulatedProjector(),
            camera,
            exposure,
            seed,
        )
        for seed in range(count)
    ]


def shared_photos(made, each):
    together = simulated_side_by_side(each, [rig.name for rig in each])
    return photos_of_each(acquire_in_memory(shared_plan(made, len(each)), together))


@pytest.mark.parametrize("offset", ["reference", "inverse"])
@pytest.mark.parametrize("count", [2, 3])
def test_without_noise_they_are_those_of_each_projector_in_the_others_light(offset, count):
    made = paper_plan(GRID, 3, Size(3, 3), offset=offset)
    each = rigs(count, QUIET)
    white = [rig.exposure * (rig.world @ np.ones(GRID, np.float32)) for rig in each]
    for rig, own, photos in zip(each, white, shared_photos(made, each), strict=True):
        assert photos.plan == made
        rows, numbers = slice(1, 4), list(range(len(made.patterns)))
        alone = acquire_in_memory(made, rig).read(numbers, rows)
        ambient = (sum(white) - own)[rows] / 2
        # Photos are whole levels of 65 535.
        np.testing.assert_allclose(photos.read(numbers, rows), alone + ambient, atol=3 / 65535)
        together, in_turn = (measure(taken) for taken in (photos, acquire_in_memory(made, rig)))
        np.testing.assert_allclose(together.responses, in_turn.responses, atol=1e-4)


def test_responses_and_their_noise_are_read_rightly():
    """Of 16 takes: what responses scatter by is the noise that the photos are said to have.

    Also where one projector lights the scene much more than the other.
    """
    made = choose_plan((8, 10), 40, checks=1)[0]
    camera = SimulatedCamera(full_well=2000.0, read_noise=4.0, bits=16)
    dim = [np.arange(7) < 3, np.arange(7) >= 3]
    worlds = [
        replace(rig.world, direct=np.where(dim[i][:, None], 0.1, 2.0) * rig.world.direct)
        for i, rig in enumerate(rigs(2, camera))
    ]
    found, told = [], []
    for take in range(16):
        each = [
            SimulatedRig(world, f"projector {i}", SimulatedProjector(), camera, 0.3, 2 * take + i)
            for i, world in enumerate(worlds)
        ]
        measured = [measure(photos) for photos in shared_photos(made, each)]
        found.append([one.responses for one in measured])
        # Of the photo itself, and of white and black, against which it is measured.
        told.append([one.noise**2 + one.white_noise**2 + one.black_noise**2 for one in measured])
    once = measured[0].multiplicity == 1
    once[measured[0].basis.response_indices([(0, 0)])] = False
    variance = np.var(np.stack(found), axis=0, ddof=1)[..., once].mean(axis=-1)
    for projector in range(2):
        expected = np.mean(np.stack(told)[:, projector], axis=0)
        in_others = np.tile(dim[projector], CAMERA.height)
        for chosen in (in_others, ~in_others):
            ratio = variance[projector][chosen].mean() / expected[chosen].mean()
            assert ratio == pytest.approx(1.0, abs=0.12)


def test_what_is_saturated_for_both_is_saturated_for_each():
    made = paper_plan(GRID, 3, Size(3, 3), offset="reference")
    each = rigs(2, QUIET, exposure=1.0)
    wide = simulated_side_by_side(each, ["left", "right"])
    # The exposure of both whites together is lowered; here it is as it was.
    assert wide.exposure < 1
    bright = SimulatedRig(wide.world, "both", wide.optics, wide.sensor, 1.0, 0)
    taken = acquire_in_memory(shared_plan(made, 2), bright)
    saturated = (taken.read(range(len(taken.plan.patterns)), slice(None)) >= 1).any(axis=0)
    assert 0.02 < saturated.mean() < 0.98
    for photos in photos_of_each(taken):
        white = next(i for i, p in enumerate(made.patterns) if made.draw(i).min() == 255)
        np.testing.assert_array_equal(photos.read([white])[0] >= 1, saturated)


READ, SHOT = NoiseModel(0.0, 1e-4), NoiseModel(1e-3, 0.0)
LIT, DARK = np.full((1, 4, 1), 0.5), np.zeros((1, 4, 1))
APART = np.stack([np.concatenate([LIT, DARK]), np.concatenate([DARK, LIT])])
SAME = np.stack([np.concatenate([LIT, DARK])] * 2)


@pytest.mark.parametrize(
    ("whites", "noise", "exposures", "decibels"),
    [
        # Reading is as noisy whatever the light: half of the variance for each.
        (APART, READ, (1.0, 1.0), 3.01),
        (SAME, READ, (1.0, 1.0), 3.01),
        # Shot noise of one projector's light is only moved to the other's responses.
        (APART, SHOT, (1.0, 1.0), 0.0),
        (SAME, SHOT, (1.0, 1.0), 0.0),
        # Where full scale is shared too.
        (SAME, SHOT, (2.0, 1.0), -3.01),
        (SAME, READ, (2.0, 1.0), -3.01),
        (np.stack([LIT] * 4), READ, (1.0, 1.0), 6.02),
        # Four photos for three projectors.
        (np.stack([LIT] * 3), READ, (1.0, 1.0), 4.77),
    ],
)
def test_what_sharing_gains_follows_from_whites_and_noise(whites, noise, exposures, decibels):
    black = np.zeros(whites.shape[1:])
    found = sharing_gain(whites, black, [noise], exposures=exposures)
    assert found.decibels == pytest.approx(decibels, abs=0.02)
    ratio = found.noise_in_turn / found.noise_shared
    assert 20 * np.log10(ratio) == pytest.approx(decibels, abs=0.02)


def test_exposures_are_those_of_the_brightest_whites():
    black = np.full((2, 4, 1), 0.1)
    assert largest_exposures(APART + 0.1, black) == pytest.approx((1.6, 1.6))
    assert largest_exposures(SAME + 0.1, black) == pytest.approx((1.6, 0.8))


def test_the_plan_is_shared_where_that_is_expected_to_relight_better():
    for whites, exposures, projectors in ((APART, (1.0, 1.0), 2), (SAME, (2.0, 1.0), 1)):
        gain = sharing_gain(whites, 0 * whites[0], [READ], exposures=exposures)
        made, expected = choose_plan_together((16, 16), 40, gain, 2)
        assert projectors_of(made) == projectors
        # By the better of both noises.
        noise = min(gain.noise_in_turn, gain.noise_shared)
        assert expected == choose_plan((16, 16), 40, noise=noise)[1]


def test_without_light_there_is_nothing_to_compare():
    with pytest.raises(InputError, match="no projector lights"):
        sharing_gain(0 * SAME, 0 * SAME[0], [READ])


def test_a_hot_pixel_does_not_bound_exposures():
    whites, black = np.full((2, 4, 5, 1), 0.3), np.full((4, 5, 1), 0.1)
    known = largest_exposures(whites, black)
    assert known == (pytest.approx(4), pytest.approx(2))
    black[1, 2], whites[:, 1, 2] = 0.99, 1.0
    assert largest_exposures(whites, black) == known
    with pytest.raises(InputError, match="above 90% of full scale"):
        largest_exposures(whites, np.full_like(black, 0.95))
