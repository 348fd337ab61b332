"""Compressive light transport on the wedge at 423 patterns: SNR_b, time and peak memory.

Run ``python benchmarks/compressive.py [--photos]``. Without ``--photos`` the measurements are
exact; with it they are photos of a camera with 30 000 e- at full well, 4 e- of read noise and
14 bits, ambient light 1 %. lambda is the best of a grid on random rows, judged by the truth.
"""

import argparse
import resource
import time

import numpy as np

from nearfar import Size, natural_picture, random_pattern, snr, white
from nearfar.arrays import Floats
from nearfar.baselines.choosing import best_share, held_out_share
from nearfar.baselines.compressive import reconstruct_compressive
from nearfar.baselines.random_patterns import (
    bernoulli_patterns,
    measure_by_rig,
    measure_without_noise,
)
from nearfar.rigs.simulated.camera import SimulatedCamera
from nearfar.rigs.simulated.projector import SimulatedProjector
from nearfar.rigs.simulated.rig import SimulatedRig
from nearfar.scenes.cache import cached_scene

PATTERNS = 423


def fine_detail(size: Size) -> Floats:
    """Draw strokes a pixel or two wide on white, as of text, float32."""
    generator = np.random.default_rng(7)
    drawn = np.ones(size, dtype=np.float32)
    for top in range(2, size.height - 7, 9):
        for left in range(2, size.width - 5, 6):
            strokes = generator.integers(0, 2, size=(6, 4))
            drawn[top : top + 6, left : left + 4] = strokes
    return drawn


def main() -> None:
    """Measure, choose, reconstruct, relight."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--photos", action="store_true", help="measure noisy photos")
    truth = cached_scene("wedge")
    size = truth.projector
    patterns = bernoulli_patterns(size, PATTERNS, seed=0)
    if parser.parse_args().photos:
        rig = SimulatedRig(truth, "wedge", SimulatedProjector(), SimulatedCamera(), 1.0, 0)
        measurements = measure_by_rig(rig, patterns)
    else:
        measurements = measure_without_noise(truth, patterns)
    started = time.perf_counter()
    choice = best_share(measurements, truth)
    blind = held_out_share(measurements)
    print(f"{len(patterns)} patterns, {measurements.photos} photos")
    for judge, tried in (("SNR of T", choice), ("SNR of held-out responses", blind)):
        print(f"    share   {judge}, plain and refitted")
        for row in zip(tried.shares, tried.plain, tried.refitted, strict=True):
            print("{:9.6f}   {:6.2f} {:6.2f}".format(*row))
    print(f"best {choice.share:.6f}, by held-out patterns {blind.share:.6f}", end="; ")
    print(f"choosing both took {time.perf_counter() - started:.1f} s")
    started = time.perf_counter()
    found = reconstruct_compressive(measurements, choice.share, refitted=choice.is_refitted)
    seconds = time.perf_counter() - started
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    print(f"{len(measurements.rows)} rows in {seconds:.1f} s, peak memory {peak:.2f} GiB")
    lights = {
        "white": white(size),
        "picture": natural_picture(size, 1),
        "fine detail": fine_detail(size),
        "random": random_pattern(size, 0),
    }
    for name, light in lights.items():
        print(f"  SNR_b under {name}: {snr(truth @ light, found @ light):.2f} dB")


if __name__ == "__main__":
    main()
