"""
Light, bounce by bounce
=======================

A spot on one wall of a corner: once reflected, twice, three times.
"""

import tempfile

import numpy as np
from matplotlib import pyplot

import nearfar
from nearfar.files import to_srgb

size = nearfar.Size(32, 32)
plan, _ = nearfar.choose_plan(size, 80)
folder = tempfile.TemporaryDirectory()
rig = nearfar.open_rig("corner", size)
capture = nearfar.acquire(plan, f"{folder.name}/capture.zarr", rig)
transport, _ = nearfar.reconstruct(capture)

# %%
# The transport alone tells the bounces apart: no shapes, no materials.
y, x = np.mgrid[:32, :32]
spot = (np.hypot(y - 10, x - 8) < 6).astype(np.float32)
found = nearfar.bounces(nearfar.split_physically(transport), spot, 3)

# %%
# Each bounce is fainter. The wall that the spot is on is flat, so that the second bounce leaves it
# dark: what shows there is noise, 16 times as bright.
figure, axes = pyplot.subplots(1, 3, figsize=(10, 3.6), layout="constrained")
for number, (axis, picture) in enumerate(zip(axes, found.pictures, strict=True), start=1):
    gain = 0.9 / np.quantile(picture, 0.995)
    axis.imshow(to_srgb(np.clip(gain * picture, 0, 1)))
    axis.set(title=f"bounce {number}, {gain:.0f} times as bright", xticks=(), yticks=())
