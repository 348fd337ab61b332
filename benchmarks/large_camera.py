"""A large camera in little memory: 2 megapixels, a projector of 128 x 128, 300 photos.

Run ``python benchmarks/large_camera.py [HxW ...]``, cameras (1225x1633 by default); give several
to see that the cost grows with their pixels. Captures are made from a simple world, photo by photo:
of the joint method's plan of 300 photos, and of the paper's with W = 11 and 5 x 5 (292 photos,
correspondence given). Then a process of its own runs ``nearfar reconstruct --memory 2GB`` on each,
and its time, camera pixels a second and peak memory are printed.
"""

import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from nearfar import Size, choose_plan, paper_plan
from nearfar.arrays import Floats, Integers, parse_size
from nearfar.capture import write_capture
from nearfar.plan import Plan

PROJECTOR = Size(128, 128)
PHOTOS = 300
FULL_WELL = 20_000.0
# Runs the command and says how much memory it took at most.
COMMAND = """
import resource, sys
from nearfar.cli import main
try:
    main()
finally:
    print("peak", resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss, end=" ")
    print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
"""


def places(camera: Size) -> list[Integers]:
    """Row and column of the projector that each row and column of the camera sees."""
    return [
        np.linspace(1, p - 2, c).round().astype(int) for p, c in zip(PROJECTOR, camera, strict=True)
    ]


def photos_of(plan: Plan, camera: Size) -> Iterator[Integers]:
    """Yield photos of a flat scene with a little light from beside and from everywhere."""
    generator = np.random.default_rng(0)
    q = places(camera)
    beside = np.exp(-(np.arange(-4, 5) ** 2) / 4.0)
    for number in range(len(plan.patterns)):
        light = plan.draw(number).astype(np.float32) / 255
        blurred: Floats = light
        for axis in (0, 1):
            blurred = np.apply_along_axis(np.convolve, axis, blurred, beside / beside.sum(), "same")
        seen = 0.5 * light + 0.2 * blurred + 0.2 * light.mean()
        electrons = FULL_WELL * (0.02 + seen[np.ix_(*q)])
        electrons += np.sqrt(electrons) * generator.standard_normal(electrons.shape, np.float32)
        yield np.clip(electrons * (65535 / FULL_WELL), 0, 65535).astype(np.uint16)


def run(camera: Size, folder: Path, method: str) -> None:
    """Print one camera's row."""
    given = []
    if method == "joint":
        plan, _ = choose_plan(PROJECTOR, PHOTOS, checks=0)
    else:
        plan = paper_plan(PROJECTOR, 11, Size(5, 5), correspondence="none")
        q = np.stack(np.meshgrid(*places(camera), indexing="ij"), axis=-1)
        np.save(folder / "q.npy", q.astype(np.float32))
        given = ["--method", "paper", "--correspondence", str(folder / "q.npy")]
    capture = folder / "capture.zarr"
    write_capture(plan, capture, photos_of(plan, camera))
    command = [sys.executable, "-c", COMMAND, "reconstruct", str(capture), str(folder / "t.zarr")]
    started = time.perf_counter()
    said = subprocess.run([*command, *given], check=True, capture_output=True, text=True)
    seconds = time.perf_counter() - started
    peak = int(said.stdout.split()[-1]) / 1e6
    print(
        f"{camera}, {method}: {camera.pixels / 1e6:.2f} megapixels, {len(plan.patterns)} photos: "
        f"{seconds:.0f} s, {camera.pixels / seconds:.0f} camera pixels a second, "
        f"peak memory {peak:.2f} GB",
        flush=True,
    )


if __name__ == "__main__":
    for size in sys.argv[1:] or ["1225x1633"]:
        for name in ("paper", "joint"):
            with tempfile.TemporaryDirectory() as made:
                run(parse_size(size), Path(made), name)
