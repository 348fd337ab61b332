"""Transport from photos of anybody's patterns, beside a plan of nearfar's own of as many photos.

Run ``python benchmarks/any_patterns.py [SCENE] [SIDE] [PHOTOS]``. Prints SNR_b in dB under five
pictures and under a random light, the share of errors within one standard deviation, and the
seconds of processor time that the estimate took.

``python benchmarks/any_patterns.py --large [SCENE]`` measures processor time and memory of 200
random patterns of 128x128 pixels before a camera of 512x512 pixels and one channel. The scene is
rendered at 160x160 camera pixels, of which the camera sees the nearest, each with noise of its own.
"""

import resource
import sys
import time
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from nearfar import ErrorBars, Size, choose_plan, natural_picture, reconstruct, snr
from nearfar.arrays import Floats
from nearfar.capture import open_capture, write_capture
from nearfar.illumination import patterns
from nearfar.plan import Plan
from nearfar.plan.recognition import recognise
from nearfar.plan.recognition.own import plan_of_pictures
from nearfar.rigs.simulated.camera import SimulatedCamera
from nearfar.scenes.cache import cached_operator, cached_scene
from nearfar.transport.exact import ExactTransport
from nearfar.transport.model import Transport
from nearfar.workflow.from_patterns import reconstruct_from_patterns

# The large case: photos, projector, rendered camera, and camera.
LARGE_PHOTOS, LARGE = 200, Size(128, 128)
RENDERED, LARGE_CAMERA = Size(160, 160), Size(512, 512)

Pictures = list[NDArray[np.uint8]]


def random_binary(size: Size, count: int) -> Pictures:
    """Return random patterns, half white."""
    generator = np.random.default_rng(3)
    return [patterns.quantise((generator.random(size) < 0.5) * 1.0) for _ in range(count)]


def hadamard(size: Size, count: int) -> Pictures:
    """Return random rows of the Hadamard matrix."""
    rows = np.random.default_rng(3).permutation(size.pixels)[:count].astype(np.uint64)
    pixels = np.arange(size.pixels, dtype=np.uint64)
    return [
        patterns.quantise((np.bitwise_count(pixels & row) % 2 == 0).reshape(size) * 1.0)
        for row in rows
    ]


def gray_and_fringes(size: Size, count: int) -> Pictures:
    """Return Gray code, and 4-step fringes of rows and columns at as many periods as fit."""
    bits = [
        draw(bit, size)
        for draw, side in ((patterns.gray_rows, size.height), (patterns.gray_columns, size.width))
        for bit in range(patterns.gray_bits(side))
    ]
    found = [patterns.quantise(bit) for bit in bits]
    place = np.indices(size)
    for cycles in range(1, count):
        for axis in (0, 1):
            for step in range(4):
                if len(found) < count:
                    phase = 2 * np.pi * (cycles * place[axis] / size[axis] + step / 4)
                    found.append(patterns.quantise(0.5 + 0.5 * np.cos(phase)))
    return found


SETS: dict[str, Callable[[Size, int], Pictures]] = {
    "random": random_binary,
    "Hadamard": hadamard,
    "Gray code and fringes": gray_and_fringes,
}


def capture_of(world: ExactTransport, pictures: Pictures, plan: Plan, path: str) -> None:
    """Photograph pictures, and write them as a capture."""
    camera, generator = SimulatedCamera(), np.random.default_rng(1)
    photos = (
        camera.photograph(world @ (picture / np.float32(255)), generator) for picture in pictures
    )
    shown = pictures if plan.offset == "shown" else None
    write_capture(plan, path, photos, full_scale=camera.full_scale, shown=shown, force=True)


def judge(world: ExactTransport, transport: Transport) -> str:
    """Return SNR_b under pictures and under a random light."""
    size = world.projector
    lights = [natural_picture(size, seed) for seed in range(5)]
    random: Floats = np.random.default_rng(5).random(size).astype(np.float32)
    pictures = np.mean([snr(world @ light, transport @ light) for light in lights])
    return f"{pictures:5.1f} / {float(snr(world @ random, transport @ random)):5.1f}"


