"""Processor time of probing, in relightings of the same transport under the same light.

Run ``python benchmarks/probing.py [SIDE ...]``, with a projector and a camera of SIDE x SIDE (64
and 256). W is 15 and the far band 13x13, one channel; in the last column near-range light is made
of hats of a pitch of 4, W = 9, and direct light of boxes.
"""

import argparse
from collections.abc import Callable
from dataclasses import replace
from time import process_time

import numpy as np
from tests.worlds import model_transport

import nearfar
from nearfar.arrays import Size
from nearfar.illumination.near_basis import NearBasis

SAME_ROW = np.array([[0, 0, 0], [0, 0, -1], [0, 1, 0]])
HATS = NearBasis(9, 4)


def least_time(work: Callable[[], object], times: int = 8) -> float:
    """Return the shortest processor time of some calls, after one that does not count."""
    work()
    found = []
    for _ in range(times):
        start = process_time()
        work()
        found.append(process_time() - start)
    return min(found)


def of_hats(transport: nearfar.Transport) -> nearfar.Transport:
    """Return a transport whose near-range light is made of hats."""
    near = np.random.default_rng(5).uniform(0, 0.01, (*transport.camera, 1, HATS.count))
    footprint = np.tile(np.array([1.7, 2.2, 0.3, -0.4]), (*transport.camera, 1))
    return replace(
        transport,
        near=near.astype(np.float32),
        pitch=HATS.pitch,
        footprint=footprint.astype(np.float32),
    )


def main(side: int) -> None:
    """Print the ratios of one size."""
    size = Size(side, side)
    pixels = model_transport(size, size, window=15, far=Size(13, 13), fractional=True)
    transports = [pixels, of_hats(pixels)]
    light = nearfar.natural_picture(size, seed=1)
    relighting = [least_time(lambda t=t: t @ light) for t in transports]
    of_pixels, hats = (f"{1e3 * one:.1f} ms" for one in relighting)
    print(f"{size}: a relighting takes {of_pixels}, of hats {hats}")
    mask = nearfar.ProbingMask
    masks = {
        "within 5": mask.within(5),
        "within 20": mask.within(20),
        "within 60": mask.within(60),
        "ring 5 to 20": mask.ring(5, 20),
        "beyond 5": mask.beyond(5),
        "band of 3": mask.epipolar(SAME_ROW, 3),
        "same for all": mask.of_matrix(np.eye(side)),
    }
    for name, one in masks.items():
        spent = [least_time(lambda t=t, m=one: nearfar.probe(t, light, m)) for t in transports]
        ratios = [a / b for a, b in zip(spent, relighting, strict=True)]
        print(f"{name}: {ratios[0]:.1f}, of hats {ratios[1]:.1f} relightings", flush=True)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("sides", nargs="*", type=int, default=[64, 256])
    for one_side in parser.parse_args().sides:
        main(one_side)
