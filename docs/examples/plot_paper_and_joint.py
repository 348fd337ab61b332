"""
The paper's estimate and the joint one
======================================

The same scene by the paper's plan and estimator, and by the joint estimate from a quarter of the
photos.
"""

import tempfile

import numpy as np
from matplotlib import pyplot

import nearfar
from nearfar.files import to_srgb

size = nearfar.Size(32, 32)
folder = tempfile.TemporaryDirectory()
rig = nearfar.open_rig("alcove", size)
paper = nearfar.paper_plan(size, window=9, far=nearfar.Size(5, 5))
chosen, _ = nearfar.choose_plan(size, len(paper.patterns) // 4)
light = nearfar.natural_picture(size, seed=2)
truth = rig.world @ light
pictures, errors = {"the scene": truth}, {}
for name, plan, method in (("paper", paper, "paper"), ("joint", chosen, "joint")):
    capture = nearfar.acquire(plan, f"{folder.name}/{name}.zarr", rig)
    transport, _ = nearfar.reconstruct(capture, method=method)
    snr = nearfar.relighting_snr(transport, rig.world, {"picture": light})["picture"]
    title = f"{name}, {len(plan.patterns)} photos, {snr:.1f} dB"
    pictures[title] = transport @ light
    errors[title] = np.abs(pictures[title] - truth).mean(axis=-1)

# %%
# The pictures, and the size of their errors.
figure, axes = pyplot.subplots(1, 3, figsize=(10, 3.8), layout="constrained")
for axis, (name, picture) in zip(axes, pictures.items(), strict=True):
    axis.imshow(to_srgb(picture))
    axis.set(title=name, xticks=(), yticks=())
figure, axes = pyplot.subplots(1, 2, figsize=(8, 3.8), layout="constrained")
for axis, (name, error) in zip(axes, errors.items(), strict=True):
    drawn = axis.imshow(error, vmin=0, vmax=0.02, cmap="magma")
    axis.set(title=f"error of {name.split(',')[0]}", xticks=(), yticks=())
figure.colorbar(drawn, ax=axes, label="photo units")
