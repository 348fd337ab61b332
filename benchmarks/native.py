"""Transport at every projector pixel: accuracy against the projector's size and against photos.

Run ``python benchmarks/native.py SCENE --projector HxW ... --camera HxW [--photos N ...]``. A
built-in scene is shot with 30 000 electrons, 14 bits, 8-bit patterns, 1 % ambient light and white
at 90 % of full scale; one channel, green. Photos are all counted and q is found in them. It prints
SNR_b in dB under five natural pictures, a random light and white, all at the projector's full
resolution, and how much wall and processor time and peak memory the process had taken after each
step; then a table of them all. The pictures are the same on the scene, whatever the projector: each
pixel is the mean of what it covers of an original of 1920x1920. A projector that is not square
shows the middle of it, as it lights the middle of the scene.

With ``--blocks S ...``, one for each projector, the table has besides what a plan for blocks of
S x S projector pixels comes to.
"""

import argparse
import resource
import sys
import time
from dataclasses import replace
from functools import cache
from typing import NamedTuple

import numpy as np

from nearfar import Size, choose_plan, natural_picture, snr
from nearfar.arrays import Floats, parse_size
from nearfar.correspondence import correspond_by_phase
from nearfar.estimate.joint import estimate_jointly
from nearfar.files.resizing import resize_light
from nearfar.parallel import single_threaded_products
from nearfar.photometry.measure import measure
from nearfar.plan.expect import Expected
from nearfar.rigs.simulated.camera import SimulatedCamera
from nearfar.rigs.simulated.projector import SimulatedProjector
from nearfar.rigs.simulated.rig import SimulatedRig, brightest
from nearfar.scenes.cache import cached_operator
from nearfar.transport.exact_operator import ExactOperator
from nearfar.transport.mediated import DenseBetween, Mediated
from nearfar.transport.model import Transport
from nearfar.workflow.acquire import acquire_in_memory

GREEN = 1
PICTURES = 5
# Side of the pictures that all projectors show.
ORIGINAL = 1920
# White of the brightest camera pixel, as a share of full scale.
LEVEL = 0.9
CAMERA = SimulatedCamera(full_well=30_000.0, bits=14, ambient=0.01)


