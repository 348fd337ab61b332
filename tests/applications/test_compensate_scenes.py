"""True photos of lights that compensate a scene whose walls face each other, from noisy photos."""

from dataclasses import replace
from math import log10

import numpy as np
import pytest

from nearfar import Size, choose_plan, compensate, natural_picture
from nearfar.applications.compensation_problem import (
    camera_weights,
    compensation_problem,
    direct_alone,
)
from nearfar.correspondence import correspond_by_phase
from nearfar.estimate.joint import estimate_jointly
from nearfar.photometry.measure import measure
from nearfar.rigs.simulated.camera import SimulatedCamera
from nearfar.rigs.simulated.projector import SimulatedProjector
from nearfar.rigs.simulated.rig import SimulatedRig
from nearfar.scenes.cache import cached_scene
from nearfar.workflow.acquire import acquire_in_memory

SIZE = Size(32, 32)


@pytest.mark.slow
def test_the_photo_is_as_near_as_the_scenes_own_transport_brings_it():
    scene = cached_scene("alcove", SIZE, SIZE)
    plan, _ = choose_plan(SIZE, 117)
    rig = SimulatedRig(scene, "alcove", SimulatedProjector(), SimulatedCamera(), 1.0, 0)
    measurements = measure(acquire_in_memory(plan, rig))
    q = correspond_by_phase(measurements, pitch=plan.pitch).q
    transport = estimate_jointly(measurements, q, plan.window, plan.far, pitch=plan.pitch)
    wanted = natural_picture(SIZE, 5)
    found = compensate(transport, wanted)

    def psnr(light):
        error = (scene @ light.astype(np.float32) - found.target)[transport.lit]
        return 10 * log10(found.peak**2 / np.mean(error**2))

    weights = camera_weights(transport)
    problem = compensation_problem(transport, weights)
    known = replace(
        problem,
        forward=lambda light: (scene @ light.astype(np.float32)).astype(np.float64),
        adjoint=lambda image: (scene.H @ image.astype(np.float32)).astype(np.float64),
    )
    target = found.target.astype(np.float64)
    limit = known.solve(target, found.light.astype(np.float64), 1.0)
    alone = compensation_problem(direct_alone(transport), weights)
    by_direct = alone.solve(target, found.light.astype(np.float64), 1.0)
    assert psnr(found.light) > psnr(limit) - 1
    assert psnr(found.light) > psnr(by_direct) + 6
    assert found.psnr == pytest.approx(psnr(found.light), abs=1)
