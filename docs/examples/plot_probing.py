"""
Light by how far it came
========================

Probing keeps the light that reached a camera pixel from chosen projector pixels: those near the one
that lights it directly, in a ring, farther away.
"""

import tempfile

import numpy as np
from matplotlib import pyplot

import nearfar
from nearfar.files import to_srgb

size = nearfar.Size(32, 32)
plan, _ = nearfar.choose_plan(size, 80)
folder = tempfile.TemporaryDirectory()
rig = nearfar.open_rig("cornell-aside", size)
capture = nearfar.acquire(plan, f"{folder.name}/capture.zarr", rig)
transport, _ = nearfar.reconstruct(capture)

# %%
# Distances are in projector pixels. Discs and rings that meet add up to the relit picture.
white = nearfar.white(size)
masks = {
    "within 2": nearfar.ProbingMask.within(2),
    "2 to 6": nearfar.ProbingMask.ring(2, 6),
    "6 to 14": nearfar.ProbingMask.ring(6, 14),
    "beyond 14": nearfar.ProbingMask.beyond(14),
}
pictures = {name: nearfar.probe(transport, white, mask) for name, mask in masks.items()}
rest = np.abs(sum(pictures.values()) - transport @ white).max()
print(f"largest difference from the whole: {rest:.1e}")

# %%
figure, axes = pyplot.subplots(1, 4, figsize=(12, 3.4), layout="constrained")
for axis, (name, picture) in zip(axes, pictures.items(), strict=True):
    gain = 0.9 / np.quantile(picture, 0.995)
    axis.imshow(to_srgb(np.clip(gain * picture, 0, 1)))
    axis.set(title=f"{name}, {gain:.1f} times as bright", xticks=(), yticks=())