class Blocks:
    """A transport whose projector pixels are blocks of another's."""

    def __init__(self, world: ExactOperator, side: int) -> None:
        self.world, self.side = world, side
        self.projector = Size(*(length // side for length in world.projector))
        self.camera, self.channels, self.name = world.camera, world.channels, world.name

    def __matmul__(self, light: Floats) -> Floats:
        return self.world @ self.enlarged(light)

    def pictures(self, lights: Floats) -> Floats:
        """Relight under several lights."""
        return self.world.pictures(np.stack([self.enlarged(light) for light in lights]))

    def enlarged(self, light: Floats) -> Floats:
        """Return a light at the world's own resolution."""
        return light.repeat(self.side, axis=0).repeat(self.side, axis=1)


def green(world: ExactOperator) -> ExactOperator:
    """Return the green channel of an operator."""
    return replace(
        world,
        direct=world.direct[GREEN : GREEN + 1],
        near=None if world.near is None else _green(world.near),
        far=_green(world.far),
    )


def _green(part: Mediated) -> Mediated:
    name = "matrices" if isinstance(part.between, DenseBetween) else "spectra"
    values = getattr(part.between, name)[GREEN : GREEN + 1]
    return replace(part, between=replace(part.between, **{name: values}))


class Clock:
    """Prints what each step takes."""

    def __init__(self) -> None:
        self.wall, self.cpu = time.perf_counter(), time.process_time()

    def say(self, step: str) -> None:
        """Print the time since the last step, and the peak memory so far."""
        wall, cpu = time.perf_counter(), time.process_time()
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
        print(
            f"  {step:<12}{wall - self.wall:8.1f} s, {cpu - self.cpu:8.1f} s of processor time, "
            f"peak {peak:.2f} GiB",
            flush=True,
        )
        self.wall, self.cpu = wall, cpu


def lights_of(projector: Size) -> list[Floats]:
    """Return the pictures, a random light and white at a projector's resolution."""
    lights = [picture_on(projector, seed) for seed in range(PICTURES)]
    lights.append(np.random.default_rng(5).random(projector).astype(np.float32))
    lights.append(np.ones(projector, dtype=np.float32))
    return lights


def picture_on(projector: Size, seed: int) -> Floats:
    """Crop an original to the projector's shape, and resize it so that the longer sides agree."""
    rows, columns = (ORIGINAL * side // max(projector) for side in projector)
    top, left = (ORIGINAL - rows) // 2, (ORIGINAL - columns) // 2
    original = _original(seed)[top : top + rows, left : left + columns]
    return resize_light(original, projector)


@cache
def _original(seed: int) -> Floats:
    return natural_picture(Size(ORIGINAL, ORIGINAL), seed)


class Found(NamedTuple):
    """What a reconstruction comes to, in dB.

    Attributes
    ----------
    relit : list of float
        SNR_b of the lights of `lights_of`.
    expected : Expected
        What the plan had promised.
    """

    relit: list[float]
    expected: Expected

    @property
    def pictures(self) -> float:
        """SNR_b of the pictures, their mean."""
        return float(np.mean(self.relit[:PICTURES]))


def reconstruct(world: ExactOperator | Blocks, photos: int) -> tuple[Transport, float, Expected]:
    """Plan, shoot and estimate; returns the transport, the exposure and what was expected."""
    clock = Clock()
    plan, expected = choose_plan(world.projector, photos)
    clock.say("plan")
    exposure = LEVEL / brightest(world)
    rig = SimulatedRig(world, world.name, SimulatedProjector(), CAMERA, exposure, 0)
    taken = acquire_in_memory(plan, rig)
    clock.say("shoot")
    measurements = measure(taken)
    clock.say("measure")
    q = correspond_by_phase(measurements, pitch=plan.pitch).q
    clock.say("correspond")
    with single_threaded_products():
        transport = estimate_jointly(measurements, q, plan.window, plan.far, pitch=plan.pitch)
    clock.say("estimate")
    return transport, rig.exposure, expected


def judge(world: ExactOperator, photos: int, side: int = 1) -> Found:
    """Plan, simulate and estimate with so many photos of blocks of side x side pixels; score it."""
    seen = world if side == 1 else Blocks(world, side)
    blocks = "" if side == 1 else f", blocks of {side}x{side}"
    print(f"{photos} photos of projector {world.projector}{blocks}")
    transport, exposure, expected = reconstruct(seen, photos)
    lights = lights_of(world.projector)
    clock = Clock()
    relit = [np.asarray(transport @ resize_light(light, seen.projector)) for light in lights]
    clock.say(f"{len(lights)} lights")
    truths = [np.asarray(world @ light)[..., 0] for light in lights]
    found = [snr(exposure * t, r) for t, r in zip(truths, relit, strict=True)]
    print(" ", " ".join(f"{value:.2f}" for value in found), "dB", flush=True)
    return Found(found, expected)


def row(world: ExactOperator, photos: int, side: int) -> str:
    """Return the row of a table."""
    own = judge(world, photos)
    cells = [
        f"{world.projector}",
        f"{photos}",
        f"{own.pictures:.1f} ({min(own.relit[:PICTURES]):.1f} to {max(own.relit[:PICTURES]):.1f})",
        *(f"{value:.1f}" for value in own.relit[PICTURES:]),
        f"{own.expected.pictures:.1f} / {own.expected.random:.1f}",
    ]
    if side > 1:
        blocks = judge(world, photos, side)
        cells.append(f"{side}x{side}: {blocks.pictures:.1f} / {blocks.relit[PICTURES]:.1f}")
    return f"| {' | '.join(cells)} |"


def main() -> None:
    """Print the table of one scene."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scene")
    parser.add_argument("--projector", type=parse_size, nargs="+", default=[Size(256, 256)])
    parser.add_argument("--camera", type=parse_size, default=Size(320, 320))
    parser.add_argument("--photos", type=int, nargs="+", default=[200])
    parser.add_argument("--blocks", type=int, nargs="*", default=[])
    arguments = parser.parse_args()
    sides = arguments.blocks or [1] * len(arguments.projector)
    rows = []
    for projector, side in zip(arguments.projector, sides, strict=True):
        clock = Clock()
        world = green(cached_operator(arguments.scene, projector, arguments.camera))
        print(f"{arguments.scene}, projector {world.projector}, camera {world.camera}")
        clock.say("scene")
        rows += [row(world, photos, side) for photos in arguments.photos]
    print(f"\n{arguments.scene}, camera {arguments.camera}")
    print("| projector | photos | pictures | random | white | expected | blocks |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    print("\n".join(rows))


if __name__ == "__main__":
    sys.exit(main())
