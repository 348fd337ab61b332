"""Estimates of transports that are not direct + near + far, beside what assumes nothing of them.

Run ``python benchmarks/hostile.py [--scenes] [--look] [--bars] [--seed SEED] [NAME ...]``.
Transports are those of `nearfar.scenes.hostile` that follow from a seed (0), cameras of three
constant noises; with ``--scenes``, small built-in scenes with the camera of benchmarks/accuracy.py.
At five budgets, shares of the projector's pixels P, it prints SNR_b in dB under pictures, under
random lights, and the 10th percentile over lights of one projector pixel, for

- joint: the joint estimate from a plan that was chosen for the budget, q by phase;
- DFT: the inverse DFT of the responses of the same photos, 0 where none was measured;
- paper: the best of the paper's plans that the budget allows;
- Hadamard, brute force: where the budget allows them.

With ``--look``, the plan is chosen by a first look of a fifth of P photos, which come on top of the
budget, and "look" stands in place of "joint".

``--alone`` leaves out all but the joint estimate; ``--budgets`` takes other shares of P. With
``--bars`` it prints for the joint estimate how many errors lie within one standard deviation,
in per cent, in place of the others.
"""

import argparse
import sys
from collections.abc import Iterator

import numpy as np

from nearfar import ErrorBars, ExactTransport, Size, choose_plan, snr
from nearfar.arrays import Floats
from nearfar.correspondence import correspond_by_phase
from nearfar.errors import PlanError
from nearfar.estimate.joint import estimate_jointly
from nearfar.illumination.pictures import natural_picture, random_pattern
from nearfar.illumination.real_basis import real_basis
from nearfar.photometry.measure import measure
from nearfar.photometry.measurements import Measurements
from nearfar.plan.by_look import plan_by_look
from nearfar.plan.look import Look, look_at
from nearfar.plan.model import Plan
from nearfar.rigs.simulated.camera import SimulatedCamera
from nearfar.scenes.cache import cached_scene
from nearfar.scenes.hostile import HOSTILE, hostile_transport
from nearfar.transport.model import Transport
from nearfar.workflow.acquire import acquire_in_memory
from nearfar.workflow.rivals.bench import Bench
from nearfar.workflow.rivals.brute_force import BRUTE_FORCE
from nearfar.workflow.rivals.hadamard import HADAMARD
from nearfar.workflow.rivals.paper import PAPER
from nearfar.workflow.rivals.rival import Budget, Relights

# Sizes of projector and camera.
SIZES = {
    "dense": (Size(12, 12), Size(16, 16)),
    "caustics": (Size(16, 16), Size(20, 20)),
    "glass": (Size(16, 16), Size(20, 20)),
    "hair": (Size(14, 18), Size(20, 20)),
    "lamps": (Size(15, 15), Size(20, 20)),
    "permuted": (Size(16, 16), Size(20, 20)),
}
SCENES = {
    "cornell": (Size(32, 32), Size(32, 32)),
    "cornell-aside": (Size(32, 32), Size(64, 64)),
    "wedge": (Size(34, 50), Size(34, 50)),
}
# Noise of a photo, as a share of full scale.
NOISES = (1 / 2000, 1 / 200, 1 / 60)
# Photos, as shares of the projector's pixels.
BUDGETS = (0.2, 0.4, 0.7, 1.0, 1.2)
SCENE_BUDGETS = (0.06, 0.12, 0.25, 0.5)
# Photos of a look.
LOOK_SHARE = 0.2
RANDOM_LIGHTS = 4
PICTURES = 5
# For error bars there are more: errors of all camera pixels under one light can have one cause.
RANDOM_LIGHTS_OF_BARS = 40
PICTURES_OF_BARS = 20
# White reaches this share of full scale; the black level keeps noise from being cut off.
EXPOSURE = 0.8


def camera_of(noise: float) -> SimulatedCamera:
    """Return a camera of constant noise, a share of full scale."""
    return SimulatedCamera(
        full_well=1e6, read_noise=noise * 1e6, bits=16, black_level=0.12, shot_noise=False
    )


def lights_of(
    projector: Size, pictures: int = PICTURES, random_lights: int = RANDOM_LIGHTS
) -> dict[str, list[Floats]]:
    """Return the lights to relight under, by kind."""
    single = np.eye(projector.pixels, dtype=np.float32).reshape(-1, *projector)
    return {
        "pictures": [natural_picture(projector, seed) for seed in range(pictures)],
        "random": [random_pattern(projector, seed) for seed in range(random_lights)],
        "single": list(single),
    }


def pictures_under(world: Relights, lights: list[Floats]) -> list[Floats]:
    """Relight under each light, each picture flat."""
    return [np.asarray(world @ light).ravel() for light in lights]


def inverse_dft(measurements: Measurements) -> Floats:
    """Return T by the inverse DFT of what was measured, (C, channels, P)."""
    basis = measurements.basis
    return real_basis(basis.frequencies, basis.projector).synthesise(measurements.responses)


class Dense:
    """A transport that is a dense matrix, (C, channels, P)."""

    def __init__(self, matrix: Floats) -> None:
        self._matrix = matrix

    def __matmul__(self, light: Floats) -> Floats:
        """Return the flat picture under a light."""
        return np.asarray(self._matrix @ light.ravel())


