"""Time and memory of a reconstruction of the paper's size: 128 x 128 x 3 at W = 19.

Run ``python benchmarks/reconstruction.py``. A capture of 1060 photos of transport and 256 of
stripes is made from a simple world first; then a process of its own reconstructs it, and its time
and peak memory are printed, beside one float32 product of (49152 x 530) x (530 x 530) in the same
run, since machines differ. Both methods, the paper's and the joint one.
"""

import argparse
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from nearfar import Size, Transport, acquire, open_capture, paper_plan, reconstruct
from nearfar.illumination.frequencies import far_frequencies, representatives
from nearfar.illumination.real_basis import real_basis
from nearfar.rigs.simulated.camera import SimulatedCamera
from nearfar.rigs.simulated.projector import SimulatedProjector
from nearfar.rigs.simulated.rig import SimulatedRig

PROJECTOR = Size(128, 128)
WINDOW, FAR = 19, Size(13, 13)
# The world's own window is small, so that photos are quick to make; the estimate's is not.
WORLD_WINDOW = 3
CHANNELS = 3


def random_transport(
    projector: Size, window: int, far_band: Size, camera: Size | None = None
) -> Transport:
    """Draw a transport with direct, near and far light at every camera pixel.

    The camera has as many pixels as the projector unless it is given.
    """
    generator = np.random.default_rng(0)
    camera = camera or projector
    shape = (*camera, CHANNELS)
    sides = [np.linspace(0, p - 1, c).round() for p, c in zip(projector, camera, strict=True)]
    y, x = np.meshgrid(*sides, indexing="ij")
    basis = real_basis(representatives(far_frequencies(far_band, projector)), projector)
    far = 0.002 * generator.normal(size=(*shape, basis.count))
    far[..., 0] += 0.1
    window = generator.uniform(0, 0.01, size=(*shape, window, window))
    nothing = np.zeros(shape, dtype=np.float32)
    return Transport(
        projector=projector,
        correspondence=np.stack([y, x], axis=-1).astype(np.float32),
        direct=generator.uniform(0.1, 0.5, size=shape).astype(np.float32),
        near=window.astype(np.float32),
        far=far.astype(np.float32),
        far_basis=basis,
        black=nothing,
        noise=nothing,
    )


def make(folder: Path) -> Path:
    """Shoot the capture."""
    plan = paper_plan(PROJECTOR, WINDOW, FAR)
    rig = SimulatedRig(
        random_transport(PROJECTOR, WORLD_WINDOW, FAR),
        "benchmark",
        SimulatedProjector(),
        SimulatedCamera(),
        1.0,
        0,
    )
    acquire(plan, folder / "capture.zarr", rig)
    return folder / "capture.zarr"


def one_product() -> float:
    """Return the seconds of the matrix product that times are compared with, best of five."""
    generator = np.random.default_rng(0)
    left = generator.random((49152, 530), dtype=np.float32)
    right = generator.random((530, 530), dtype=np.float32)
    seconds = []
    for _ in range(5):
        started = time.perf_counter()
        _ = left @ right
        seconds.append(time.perf_counter() - started)
    return min(seconds)


def main() -> None:
    """Make a capture, or reconstruct one that is there."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--capture", type=Path, help="reconstruct this capture and say how")
    parser.add_argument("--method", choices=("paper", "joint"), default="paper")
    given, method = parser.parse_args().capture, parser.parse_args().method
    if given is not None:
        started = time.perf_counter()
        transport, _ = reconstruct(open_capture(given), method=method)
        seconds = time.perf_counter() - started
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
        pixels = transport.camera.pixels
        print(
            f"{method}: {pixels} camera pixels x {transport.channels} channels, "
            f"W = {transport.window}: {seconds:.1f} s, "
            f"{pixels / seconds:.0f} camera pixels a second, peak memory {peak:.2f} GiB"
        )
        product = one_product()
        print(f"one product {product:.2f} s: reconstruction takes {seconds / product:.1f} of them")
        return
    with tempfile.TemporaryDirectory() as folder:
        capture = make(Path(folder))
        for each in ("paper", "joint"):
            command = [sys.executable, __file__, "--capture", str(capture), "--method", each]
            subprocess.run(command, check=True)


if __name__ == "__main__":
    main()
