"""
How many photos?
================

Relighting error against the number of photos, for plans that nearfar chose, beside what the plans
expected: for scenes like the simulated ones on average, which is a little more than this one gives.
"""

import tempfile

import numpy as np
from matplotlib import pyplot

import nearfar

size = nearfar.Size(24, 24)
budgets = [30, 45, 60, 90, 140]
rig = nearfar.open_rig("cornell", size)
lights = {str(seed): nearfar.natural_picture(size, seed) for seed in range(1, 4)}
folder = tempfile.TemporaryDirectory()
found, expected = [], []
for photos in budgets:
    plan, told = nearfar.choose_plan(size, photos)
    rig = nearfar.open_rig("cornell", size)
    capture = nearfar.acquire(plan, f"{folder.name}/{photos}.zarr", rig)
    transport, _ = nearfar.reconstruct(capture)
    snr = nearfar.relighting_snr(transport, rig.world, lights)
    found.append(np.mean(list(snr.values())))
    expected.append(told.pictures)

figure, axes = pyplot.subplots(layout="constrained")
axes.plot(budgets, found, "o-", label="found")
axes.plot(budgets, expected, "s--", label="expected by the plan")
axes.set(xlabel="photos", ylabel="SNR_b on pictures, dB")
axes.legend()
