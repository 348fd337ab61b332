"""Correspondence by phase and by stripes against the truth on the exact scenes.

Run ``python benchmarks/correspondence.py [SCENE[:HxW] ...]``, HxW being a camera's size. Photos
are those of the default simulated camera: the paper's plan in inverse pairs, and plans that were
chosen for a quarter and an eighth of its photos. For each it prints the photos used (for stripes
their own), and in percent

- how many lit camera pixels (at least half of their area lit directly) have q within 0.5 and
  1 pixel of the centroid of their direct light, and of the centroid of their stronger surface,
  which differ where a camera pixel sees two;
- unlit camera pixels: how many of those that were marked are less than half lit (precision), and
  how many of those without any direct light were marked (recall);

and the seconds of the correspondence alone.
"""

import sys
import time
from collections.abc import Sequence

import numpy as np
from scipy import ndimage

from accuracy import shoot
from fewer_photos import CASES as PAPER
from nearfar import ExactTransport, Size, choose_plan, paper_plan
from nearfar.arrays import Floats, parse_size
from nearfar.correspondence import Correspondence, correspond_by_phase, correspond_by_stripes
from nearfar.photometry.measure import measure
from nearfar.rigs.simulated.camera import SimulatedCamera
from nearfar.scenes import SCENES, sizes
from nearfar.scenes.cache import cached_scene
from nearfar.scenes.camera import gather
from nearfar.scenes.description import ByRadiosity
from nearfar.scenes.optics import pinhole
from nearfar.scenes.patches import build_patches
from nearfar.scenes.rays import surface
from nearfar.scenes.render import SAMPLES_PER_SIDE

CASES = (
    *("cornell", "cornell:32x32", "cornell:48x48", "cornell:128x128"),
    *("cornell-aside", "cornell-aside:64x64", "wedge", "wedge:34x50", "corner", "corner:64x64"),
)
# Chosen plans take these shares of the paper's photos.
SHARES = (4, 8)
CAMERA = SimulatedCamera()


def lit_area(name: str, projector: Size, camera: Size) -> Floats:
    """Share of each camera pixel that the projector lights directly, shape (C,)."""
    compute = SCENES[name].compute
    assert isinstance(compute, ByRadiosity), f"{name} has no surfaces"
    scene = compute.surfaces()
    everything = surface(scene.parts, range(len(scene.parts)))
    eye = pinhole(scene.projector_view, projector)
    lens = pinhole(scene.camera_view or scene.projector_view, projector)
    patches = build_patches(everything, scene.parts, eye, projector, samples=SAMPLES_PER_SIDE)
    finest = min(camera.height / projector.height, camera.width / projector.width)
    samples = max(1, int(np.ceil(SAMPLES_PER_SIDE / finest)))
    ends = (eye, projector), (lens, camera)
    seen = gather(everything, scene.parts, patches, *ends, samples=samples)
    return np.asarray(seen.radiosity @ (patches.pixel >= 0).astype(float))


def stronger_surface(scene: ExactTransport) -> Floats:
    """Centroid of the strongest connected patch of direct light, shape (C, 2)."""
    direct = sum(scene.direct[1:], start=scene.direct[0])
    q = scene.correspondence.reshape(-1, 2).copy()
    for c in np.flatnonzero(np.isfinite(q[:, 0])):
        row = slice(direct.indptr[c], direct.indptr[c + 1])
        y, x = np.divmod(direct.indices[row], scene.projector.width)
        entries = direct.data[row]
        y0, x0 = y.min(), x.min()
        image = np.zeros((y.max() - y0 + 1, x.max() - x0 + 1))
        image[y - y0, x - x0] = entries
        labels = ndimage.label(image > 0, np.ones((3, 3)))[0][y - y0, x - x0]
        mine = labels == np.argmax(np.bincount(labels, entries))
        q[c] = np.average(np.stack([y, x], axis=-1)[mine], axis=0, weights=entries[mine])
    return q


def report(
    label: str,
    photos: int,
    found: Correspondence,
    truths: Sequence[Floats],
    area: Floats,
    seconds: float,
) -> None:
    """Print a row of the table."""
    unlit, lit = ~found.lit.ravel(), area >= 0.5
    cells = []
    for truth in truths:
        off = np.abs(found.q.reshape(-1, 2)[lit] - truth[lit]).max(axis=1)
        off[np.isnan(off)] = np.inf
        cells += [f"{np.mean(off <= limit):9.2%}" for limit in (0.5, 1.0)]
    for chosen in (~lit[unlit], unlit[area == 0]):
        cells.append(f"{np.mean(chosen):9.2%}" if len(chosen) else "        -")
    print(f"  {label:<16}{photos:>7}{''.join(cells)}{seconds:8.1f}", flush=True)


def run(name: str, camera: Size | None) -> None:
    """Print one scene's table."""
    projector, camera = sizes(name, None, camera)
    scene = cached_scene(name, projector, camera)
    area = lit_area(name, projector, camera)
    truths = (scene.correspondence.reshape(-1, 2), stronger_surface(scene))
    print(f"{name}: projector {projector}, camera {camera}, {np.mean(area == 0):.1%} unlit")
    titles = ("within .5", "within 1", "of strong", "within 1", "precision", "recall")
    print(f"  {'':<16}{'photos':>7}" + "".join(f"{t:>9}" for t in titles) + "       s")
    plan = paper_plan(projector, *PAPER[name])
    photos = shoot(plan, scene, CAMERA)
    started = time.perf_counter()
    found = correspond_by_stripes(photos)
    seconds = time.perf_counter() - started
    report("stripes", plan.counts["correspondence"], found, truths, area, seconds)
    measured = [("phase, pairs", measure(photos), plan.transport_photos, plan.pitch)]
    for share in SHARES:
        window, _ = PAPER[name]
        chosen, _ = choose_plan(projector, len(plan.patterns) // share, window=window, checks=0)
        count = len(chosen.patterns)
        measurements = measure(shoot(chosen, scene, CAMERA))
        measured.append((f"phase, 1/{share}", measurements, count, chosen.pitch))
    for label, measurements, count, pitch in measured:
        started = time.perf_counter()
        found = correspond_by_phase(measurements, pitch=pitch)
        report(label, count, found, truths, area, time.perf_counter() - started)


if __name__ == "__main__":
    for case in sys.argv[1:] or CASES:
        scene_name, _, size = case.partition(":")
        run(scene_name, parse_size(size) if size else None)
