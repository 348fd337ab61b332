"""Equation (10) by a library's Bayesian solver, window by window, and by ours for all at once.

Run ``python benchmarks/library_solver.py``. Windows of 19 x 19 with light under a tenth of their
entries are seen by the paper's near frequencies but DC, with noise; scikit-learn's ARDRegression
solves 20 of them one by one, ours 49 152, as many as 128 x 128 camera pixels of 3 channels have.
"""

import time

import numpy as np
from sklearn.linear_model import ARDRegression

from nearfar import Size
from nearfar.estimate.sparse import least_risk, solve
from nearfar.illumination.frequencies import near_frequencies, representatives
from nearfar.illumination.near_basis import window_offsets
from nearfar.illumination.real_basis import real_basis

WINDOW, NOISE = 19, 0.003
ALONE, TOGETHER = 20, 128 * 128 * 3
# Windows at once, as the estimate takes them.
BLOCK = 2048


def main() -> None:
    """Print the seconds of both, and their ratio."""
    generator = np.random.default_rng(0)
    offsets = window_offsets(WINDOW)
    frequencies = representatives(near_frequencies(WINDOW, Size(1, 1)))
    patterns = real_basis(frequencies, Size(128, 128)).patterns_at(offsets)
    windows = generator.uniform(0, 0.05, (TOGETHER, len(offsets))).astype(np.float32)
    windows *= generator.random(windows.shape) < 0.1
    noisy = generator.normal(0, NOISE, (TOGETHER, len(patterns))).astype(np.float32)
    responses = windows @ patterns.T + noisy
    started = time.perf_counter()
    for row in responses[:ALONE]:
        ARDRegression(fit_intercept=False).fit(patterns, row)
    alone = (time.perf_counter() - started) / ALONE

    started = time.perf_counter()
    energy = np.sum(patterns**2, axis=1)
    inverse = (patterns / energy[:, None]).astype(np.float32)
    unseen = np.full((len(offsets), 1), 1 / WINDOW, dtype=np.float32)
    entry_noise = np.full(BLOCK, NOISE * np.sqrt(2) / WINDOW, dtype=np.float32)
    inside = np.ones((BLOCK, len(offsets)), dtype=bool)
    for first in range(0, TOGETHER, BLOCK):
        n0 = responses[first : first + BLOCK] @ inverse
        _, z = solve(n0, unseen, inside, np.float32(0.75) * entry_noise)
        solve(n0, unseen, inside, least_risk(n0 + z @ unseen.T, inside, entry_noise), z)
    together = (time.perf_counter() - started) / TOGETHER
    print(f"scikit-learn: {alone:.2f} s a window")
    print(f"ours: {1e6 * together:.0f} us a window, {alone / together:.0f} times as fast")


if __name__ == "__main__":
    main()
