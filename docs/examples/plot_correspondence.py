"""
Where does each camera pixel's light come from?
===============================================

Correspondence from the photos of transport themselves, beside that of stripes, which take photos of
their own.
"""

import tempfile

import numpy as np
from matplotlib import pyplot

import nearfar

size = nearfar.Size(32, 32)
folder = tempfile.TemporaryDirectory()
rig = nearfar.open_rig("shelf", size)
plan, _ = nearfar.choose_plan(size, 80)
capture = nearfar.acquire(plan, f"{folder.name}/phase.zarr", rig)
by_phase = nearfar.correspond(capture)

# %%
# The paper's plan has stripes: 64 photos that tell q and nothing else.
paper = nearfar.paper_plan(size, window=9, far=nearfar.Size(5, 5), correspondence="stripes")
photos = nearfar.acquire(paper, f"{folder.name}/stripes.zarr", rig)
by_stripes = nearfar.correspond(photos)
print(f"{len(plan.patterns)} photos in all, or {paper.counts['correspondence']} of stripes alone")

# %%
# Column and confidence by phase, and how far the two are apart. Shadows are white.
apart = np.hypot(*np.moveaxis(by_phase.q - by_stripes.q, -1, 0))
figure, axes = pyplot.subplots(1, 3, figsize=(11, 3.4), layout="constrained")
shown = (by_phase.q[..., 1], by_phase.confidence, apart)
titles = "column of q", "confidence", "from stripes, pixels"
for axis, picture, title in zip(axes, shown, titles, strict=True):
    drawn = axis.imshow(picture, vmax=1.0 if title != "column of q" else None)
    axis.set(title=title, xticks=(), yticks=())
    figure.colorbar(drawn, ax=axis, shrink=0.8)
print(f"half of the camera pixels are within {np.nanmedian(apart):.2f} projector pixels")