def coverage(world: ExactTransport, transport: Transport) -> str:
    """Return the shares of errors within one deviation: a picture, a random light, one pixel."""
    size, bars = world.projector, ErrorBars(transport)
    single = np.zeros(size, dtype=np.float32)
    single[size.height // 2, size.width // 3] = 1.0
    random: Floats = np.random.default_rng(5).random(size).astype(np.float32)
    shares = []
    for light in (natural_picture(size, 1), random, single):
        error = np.abs(transport @ light - world @ light)
        shares.append(f"{100 * np.mean(error < bars.picture(light)):.0f}")
    return ", ".join(shares)


def large(scene: str) -> None:
    """Measure processor time and memory of the large case, and how good it is."""
    world = cached_operator(scene, LARGE, RENDERED)
    rows, columns = (
        np.arange(side) * rendered // side
        for side, rendered in zip(LARGE_CAMERA, RENDERED, strict=True)
    )

    def seen(light: Floats) -> Floats:
        return np.asarray((world @ light)[rows][:, columns, 1], dtype=np.float32)

    brightest = float(seen(np.ones(LARGE, dtype=np.float32)).max())
    uniform = [np.full(LARGE, 255, np.uint8), np.zeros(LARGE, np.uint8)]
    pictures = [*random_binary(LARGE, LARGE_PHOTOS - 2), *uniform]
    plan = plan_of_pictures(
        recognise(picture.astype(np.float32) / np.float32(255) for picture in pictures),
        pictures.__getitem__,
    )
    camera, generator = SimulatedCamera(), np.random.default_rng(1)
    photos = (
        camera.photograph(
            0.9 / brightest * seen((picture / np.float32(255)).astype(np.float32)), generator
        )
        for picture in pictures
    )
    path = f"any-patterns-{scene}-large.zarr"
    write_capture(plan, path, photos, full_scale=camera.full_scale, shown=pictures, force=True)
    start, before = time.process_time(), resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    transport = reconstruct_from_patterns(open_capture(path), memory=4 * 10**9)
    took = time.process_time() - start
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    lights = [natural_picture(LARGE, seed) for seed in range(5)]
    random: Floats = np.random.default_rng(5).random(LARGE).astype(np.float32)
    found = [snr(0.9 / brightest * seen(light), transport @ light) for light in [*lights, random]]
    print(
        f"{scene} {LARGE}, camera {LARGE_CAMERA}, {LARGE_PHOTOS} random patterns: "
        f"{np.mean(found[:-1]):.1f} / {found[-1]:.1f} dB, {took:.0f} s of processor time, "
        f"{peak / 2**20:.2f} GiB at most ({before / 2**20:.2f} before)"
    )


def main() -> None:
    """Measure every set of patterns."""
    if sys.argv[1:2] == ["--large"]:
        large(*(sys.argv[2:] or ["cornell-aside"]))
        return
    scene, side, photos = (sys.argv[1:] + ["cornell", "64", "117"][len(sys.argv) - 1 :])[:3]
    size, count = Size(int(side), int(side)), int(photos)
    world = cached_scene(scene, size, size)
    world = world * (0.9 / float((world @ np.ones(size, dtype=np.float32)).max()))
    path = f"any-patterns-{scene}-{side}.zarr"
    uniform = [np.full(size, 255, np.uint8), np.zeros(size, np.uint8)]
    for name, draw in SETS.items():
        pictures = [*draw(size, count - 2), *uniform]
        seen = recognise(picture.astype(np.float32) / np.float32(255) for picture in pictures)
        plan = plan_of_pictures(seen, pictures.__getitem__)
        capture_of(world, pictures, plan, path)
        start = time.process_time()
        transport = reconstruct_from_patterns(open_capture(path))
        took = time.process_time() - start
        verdict = transport.verdict
        assert verdict is not None
        print(
            f"{scene} {size}, {name}, {len(pictures)}: {judge(world, transport)} dB, held out "
            f"{verdict.held_out_snr:.1f}, within one deviation "
            f"{coverage(world, transport)} %, {took:.0f} s",
            flush=True,
        )
    plan, _ = choose_plan(size, count)
    capture_of(world, [plan.draw(i) for i in range(len(plan.patterns))], plan, path)
    own = judge(world, reconstruct(open_capture(path))[0])
    print(f"{scene} {size}, plan of nearfar's own, {len(plan.patterns)}: {own} dB")


if __name__ == "__main__":
    main()
