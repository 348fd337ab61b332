"""Relighting a transport of 128 x 128 x 3, W = 19, a far band of 13 x 13.

Run ``python benchmarks/relighting.py``. It prints lights a second, one by one and 64 at once, and
how many times as long as one pass over the factors' bytes a light takes, in the same run: float32
lights, then float64 ones, which NumPy takes longer over; and prepared transports, by NumPy and,
where it is installed, by PyTorch, on an accelerator if there is one.
"""

import time
from collections.abc import Callable
from importlib import import_module
from importlib.util import find_spec

import numpy as np

from nearfar import Size, Transport, prepare_transport
from nearfar.arrays import fetch
from nearfar.devices import Device, mover
from reconstruction import FAR, PROJECTOR, WINDOW, random_transport

LIGHTS = 64
RUNS = 7


def fastest(work: Callable[[], object]) -> float:
    """Return the seconds of the fastest of some runs."""
    seconds = []
    for _ in range(RUNS):
        started = time.perf_counter()
        work()
        seconds.append(time.perf_counter() - started)
    return min(seconds)


def one_pass(transport: Transport) -> float:
    """Return the seconds of reading every factor once."""
    factors = [transport.direct.ravel(), transport.near.ravel(), transport.far.ravel()]
    return fastest(lambda: [np.dot(values, values) for values in factors])


def main() -> None:
    """Print the table."""
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
