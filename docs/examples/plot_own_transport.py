"""
Your own matrix as a rig
========================

Any measured transport can be photographed: here a lens that turns the projector's picture round,
with a veil of stray light.
"""

import tempfile

import numpy as np

import nearfar

size = nearfar.Size(24, 24)
folder = tempfile.TemporaryDirectory()
matrix = 0.6 * np.eye(size.pixels)[::-1] + 0.2 / size.pixels
path = f"{folder.name}/lens.npy"
np.save(path, matrix.astype(np.float32))  # camera pixels by projector pixels

# %%
# The rig exposes so that white fits the camera, and adds a sensor's noise.
rig = nearfar.open_rig(path, size)
plan, _ = nearfar.choose_plan(size, 60)
capture = nearfar.acquire(plan, f"{folder.name}/capture.zarr", rig)
transport, correspondence = nearfar.reconstruct(capture)
transport.plot.relit(nearfar.penguin(size).mean(axis=-1))

# %%
# The model fits where light is direct, near and far.
truth = nearfar.load_exact(path, projector=size)
lights = {"picture": nearfar.natural_picture(size, 1), "random": nearfar.random_pattern(size, 1)}
for name, value in nearfar.relighting_snr(transport, truth, lights).items():
    print(f"{name}: {value:.1f} dB")
