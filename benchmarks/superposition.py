"""Relighting from stored photos alone, beside the joint estimate of the same photos.

    python benchmarks/superposition.py [--projector 64x64] [--photos 117]

SNR_b in dB by the true picture, for each scene and light; for photos alone also the part of the
light that is missing, in dB, and the share of errors within one standard deviation of the picture
of what is not missing.
"""

import argparse
import tempfile
from pathlib import Path

import numpy as np

import nearfar
from nearfar.arrays import Size, parse_size

SCENES = ("cornell", "alcove")


def lights_of(plan: nearfar.Plan) -> dict[str, np.ndarray]:
    """Return lights that are more and more of what the patterns do not hold."""
    size, generator = plan.projector, np.random.default_rng(5)
    chosen = generator.choice(len(plan.patterns), size=6, replace=False)
    patterns = np.stack([plan.draw(int(k)) for k in chosen]).astype(np.float32) / 255
    y, x = np.indices(size) / np.array(size)[:, None, None] - 0.5
    return {
        "white": nearfar.white(size),
        "mean of six of the patterns": patterns.mean(axis=0),
        "soft spot": np.exp(-((x / 0.25) ** 2) - (y / 0.25) ** 2).astype(np.float32),
        "picture": nearfar.natural_picture(size, seed=1),
        "random": nearfar.random_pattern(size, seed=1),
    }


def main() -> None:
    """Print a table for each scene."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--projector", type=parse_size, default=Size(64, 64))
    parser.add_argument("--photos", type=int, default=117)
    options = parser.parse_args()
    plan, _ = nearfar.choose_plan(options.projector, options.photos)
    for scene in SCENES:
        print(f"{scene}, {options.photos} photos: missing, by photos alone, by the joint estimate")
        with tempfile.TemporaryDirectory() as folder:
            rig = nearfar.open_rig(scene, options.projector)
            capture = nearfar.acquire(plan, Path(folder) / "capture.zarr", rig)
            transport, _ = nearfar.reconstruct(capture)
            for name, light in lights_of(plan).items():
                truth = rig.exposure * (rig.world @ light)
                found = nearfar.superpose(capture, light)
                errors = found.picture - rig.exposure * (rig.world @ found.shown)
                within = np.mean(np.abs(errors) < found.sigma)
                print(
                    f"  {name:28} {found.missing_decibels:7.1f} "
                    f"{nearfar.snr(truth, found.picture):6.1f} "
                    f"{nearfar.snr(truth, transport @ light):6.1f}   {within:.0%} within"
                )


if __name__ == "__main__":
    main()
