"""Held-out SNR_b beside the true one, over scenes, hostile transports, budgets and cameras.

Run ``python benchmarks/held_out.py [NAME ...]``. Each capture is of a plan with check photos. For
each it prints in dB, without the transport's own exposure being fitted,

- held out: what the verdict says;
- true: under the same check patterns, against the exact transport;
- pictures: under other natural pictures, against the exact transport;
- expected: by the error bars.

At the end it prints the share of captures whose held-out SNR_b lies within 1.5 dB of the true one,
and of the one under other pictures.
"""

import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from hostile import BUDGETS, EXPOSURE, NOISES, SIZES, camera_of
from nearfar import ExactTransport, Size, Transport, choose_plan, reconstruct_to_file, snr
from nearfar.arrays import Floats
from nearfar.errors import NearfarError
from nearfar.illumination.pictures import natural_picture
from nearfar.plan.checks import check_lights
from nearfar.rigs.simulated.camera import SimulatedCamera
from nearfar.rigs.simulated.projector import SimulatedProjector
from nearfar.rigs.simulated.rig import SimulatedRig
from nearfar.scenes.cache import cached_scene
from nearfar.scenes.hostile import hostile_transport
from nearfar.transport.stored import open_transport
from nearfar.workflow.acquire import acquire
from nearfar.workflow.evaluate import exposure_of
from nearfar.workflow.verdict.verdict import judge_reconstruction

SCENES = ("cornell", "cornell-aside", "shelf", "alcove", "wedge", "corner")
SIDE = 32
SCENE_PHOTOS = (50, 90, 160, 300)
FULL_WELLS = (3_000.0, 30_000.0)
PICTURES = 5
NEAR_ENOUGH = 1.5


def captures(names: list[str]) -> Iterator[tuple[str, ExactTransport, SimulatedCamera, float, int]]:
    """Yield label, transport, camera, exposure and photos of every capture."""
    for name in SCENES:
        if names and name not in names:
            continue
        scene = cached_scene(name, Size(SIDE, SIDE))
        for full_well in FULL_WELLS:
            for photos in SCENE_PHOTOS:
                camera = SimulatedCamera(full_well=full_well)
                yield f"{name} {full_well:g} e-", scene, camera, 1.0, photos
    for name, sizes in SIZES.items():
        if names and name not in names:
            continue
        scene = hostile_transport(name, *sizes)
        for noise in NOISES:
            for share in BUDGETS:
                photos = max(24, round(share * scene.projector.pixels))
                yield f"{name} 1/{round(1 / noise)}", scene, camera_of(noise), EXPOSURE, photos


def mean_snr(
    truth: ExactTransport, found: Transport, exposure: float, lights: list[Floats]
) -> float:
    """Mean SNR_b under some lights."""
    return float(
        np.mean(
            [
                snr(np.float32(exposure) * (truth @ light).ravel(), (found @ light).ravel())
                for light in lights
            ]
        )
    )


def main() -> None:
    """Print a line for each capture, and the shares."""
    differences: dict[str, list[tuple[float, float]]] = {"scenes": [], "hostile": []}
    for label, truth, camera, exposure, photos in captures(sys.argv[1:]):
        plan, _ = choose_plan(truth.projector, photos)
        rig = SimulatedRig(truth, truth.name, SimulatedProjector(), camera, exposure, 0)
        with tempfile.TemporaryDirectory() as folder:
            capture = acquire(plan, Path(folder) / "capture.zarr", rig)
            try:
                reconstruct_to_file(capture, Path(folder) / "transport.zarr")
            except NearfarError as error:
                print(f"{label:24} {photos:4d}  {error}", flush=True)
                continue
            stored = open_transport(Path(folder) / "transport.zarr")
            verdict = judge_reconstruction(stored, capture)
            found = stored.rows()
        assert verdict.held_out is not None
        factor = exposure_of(found, truth).factor
        checks = [
            light.pattern.draw(truth.projector) / np.float32(255) for light in check_lights(plan)
        ]
        others = [natural_picture(truth.projector, seed) for seed in range(PICTURES)]
        true, pictures = (mean_snr(truth, found, factor, lights) for lights in (checks, others))
        held_out = verdict.held_out.snr
        kind = "scenes" if label.split()[0] in SCENES else "hostile"
        differences[kind].append((held_out - true, held_out - pictures))
        print(
            f"{label:24} {photos:4d}  held out {held_out:5.1f}  true {true:5.1f}  "
            f"pictures {pictures:5.1f}  expected {verdict.held_out.expected_snr:5.1f}  "
            f"{verdict.grade} {' '.join(verdict.causes)}",
            flush=True,
        )
    for kind, values in differences.items():
        if values:
            near = np.mean(np.abs(values) < NEAR_ENOUGH, axis=0)
            print(
                f"{kind}: {len(values)} captures, within {NEAR_ENOUGH} dB of true {near[0]:.0%}, "
                f"of other pictures {near[1]:.0%}"
            )


if __name__ == "__main__":
    main()
