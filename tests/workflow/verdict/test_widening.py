"""Error bars that held-out photos contradict are widened until they hold, and no others."""

import json
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.estimate.error_bars import ErrorBars
from nearfar.illumination.pictures import natural_picture
from nearfar.plan import choose_plan
from nearfar.rigs.simulated.camera import SimulatedCamera
from nearfar.rigs.simulated.projector import SimulatedProjector
from nearfar.rigs.simulated.rig import SimulatedRig
from nearfar.scenes.cache import cached_scene
from nearfar.scenes.hostile import HOSTILE, hostile_transport
from nearfar.transport.stored import open_transport
from nearfar.transport.verdict import KeptVerdict, verdict_from_json, verdict_to_json
from nearfar.workflow.acquire import acquire
from nearfar.workflow.reconstruction.reconstruct import reconstruct_to_file
from nearfar.workflow.verdict.by_check_photos import measure_held_out
from nearfar.workflow.verdict.held_out import HeldOut
from nearfar.workflow.verdict.verdict import Verdict
from nearfar.workflow.verdict.widening import widening_of
from tests.workflow.verdict.lights import held_out_light

PROJECTOR = Size(16, 16)


@pytest.mark.parametrize(
    ("ratios", "expected"),
    [
        ([0.1], 1.0),
        ([1.4], 1.0),
        ([4.0], 2.0),
        # Six patterns agree on what one alone does not prove.
        ([1.4] * 6, np.sqrt(1.4)),
        # Only pictures show that a response bends: half-screens do not.
        ([17.0, 1.0], 3.0),
    ],
)
def test_bars_are_widened_by_what_is_no_chance(ratios, expected):
    held_out = HeldOut(tuple(held_out_light(ratio * 1e-3, 1e-3) for ratio in ratios))
    assert widening_of(held_out) == pytest.approx(expected, rel=1e-3)


def test_noise_that_hides_the_error_widens_nothing():
    held_out = HeldOut((held_out_light(2e-3, 1e-3, noise=2e-3),))
    assert held_out.error_ratio > 1.9
    assert widening_of(held_out) == 1.0


def test_without_error_bars_or_usable_pixels_nothing_is_widened():
    assert widening_of(HeldOut((held_out_light(1.0, None),))) == 1.0
    assert widening_of(HeldOut((held_out_light(np.nan, np.nan),))) == 1.0


def test_whatever_is_found_can_be_kept():
    # As of photos without noise, of which hardly any error is expected.
    for expected in (1e-300, 1e-60, 0.0):
        verdict = Verdict("wrong", HeldOut((held_out_light(0.1, expected),)), ()).kept
        assert verdict.widening > 1
        assert verdict_from_json(json.loads(json.dumps(verdict_to_json(verdict)))) == verdict
    unusable = Verdict("wrong", HeldOut((held_out_light(np.nan, np.nan),)), ()).kept
    assert verdict_from_json(json.loads(json.dumps(verdict_to_json(unusable)))) == unusable


@pytest.fixture(scope="module")
def shot(tmp_path_factory):
    """Reconstruct a scene; return what is held out, the transport, and photos of pictures."""

    @cache
    def shoot(name, gamma=1.0):
        if name in HOSTILE:
            world = hostile_transport(name, PROJECTOR, PROJECTOR)
        else:
            world = cached_scene(name, PROJECTOR)
        folder = tmp_path_factory.mktemp("made")
        plan, _ = choose_plan(PROJECTOR, 60)
        exposure = 0.8 / float((world @ np.ones(PROJECTOR)).max())
        projector = SimulatedProjector(gamma=gamma)
        rig = SimulatedRig(world, name, projector, SimulatedCamera(), exposure, 0)
        capture = acquire(plan, folder / "c.zarr", rig)
        reconstruct_to_file(capture, folder / "t.zarr")
        stored = open_transport(folder / "t.zarr")
        lights = [natural_picture(PROJECTOR, seed) for seed in range(5)]
        truth = [exposure * (world @ light**gamma).ravel() for light in lights]
        return measure_held_out(stored, capture), stored.rows(), lights, truth

    return shoot


def _within(transport, lights, truth):
    """Return the share of the errors of pictures within one standard deviation."""
    bars = ErrorBars(transport)
    return np.mean(
        [
            np.abs((transport @ light).ravel() - known) < bars.picture(light).ravel()
            for light, known in zip(lights, truth, strict=True)
        ]
    )


@pytest.mark.parametrize("gamma", [1.02, 2.2])
def test_widened_bars_hold_where_the_rig_is_not_linear(shot, gamma):
    held_out, transport, lights, truth = shot("cornell", gamma)
    widening = widening_of(held_out)
    assert widening > 1
    verdict = KeptVerdict("wrong", widening=widening)
    assert _within(transport, lights, truth) < 0.5
    assert 0.55 < _within(replace(transport, verdict=verdict), lights, truth) < 0.8


@pytest.mark.parametrize("name", ["cornell", "dense", "hair"])
def test_bars_that_hold_are_not_touched(shot, name):
    held_out, transport, lights, truth = shot(name)
    assert widening_of(held_out) == 1.0
    assert 0.6 < _within(transport, lights, truth) < 0.8


def test_every_deviation_is_widened(shot):
    _, transport, lights, _ = shot("cornell")
    bars = ErrorBars(transport)
    wide = ErrorBars(replace(transport, verdict=KeptVerdict("doubtful", widening=2.5)))
    pixels = slice(30, 32)
    for one, other in (
        (bars.picture(lights[0]), wide.picture(lights[0])),
        (bars.direct(), wide.direct()),
        (bars.component_rows(pixels), wide.component_rows(pixels)),
        (bars.along(7, 3), wide.along(7, 3)),
    ):
        np.testing.assert_allclose(np.asarray(other), 2.5 * np.asarray(one), rtol=1e-5)