def scores(bench: Bench, found: Relights, lights: dict[str, list[Floats]]) -> list[float]:
    """Return SNR_b under pictures and random lights, and the 10th percentile of single pixels."""
    values = {}
    for kind, shown in lights.items():
        pairs = zip(pictures_under(bench.scene, shown), pictures_under(found, shown), strict=True)
        values[kind] = [snr(bench.gain * truth, one) for truth, one in pairs if truth.any()]
    return [
        float(np.mean(values["pictures"])),
        float(np.mean(values["random"])),
        float(np.percentile(values["single"], 10)),
    ]


def coverage(bench: Bench, found: Transport, lights: dict[str, list[Floats]]) -> list[float]:
    """Return how many errors lie within one standard deviation, in per cent."""
    bars, shares = ErrorBars(found), []
    for shown in lights.values():
        within = [
            np.abs(np.asarray(found @ light).ravel() - bench.gain * truth)
            < bars.picture(light).ravel()
            for light, truth in zip(shown, pictures_under(bench.scene, shown), strict=True)
        ]
        shares.append(100.0 * float(np.mean(within)))
    return shares


def measured(bench: Bench, plan: Plan) -> Measurements:
    """Photograph a plan of sinusoids."""
    return measure(acquire_in_memory(plan, bench.rig(1.0)))


def jointly(measurements: Measurements, plan: Plan) -> Transport:
    """Return the joint estimate."""
    q = correspond_by_phase(measurements, pitch=plan.pitch).q
    return estimate_jointly(measurements, q, plan.window, plan.far, pitch=plan.pitch)


def look(bench: Bench) -> Look:
    """Return a first look at a scene."""
    projector = bench.scene.projector
    photos = max(24, round(LOOK_SHARE * projector.pixels))
    plan, _ = choose_plan(projector, photos, window=bench.window or None, checks=0)
    return look_at(jointly(measured(bench, plan), plan))


def estimates(
    bench: Bench, photos: int, seen: Look | None, *, rivals: bool
) -> Iterator[tuple[str, Relights]]:
    """Yield every estimate that a budget allows."""
    projector = bench.scene.projector
    plan, _ = choose_plan(projector, photos, window=bench.window or None, checks=0)
    measurements = measured(bench, plan)
    if seen is None:
        yield "joint", jointly(measurements, plan)
    else:
        chosen = plan_by_look(projector, photos, seen, checked=False)
        yield "look", jointly(measured(bench, chosen), chosen)
    if not rivals:
        return
    yield "DFT", Dense(inverse_dft(measurements))
    for name, rival in (("paper", PAPER), ("Hadamard", HADAMARD), ("brute", BRUTE_FORCE)):
        if rival.photos is not None and rival.photos(bench.scene.projector) > photos:
            continue
        try:
            for attempt in rival.attempts(bench, Budget(photos)):
                yield name, attempt.transport
        except PlanError:
            continue


def run(
    scene: ExactTransport, camera: SimulatedCamera, label: str, options: argparse.Namespace
) -> None:
    """Measure one transport by one camera."""
    gain = EXPOSURE if not options.scenes else 1.0
    bench = Bench(scene, camera, 0, gain)
    lights = lights_of(scene.projector)
    if options.bars:
        lights = lights_of(scene.projector, PICTURES_OF_BARS, RANDOM_LIGHTS_OF_BARS)
    seen = look(bench) if options.look else None
    for share in options.budgets or (SCENE_BUDGETS if options.scenes else BUDGETS):
        photos = max(24, round(share * scene.projector.pixels))
        best: dict[str, list[float]] = {}
        rivals = not (options.bars or options.alone)
        for name, found in estimates(bench, photos, seen, rivals=rivals):
            if options.bars:
                assert isinstance(found, Transport)
                best[name] = coverage(bench, found, lights)
                continue
            score = scores(bench, found, lights)
            best[name] = max(best.get(name, score), score)
        values = "   ".join(
            f"{name} " + " ".join(f"{value:6.2f}" for value in score)
            for name, score in best.items()
        )
        print(f"{label:20s} {photos:4d}   {values}", flush=True)


def main() -> None:
    """Measure what was asked for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*")
    parser.add_argument("--scenes", action="store_true")
    parser.add_argument("--bars", action="store_true")
    parser.add_argument("--look", action="store_true", help="plans by a first look")
    parser.add_argument("--alone", action="store_true", help="the joint estimate alone")
    parser.add_argument("--budgets", nargs="*", type=float, help="photos, as shares of P")
    parser.add_argument("--seed", type=int, default=0, help="of the hostile transports")
    options = parser.parse_args()
    if options.scenes:
        for name in options.names or SCENES:
            run(cached_scene(name, *SCENES[name]), SimulatedCamera(), name, options)
        return
    for name in options.names or HOSTILE:
        scene = hostile_transport(name, *SIZES[name], seed=options.seed)
        for noise in NOISES:
            run(scene, camera_of(noise), f"{name} 1/{round(1 / noise)}", options)


if __name__ == "__main__":
    sys.exit(main())
