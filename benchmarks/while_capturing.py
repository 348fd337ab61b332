"""How soon after the last photo the transport is there: 128 x 128 x 3 at W = 19, 1316 photos.

Run ``python benchmarks/while_capturing.py [SECONDS]``. The photos of `benchmarks/reconstruction.py`
come one by one, a photo in so many seconds (0.1 by default), as from a rig, to an
`EstimateObserver`; then the same capture is reconstructed from the disk. Both times are printed
beside one float32 product of (49152 x 530) x (530 x 530) in the same run.
"""

import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nearfar import Transport, open_capture, reconstruct
from nearfar.capture import Capture, write_capture
from nearfar.progress import ignore_progress
from nearfar.workflow.observers.estimate import EstimateObserver
from nearfar.workflow.reconstruction.executors import SerialExecutor, execute
from nearfar.workflow.reconstruction.options import ReconstructionOptions
from nearfar.workflow.reconstruction.sinks import MemorySink
from reconstruction import make, one_product

# Room for photos and estimate of the whole camera.
MEMORY = 4 * 10**9


def one_by_one(capture: Capture, seconds: float) -> Iterator[NDArray[Any]]:
    """Yield the photos of a capture, each after so many seconds."""
    photos = capture.photos[:]
    ready = time.monotonic()
    for photo in photos:
        ready += seconds
        time.sleep(max(0.0, ready - time.monotonic()))
        yield photo


def differ(one: Transport, other: Transport) -> str:
    """Write how much two transports differ, root mean square, as shares of the second."""
    shares = []
    for name in ("direct", "near", "far"):
        a, b = getattr(one, name), getattr(other, name)
        shares.append(f"{name} {np.sqrt(np.mean((a - b) ** 2) / np.mean(b**2)):.3f}")
    return ", ".join(shares)


def main() -> None:
    """Shoot, observe, reconstruct, compare."""
    seconds = float(sys.argv[1]) if len(sys.argv) > 1 else 0.1
    product = one_product()
    with tempfile.TemporaryDirectory() as folder:
        source = open_capture(make(Path(folder)))
        plan, scale = source.plan, source.full_scale
        with EstimateObserver(plan, scale, ReconstructionOptions(memory=MEMORY)) as estimate:
            capture = write_capture(
                plan,
                Path(folder, "again.zarr"),
                one_by_one(source, seconds),
                full_scale=scale,
                observers=[estimate],
            )
            last = time.perf_counter()
            sink = MemorySink()
            execute(estimate.finish(capture), SerialExecutor(), sink, ignore_progress)
            made, _ = sink.collected()
            after = time.perf_counter() - last
        started = time.perf_counter()
        found, _ = reconstruct(capture, memory=MEMORY)
        whole = time.perf_counter() - started
    print(f"one product: {product:.2f} s; components chosen from {estimate.chosen_by} photos")
    print(f"after the last photo: {after:.1f} s, {after / product:.0f} products")
    print(f"from the disk: {whole:.1f} s, {whole / product:.0f} products")
    print(f"they differ by {differ(made, found)}")


if __name__ == "__main__":
    main()
