"""Compensation on the exact scenes: what photos of the light that was computed look like.

Run ``python benchmarks/compensation.py [--photos N] [SCENE ...]``. The camera is that of
benchmarks/accuracy.py, the plan one of N photos (117) that were chosen for it. Wanted is a natural
picture of the camera's size. For the scale that is chosen it prints PSNR in dB below the brightest
wanted value, over camera pixels with direct light, of the *true* photos of five lights: the picture
itself, laid on the projector's pixels through q at the brightness that suits it best; a light from
direct light alone; a truncated inverse series of as many terms as suit it best; the light that
nearfar computes, beside what it says beforehand; and the light that the scene's own transport
gives, which is the limit. Then come the share of the camera that is out of reach and the time in
relightings.
"""

import argparse
import time
from dataclasses import replace
from math import log10

import numpy as np

from accuracy import shoot
from components import WINDOWS
from fewer_photos import jointly
from nearfar import Transport, choose_plan, compensate, natural_picture
from nearfar.applications.compensate import camera_weights, compensation_problem, direct_alone
from nearfar.applications.onto_projector import onto_projector
from nearfar.arrays import Floats
from nearfar.rigs.simulated.camera import SimulatedCamera
from nearfar.scenes.cache import cached_scene
from nearfar.transport.exact import ExactTransport

BRIGHTNESSES = np.geomspace(0.02, 1.0, 18)
TERMS = 40


def run(name: str, photos: int) -> None:
    """Measure one scene."""
    scene = cached_scene(name)
    plan, _ = choose_plan(scene.projector, photos, window=WINDOWS[name])
    transport = jointly(plan, shoot(plan, scene, SimulatedCamera()))
    shape = (*transport.camera, transport.channels)
    picture = natural_picture(transport.camera, 5).astype(np.float64)
    picture = np.repeat(picture[..., None], transport.channels, axis=2)
    began = time.perf_counter()
    found = compensate(transport, picture)
    took = time.perf_counter() - began
    began = time.perf_counter()
    _ = [transport @ found.light for _ in range(10)]
    relighting = (time.perf_counter() - began) / 10
    target = found.scale * picture

    def psnr(light: Floats) -> float:
        photo = np.reshape(scene @ light.astype(np.float32), shape)
        off = float(np.mean((photo - target)[transport.lit] ** 2))
        return 10 * log10(found.peak**2 / off)

    weights = camera_weights(transport)
    problem = compensation_problem(transport, weights)
    alone = compensation_problem(direct_alone(transport), weights)
    exact = replace(problem, forward=_forward(scene, shape), adjoint=_adjoint(scene))
    limit = exact.solve(target, found.light.reshape(problem.diagonal.shape), 1.0)
    seen = np.repeat(transport.lit.reshape(-1, 1).astype(float), transport.channels, axis=1)
    laid = onto_projector(transport.correspondence, seen, transport.projector)(target)
    laid = laid / laid.max()
    print(
        f"{name}, {len(plan.patterns)} photos, scale {found.scale:.3f}: "
        f"uncompensated {max(psnr(b * laid) for b in BRIGHTNESSES):.1f}, "
        f"direct light alone {psnr(alone.solve(target, laid, 1.0)):.1f}, "
        f"series {_series(transport, target, psnr):.1f}, "
        f"compensated {psnr(found.light):.1f} (said: {found.psnr:.1f}), limit {psnr(limit):.1f}; "
        f"out of reach {found.out_of_reach_share:.1%}; {took / relighting:.0f} relightings",
        flush=True,
    )


def _forward(scene: ExactTransport, shape: tuple[int, ...]):
    return lambda light: np.reshape(scene @ light.astype(np.float32), shape).astype(np.float64)


def _adjoint(scene: ExactTransport):
    return lambda image: np.reshape(
        scene.H @ image.astype(np.float32), (*scene.projector, scene.channels)
    ).astype(np.float64)


def _series(transport: Transport, target: Floats, psnr) -> float:
    """Return the best PSNR of l += D^-1 (target - T l), begun at 0, of up to `TERMS` terms."""
    white = transport.direct.reshape(-1, transport.channels)
    onto = onto_projector(transport.correspondence, white, transport.projector)
    light = np.zeros((*transport.projector, transport.channels))
    best = -np.inf
    for _ in range(TERMS):
        light = light + onto(target - np.reshape(transport @ light, target.shape))
        if not np.isfinite(light).all() or np.abs(light).max() > 1e6:
            break
        best = max(best, psnr(np.clip(light, 0.0, 1.0)))
    return best


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenes", nargs="*", default=list(WINDOWS))
    parser.add_argument("--photos", type=int, default=117)
    chosen = parser.parse_args()
    for scene_name in chosen.scenes:
        run(scene_name, chosen.photos)
