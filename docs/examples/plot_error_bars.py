"""
Do the error bars hold?
=======================

A transport has standard deviations: of relit pictures, of rows, of single projector pixels. Here
those of pictures are compared with the errors, on a wedge with a toy in it whose light is known.
"""

import tempfile

import numpy as np
from matplotlib import pyplot

import nearfar

size = nearfar.Size(32, 32)
plan, _ = nearfar.choose_plan(size, 60)
folder = tempfile.TemporaryDirectory()
rig = nearfar.open_rig("wedge", size)
capture = nearfar.acquire(plan, f"{folder.name}/capture.zarr", rig)
transport, _ = nearfar.reconstruct(capture)

# %%
# The standard deviation of a relit picture is a picture itself.
light = nearfar.natural_picture(size, seed=4)
bars = nearfar.ErrorBars(transport)
sigma = bars.picture(light)
error = transport @ light - rig.world @ light
figure, axes = pyplot.subplots(1, 2, figsize=(9, 4), layout="constrained")
titles = "the error's size", "the standard deviation said beforehand"
for axis, picture, title in zip(axes, (np.abs(error), sigma), titles, strict=True):
    shown = axis.imshow(picture.mean(axis=-1), vmin=0, vmax=3 * sigma.mean(), cmap="magma")
    axis.set(title=title, xticks=(), yticks=())
figure.colorbar(shown, ax=axes, label="photo units")

# %%
# Errors over their standard deviations, for twenty lights. If the bars hold, they follow the
# Gaussian: about two thirds lie within one standard deviation.
ratios = np.concatenate(
    [
        ((transport @ light - rig.world @ light) / bars.picture(light)).ravel()
        for light in (nearfar.natural_picture(size, seed) for seed in range(20))
    ]
)
figure, axis = pyplot.subplots(layout="constrained")
edges = np.linspace(-4, 4, 81)
axis.hist(ratios, bins=edges, density=True, label="errors of pictures")
axis.plot(edges, np.exp(-(edges**2) / 2) / np.sqrt(2 * np.pi), label="Gaussian")
axis.set(xlabel="error over standard deviation", ylabel="density")
axis.legend()
print(f"{np.mean(np.abs(ratios) < 1):.0%} lie within one standard deviation")
