"""
One row of a transport
======================

What one camera pixel sees of each projector pixel: direct, near-range and far-range light, and
their spectra.
"""

import tempfile

from matplotlib import pyplot

import nearfar

plan = nearfar.paper_plan(nearfar.Size(32, 32), window=9, far=nearfar.Size(5, 5))
folder = tempfile.TemporaryDirectory()
rig = nearfar.open_rig("cornell", plan.projector)
capture = nearfar.acquire(plan, f"{folder.name}/capture.zarr", rig)
transport, _ = nearfar.reconstruct(capture)

# %%
# A camera pixel on the candle. Direct light is one peak, near-range light lies about it, far-range
# light is a broad hill. The bands are one standard deviation.
y, x = 20, 12
transport.plot.row(y, x, errors=nearfar.ErrorBars(transport))

# %%
# The whole row over the projector, log scale, and its spectrum: beyond k_far there is what is
# sharp.
figure, axes = pyplot.subplots(1, 2, figsize=(9, 3.6), layout="constrained")
transport.plot.transport_row(y, x, ax=axes[0])
transport.plot.spectrum(y, x, ax=axes[1])

# %%
# A column is the other way round: what one projector pixel lights.
transport.plot.column(18, 13)
