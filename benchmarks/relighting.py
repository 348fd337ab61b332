"""Relighting a transport of 128 x 128 x 3, W = 19, a far band of 13 x 13.

Run ``python benchmarks/relighting.py``. It prints lights a second, one by one and 64 at once, and
how many times as long as one pass over the factors' bytes a light takes, in the same run: float32
lights, then float64 ones, which NumPy takes longer over; and prepared transports, by NumPy and,
where it is installed, by PyTorch, on an accelerator if there is one. With ``--native`` it prints,
for a projector of 1080 x 1920 before a camera of 1000 x 1000, one channel, how many passes a
picture, a column, a row, the adjoint and preparing take, in processor time and on the wall.
"""

import sys
import time
from collections.abc import Callable
from importlib import import_module
from importlib.util import find_spec

import numpy as np

from nearfar import Size, Transport, prepare_transport
from nearfar.arrays import fetch
from nearfar.devices import Device, mover
from nearfar.illumination.frequencies import far_frequencies, representatives
from nearfar.illumination.near_basis import NearBasis
from nearfar.illumination.real_basis import real_basis
from reconstruction import FAR, PROJECTOR, WINDOW, random_transport

LIGHTS = 64
RUNS = 5


def fastest(work: Callable[[], object], clock: Callable[[], float] = time.perf_counter) -> float:
    """Return the seconds of the fastest of some runs."""
    seconds = []
    for _ in range(RUNS):
        started = clock()
        work()
        seconds.append(clock() - started)
    return min(seconds)


def one_pass(transport: Transport) -> float:
    """Return the seconds of reading every factor once."""
    factors = [transport.direct.ravel(), transport.near.ravel(), transport.far.ravel()]
    return fastest(lambda: [np.dot(values, values) for values in factors])


def native_transport() -> Transport:
    """Draw a transport of every pixel of a 1080 x 1920 projector, 1000 x 1000 camera pixels."""
    projector, camera = Size(1080, 1920), Size(1000, 1000)
    generator = np.random.default_rng(0)
    sides = [np.linspace(20, side - 20, n) for side, n in zip(projector, camera, strict=True)]
    y, x = np.meshgrid(*sides, indexing="ij")
    q = np.stack([y + 3 * np.sin(x / 50), x + 4 * np.cos(y / 80)], axis=-1)
    basis = real_basis(representatives(far_frequencies(FAR, projector)), projector)
    near_basis = NearBasis(11, 16)
    shape = (*camera, 1)
    nothing = np.zeros(shape, dtype=np.float32)
    return Transport(
        projector=projector,
        correspondence=q.astype(np.float32),
        direct=generator.random(shape, dtype=np.float32),
        near=0.01 * generator.random((*shape, near_basis.count), dtype=np.float32),
        far=0.002 * generator.standard_normal((*shape, basis.count), dtype=np.float32),
        far_basis=basis,
        black=nothing,
        noise=nothing,
        pitch=near_basis.pitch,
        footprint=np.full((*camera, 4), [1.1, 1.9, 0.4, 0.3], dtype=np.float32),
    )


def native() -> None:
    """Print the table of a transport of every projector pixel."""
    transport = native_transport()
    reading = one_pass(transport)
    print(f"one pass over the factors {1e3 * reading:.1f} ms")
    light = np.random.default_rng(1).random(transport.projector, dtype=np.float32)
    image = transport @ light
    prepared = prepare_transport(transport)
    for name, work in (
        ("a picture", lambda: transport @ light),
        ("a column", lambda: transport.column(500, 900)),
        ("a row", lambda: transport.rows(slice(5, 6))),
        ("the adjoint", lambda: transport.H @ image),
        ("preparing", lambda: prepare_transport(transport)),
        ("a picture, prepared", lambda: prepared @ light),
    ):
        seconds, busy = fastest(work), fastest(work, time.process_time)
        print(
            f"{name}: {seconds:.3f} s, {seconds / reading:.1f} passes; "
            f"processor time {busy:.3f} s, {busy / reading:.1f} passes"
        )


def main() -> None:
    """Print the table."""
    if "--native" in sys.argv:
        native()
        return
    transport = random_transport(PROJECTOR, WINDOW, FAR)
    whole = sum(v.nbytes for v in (transport.direct, transport.near, transport.far))
    reading = one_pass(transport)
    print(f"factors {whole / 2**20:.0f} MiB, one pass {1e3 * reading:.1f} ms")
    generator = np.random.default_rng(1)
    for kind in (np.float32, np.float64):
        lights = generator.random((LIGHTS, *Size(*PROJECTOR))).astype(kind)
        single = fastest(lambda lights=lights: transport @ lights[0])
        many = fastest(lambda lights=lights: transport.pictures(lights)) / LIGHTS
        for name, seconds in (("one by one", single), (f"{LIGHTS} at once", many)):
            print(
                f"{np.dtype(kind)!s}, {name}: {1 / seconds:.0f} lights a second, "
                f"{seconds / reading:.2f} passes each"
            )
    for device in devices():
        for half in (False, True):
            prepared = prepare_transport(transport, device, half=half)
            lights = mover(device)(generator.random((LIGHTS, *PROJECTOR), dtype=np.float32))
            single = fastest(
                lambda prepared=prepared, one=lights[:1]: fetch(prepared.pictures(one))
            )
            many = fastest(
                lambda prepared=prepared, lights=lights: fetch(prepared.pictures(lights))
            )
            print(
                f"prepared, {device}, {'float16' if half else 'float32'}, "
                f"{prepared.nbytes / 2**20:.0f} MiB: {1 / single:.0f} lights a second one by one, "
                f"{LIGHTS / many:.0f} {LIGHTS} at once"
            )


def devices() -> list[Device]:
    """Tell where transports can be prepared."""
    if find_spec("torch") is None:
        return ["cpu"]
    return (
        ["cpu", "torch", "cuda"] if import_module("torch").cuda.is_available() else ["cpu", "torch"]
    )


if __name__ == "__main__":
    main()
