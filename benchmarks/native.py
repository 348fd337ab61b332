"""Transport at every projector pixel: accuracy, photos, time and memory of each step.

Run ``python benchmarks/native.py SCENE --projector HxW --camera HxW [--photos N ...]``. A built-in
scene is shot with 30 000 electrons, 14 bits, 8-bit patterns, 1 % ambient light and white at 90 % of
full scale; one channel, green. Photos are all counted and q is found in them. It prints SNR_b in dB
under five natural pictures, a random light and white, all at the projector's full resolution, and
how much wall and processor time and peak memory the process had taken after each step. With
``--blocks S`` it prints the same of a plan for blocks of S x S projector pixels.
"""

import argparse
import resource
import sys
import time
from dataclasses import replace

import numpy as np

from nearfar import Size, choose_plan, natural_picture, snr
from nearfar.arrays import Floats, parse_size
from nearfar.correspondence import correspond_by_phase
from nearfar.estimate.joint import estimate_jointly
from nearfar.parallel import single_threaded_products
from nearfar.photometry.measure import measure
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


def reconstruct(world: ExactOperator | Blocks, photos: int) -> tuple[Transport, float]:
    """Plan, shoot and estimate; returns the transport and the exposure."""
    clock = Clock()
    plan, expected = choose_plan(world.projector, photos)
    clock.say("plan")
    exposure = LEVEL / brightest(world)
    rig = SimulatedRig(world, world.name, SimulatedProjector(), CAMERA, exposure, 0)
    taken = acquire_in_memory(plan, rig)
    clock.say("shoot")
    measurements = measure(taken)
    clock.say("measure")
    q = correspond_by_phase(measurements).q
    clock.say("correspond")
    with single_threaded_products():
        transport = estimate_jointly(measurements, q, plan.window, plan.far, pitch=plan.pitch)
    clock.say("estimate")
    print(
        f"  {len(plan.patterns)} photos, expected {expected.pictures:.1f} / {expected.random:.1f}"
    )
    return transport, rig.exposure


def main() -> None:
    """Print the table of one scene."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scene")
    parser.add_argument("--projector", type=parse_size, default=Size(256, 256))
    parser.add_argument("--camera", type=parse_size, default=Size(320, 320))
    parser.add_argument("--photos", type=int, nargs="*", default=[200])
    parser.add_argument("--blocks", type=int, default=0)
    arguments = parser.parse_args()
    clock = Clock()
    world = green(cached_operator(arguments.scene, arguments.projector, arguments.camera))
    print(f"{arguments.scene}, projector {world.projector}, camera {world.camera}")
    clock.say("scene")
    seen = Blocks(world, arguments.blocks) if arguments.blocks else world
    lights = [natural_picture(world.projector, seed) for seed in range(PICTURES)]
    lights.append(np.random.default_rng(5).random(world.projector).astype(np.float32))
    lights.append(np.ones(world.projector, dtype=np.float32))
    truths = [np.asarray(world @ light)[..., 0] for light in lights]
    for photos in arguments.photos:
        transport, exposure = reconstruct(seen, photos)
        clock = Clock()
        shown = lights
        if arguments.blocks:
            side = arguments.blocks
            shape = (seen.projector.height, side, seen.projector.width, side)
            shown = [light.reshape(shape).mean(axis=(1, 3)) for light in lights]
        relit = [np.asarray(transport @ light) for light in shown]
        clock.say(f"{len(shown)} lights")
        found = [snr(exposure * t, r) for t, r in zip(truths, relit, strict=True)]
        pictures = " ".join(f"{value:.1f}" for value in found[:PICTURES])
        print(
            f"  pictures {np.mean(found[:PICTURES]):.2f} ({pictures}), "
            f"random {found[-2]:.2f}, white {found[-1]:.2f} dB",
            flush=True,
        )


if __name__ == "__main__":
    sys.exit(main())
