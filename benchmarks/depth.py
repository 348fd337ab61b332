"""Depth under global light: planes and a ball, by a plan's own phase and by Gray code.

A room of coloured walls with a ball in it, seen from aside: walls light each other and the ball.
Planes and the ball are fitted to the points of the camera pixels that see them alone, each weighed
by its error bar; residuals are along the normal. Gray code is photographed as often as fills the
same number of photos, and averaged. Points are compared with the true ones, too, along the ray.

    python benchmarks/depth.py [--projector 64x64] [--camera 64x64]

Beyond 128x128 the scene is rendered at native size, direct light by ray casting below the pixel.
"""

import argparse
import tempfile
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.ndimage import binary_erosion
from scipy.optimize import least_squares

import nearfar
from nearfar.arrays import Floats, Size, parse_size
from nearfar.rigs.simulated.camera import SimulatedCamera
from nearfar.rigs.simulated.projector import SimulatedProjector
from nearfar.rigs.simulated.rig import SimulatedRig
from nearfar.scenes.cornell import CAMERA, PROJECTOR, WHITE, cornell_aside
from nearfar.scenes.geometry import Scene, ball, solid
from nearfar.scenes.native.render import render_native
from nearfar.scenes.optics import pinhole, sub_rays
from nearfar.scenes.rays import hit, surface
from nearfar.scenes.render import render
from nearfar.scenes.stereo import stereo_of_scene
from nearfar.transport.known import KnownTransport

ROOM = ("back wall", "left wall", "floor")
MIDDLE, RADIUS = (0.05, 0.28, -0.3), 0.26
MILLIMETRES = 1000.0
LARGEST_MATRIX = 128
BUDGETS = (28, 56, 112)


class World(NamedTuple):
    """The scene, its true points by camera pixel, and which part each camera pixel sees alone."""

    transport: KnownTransport
    stereo: nearfar.StereoCalibration
    points: Floats
    masks: dict[str, Floats]
    middle: Floats


def room(projector: Size, camera: Size) -> World:
    """Render the room, and cast the rays of the camera's pixels."""
    parts = [part for part in cornell_aside().parts if not part.name.startswith(("cup", "candle"))]
    parts.append(solid("ball", ball(RADIUS, subdivisions=5), WHITE, move=MIDDLE))
    scene = Scene("room", tuple(parts), PROJECTOR, CAMERA)
    make = render_native if min(projector) > LARGEST_MATRIX else render
    transport = make(scene, projector, camera, progress=lambda _, __: None)
    where = surface(scene.parts, range(len(scene.parts)))
    lens = pinhole(CAMERA, projector)
    hits = hit(where, lens.position, sub_rays(lens, camera, 1)[0])
    part = where.part[hits.face].reshape(camera)
    names = [each.name for each in scene.parts]

    def turned(place: Floats) -> Floats:
        return (place - lens.position) @ lens.axes.T * [1, -1, 1]

    masks = {
        name: binary_erosion(part == names.index(name), np.ones((3, 3)), border_value=1)
        for name in (*ROOM, "ball")
    }
    stereo = stereo_of_scene("cornell-aside", projector, camera)
    return World(
        transport,
        stereo,
        turned(hits.position).reshape(*camera, 3),
        masks,
        turned(np.array(MIDDLE)),
    )


def photographed(world: World, plan: nearfar.Plan, times: int, folder: Path) -> nearfar.Capture:
    """Photograph a plan several times, and average the photos."""
    total = 0.0
    for seed in range(times):
        rig = SimulatedRig(
            world.transport, "room", SimulatedProjector(), SimulatedCamera(), 1.0, seed
        )
        taken = nearfar.acquire(plan, folder / f"{seed}.zarr", rig, force=True)
        total = total + taken.read(slice(None)) / times
    return nearfar.write_capture(
        plan, folder / "mean.zarr", np.asarray(total, np.float32), full_scale=1.0, force=True
    )


def plane_residuals(points: Floats, deviation: Floats) -> Floats:
    """Distances of points (n, 3) from the plane that is fitted to them."""
    weight = 1 / deviation**2
    middle = (weight[:, None] * points).sum(axis=0) / weight.sum()
    _, _, axes = np.linalg.svd((points - middle) / deviation[:, None], full_matrices=False)
    return (points - middle) @ axes[2]


def ball_residuals(points: Floats, deviation: Floats) -> tuple[Floats, float]:
    """Distances of points from the ball that is fitted to them, and its radius."""

    def left(ball_: Floats) -> Floats:
        return np.linalg.norm(points - ball_[:3], axis=1) - ball_[3]

    start = np.append(points.mean(axis=0) + np.array([0, 0, 0.2]), 0.2)
    found = least_squares(lambda b: left(b) / deviation, start, loss="huber").x
    return left(found), float(found[3])


def row(world: World, name: str, capture: nearfar.Capture) -> str:
    """Return a row of the table."""
    found = nearfar.depth(capture, world.stereo)
    kept = np.isfinite(found.points[..., 2])
    cells = []
    for part, mask in world.masks.items():
        chosen = kept & mask
        points, deviation = found.points[chosen], found.deviation[chosen]
        if part == "ball":
            residuals, radius = ball_residuals(points, deviation)
        else:
            residuals = plane_residuals(points, deviation)
        cells.append(f"{MILLIMETRES * np.sqrt(np.mean(residuals**2)):.1f}")
    error = np.linalg.norm(found.points, axis=-1) - np.linalg.norm(world.points, axis=-1)
    size = np.abs(error[kept])
    alone = kept & np.any(list(world.masks.values()), axis=0)
    inside = np.abs(error[alone]) < found.deviation[alone]
    return (
        f"| {name} | {' | '.join(cells)} | {MILLIMETRES * (radius - RADIUS):+.1f} | "
        f"{MILLIMETRES * np.median(size):.1f} | {found.kept} of {found.lit} | "
        f"{np.mean(size < found.deviation[kept]):.0%} | {inside.mean():.0%} |"
    )


def main() -> None:
    """Print the table."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--projector", type=parse_size, default=Size(64, 64))
    options.add_argument("--camera", type=parse_size, default=Size(64, 64))
    options.add_argument("--photos", type=int, nargs="*", default=BUDGETS)
    given = options.parse_args()
    grid: Size = given.projector
    world = room(grid, given.camera)
    gray = nearfar.paper_plan(grid, 1, (1, 1), correspondence="gray")
    print(
        f"| photos | {', mm | '.join(world.masks)}, mm | radius, mm | median error, mm | points | "
        "within one deviation | the same, off edges |"
    )
    print("| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |")
    with tempfile.TemporaryDirectory() as folder:
        for photos in given.photos:
            times = max(1, photos // len(gray.patterns))
            taken = photographed(world, gray, times, Path(folder))
            print(row(world, f"{times * len(gray.patterns)} of Gray code", taken))
            plan, _ = nearfar.choose_plan(grid, photos)
            taken = photographed(world, plan, 1, Path(folder))
            print(row(world, f"{len(plan.patterns)} by `nearfar plan`", taken))


if __name__ == "__main__":
    main()
