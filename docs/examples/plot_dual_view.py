"""
The scene as the projector sees it
==================================

Light goes both ways. The adjoint of the transport turns camera and projector round: a picture from
the projector's place, lit from the camera.
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
# Shadows change sides: what the camera does not see is dark in the dual view. A projector pixel
# adds up the camera pixels that see its light: thin lines are brighter where there is one more.
primal = transport @ nearfar.white(size)
dual = nearfar.dual_view(transport)
y, x = np.mgrid[: transport.camera.height, : transport.camera.width]
spot = (np.hypot(y - 40, x - 20) < 9).astype(np.float32)
pictures = {
    "camera's view, projector lit": primal,
    "projector's view, camera lit": dual,
    "projector's view, a spot": nearfar.dual_view(transport, spot),
}
figure, axes = pyplot.subplots(1, 3, figsize=(11, 3.8), layout="constrained")
for axis, (name, picture) in zip(axes, pictures.items(), strict=True):
    axis.imshow(to_srgb(np.clip(0.9 * picture / np.quantile(picture, 0.995), 0, 1)))
    axis.set(title=name, xticks=(), yticks=())
