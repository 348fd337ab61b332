"""The joint estimate from few photos beside the paper's protocol, on the exact scenes.

Run ``python benchmarks/fewer_photos.py [--checks] [CASE ...]``. The camera is that of
benchmarks/accuracy.py. The paper's protocol is inverse pairs and stripes by its own estimator; the
joint estimate gets a plan that was chosen for the same number of photos in all, a quarter, an
eighth and a sixteenth, and finds q in them. With ``--checks`` one photo in 25 goes to checks, as by
default, and the paper's protocol and the plan of as many photos are left out. For each it prints
SNR_b in dB, the mean over five natural pictures, under white and under a random pattern, and SNR_t
at the 1st percentile and the median of camera pixels.
alcove and shelf took no part in any choice that the estimate or the planner made.
"""

import sys
import time

import numpy as np

from accuracy import scores, shoot
from nearfar import ExactTransport, Plan, Size, choose_plan, paper_plan
from nearfar.arrays import Floats
from nearfar.correspondence import correspond_by_phase, correspond_by_stripes
from nearfar.estimate.joint import estimate_jointly
from nearfar.estimate.paper import estimate
from nearfar.illumination.pictures import standard_lights
from nearfar.photometry.in_memory import PhotosInMemory
from nearfar.photometry.measure import measure
from nearfar.rigs.simulated.camera import SimulatedCamera
from nearfar.scenes.cache import cached_scene
from nearfar.transport.model import Transport
from nearfar.workflow.evaluate import row_snr

# Scene, W and far band of the paper's plan.
CASES = {
    "cornell": (11, Size(7, 7)),
    "cornell-aside": (11, Size(7, 7)),
    "wedge": (19, Size(7, 11)),
    "corner": (15, Size(13, 13)),
    "alcove": (11, Size(7, 7)),
    "shelf": (13, Size(7, 9)),
}
SHARES = (1, 4, 8, 16)


def as_the_paper(plan: Plan, photos: PhotosInMemory) -> Transport:
    """Estimate with stripes and the paper's estimator."""
    q = correspond_by_stripes(photos).q
    return estimate(measure(photos), q, plan.window, plan.far, plan.dropped)


def jointly(plan: Plan, photos: PhotosInMemory) -> Transport:
    """Estimate with phase and the joint estimator."""
    measurements = measure(photos)
    q = correspond_by_phase(measurements, pitch=plan.pitch).q
    return estimate_jointly(measurements, q, plan.window, plan.far, pitch=plan.pitch)


def report(name: str, plan: Plan, scene: ExactTransport, lights: dict[str, Floats]) -> None:
    """Print how one plan fares."""
    truth = {light: scene @ values for light, values in lights.items()}
    photos = shoot(plan, scene, SimulatedCamera())
    started = time.perf_counter()
    found = (jointly if plan.correspondence == "phase" else as_the_paper)(plan, photos)
    seconds = time.perf_counter() - started
    low, middle = np.nanpercentile(row_snr(found, scene).snr_t, [1, 50])
    print(
        f"{name:22s} {len(plan.patterns):5d}   {scores(truth, found, lights)}  {low:7.2f} "
        f"{middle:7.2f}  {seconds:6.1f} s",
        flush=True,
    )


def run(name: str, *, checks: bool) -> None:
    """Measure one scene, with plans that have check photos or not."""
    window, far = CASES[name]
    scene = cached_scene(name)
    lights = standard_lights(scene.projector)
    print(f"{name}\n{'':22s} photos  pictures   white  random   SNR_t 1 %   50 %")
    papers = paper_plan(scene.projector, window, far)
    if not checks:
        report("the paper's", papers, scene, lights)
    for share in SHARES[1:] if checks else SHARES:
        plan, _ = choose_plan(
            scene.projector,
            len(papers.patterns) // share,
            window=window,
            checks=None if checks else 0,
        )
        report(f"joint, 1/{share}", plan, scene, lights)


if __name__ == "__main__":
    chosen = [name for name in sys.argv[1:] if name != "--checks"]
    for case in chosen or CASES:
        run(case, checks="--checks" in sys.argv)
