"""Estimates on an accelerator beside those of the processor, in one run.

Run ``python benchmarks/devices.py [--device cuda] [HxW ...]``, cameras (64x64, 256x256 and 512x512
by default). Each sees a random transport of three channels before a projector of 64 x 64: in 117
photos that were chosen for the joint estimate, and in the 292 that the paper's protocol takes for
W = 11 and a far band of 5 x 5, q given. For both estimators it prints the seconds of the processor,
of the device's first run, which builds priors and loads PyTorch's kernels, and of its second; how
many times as fast that is; and how far apart both transports are, in dB under a random light. Then
comes the exact Cornell box: how many dB pictures have by each.
"""

import argparse
import time
from collections.abc import Callable
from functools import partial

import numpy as np

from accuracy import scores, shoot
from nearfar import Size, Transport, choose_plan, paper_plan, snr
from nearfar.arrays import Floats, parse_size
from nearfar.correspondence import correspond_by_phase
from nearfar.devices import Device, require_device
from nearfar.estimate.joint import estimate_jointly
from nearfar.estimate.paper import estimate
from nearfar.illumination.pictures import standard_lights
from nearfar.parallel import threads
from nearfar.photometry.measure import measure
from nearfar.photometry.measurements import Measurements
from nearfar.plan import Plan
from nearfar.rigs.simulated.camera import SimulatedCamera
from nearfar.rigs.simulated.projector import SimulatedProjector
from nearfar.rigs.simulated.rig import SimulatedRig
from nearfar.scenes.cache import cached_scene
from nearfar.workflow.acquire import acquire_in_memory
from reconstruction import random_transport

PROJECTOR = Size(64, 64)
PHOTOS = 117
FAR = Size(5, 5)

Estimate = Callable[[Measurements, Floats, Plan, Device], Transport]


def jointly(measurements: Measurements, q: Floats, plan: Plan, device: Device) -> Transport:
    """Estimate jointly."""
    return estimate_jointly(measurements, q, plan.window, plan.far, pitch=plan.pitch, device=device)


def as_the_paper(measurements: Measurements, q: Floats, plan: Plan, device: Device) -> Transport:
    """Estimate as the paper does."""
    return estimate(measurements, q, plan.window, plan.far, plan.dropped, device=device)


def timed(work: Callable[[], Transport]) -> tuple[Transport, float]:
    """Return the result of a function and its run time in seconds."""
    started = time.perf_counter()
    return work(), time.perf_counter() - started


def run(camera: Size, device: Device) -> None:
    """Print one camera's rows."""
    world = random_transport(PROJECTOR, 3, FAR, camera)
    rig = SimulatedRig(world, "benchmark", SimulatedProjector(), SimulatedCamera(), 1.0, 0)
    light = np.random.default_rng(0).random(PROJECTOR, dtype=np.float32)
    estimates: dict[str, tuple[Plan, Estimate]] = {
        "joint": (choose_plan(PROJECTOR, PHOTOS)[0], jointly),
        "paper": (paper_plan(PROJECTOR, 11, FAR, correspondence="none"), as_the_paper),
    }
    for name, (plan, by) in estimates.items():
        measurements = measure(acquire_in_memory(plan, rig))
        q = world.correspondence
        ours, slow = timed(partial(by, measurements, q, plan, "cpu"))
        _, first = timed(partial(by, measurements, q, plan, device))
        theirs, fast = timed(partial(by, measurements, q, plan, device))
        print(
            f"{camera!s:>9s} {name:6s} {slow:8.1f} s {first:8.1f} s {fast:8.1f} s "
            f"{slow / fast:6.1f} times {snr(ours @ light, theirs @ light):7.1f} dB",
            flush=True,
        )


def on_an_exact_scene(device: Device) -> None:
    """Print how good both are on the Cornell box."""
    scene = cached_scene("cornell")
    plan, _ = choose_plan(scene.projector, PHOTOS, window=11)
    lights = standard_lights(scene.projector)
    truth = {light: scene @ values for light, values in lights.items()}
    measurements = measure(shoot(plan, scene, SimulatedCamera()))
    q = correspond_by_phase(measurements, pitch=plan.pitch).q
    print("cornell       pictures   white  random")
    every: tuple[Device, ...] = ("cpu", device)
    for each in every:
        print(f"  {each:9s}  {scores(truth, jointly(measurements, q, plan, each), lights)}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("cameras", nargs="*", default=["64x64", "256x256", "512x512"])
    parser.add_argument("--device", choices=["cuda", "torch"], default="cuda")
    chosen = parser.parse_args()
    require_device(chosen.device)
    print(f"{threads()} threads; processor, {chosen.device} first, {chosen.device} again, apart")
    for text in chosen.cameras:
        run(parse_size(text), chosen.device)
    on_an_exact_scene(chosen.device)
