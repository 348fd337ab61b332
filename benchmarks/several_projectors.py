"""Two projectors before one camera: shared photos, and lights that compensate together.

Run ``python benchmarks/several_projectors.py``. Two projectors of 32x32 light the box of cornell
from the left and from the right, before a camera of 48x48; they overlap in much of the scene (the
scenes cornell-left and cornell-right) or in little of it. The plan is one of N photos (117) for
each.

First come shared photos beside photos in turn, 2 N exposures either way, of a camera of 30 000
electrons, one of 1000, and one of 1000 in a lit room (ambient light of a quarter of full scale).
Exposure is bound by time, and then the same for both ways; or by full scale, and then photos in
turn are exposed for the brighter of both whites, and shared ones for their sum. It prints what is
said of the noise beforehand, in dB, and the SNR_b of relighting, mean error of both projectors,
under pictures and under a random light; then how large true errors are, by the error bars of both.

Then come lights for a natural picture, PSNR in dB of the *true* photo below the brightest wanted
value, over camera pixels that either projector lights directly: by each projector alone, both of
these lights shown together, lights from direct light alone that fade towards the edges of the
projectors, the lights that nearfar computes for both (and what it says beforehand), and those of
the scene's own transports.
"""

import argparse
from dataclasses import replace
from math import log10

import numpy as np

from fewer_photos import jointly
from nearfar import (
    ErrorBars,
    ExactTransport,
    Size,
    Transport,
    choose_plan,
    compensate_together,
    natural_picture,
    random_pattern,
    relight_together,
)
from nearfar.applications.compensate_together import blended_lights, joint_problem
from nearfar.arrays import Floats
from nearfar.photometry.shared_photos import photos_of_each
from nearfar.plan import Plan
from nearfar.plan.sharing import shared_plan
from nearfar.rigs.simulated.camera import SimulatedCamera
from nearfar.rigs.simulated.projector import SimulatedProjector
from nearfar.rigs.simulated.rig import SimulatedRig
from nearfar.rigs.simulated.side_by_side import simulated_side_by_side
from nearfar.scenes.cornell import cornell_left, cornell_right
from nearfar.scenes.geometry import Scene, View
from nearfar.scenes.render import render
from nearfar.workflow.acquire import acquire_in_memory
from nearfar.workflow.acquire_shared import gain_of_sharing

PROJECTOR, CAMERA = Size(32, 32), Size(48, 48)
# Share of full scale of the brightest white: at 1000 electrons noise is 3 % of it.
WHITE = 0.8
CAMERAS = {
    "30 000 electrons": SimulatedCamera(),
    "1000 electrons": SimulatedCamera(full_well=1000.0),
    "1000 electrons, lit room": SimulatedCamera(full_well=1000.0, ambient=0.25),
}
LIGHTS = {
    "pictures": [natural_picture(PROJECTOR, seed) for seed in range(5)],
    "random": [random_pattern(PROJECTOR, seed) for seed in range(3)],
}


def narrow(scene: Scene, x: float) -> Scene:
    """Turn a projector further aside, and narrow its beam."""
    return replace(scene, projector_view=View((x, 0.6, 2.3), (x, 0.5, -0.3), 0.12))


def worlds(overlap: str) -> list[ExactTransport]:
    """Compute the transports of both projectors."""
    scenes = [cornell_left(), cornell_right()]
    if overlap == "little":
        scenes = [narrow(scene, x) for scene, x in zip(scenes, (-0.27, 0.27), strict=True)]
    return [render(scene, PROJECTOR, CAMERA, progress=lambda *_: None) for scene in scenes]


def rigs(transports: list[ExactTransport], camera: SimulatedCamera, exposure: float):
    """Return a rig of each projector, and of both."""
    each = [
        SimulatedRig(world, f"projector {i}", SimulatedProjector(), camera, exposure, i)
        for i, world in enumerate(transports)
    ]
    return each, simulated_side_by_side(each, ["left", "right"])


def brightest(transports: list[ExactTransport]) -> tuple[float, float]:
    """Return the brightest white of one projector, and of both together."""
    whites = [transport @ np.ones(PROJECTOR, np.float32) for transport in transports]
    return float(np.max(whites)), float(np.sum(whites, axis=0).max())


def decibels(found: list[Transport], transports: list[ExactTransport], exposure: float, lights):
    """Return SNR_b, the errors of both projectors together, and errors over error bars."""
    signal = error = scaled = 0.0
    for transport, world in zip(found, transports, strict=True):
        bars = ErrorBars(transport)
        for light in lights:
            truth = exposure * (world @ light)
            off = (transport @ light) - truth
            signal += float(np.sum(truth**2))
            error += float(np.sum(off**2))
            scaled += float(np.mean((off / bars.picture(light)) ** 2))
    return 10 * log10(signal / error), (scaled / len(found) / len(lights)) ** 0.5


