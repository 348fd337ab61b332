"""Accuracy on the exact scenes, beside what the model allows and what photon noise allows.

Run ``python benchmarks/accuracy.py [CASE ...]``. The camera has 30 000 e- at full well, 4 e- of
read noise and 14 bits, patterns have 8 bits, ambient light is 1 %, white reaches 90 % of the
range; inverse pairs, correspondence by stripes. For each scene it prints SNR_b in dB, the mean
over five natural pictures, under white and under a random pattern, of

- nearfar: the reconstruction from noisy photos;
- ceiling: D, a window and a band fitted to the true transport, no noise;
- floor: the noise of the same photos laid on a scene that obeys the model, so that photon noise
  is all that is wrong.
"""

import sys
import time
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from nearfar import ExactTransport, Plan, Size, Transport, paper_plan, snr
from nearfar.arrays import Floats
from nearfar.correspondence import correspond_by_stripes
from nearfar.estimate.fit import fit_model
from nearfar.estimate.paper import estimate
from nearfar.illumination.pictures import standard_lights
from nearfar.photometry.in_memory import PhotosInMemory
from nearfar.photometry.measure import measure
from nearfar.photometry.measurements import Measurements
from nearfar.rigs.simulated.camera import SimulatedCamera
from nearfar.rigs.simulated.projector import SimulatedProjector
from nearfar.rigs.simulated.rig import SimulatedRig
from nearfar.scenes.cache import cached_scene
from nearfar.workflow.acquire import acquire_in_memory

# Scene, W, far band, and the least mean over pictures that is asked for.
CASES = {
    "cornell": (11, Size(7, 7), 40.3),
    "cornell-aside": (11, Size(7, 7), 40.2),
    "wedge": (19, Size(7, 11), 45.5),
    "corner": (15, Size(13, 13), 44.2),
}
CLEAN = SimulatedCamera(shot_noise=False, read_noise=0.0, full_well=1e9, bits=16)


def shoot(plan: Plan, scene: ExactTransport, camera: SimulatedCamera) -> PhotosInMemory:
    """Take the photos of a plan."""
    rig = SimulatedRig(scene, scene.name, SimulatedProjector(), camera, 1.0, 0)
    return acquire_in_memory(plan, rig)


def scores(truth: Mapping[str, Floats], found: Transport, lights: Mapping[str, Floats]) -> str:
    """Write the mean over pictures, white and random, in dB."""
    values = {
        n: snr(truth[n], (found @ light).reshape(truth[n].shape)) for n, light in lights.items()
    }
    pictures = np.mean([value for name, value in values.items() if name.startswith("picture")])
    return f"{pictures:6.2f} {values['white']:7.2f} {values['random']:7.2f}"


def responses_of(transport: Transport, measurements: Measurements) -> NDArray[np.float32]:
    """Return the true responses of a transport to the measured patterns."""
    patterns = measurements.basis.patterns + measurements.quantisation_error
    pixels = transport.camera.pixels
    parts = [transport.rows(slice(c, c + 512)) @ patterns.T for c in range(0, pixels, 512)]
    return np.concatenate(parts)


def run(name: str) -> None:
    """Measure one scene."""
    window, far, asked = CASES[name]
    scene = cached_scene(name)
    plan = paper_plan(scene.projector, window, far)
    lights = standard_lights(scene.projector)
    truth = {light: scene @ values for light, values in lights.items()}

    photos = shoot(plan, scene, SimulatedCamera())
    started = time.perf_counter()
    q = correspond_by_stripes(photos).q
    measurements = measure(photos)
    found = estimate(measurements, q, window, far, plan.dropped)
    seconds = time.perf_counter() - started
    print(
        f"{name}: {plan.transport_photos} + {plan.counts['correspondence']} photos, W = {window}, "
        f"far {far}, {seconds:.1f} s; asked for {asked} dB under pictures"
    )
    print("            pictures   white  random")
    print(f"  nearfar     {scores(truth, found, lights)}")

    fitted = fit_model(scene, window, found.far_basis)
    print(f"  ceiling     {scores(truth, fitted, lights)}")

    clean = measure(shoot(plan, scene, CLEAN))
    laid = responses_of(fitted, measurements) + measurements.responses - clean.responses
    noise_alone = estimate(
        replace(measurements, responses=laid), scene.correspondence, window, far, plan.dropped
    )
    obeying = {light: fitted @ values for light, values in lights.items()}
    print(f"  floor       {scores(obeying, noise_alone, lights)}", flush=True)


if __name__ == "__main__":
    for case in sys.argv[1:] or CASES:
        run(case)
