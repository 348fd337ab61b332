"""How often the truth lies within one standard deviation of the joint estimate, on exact scenes.

Run ``python benchmarks/error_bars.py [CASE ...]``. Cameras and plans are those of
benchmarks/fewer_photos.py, q by phase. For each plan it prints the share, in per cent, of camera
pixels and channels under white, under five natural pictures and under a random light; of d where
there is direct light; and of entries of N and F of some camera pixels, against the D, window and
band that fit the true transport best. 68 is what errors of a Gaussian would give.
"""

import sys

import numpy as np

from accuracy import shoot
from fewer_photos import CASES
from nearfar import ErrorBars, ExactTransport, Transport, choose_plan, paper_plan
from nearfar.arrays import Floats
from nearfar.correspondence import correspond_by_phase
from nearfar.estimate.fit import fit_model
from nearfar.estimate.joint import estimate_jointly
from nearfar.illumination.pictures import standard_lights
from nearfar.photometry.measure import measure
from nearfar.rigs.simulated.camera import SimulatedCamera
from nearfar.scenes.cache import cached_scene

SHARES = (4, 16)
# Camera pixels whose rows are looked at.
ROWS = 100


def within(error: Floats, deviation: Floats) -> float:
    """Share of errors within one deviation, in per cent."""
    return 100.0 * float(np.mean(np.abs(error) < deviation))


def coverage(scene: ExactTransport, found: Transport) -> dict[str, float]:
    """Measure how often the truth lies within one deviation."""
    bars = ErrorBars(found)
    shares: dict[str, list[float]] = {"white": [], "pictures": [], "random": []}
    for name, light in standard_lights(scene.projector).items():
        truth = scene @ light
        error = (found @ light).reshape(truth.shape) - truth
        share = within(error, bars.picture(light).reshape(truth.shape))
        shares["pictures" if name.startswith("picture") else name].append(share)
    model = fit_model(scene, found.window, found.far_basis, found.correspondence)
    lit = found.lit
    shares["D"] = [within((found.direct - model.direct)[lit], bars.direct()[lit])]
    chosen = np.random.default_rng(0).choice(np.flatnonzero(lit), ROWS, replace=False)
    shares |= {"N": [], "F": []}
    for c in chosen:
        pixel = slice(c, c + 1)
        rows = [t.component_rows(pixel) for t in (bars, found, model)]
        for name, part in (("N", "near"), ("F", "far")):
            deviation, mine, truth = (getattr(row, part) for row in rows)
            held = deviation > 0
            # A prior component may hold no near-range light at all.
            if held.any():
                shares[name].append(within((mine - truth)[held], deviation[held]))
    return {name: float(np.mean(values)) for name, values in shares.items()}


def run(name: str) -> list[dict[str, float]]:
    """Measure one scene."""
    window, far = CASES[name]
    scene = cached_scene(name)
    total = len(paper_plan(scene.projector, window, far).patterns)
    results = []
    for share in SHARES:
        plan, _ = choose_plan(scene.projector, total // share, window=window, checks=0)
        measurements = measure(shoot(plan, scene, SimulatedCamera()))
        q = correspond_by_phase(measurements, pitch=plan.pitch).q
        found = estimate_jointly(measurements, q, plan.window, plan.far, pitch=plan.pitch)
        results.append(coverage(scene, found))
        values = " ".join(f"{value:8.1f}" for value in results[-1].values())
        print(f"{name:14s} {len(plan.patterns):5d}  {values}", flush=True)
    return results


if __name__ == "__main__":
    print(f"{'':14s} photos    white pictures   random        D        N        F")
    every = [result for case in sys.argv[1:] or CASES for result in run(case)]
    means = " ".join(f"{np.mean([r[k] for r in every]):8.1f}" for k in every[0])
    print(f"{'mean':20s}  {means}")
