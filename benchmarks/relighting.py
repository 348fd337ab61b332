"""Relighting a transport of 128 x 128 x 3, W = 19, a far band of 13 x 13.

Run ``python benchmarks/relighting.py``. It prints lights a second, one by one and 64 at once, and
how many times as long as one pass over the factors' bytes a light takes, in the same run: float32
lights, then float64 ones, which NumPy takes longer over.
"""

import time
from collections.abc import Callable

import numpy as np

from nearfar import Size, Transport
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


if __name__ == "__main__":
    main()