def compare_photos(transports: list[ExactTransport], plan: Plan, camera: SimulatedCamera) -> None:
    """Print shared photos beside photos in turn."""
    one, both = brightest(transports)
    room = WHITE - camera.ambient
    for bound in ("time", "full scale"):
        shared = room / both
        in_turn = shared if bound == "time" else room / one
        _, together = rigs(transports, camera, shared)
        together = replace(together, exposure=1.0)
        gain = gain_of_sharing(together, 2, exposures=(in_turn / shared, 1.0))
        apart = photos_of_each(acquire_in_memory(shared_plan(plan, 2), together))
        alone = [acquire_in_memory(plan, rig) for rig in rigs(transports, camera, in_turn)[0]]
        found = {
            "in turn": ([jointly(plan, photos) for photos in alone], in_turn),
            "shared": ([jointly(plan, photos) for photos in apart], shared),
        }
        words = []
        for name, (estimates, exposure) in found.items():
            measured = [decibels(estimates, transports, exposure, LIGHTS[of]) for of in LIGHTS]
            words.append(
                f"{name} {', '.join(f'{value:.1f}' for value, _ in measured)} dB "
                f"(errors {measured[0][1]:.2f} of their bars)"
            )
        print(f"    exposure bound by {bound}: said {gain.decibels:+.1f} dB; {'; '.join(words)}")


def compare_lights(transports: list[ExactTransport], plan: Plan, scale: float) -> None:
    """Print what lights of each projector and of both make of a natural picture."""
    exposure = (WHITE - 0.01) / brightest(transports)[1]
    each, _ = rigs(transports, SimulatedCamera(), exposure)
    found = [jointly(plan, acquire_in_memory(plan, rig)) for rig in each]
    wanted = natural_picture(CAMERA, 5)
    joint = compensate_together(found, wanted, scale)
    lit = np.any([transport.lit for transport in found], axis=0)
    target = np.repeat(scale * wanted[..., None], 3, axis=2)

    def psnr(lights: list[Floats]) -> float:
        photo = exposure * sum(
            world @ light.astype(np.float32)
            for world, light in zip(transports, lights, strict=True)
        )
        return 10 * log10(joint.peak**2 / float(np.mean((photo - target)[lit] ** 2)))

    problem = joint_problem(found, lit[..., None].astype(float))
    alone = [own.solve(target, np.zeros_like(own.diagonal), 1.0) for own in problem.problems]
    dark = np.zeros((*PROJECTOR, 3))
    blended = problem.apart(blended_lights(found, target, problem.weights))
    exact = replace(problem, problems=_exact(problem.problems, transports, exposure))
    exact = replace(
        exact,
        forward=lambda flat: sum(
            own.forward(light)
            for own, light in zip(exact.problems, problem.apart(flat), strict=True)
        ),
        adjoint=lambda picture: np.concatenate(
            [own.adjoint(picture).ravel() for own in exact.problems]
        ),
    )
    start = np.concatenate([light.ravel() for light in joint.lights]).astype(np.float64)
    limit = problem.apart(exact.solve(target, start, 1.0))
    print(
        f"    scale {scale}: left alone {psnr([alone[0], dark]):.1f}, right alone "
        f"{psnr([dark, alone[1]]):.1f}, both of these {psnr(alone):.1f}, direct light alone, "
        f"blended {psnr([np.clip(light, 0, 1) for light in blended]):.1f}, jointly "
        f"{psnr(list(joint.lights)):.1f} (said {joint.psnr:.1f}), limit {psnr(limit):.1f}; "
        f"out of reach {joint.out_of_reach_share:.0%}"
    )
    relit = relight_together(found, [np.ones(PROJECTOR, np.float32)] * 2)
    white = exposure * sum(world @ np.ones(PROJECTOR, np.float32) for world in transports)
    snr = 10 * log10(np.sum(white**2) / np.sum((relit - white) ** 2))
    print(f"    white of both, relit together: {snr:.1f} dB", flush=True)


def _exact(problems, transports: list[ExactTransport], exposure: float):
    """State the problems of the scene's own transports."""

    def stated(problem, world: ExactTransport):
        return replace(
            problem,
            forward=lambda light: exposure * (world @ light.astype(np.float32)).astype(np.float64),
            adjoint=lambda picture: (
                exposure * (world.H @ picture.astype(np.float32)).astype(np.float64)
            ),
        )

    return tuple(
        stated(problem, world) for problem, world in zip(problems, transports, strict=True)
    )


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--photos", type=int, default=117)
    chosen = parser.parse_args()
    made, _ = choose_plan(PROJECTOR, chosen.photos)
    for amount in ("much", "little"):
        both_worlds = worlds(amount)
        reach = [np.isfinite(world.correspondence[..., 0]) for world in both_worlds]
        share = float(np.mean(reach[0] & reach[1]) / np.mean(reach[0] | reach[1]))
        print(f"{amount} overlap ({share:.0%} of the lit camera pixels)", flush=True)
        for name, sensor in CAMERAS.items():
            print(f"  {name}", flush=True)
            compare_photos(both_worlds, made, sensor)
        print("  compensation", flush=True)
        for wanted_scale in (0.05, 0.15):
            compare_lights(both_worlds, made, wanted_scale)
