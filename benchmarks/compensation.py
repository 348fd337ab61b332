"""Compensation on the exact scenes: what photos of the light that was computed look like.

Run ``python benchmarks/compensation.py [--photos N] [--side SIDE [--camera SIDE]] [--no-limit]
[SCENE ...]``. The projector and the camera are SIDE x SIDE, else those of the scene; the camera's
noise is that of benchmarks/accuracy.py, the plan one of N photos (117) that were chosen for it.
Wanted is a natural
picture of the camera's size. For the scale that is chosen it prints, of the *true* photos of five
lights, PSNR in dB below the brightest wanted value and RMSE, both over camera pixels with direct
light, and SSIM (Wang et al. 2004) over the whole photo, where what is wanted stands at camera
pixels without direct light: the picture itself, laid on the projector's pixels through q at the
brightness that suits it best; a light from direct light alone; a truncated inverse series of as
many terms as suit it best; the light that nearfar computes, beside what it says beforehand; and the
light that the scene's own transport gives, which is the limit (``--no-limit`` leaves it out, as it
takes long). Then come the share of the camera that is out of reach and the time in relightings.
"""

import argparse
import time
from collections.abc import Callable
from dataclasses import replace
from math import log10
from typing import NamedTuple

import numpy as np
from scipy import ndimage

from accuracy import shoot
from components import WINDOWS
from fewer_photos import jointly
from nearfar import Size, Transport, choose_plan, compensate, natural_picture
from nearfar.applications.compensation_problem import (
    camera_weights,
    compensation_problem,
    direct_alone,
)
from nearfar.applications.onto_projector import onto_projector
from nearfar.arrays import Floats
from nearfar.rigs.simulated.camera import SimulatedCamera
from nearfar.scenes.cache import cached_known
from nearfar.transport.known import KnownTransport

BRIGHTNESSES = np.geomspace(0.02, 1.0, 18)
TERMS = 40
# Of SSIM: width of its window, and what keeps its quotients from 0, as shares of the peak.
SSIM_WIDTH = 1.5
SSIM_LEAST = (0.01, 0.03)


class Judged(NamedTuple):
    """How near a photo is to what is wanted."""

    psnr: float
    rmse: float
    ssim: float

    def __str__(self) -> str:
        return f"{self.psnr:.1f} dB / {self.rmse:.4f} / {self.ssim:.3f}"


def run(name: str, photos: int, side: int | None, camera: int | None, *, with_limit: bool) -> None:
    """Measure one scene."""
    sizes = [None if one is None else Size(one, one) for one in (side, camera or side)]
    scene = cached_known(name, *sizes)
    # Of the scene's own resolution, W in projector pixels follows from the plan's own choice.
    plan, _ = choose_plan(scene.projector, photos, window=WINDOWS[name] if side is None else None)
    transport = jointly(plan, shoot(plan, scene, SimulatedCamera()))
    shape = (*transport.camera, transport.channels)
    picture = natural_picture(transport.camera, 5).astype(np.float64)
    picture = np.repeat(picture[..., None], transport.channels, axis=2)
    began = time.process_time()
    found = compensate(transport, picture)
    took = time.process_time() - began
    began = time.process_time()
    _ = [transport @ found.light for _ in range(5)]
    relighting = (time.process_time() - began) / 5
    target = found.scale * picture

    def judged(light: Floats) -> Judged:
        photo = np.reshape(scene @ light.astype(np.float32), shape)
        mean = float(np.mean((photo - target)[transport.lit] ** 2))
        whole = np.where(transport.lit[..., None], photo, target)
        return Judged(10 * log10(found.peak**2 / mean), mean**0.5, ssim(whole, target, found.peak))

    weights = camera_weights(transport)
    problem = compensation_problem(transport, weights)
    alone = compensation_problem(direct_alone(transport), weights)
    seen = np.repeat(transport.lit.reshape(-1, 1).astype(float), transport.channels, axis=1)
    laid = onto_projector(transport.correspondence, seen, transport.projector)(target)
    laid = laid / laid.max()
    print(
        f"{name}, {transport.projector}, pitch {transport.pitch}, {len(plan.patterns)} photos, "
        f"scale {found.scale:.3f}; PSNR / RMSE / SSIM\n"
        f"  uncompensated      {max(judged(b * laid) for b in BRIGHTNESSES)}\n"
        f"  direct light alone {judged(alone.solve(target, laid, 1.0))}\n"
        f"  truncated series   {_series(transport, target, judged)}\n"
        f"  compensated        {judged(found.light)} (said: {found.psnr:.1f} dB)",
        flush=True,
    )
    if with_limit:
        exact = replace(problem, forward=_forward(scene, shape), adjoint=_adjoint(scene))
        limit = exact.solve(target, found.light.reshape(problem.diagonal.shape), 1.0)
        print(f"  the true T         {judged(limit)}")
    print(
        f"  out of reach {found.out_of_reach_share:.1%}; {took:.0f} s of one processor, "
        f"{took / relighting:.0f} relightings",
        flush=True,
    )


def ssim(photo: Floats, target: Floats, peak: float) -> float:
    """Return the mean structural similarity of two pictures (Cy, Cx, channels)."""

    def blurred(picture: Floats) -> Floats:
        return np.asarray(ndimage.gaussian_filter(picture, (SSIM_WIDTH, SSIM_WIDTH, 0)))

    least, least_spread = ((share * peak) ** 2 for share in SSIM_LEAST)
    one, other = blurred(photo), blurred(target)
    own, its = blurred(photo**2) - one**2, blurred(target**2) - other**2
    both = blurred(photo * target) - one * other
    brightness = (2 * one * other + least) / (one**2 + other**2 + least)
    return float(np.mean(brightness * (2 * both + least_spread) / (own + its + least_spread)))


def _forward(scene: KnownTransport, shape: tuple[int, ...]):
    return lambda light: np.reshape(scene @ light.astype(np.float32), shape).astype(np.float64)


def _adjoint(scene: KnownTransport):
    return lambda image: np.reshape(
        scene.H @ image.astype(np.float32), (*scene.projector, scene.channels)
    ).astype(np.float64)


def _series(transport: Transport, target: Floats, judged: Callable[[Floats], Judged]) -> Judged:
    """Judge l += D^-1 (target - T l), begun at 0, at the best of up to `TERMS` terms."""
    white = transport.direct.reshape(-1, transport.channels)
    onto = onto_projector(transport.correspondence, white, transport.projector)
    light = np.zeros((*transport.projector, transport.channels))
    best = Judged(-np.inf, np.inf, 0.0)
    for _ in range(TERMS):
        light = light + onto(target - np.reshape(transport @ light, target.shape))
        if not np.isfinite(light).all() or np.abs(light).max() > 1e6:
            break
        best = max(best, judged(np.clip(light, 0.0, 1.0)))
    return best


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenes", nargs="*", default=list(WINDOWS))
    parser.add_argument("--photos", type=int, default=117)
    parser.add_argument("--side", type=int)
    parser.add_argument("--camera", type=int)
    parser.add_argument("--no-limit", action="store_true")
    chosen = parser.parse_args()
    for scene_name in chosen.scenes:
        run(scene_name, chosen.photos, chosen.side, chosen.camera, with_limit=not chosen.no_limit)
