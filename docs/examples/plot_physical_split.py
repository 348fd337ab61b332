"""
A candle that glows more
========================

The physical split tells light under wax from light between walls. A gain for each changes the
picture.
"""

import tempfile

import numpy as np
from matplotlib import pyplot

import nearfar
from nearfar.files import to_srgb

size = nearfar.Size(48, 48)
plan, _ = nearfar.choose_plan(size, 100)
folder = tempfile.TemporaryDirectory()
rig = nearfar.open_rig("cornell", size)
capture = nearfar.acquire(plan, f"{folder.name}/capture.zarr", rig)
transport, _ = nearfar.reconstruct(capture)

# %%
# Light is direct, or came under a surface, or by way of another one. The sum is the relit picture.
split = nearfar.split_physically(transport)
white = nearfar.white(size)
figure, axes = pyplot.subplots(1, 3, figsize=(10, 3.6), layout="constrained")
for axis, picture, name in zip(
    axes, split.components(white), ("direct", "subsurface", "inter-reflection"), strict=True
):
    axis.imshow(to_srgb(picture))
    axis.set(title=name, xticks=(), yticks=())

# %%
# The bodies that are translucent were found from the photos.
for body in split.bodies:
    print(f"one body of {len(body.pixels)} camera pixels")

# %%
# Wax that glows three times as much, and the same scene without light from wall to wall.
light = nearfar.penguin(size)
pictures = {
    "as it is": transport @ light,
    "glowing": split.relight(light, subsurface=3.0),
    "no inter-reflection": split.relight(light, interreflection=0.0),
}
figure, axes = pyplot.subplots(1, 3, figsize=(10, 3.6), layout="constrained")
for axis, (name, picture) in zip(axes, pictures.items(), strict=True):
    axis.imshow(to_srgb(np.clip(picture, 0, 1)))
    axis.set(title=name, xticks=(), yticks=())
