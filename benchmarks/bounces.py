"""Bounces of light beside those that radiosity knows, on the exact scenes.

Run ``python benchmarks/bounces.py [--photos N] [--size HxW] [SCENE ...]``. The camera is that of
benchmarks/accuracy.py, the plan one of N photos (117) that were chosen for it, correspondence
included. For a natural picture as the light it prints the share of all light that each bounce has
in the scene, and how far bounces are from it in dB: from the exact transport, whose error is that
of the method's assumption alone, from the transport of N photos with direct light of the model's
split, and from the same with direct and subsurface light of the physical split, which
``nearfar bounces`` takes.

``small-corner`` is the corner with walls that end within the picture, so that all surfaces are lit
and seen. In all other scenes light also goes by way of surfaces beyond it.
"""

import argparse
import time
from collections.abc import Callable

from accuracy import shoot
from components import WINDOWS
from fewer_photos import jointly
from nearfar import (
    Bounces,
    ExactTransport,
    Size,
    bounces,
    choose_plan,
    natural_picture,
    parse_size,
    snr,
    split_physically,
)
from nearfar.arrays import Floats
from nearfar.decibels import in_figures
from nearfar.rigs.simulated.camera import SimulatedCamera
from nearfar.scenes import sizes
from nearfar.scenes.bounces import bounces_between, exact_bounces
from nearfar.scenes.cache import cached_scene
from nearfar.scenes.corner import corner
from nearfar.scenes.geometry import View
from nearfar.scenes.render import render

COUNT = 4
SMALL = "small-corner"
SMALL_CORNER = corner(0.8, View((1.8, 1.8, 1.8), (0.2, 0.2, 0.2), 0.45))
SCENES = (SMALL, "corner", "wedge", "cornell", "cornell-aside")


def known(name: str, size: Size | None) -> tuple[ExactTransport, Floats, Floats]:
    """Return a scene, a light, and the scene's bounces under it."""
    if name == SMALL:
        size = size or Size(64, 64)
        light = natural_picture(size, 3)
        scene = render(SMALL_CORNER, size, size, progress=lambda *_: None)
        return scene, light, bounces_between(SMALL_CORNER, light, COUNT, size, size)
    projector, camera = sizes(name, size)
    light = natural_picture(projector, 3)
    scene = cached_scene(name, projector, camera)
    return scene, light, exact_bounces(name, light, COUNT, projector, camera)


def run(name: str, photos: int, size: Size | None) -> None:
    """Measure one scene."""
    scene, light, truth = known(name, size)
    everything = float((scene @ light).sum())
    print(f"{name}, projector {scene.projector}, camera {scene.camera}, {photos} photos")
    shares = " ".join(f"{100 * picture.sum() / everything:6.2f}" for picture in truth)
    print(f"  share of the light, %   {shares}")
    plan, _ = choose_plan(scene.projector, photos, window=WINDOWS.get(name))
    transport = jointly(plan, shoot(plan, scene, SimulatedCamera()))
    split = split_physically(transport)
    report("exact transport", lambda: bounces(scene, light, COUNT), truth)
    report("model's split", lambda: bounces(transport, light, COUNT), truth)
    report("physical split", lambda: bounces(split, light, COUNT), truth)


def report(name: str, find: Callable[[], Bounces], truth: Floats) -> None:
    """Print how far bounces are from the true ones, and how long they took."""
    started = time.perf_counter()
    found = find()
    seconds = time.perf_counter() - started
    pairs = zip(truth, found.pictures, strict=True)
    decibels = ", ".join(in_figures(snr(true, picture)) for true, picture in pairs)
    print(f"  {name:18s} dB   {decibels}  {seconds:5.1f} s", flush=True)
    for fault in found.faults:
        print(f"    {fault}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenes", nargs="*", default=list(SCENES))
    parser.add_argument("--photos", type=int, default=117)
    parser.add_argument("--size", type=parse_size, help="projector, and camera; the scene's own")
    chosen = parser.parse_args()
    for scene_name in chosen.scenes:
        run(scene_name, chosen.photos, chosen.size)
