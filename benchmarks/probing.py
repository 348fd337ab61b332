"""Time of probing, in relightings of the same transport under the same light."""

from collections.abc import Callable
from time import perf_counter

import numpy as np
from tests.worlds import model_transport

import nearfar
from nearfar.arrays import Size

SIDE = Size(64, 64)
SAME_ROW = np.array([[0, 0, 0], [0, 0, -1], [0, 1, 0]])


def best_time(work: Callable[[], object], times: int = 3) -> float:
    """Return the shortest time of some calls, after one that does not count."""
    work()
    found = []
    for _ in range(times):
        start = perf_counter()
        work()
        found.append(perf_counter() - start)
    return min(found)


def main() -> None:
    """Print the ratios."""
    transport = model_transport(SIDE, SIDE, window=15, far=Size(13, 13), fractional=True)
    light = nearfar.natural_picture(SIDE, seed=1)
    relighting = best_time(lambda: transport @ light)
    print(f"relighting: {1e3 * relighting:.1f} ms")
    mask = nearfar.ProbingMask
    masks = {
        "within 5": mask.within(5),
        "ring 5 to 20": mask.ring(5, 20),
        "beyond 5": mask.beyond(5),
        "band of 3": mask.epipolar(SAME_ROW, 3),
        "same for all": mask.of_matrix(np.eye(64)),
    }
    for name, one in masks.items():
        spent = best_time(lambda one=one: nearfar.probe(transport, light, one))
        print(f"{name}: {spent / relighting:.1f} relightings")


if __name__ == "__main__":
    main()
