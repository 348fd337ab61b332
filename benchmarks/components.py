"""Components of floodlit pictures beside physical truth, on the exact scenes.

Run ``python benchmarks/components.py [--photos N] [SCENE ...]``. The camera is that of
benchmarks/accuracy.py, the plan one of N photos (117) that were chosen for it, correspondence
included. For the model's split and the physical one it prints, in dB under white, how far direct
light, light under surfaces and inter-reflection are from those of the scene; then the share of the
light that is taken for subsurface light, and mean and standard deviation of direct light at
translucent surfaces beside the true ones. The model's near-range light stands beside subsurface
light, its far-range light beside inter-reflection.
alcove and shelf took no part in any choice that the split made.
"""

import argparse

import numpy as np

from accuracy import shoot
from fewer_photos import jointly
from nearfar import choose_plan, snr
from nearfar.arrays import Floats
from nearfar.estimate.physical import split_physically
from nearfar.rigs.simulated.camera import SimulatedCamera
from nearfar.scenes.cache import cached_scene

# W, where it is not the plan's own choice.
WINDOWS = {
    "cornell": 11,
    "cornell-aside": 11,
    "wedge": 19,
    "corner": None,
    "alcove": 11,
    "shelf": 13,
}


def decibels(truth: tuple[Floats, ...], found: tuple[Floats, ...]) -> str:
    """Write the SNR of each component that the scene has."""
    values = [
        f"{snr(t, np.reshape(f, t.shape)):6.2f}" if t.any() else "     -"
        for t, f in zip(truth, found, strict=True)
    ]
    return " ".join(values)


def run(name: str, photos: int) -> None:
    """Measure one scene."""
    scene = cached_scene(name)
    plan, _ = choose_plan(scene.projector, photos, window=WINDOWS[name])
    transport = jointly(plan, shoot(plan, scene, SimulatedCamera()))
    white = np.ones(scene.projector, dtype=np.float32)
    truth = scene.component_pictures(white)
    physical = split_physically(transport).components(white)
    share = physical.subsurface.sum() / sum(part.sum() for part in physical)
    print(f"{name}, {len(plan.patterns)} photos; direct, subsurface, inter-reflection")
    print(f"  model's split    {decibels(truth, transport.components(white))}")
    print(f"  physical split   {decibels(truth, physical)}  subsurface {100 * share:.1f} %")
    translucent = truth[1].any(axis=-1) & transport.lit
    if translucent.any():
        direct = np.reshape(physical.direct, truth[0].shape)
        for kind, part in (("true", truth[0]), ("found", direct)):
            means, spreads = part[translucent].mean(axis=0), part[translucent].std(axis=0)
            numbers = f"mean {means.round(3)} deviation {spreads.round(3)}"
            print(f"  direct light there, {kind:5s} {numbers}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenes", nargs="*", default=list(WINDOWS))
    parser.add_argument("--photos", type=int, default=117)
    chosen = parser.parse_args()
    for scene_name in chosen.scenes:
        run(scene_name, chosen.photos)
