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
# A measured row of far-range light is smooth over the projector, and so is its transpose. The
# camera sees what is missing: light that goes from one place of the scene to another goes back
# alike.
reciprocity = nearfar.find_reciprocity(transport)
print(f"both sides differ by {reciprocity.disagreement:.0%}, so it holds: {reciprocity.holds}")

# %%
# Shadows change sides: what the camera does not see is dark in the dual view. A projector pixel
# adds up the camera pixels that see its light: thin lines are brighter where there is one more.
# Where half of the camera's view is lit, the other half shows far-range light alone.
primal = transport @ nearfar.white(size)
half = np.zeros(transport.camera, dtype=np.float32)
half[:, : transport.camera.width // 2] = 1
pictures = {
    "camera's view, projector lit": primal,
    "projector's view, camera lit": nearfar.dual_view(transport, reciprocity=reciprocity),
    "half of it lit, by T^T": 3 * nearfar.dual_view(transport, half),
    "the same, by reciprocity": 3 * nearfar.dual_view(transport, half, reciprocity=reciprocity),
}
figure, axes = pyplot.subplots(1, 4, figsize=(13, 3.5), layout="constrained")
brightest = {"camera": np.quantile(primal, 0.995)}
brightest["projector"] = np.quantile(pictures["projector's view, camera lit"], 0.995)
for axis, (name, picture) in zip(axes, pictures.items(), strict=True):
    full = brightest["camera" if name.startswith("camera") else "projector"]
    axis.imshow(to_srgb(np.clip(0.9 * picture / full, 0, 1)))
    axis.set(title=name, xticks=(), yticks=())
