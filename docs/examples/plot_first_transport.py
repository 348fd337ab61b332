"""
A first transport
=================

Plan, noisy photos of a built-in scene, reconstruction, relighting.
"""

import tempfile

import nearfar

plan, expected = nearfar.choose_plan(nearfar.Size(32, 32), 100)
plan

# %%
# The plan expects to relight pictures this well, in dB, before any photo was taken:
print(f"{expected.pictures:.1f} dB expected")

# %%
# A rig shows patterns and takes photos. This one is simulated, noise and all.
folder = tempfile.TemporaryDirectory()
rig = nearfar.open_rig("cornell", plan.projector)
capture = nearfar.acquire(plan, f"{folder.name}/capture.zarr", rig)
capture

# %%
# Which projector pixel lights which camera pixel is found in the same photos.
transport, correspondence = nearfar.reconstruct(capture)
transport

# %%
# Any light will do: ``transport @ light`` is the photo under it less the photo under black.
light = nearfar.penguin(plan.projector)
transport.plot.relit(light)

# %%
# The same, taken apart, as far as 100 photos tell: light from under the candle's skin is
# near-range, the walls' red and green on the cup far-range.
transport.plot.components(light, exposure=1.5)

# %%
# How sure is it?
sigma = nearfar.ErrorBars(transport).picture(light)
print(f"mean error bar {sigma.mean():.5f}, mean light {(transport @ light).mean():.3f}")
