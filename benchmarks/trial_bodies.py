"""The physical split on scenes that it was tuned on beside the built-in ones.

Run ``python benchmarks/trial_bodies.py [NAME ...]``. The scenes are those of `trial_scenes`. For
each it prints, from 117 photos and in dB under white, how far direct light, light under surfaces
and inter-reflection of the physical split are from those of the scene, and the share of errors
within one standard deviation at translucent surfaces. A scene takes one to three minutes to
compute, and is not kept.
"""

import sys

import numpy as np

from accuracy import shoot
from components import line, within
from fewer_photos import jointly
from nearfar import PhysicalErrorBars, Size, choose_plan, split_physically
from nearfar.rigs.simulated.camera import SimulatedCamera
from nearfar.scenes.render import render
from nearfar.workflow.physical_split import physical_snr
from trial_scenes import SCENES

SIZE = Size(64, 64)
PHOTOS, WINDOW = 117, 11


def run(name: str) -> None:
    """Measure one scene."""
    scene = render(SCENES[name](), SIZE, SIZE, progress=lambda _, __: None)
    plan, _ = choose_plan(scene.projector, PHOTOS, window=WINDOW)
    transport = jointly(plan, shoot(plan, scene, SimulatedCamera()))
    split = split_physically(transport)
    white = np.ones(scene.projector, dtype=np.float32)
    truth, found = scene.component_pictures(white), split.components(white)
    names = found._fields
    bars = PhysicalErrorBars(split).components(white)
    translucent = truth[1].any(axis=-1) & transport.lit
    print(f"{name}: {line(physical_snr(split, scene).components, names)}")
    print(f"  within error bars {within(found, truth, bars, translucent)}", flush=True)


if __name__ == "__main__":
    for scene_name in sys.argv[1:] or SCENES:
        run(scene_name)
