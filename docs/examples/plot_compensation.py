"""
A picture where there is none
=============================

The light under which a marble bust in an alcove looks like a wanted picture: texture, shading and
light from the walls are counter-acted.
"""

import tempfile

import numpy as np
from matplotlib import pyplot

import nearfar
from nearfar.files import to_srgb

size = nearfar.Size(32, 32)
plan, _ = nearfar.choose_plan(size, 80)
folder = tempfile.TemporaryDirectory()
rig = nearfar.open_rig("alcove", size)
capture = nearfar.acquire(plan, f"{folder.name}/capture.zarr", rig)
transport, _ = nearfar.reconstruct(capture)

# %%
# What the photo is to look like. How bright it can be is chosen with it: so that 95 % of the camera
# pixels need no more than full white.
wanted = nearfar.natural_picture(transport.camera, seed=3, colour=True)
found = nearfar.compensate(transport, wanted)
print(f"{found.psnr:.1f} dB expected, {found.out_of_reach_share:.0%} of the picture out of reach")

# %%
# The true photos: with the wanted picture projected as it is, and with the light that was found.
as_it_is = rig.world @ nearfar.natural_picture(size, seed=3, colour=True)
photo = rig.world @ found.light
pictures = {
    "wanted": found.scale * wanted,
    "projected as it is": as_it_is,
    "light that compensates": found.light,
    "its photo": photo,
}
figure, axes = pyplot.subplots(1, 4, figsize=(12, 3.4), layout="constrained")
for axis, (name, picture) in zip(axes, pictures.items(), strict=True):
    gain = 1.0 if name.startswith("light") else 0.9 / np.quantile(picture, 0.98)
    axis.imshow(to_srgb(np.clip(gain * picture, 0, 1)))
    axis.set(title=name, xticks=(), yticks=())
